// The watch over runs: torn constraints, ranks that change, drift, what is no number; and no alarm where all is well.
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;
using Catch::Detail::Approx;
using Catch::Matchers::Contains;

namespace {

Problem case_of(const std::string& name, const std::string& formulation,
                const std::vector<std::string>& overrides = {}) {
  Problem p = make_problem(Scene::load(COSTATE_SOURCE_DIR "/test/cases/" + name + ".toml", overrides));
  if (!formulation.empty()) p.formulation = formulation;
  return p;
}

Simulation simulated(const Problem& p) { return simulate(p, p.parameters.values()); }

std::string all_notices() {
  std::string text;
  for (const auto& sentence : take_notices()) text += sentence + "\n";
  return text;
}

/// What a run ends with: its error, or its notices.
template <class Run>
std::string said(const Run& run) {
  take_notices();
  try {
    run();
  } catch (const Error& e) {
    take_notices();
    return std::string("error: ") + e.what();
  }
  return all_notices();
}

}  // namespace

TEST_CASE("watch: a mechanism that locks is not torn in silence") {
  // The crank turns where the rocker cannot follow; penalties stretch a bar of 0.5 m by 0.11 m.
  for (const char* formulation : {"penalty", "augmented-lagrangian"}) {
    INFO(formulation);
    const Problem p = case_of("locked_linkage", formulation);
    const std::string text = said([&] { simulated(p); });
    CHECK_THAT(text, Contains("error: "));
    if (std::string(formulation) == "penalty")
      CHECK_THAT(text, Contains("no longer hold at t = ") && Contains(" m, ") && Contains("row '"));
  }
  CHECK_THAT(said([] { simulated(case_of("chain_locks", "penalty")); }),
             Contains("error: ") && Contains("no longer hold"));
}

TEST_CASE("watch: coordinates that are rounding are no lengths") {
  // 1.5e-32 m, "84 % of its own length" of a row; and Maggi's positions, which asked for as many digits of it.
  for (const std::string name : {"no_lengths", "turned_at_origin"})
    for (const std::string formulation : {"index1", "index2", "index3", "baumgarte", "penalty", "augmented-lagrangian",
                                          "maggi", "maggi-implicit", "maggi-second-order", "penalty-second-order"}) {
      INFO(name << " by " << formulation);
      CHECK(said([&] { simulated(case_of(name, formulation)); }) == "");
    }
}

TEST_CASE("watch: drivers alone lead over no place without positions") {
  // No unknown of Maggi's equations keeps steps short here: one led over the gap, from which C came back at 0.188073 m.
  for (const auto& [formulation, integrator] : {std::pair("maggi", "cvodes"), std::pair("maggi-second-order", "cvodes"),
                                                std::pair("maggi-implicit", "radau3")}) {
    INFO(formulation << " on " << integrator);
    Problem p = case_of("driven_over_a_gap", formulation);
    p.solver.integrator = integrator;
    CHECK_THAT(said([&] { simulated(p); }), Contains("error: ") && Contains("have no positions near the last ones"));
  }
}

TEST_CASE("watch: a crank that drivers turn round and round stays on its branch") {
  // A crank of 0.3 m, a coupler of 1.2 m and a rocker of 1 m on a base of 1.1 m, ten turns and a third of one. Where
  // the circles of coupler and rocker meet, on the side where they do at the start.
  const double pi = 3.14159265358979323846, from = -2.1641710723549261, to = from + 2 * pi * (10 + 1.0 / 3);
  const double b[2] = {0.3 * std::cos(to), 0.3 * std::sin(to)}, d[2] = {1.1 - b[0], -b[1]},
               gap = std::hypot(d[0], d[1]), along = (1.2 * 1.2 - 1 + gap * gap) / (2 * gap),
               beside = -std::sqrt(1.2 * 1.2 - along * along);
  for (const char* formulation : {"maggi", "maggi-second-order"}) {
    INFO(formulation);
    Problem p =
        case_of("driven_over_a_gap", formulation,
                {"bar.crank.length_m=0.3", "bar.coupler.length_m=1.2", "bar.rocker.length_m=1", "point.D.x_m=1.1",
                 "driver.motor.law={kind=\"polynomial\",coefficients=[-2.1641710723549261," +
                     std::to_string((to - from) / 2) + "]}",
                 "run.t_end_s=2"});
    p.solver.integrator = "cvodes";
    // The slope is written with six digits behind the point.
    CHECK(simulated(p).psi == Approx((along * d[0] - beside * d[1]) / gap + b[0]).margin(1e-5));
  }
}

TEST_CASE("watch: redundant rows whose weight is lost in rounding are named") {
  // It had been said that a point of 2.8 t has no inertia; then that the weight is lost, where columns that are
  // balanced have it; then, of stages of Radau's scheme, that they are singular, where solutions can be refined: psi's
  // derivative is that of maggi.
  const Problem p = case_of("redundant_in_grams", "augmented-lagrangian"),
                exact = case_of("redundant_in_grams", "maggi");
  const double right = gradient(exact, "cvodes-adjoint", exact.parameters.values()).gradient[0];
  for (const char* method : {"cvodes-adjoint", "hand-tangent", "hand-adjoint"}) {
    CAPTURE(method);
    CHECK(gradient(p, method, p.parameters.values()).gradient[0] == Approx(right).epsilon(1e-6));
  }
  // Where it is lost indeed.
  Problem lost = case_of("redundant_in_grams", "penalty");
  lost.formulation_options.set("penalty_alpha", 1e25);
  CHECK_THAT(said([&] { simulated(lost); }),
             Contains("error: ") && Contains("bar.B3.length") && Contains("lost in rounding"));
}

TEST_CASE("watch: a change point is named, between steps too") {
  // A parallelogram of sides 1, 2, 1 on a base of 2 lies flat where the left bar's angle is 0 or pi.
  for (const auto& [formulation, method] :
       {std::pair("baumgarte", "cvodes-adjoint"), std::pair("baumgarte", "idas-adjoint"),
        std::pair("index1", "cvodes-forward"), std::pair("maggi", "cvodes-adjoint")}) {
    INFO(formulation << " " << method);
    const Problem p = case_of("change_point", formulation);
    CHECK_THAT(said([&] { gradient(p, method, p.parameters.values()); }),
               Contains("passes a singular position at t = "));
    CHECK_THAT(said([&] { simulated(p); }), Contains("passes a singular position at t = ") && Contains("bar."));
  }
  // As long as it does not get there, nothing is said.
  Problem before = case_of("change_point", "baumgarte");
  before.solver.t_end = 0.05;
  CHECK(said([&] { simulated(before); }) == "");
}

TEST_CASE("watch: rows that nearly depend on each other are refused by name") {
  for (const char* formulation : {"index1", "baumgarte", "index2"}) {
    INFO(formulation);
    const Problem p = case_of("red_13", formulation);
    CHECK_THAT(said([&] { simulated(p); }),
               Contains("error: ") && Contains("depend on the others") && Contains("distance.d"));
  }
  // Formulations that carry them say what is right, which the parallelogram's one degree of freedom gives: 0.18228.
  const Problem p = case_of("red_13", "augmented-lagrangian");
  CHECK(simulated(p).psi == Approx(0.18228).epsilon(1e-4));
}

TEST_CASE("watch: index 1 says that it drifts, and the default does not drift") {
  // By 1e-4 of the rod's length; by some 1e-6 only in a hundred seconds, since first iterations of Newton's are judged.
  const Problem drifting = case_of("longp", "index1", {"run.t_end_s=300"});
  CHECK_THAT(said([&] { simulated(drifting); }), Contains("drift") && Contains("bar.rod.length"));
  const Problem p = case_of("longp", "", {"run.t_end_s=100"});
  GradientResult r;
  // A hundred seconds make much of small errors, and that is said; of rows that come apart nothing is.
  CHECK_THAT(said([&] { r = gradient(p, "idas-adjoint", p.parameters.values()); }), !Contains("drift"));
  // From runs at rtol 1e-12; what phase errors of a hundred seconds leave at rtol 1e-8 is some 1e-3 of it.
  CHECK(r.gradient[0] == Approx(-3.723).epsilon(3e-3));
}

TEST_CASE("watch: what is no number is an error") {
  const Problem p = case_of("discrete_nan", "index3");
  GradientResult r;
  const std::string text = said([&] { r = gradient(p, "discrete-adjoint", p.parameters.values()); });
  if (text.find("error: ") == std::string::npos)
    for (const double g : r.gradient) CHECK(std::isfinite(g));
}

TEST_CASE("watch: the models run without a warning, but where they pass singular positions") {
  for (const char* name :
       {"five_bar/five_bar", "pendulum/pendulum", "slider_crank/slider_crank", "golden_car/golden_car",
        "damped_pendulum/damped_pendulum", "bricard/bricard", "rigid_body/dzhanibekov"}) {
    INFO(name);
    const Problem p = make_problem(Scene::load(std::string(COSTATE_MODELS_DIR "/") + name + ".toml"));
    CHECK(said([&] { simulated(p); }) == "");
  }
  Problem windows = make_problem(Scene::load(COSTATE_MODELS_DIR "/n_four_bar/n_four_bar_2.toml"));
  windows.formulation = "maggi";
  windows.solver.t_end = 1;  // the uprights lie flat at 0.71 s
  CHECK_THAT(said([&] { simulated(windows); }), Contains("passes a singular position at t = 0.71"));
}

TEST_CASE("watch: a spring whose ends pass through each other jumps, and has no gradient there") {
  // On a rail the ends meet to rounding. No formulation and no exact method knows of the instant: they agreed on
  // 557.086 where psi's differences give 553.725, by six formulations and integrators alike.
  const auto gradient_of = [](const std::string& formulation, const std::string& method,
                              const std::vector<std::string>& overrides = {}) {
    const Problem p = case_of("ends_that_meet", formulation, overrides);
    return gradient(p, method, p.parameters.values());
  };
  for (const auto& [formulation, method] : {std::pair{"index1", "idas-forward"},
                                            {"index2", "idas-adjoint"},
                                            {"baumgarte", "cvodes-adjoint"},
                                            {"maggi", "cvodes-forward"},
                                            {"maggi", "hand-tangent"},
                                            {"index2", "hand-adjoint"},
                                            {"index3", "discrete-tangent"},
                                            {"maggi", "discrete-adjoint"},
                                            {"augmented-lagrangian", "cvodes-adjoint"}}) {
    INFO(formulation << " by " << method);
    CHECK_THAT(said([&] { gradient_of(formulation, method); }), Contains("error: ") && Contains("spring.return"));
  }
  CHECK(gradient_of("index1", "differences").gradient[1] == Approx(553.7245).epsilon(1e-5));
  CHECK_THAT(said([] { simulated(case_of("ends_that_meet", "index1")); }),
             Contains("the ends of 'spring.return' pass through each other") && Contains("jumps by 4.54 N"));
  // A force that is zero where they meet has nothing to jump by.
  const std::string zero = "spring.return.natural_length_m=0";
  CHECK_THAT(said([&] { gradient_of("baumgarte", "cvodes-adjoint", {zero}); }), !Contains("spring.return"));
  CHECK(gradient_of("baumgarte", "cvodes-adjoint", {zero}).gradient[1] ==
        Approx(gradient_of("index1", "differences", {zero}).gradient[1]).epsilon(1e-5));
  // At a distance of 1 mm it turns within some steps, and all is resolved.
  const std::vector<std::string> aside = {"point.W={ground=true,x_m=-0.001,y_m=0.505}", "spring.return.from=\"W\""};
  CHECK(said([&] { gradient_of("baumgarte", "cvodes-forward", aside); }) == "");
  // Runs at rtol 1e-13: at 1e-12 the noise in psi leaves differences 1e-4 of their digits at the worst of such places.
  std::vector<std::string> finely = aside;
  finely.push_back("run.rtol=1e-10");
  CHECK(gradient_of("baumgarte", "cvodes-forward", aside).gradient[1] ==
        Approx(gradient_of("index1", "differences", finely).gradient[1]).epsilon(1e-4));
}

TEST_CASE("watch: redundant rows that exchange their parts lose no rank") {
  // The row that was independent at the start depends on others at the collinear pose, another one does no longer.
  for (const char* formulation : {"maggi", "augmented-lagrangian", "penalty"}) {
    INFO(formulation);
    const Problem p = case_of("bennett", formulation, {"run.formulation=\"baumgarte\"", "run.method=\"idas-adjoint\""});
    Simulation r;
    CHECK_THAT(said([&] { r = simulated(p); }), !Contains("singular position"));
    // In the minimal coordinate, tan(a/2) tan(b/2) being constant, by Lagrange's equations.
    CHECK(r.psi == Approx(14.1512539).epsilon(formulation == std::string("penalty") ? 1e-5 : 1e-6));
  }
}

TEST_CASE("watch: a start that is itself the singular position is told, with its time") {
  for (const char* formulation : {"maggi", "augmented-lagrangian", "penalty"}) {
    INFO(formulation);
    CHECK_THAT(said([&] { simulated(case_of("starts_flat", formulation)); }),
               Contains("singular position at t = 0 s: there row bar.DQ.length"));
  }
}

TEST_CASE("watch: a singular position at which the motion turns round in short steps is told, whatever the size") {
  // A crank and a rod of one length: where the slide comes over the crank's axis the rod may go on turning with the
  // crank. Of 0.2 mm index1 does, in steps of nanoseconds; masses, torques and gravity are those of 0.2 m, scaled.
  const Scene scene = Scene::parse(R"toml(
[gravity]
y_m_per_s2 = -9.81e-3
[point.A]
ground = true
x_m = 0
y_m = 0
[body.crank]
x_m = 0
y_m = 0
angle_rad = 1
angular_velocity_rad_per_s = 10
mass_kg = 1
inertia_kg_m2 = 5e-8
[body.rod]
x_m = 2.161209223472559e-4
y_m = 0
angle_rad = -1
mass_kg = 1
inertia_kg_m2 = 1e-7
[point.c0]
on = "crank"
x_m = 0
y_m = 0
[point.c1]
on = "crank"
x_m = 2e-4
y_m = 0
[point.r1]
on = "rod"
x_m = -2e-4
y_m = 0
[point.s]
on = "rod"
x_m = 0
y_m = 0
[revolute.b]
points = ["A", "c0"]
[revolute.p]
points = ["c1", "r1"]
[driver.slide]
coordinate = "rod.y"
law = 0
[start]
given = ["crank.angle"]
[run]
t_end_s = 0.1
rtol = 1e-10
atol = 1e-13
)toml",
                                   "equal.toml");
  Problem p = make_problem(scene);
  for (const char* formulation : {"index1", "baumgarte"}) {
    INFO(formulation);
    p.formulation = formulation;
    CHECK_THAT(said([&] { simulate(p, p.parameters.values()); }),
               Contains("passes a singular position at t = 0.06") && Contains("revolute.p"));
  }
}
