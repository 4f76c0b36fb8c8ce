// Costs that hold the cycle's own period, travel, speed and largest multiplier: their gradients by every kind of
// method, and the multiplier's against differences of cycles that are found anew.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/cycle/cycle.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/cycle_gradient.h"
#include "costate/sensitivity/difference_hessian.h"
#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;

namespace {

const std::string kWalkers = COSTATE_MODELS_DIR "/walker/";

/// A rigid walker whose cost is one of a cycle.
Problem walker(const std::string& file, const std::string& term, std::vector<std::string> overrides,
               const std::vector<std::string>& parameters) {
  overrides.insert(overrides.end(), {"run.cycle=true", "cost.terminal=[" + term + "]"});
  return make_problem(Scene::load(kWalkers + file, overrides), parameters);
}

const std::vector<std::string> kWay = {"cycle.travel=left.x", "cycle.travel_angle_rad=contact.left.ground_angle_rad"};

std::string value_of(const std::string& output) { return "{kind='value', output='" + output + "'}"; }

/// Largest difference of two gradients in scaled parameters against the largest entry.
double off(const Problem& p, const std::vector<double>& a, const std::vector<double>& b) {
  double most = 0, size = 0;
  for (std::size_t j = 0; j < a.size(); ++j) {
    const double scale = p.parameters.parameters[j].scale;
    most = std::max(most, std::abs(a[j] - b[j]) * scale);
    size = std::max(size, std::abs(b[j]) * scale);
  }
  return most / size;
}

}  // namespace

// What a rigid contact holds, where no position is given along the way, travels by where it is when the cycle is over:
// 2.4279558426 s a step of a program apart (rigid_gait.py). At rtol 1e-10 gradients of different methods are some
// hundred tolerances apart, which (I - P_x)^-1 amplifies by less than ten: 1e-7 of derivatives of order one. The
// largest scaled ones here are 0.07 (speed) to 1: 1e-6 of them.
TEST_CASE("cycle costs: period, travel and speed by every kind of method", "[cycle][walker]") {
  std::vector<std::string> more = kWay;
  more.push_back("parameter.center={numbers=['body.left.center_y_m','body.right.center_y_m']}");
  for (const char* output : {"cycle.period", "cycle.travel", "cycle.speed"}) {
    CAPTURE(output);
    Problem p = walker("rigid_arcs.toml", value_of(output), more, {"slope", "center"});
    const std::vector<double> rho = p.parameters.values();
    CycleOptions once;
    once.estimate = false;
    const CycleResult r = find_cycle(p, *p.cycle, rho, once);
    const bool period = std::string(output) == "cycle.period", travel = std::string(output) == "cycle.travel";
    const double value = period ? r.period.value : travel ? r.travel.value : r.speed();
    CHECK(std::abs(r.psi.value - value) <= 1e-14);
    CHECK(std::abs(r.period.value - 2.4279558426) <= 1e-8);
    const Eigen::VectorXd by = period ? r.period_rho : travel ? r.travel_rho : r.speed_rho();
    const std::vector<double> expected(by.data(), by.data() + by.size());
    for (const char* method : {"idas-forward", "idas-adjoint", "cvodes-adjoint"}) {
      CAPTURE(method);
      CHECK(off(p, gradient(p, method, rho).gradient, expected) <= 1e-6);
    }
    CHECK(off(p, gradient(p, "differences", rho).gradient, expected) <= 1e-6);
  }
}

// A formula of the cycle's values and of outputs along it, in a running and a terminal term.
TEST_CASE("cycle costs: formulas of a cycle's values", "[cycle][walker]") {
  std::vector<std::string> more = kWay;
  more.push_back("parameter.center={numbers=['body.left.center_y_m','body.right.center_y_m']}");
  more.push_back("output.swing={formula='right.angle_dot^2/cycle.travel', unit='1'}");
  more.push_back("output.price={formula='standby/cycle.speed + hip.y*cycle.period', unit='1', standby=0.004}");
  more.push_back("cost.running=[{kind='value', output='swing', weight=0.3}]");
  Problem p = walker("rigid_arcs.toml", value_of("price"), more, {"slope", "center"});
  const std::vector<double> rho = p.parameters.values();
  const GradientResult differences = gradient(p, "differences", rho);
  for (const char* method : {"cvodes-forward", "cvodes-adjoint", "idas-adjoint"}) {
    CAPTURE(method);
    const GradientResult r = gradient(p, method, rho);
    CHECK(std::abs(r.psi / differences.psi - 1) <= 1e-7);
    CHECK(off(p, r.gradient, differences.gradient) <= 1e-6);
  }
}

// Second derivatives of a formula of the cycle's values and of what lies along it, and of the speed of a walker that
// touches ground that gives, whose way begins at a coordinate of the section, and of one that is held where it stands,
// which an arc's radius moves with its leg's angle, against differences of gradients, which say what they are within.
// Exact ones are symmetric: what is not is what tolerances leave.
TEST_CASE("cycle costs: second derivatives follow the cycle", "[cycle][walker]") {
  std::vector<std::string> formulas = kWay;
  formulas.push_back("parameter.center={numbers=['body.left.center_y_m','body.right.center_y_m']}");
  formulas.push_back("output.swing={formula='right.angle_dot^2/cycle.travel', unit='1'}");
  formulas.push_back("output.price={formula='standby/cycle.speed^2 + hip.y*cycle.period', unit='1', standby=0.004}");
  formulas.push_back("cost.running=[{kind='value', output='swing', weight=0.3}]");
  for (const Problem& p :
       {walker("rigid_arcs.toml", value_of("price"), formulas, {"slope", "center"}),
        walker("arc_feet.toml", value_of("cycle.speed"), {"run.rtol=1e-10"}, {"slope", "radius", "leg_mass"}),
        walker("gait_speed.toml", value_of("cycle.speed"), {}, {"slope", "radius", "leg_fore"})}) {
    const std::vector<double> rho = p.parameters.values();
    const Hessian h = hessian(p, rho), by_differences = hessian_by_differences(p, "cvodes-forward", rho);
    double size = 0, most = 0;
    for (Eigen::Index i = 0; i < h.matrix.rows(); ++i)
      for (Eigen::Index j = 0; j < h.matrix.cols(); ++j) {
        const double scale = p.parameters.parameters[static_cast<std::size_t>(i)].scale *
                             p.parameters.parameters[static_cast<std::size_t>(j)].scale;
        size = std::max(size, std::abs(h.matrix(i, j)) * scale);
        most = std::max(most, std::abs(h.matrix(i, j) - by_differences.matrix(i, j)) * scale);
      }
    CAPTURE(most / size, by_differences.error, h.asymmetry);
    CHECK(by_differences.error <= 1e-4);
    CHECK(most <= (2 * by_differences.error + 1e-6) * size);
    CHECK(h.asymmetry <= 1e-5);
    // Stiff touches make ten times as much of the tolerance as rigid ones, in adjoints most of all: 1.1e-5 at rtol
    // 1e-10. At a tenth of it a tenth is left, and of this gradient some 6e-7.
    Problem tight = p;
    tight.solver.rtol *= 0.1;
    CHECK(off(p, h.gradient, gradient(tight, "cvodes-adjoint", rho).gradient) <= 2e-6);
  }
  const Problem of_multiplier = walker("rigid_arcs.toml", value_of("cycle.multiplier"), {}, {"slope"});
  CHECK_THROWS_WITH(hessian(of_multiplier, of_multiplier.parameters.values()),
                    Catch::Contains("largest multiplier, whose second derivatives"));
}

// Richardson differences of cycles found anew at rtol 1e-13, whose own estimates of their errors are below 1e-8; the
// tangents that the derivative is extrapolated from are good to some 1e-11 over steps of a hundredth. A real multiplier
// (arcs, rigid and compliant) and a pair (points).
TEST_CASE("cycle costs: the largest multiplier", "[cycle][walker]") {
  struct Case {
    const char* file;
    std::vector<std::string> overrides, parameters;
  };
  const std::string feet = "parameter.foot_mass={numbers=['body.left.mass_kg','body.right.mass_kg']}",
                    center = "parameter.center={numbers=['body.left.center_y_m','body.right.center_y_m']}";
  for (const auto& c :
       {Case{"rigid_arcs.toml", {center}, {"slope", "center"}}, Case{"point_feet.toml", {feet}, {"slope", "foot_mass"}},
        Case{"arc_feet.toml", {"run.rtol=1e-10"}, {"slope"}}}) {
    CAPTURE(c.file);
    const Problem p = walker(c.file, value_of("cycle.multiplier"), c.overrides, c.parameters);
    const std::vector<double> rho = p.parameters.values();
    const GradientResult expected = gradient(p, "differences", rho);
    take_notices();
    for (const char* method : {"cvodes-forward", "cvodes-adjoint"}) {
      CAPTURE(method);
      const GradientResult r = gradient(p, method, rho);
      CHECK(off(p, r.gradient, expected.gradient) <= 1e-6);
      // Not exact to rounding, and it says so; a search may say other things besides.
      // That is a part of its error, and not told as the whole.
      CHECK(r.gradient_error.empty());
      REQUIRE(r.known_error);
      REQUIRE(r.known_error->gradient.size() == rho.size());
      std::string said;
      for (const auto& sentence : take_notices()) said += sentence + "\n";
      CHECK_THAT(said, Catch::Contains("exact second derivatives"));
    }
  }
}

TEST_CASE("cycle costs: what there is none of is refused by name", "[cycle]") {
  using Catch::Contains;
  const std::vector<std::string> two = {"slope"};
  CHECK_THROWS_WITH(walker("rigid_arcs.toml", value_of("cycle.speed"), {}, two), Contains("needs 'travel'"));
  CHECK_THROWS_WITH(walker("rigid_arcs.toml", value_of("cycle.sped"), kWay, two), Contains("'cycle.speed'"));
  CHECK_THROWS_WITH(
      Scene::load(COSTATE_MODELS_DIR "/pendulum/pendulum.toml", {"cost.terminal=[" + value_of("cycle.period") + "]"}),
      Contains("scenes with a table [cycle]"));
  Problem p = walker("rigid_arcs.toml", value_of("cycle.speed"), kWay, two);
  p.cycle = nullptr;
  CHECK_THROWS_WITH(simulate(p, p.parameters.values()), Contains("does not look for"));
}

// The motion that begins on a cycle stays on it: steps of one length.
TEST_CASE("cycle costs: the motion on a cycle", "[cycle][walker]") {
  Problem p = walker("rigid_arcs.toml", value_of("cycle.speed"), kWay, {"slope"});
  p.formulation = "baumgarte";  // index 1 drifts by 1e-6 in this time
  p.solver.t_end = 12;
  const std::vector<double> rho = {0.008};
  const auto [motion, values] = shown_motion(p, rho);
  const Simulation run = simulate(motion, values);
  REQUIRE(run.events.size() >= 4);
  const double step = run.events[1].t - run.events[0].t;
  // A stable gait forgets what the search left, 1e3 tolerances at most.
  for (std::size_t i = 2; i < run.events.size(); ++i)
    CHECK(std::abs(run.events[i].t - run.events[i - 1].t - step) <= 1e-6);
}
