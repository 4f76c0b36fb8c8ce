// What a user may set of a formulation: described once, asked everywhere.
#include "costate/level/formulation_options.h"

#include <catch2/catch.hpp>

#include "costate/base/error.h"
#include "costate/formulation/formulation.h"
#include "costate/level/acceleration_level.h"
#include "costate/optimize/optimizer.h"
#include "costate/scene/scene.h"

using namespace costate;
using Catch::Contains;

TEST_CASE("formulation options: defaults, values, and what is not allowed") {
  FormulationOptions o;
  CHECK(o.number("baumgarte_omega_rad_per_s") == 10);
  CHECK(o.word("discrete_scheme") == "newmark");
  o.set("baumgarte_omega_rad_per_s", 20);
  o.set("discrete_scheme", "generalized-alpha");
  CHECK(o.number("baumgarte_omega_rad_per_s") == 20);
  CHECK(o.word("discrete_scheme") == "generalized-alpha");
  CHECK_THROWS_WITH(o.set("baumgarte_omega_rad_s", 1), Contains("baumgarte_omega_rad_per_s"));
  CHECK_THROWS_WITH(o.set("baumgarte_omega_rad_per_s", 0), Contains("must be positive, found 0"));
  CHECK_THROWS_WITH(o.set("discrete_rho_infinity", 1.5), Contains("must not be above 1, found 1.5"));
  CHECK_THROWS_AS(o.set("discrete_scheme", 1), CapabilityError);
  CHECK_THROWS_AS(o.number("discrete_scheme"), CapabilityError);
}

TEST_CASE("formulation options: every option belongs to a formulation, and is in the registry as it describes it") {
  std::size_t count = 0;
  for (const auto& [key, option] : formulation_options()) {
    bool owned = false;
    for (const auto& f : formulations())
      for (const auto& o : f.options)
        if (o.key == key) {
          owned = true;
          CHECK(o.help == option.help);
        }
    INFO(key);
    CHECK(owned);
    CHECK_FALSE(option.help.empty());
    ++count;
  }
  CHECK(count >= 7);
  FormulationOption other = find_formulation_option("penalty_alpha");
  other.help = "something else";
  CHECK_THROWS_AS(add_formulation_option(other), std::logic_error);
}

TEST_CASE("formulations: abilities that others ask for") {
  CHECK_FALSE(find_formulation("penalty").exact_constraints());
  CHECK_FALSE(find_formulation("penalty-second-order").exact_constraints());
  CHECK(find_formulation("augmented-lagrangian").exact_constraints());
  CHECK(find_formulation("maggi").constraints == ConstraintForm::independent);
  CHECK(find_formulation("maggi-second-order").adjoint_order == 2);
  std::vector<std::string> all, redundant;
  for (const Formulation* f : stand_ins(false)) all.push_back(f->name);
  for (const Formulation* f : stand_ins(true)) redundant.push_back(f->name);
  CHECK(all == std::vector<std::string>{"baumgarte", "index1", "augmented-lagrangian", "penalty"});
  CHECK(redundant == std::vector<std::string>{"augmented-lagrangian", "penalty"});
  // What a candidate's blocks have.
  FormulationOptions o;
  o.set("penalty_alpha", 1e4);
  const Scene scene = Scene::parse("[body.b]\nx_m = 0\ny_m = 0\nmass_kg = 1\ninertia_kg_m2 = 1\n", "s.toml");
  const Stabilization s = find_formulation("penalty").candidate_stabilization(scene.mechanism(), o);
  CHECK(s.xi == 1);
  CHECK(s.omega == 10);
  CHECK(s.inverse_alpha == Approx(1e-4));
  CHECK(find_formulation("penalty").firmer(scene.mechanism(), o).number("penalty_alpha") == Approx(1e5));
}

TEST_CASE("defaults stand once") {
  CHECK(OptimizerOptions{}.max_evaluations == OptimizeSettings{}.max_evaluations);
  CHECK(Problem{}.formulation == RunSettings{}.formulation);
  CHECK(optimizer_algorithms().front().name == OptimizeSettings{}.algorithm);
}
