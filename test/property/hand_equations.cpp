// Hand-derived tangents and adjoints of every formulation on the kitchen sink: parameters of every kind, force states,
// a moving start, costs on everything. The reference is the formulation's own forward sensitivities by an integrator,
// which share the blocks but neither the equations nor the scheme; those meet differences in gradients.cpp.
#include <support/compare.h>
#include <support/models.h>
#include <support/sweep.h>
#include <support/variants.h>

#include <catch2/catch.hpp>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "gradient_compare.h"
#include "support/paths.h"

using namespace costate;
using namespace costate::test;

namespace {

// As in gradients.cpp: 1e3 rtol for each of the two.
constexpr double kRtol = 1e-8, kTolerance = 2e3 * kRtol;

/// How many gradients were compared, and the formulations whose hand-derived adjoint refuses the cost.
struct Comparison {
  int compared = 0;
  std::vector<std::string> refusals;
};

Comparison compare(const TestModel& model) {
  Comparison r;
  std::size_t turn = 0;
  for (const Variant& v : variants()) {
    const Formulation& f = find_formulation(v.formulation);
    Problem p = model.problem(v.formulation, kRtol);
    p.formulation_options = v.options;
    p.parameters = some_of(model.all_parameters(), turn++);
    const std::vector<double> rho = p.parameters.values();
    const std::string forward = f.make_ode ? "cvodes-forward" : "idas-forward";
    Problem carried = p;
    if (!f.make_ode && !f.make_dae) carried.formulation = "index2";  // index 3
    const GradientResult reference = gradient(carried, forward, rho);
    for (const char* method : {"hand-tangent", "hand-adjoint"}) {
      if (!(method == std::string("hand-tangent") ? f.make_hand_tangent : f.make_hand_adjoint)) continue;
      INFO(v.label << ", " << method);
      try {
        const GradientResult g = gradient(p, method, rho);
        CHECK(std::abs(g.psi - reference.psi) <= kTolerance * std::abs(reference.psi));
        CHECK_BELOW(gradient_mismatch(g.gradient, reference.gradient, p.parameters), kTolerance);
        ++r.compared;
      } catch (const CapabilityError& e) {
        CHECK_THAT(e.what(), Catch::Contains("running cost"));
        r.refusals.push_back(v.label + " " + method);
      }
    }
  }
  return r;
}

}  // namespace

TEST_CASE("hand-derived: kitchen sink, costs on everything", "[hand]") {
  const Comparison c = compare(kitchen_sink());
  CHECK(c.compared >= 16);
  // They would need fourth derivatives of the motion.
  CHECK(c.refusals == std::vector<std::string>{"maggi-second-order hand-adjoint", "penalty-second-order hand-adjoint"});
}

TEST_CASE("hand-derived: kitchen sink without accelerations in the running cost", "[hand]") {
  const Comparison c = compare(kitchen_sink_without_accelerations());
  CHECK(c.compared >= 18);
  CHECK(c.refusals.empty());
}

TEST_CASE("hand-derived: tiny first steps of a light mechanism", "[hand]") {
  // Steps of 1e-6 s and inertias of 1e-6 kg m^2 bring factors of 1e-12 into the matrices of index 3.
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/andrews/andrews.toml"));
  const std::vector<double> rho = p.parameters.values();
  p.solver.rtol = 1e-5;
  const GradientResult reference = gradient(p, "cvodes-adjoint", rho);
  for (const char* formulation : {"index1", "index2", "index3", "baumgarte", "penalty", "maggi"})
    for (const char* method : {"hand-tangent", "hand-adjoint"}) {
      INFO(formulation << ", " << method);
      p.formulation = formulation;
      CHECK_BELOW(gradient_mismatch(gradient(p, method, rho).gradient, reference.gradient, p.parameters), 2e3 * 1e-5);
    }
}

// Bricard's six bars hold one row twice, but only where the others hold: e off them it is a row of its own, of slope e,
// which the weight 2e12 of these equations took for a constraint from rtol 1e-6 on (derivatives of -2e10).
TEST_CASE("hand-derived: redundant rows along a motion that is off its constraints by tolerances", "[hand]") {
  Problem p = make_problem(Scene::load(COSTATE_MODELS_DIR "/bricard/bricard.toml"));
  const std::vector<double> rho = p.parameters.values();
  p.solver.t_end = 2;
  p.solver.rtol = 1e-9;
  p.formulation = "maggi";
  const GradientResult reference = gradient(p, "cvodes-forward", rho);
  p.formulation = "augmented-lagrangian";
  p.solver.confirm = false;
  for (const double rtol : {1e-5, 1e-7})
    for (const char* method : {"hand-tangent", "hand-adjoint"}) {
      INFO(method << " at " << rtol);
      p.solver.rtol = rtol;
      CHECK_BELOW(gradient_mismatch(gradient(p, method, rho).gradient, reference.gradient, p.parameters), 2e3 * rtol);
    }
  // The motion itself took that row for one that holds turn by turn of its multipliers: psi was 2e-4 off.
  p.solver.t_end = 5;
  p.solver.rtol = 1e-9;
  const double right = simulate(p, rho).psi;
  p.solver.rtol = 1e-6;
  CHECK(std::abs(simulate(p, rho).psi - right) <= 3e-5 * right);
}
