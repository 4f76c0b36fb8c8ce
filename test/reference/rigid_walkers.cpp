// Walkers on rigid ground as limit cycles, against programs apart; and one scene run as both kinds of contact.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <csignal>

#include "costate/cycle/branch.h"
#include "costate/cycle/cycle.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/record/interrupt.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;

namespace {

const std::string kRigidWalkers = COSTATE_MODELS_DIR "/walker/";

CycleResult rigid_gait(const std::string& file, const std::vector<std::string>& overrides = {},
                       bool derivatives = false) {
  const Scene scene = Scene::load(kRigidWalkers + file, overrides);
  const Problem p = make_problem(scene, {"slope"});
  CycleOptions once;
  once.derivatives = derivatives;
  once.estimate = false;
  return find_cycle(p, *scene.cycle, p.parameters.values(), once);
}

}  // namespace

// An independent program prints six digits: 3.88194 s, -0.196668 +- 0.544727 i.
TEST_CASE("rigid walkers: points with masses", "[cycle][walker]") {
  for (const char* formulation : {"index1", "maggi", "maggi-implicit"}) {
    CAPTURE(formulation);
    const CycleResult r = rigid_gait("point_feet.toml", {fmt::format("run.formulation=\"{}\"", formulation)});
    CHECK(std::abs(r.period.value - 3.88194) <= 5e-6);
    REQUIRE(r.multipliers.size() >= 2);
    CHECK(std::abs(r.multipliers[0].real() + 0.196668) <= 1e-6);
    CHECK(std::abs(std::abs(r.multipliers[0].imag()) - 0.544727) <= 1e-6);
    CHECK(r.stable() == true);
  }
}

// The same gait begun behind its heel strike: period, multipliers and their derivatives are its own, whatever the
// section; the state behind the impact by the independent program, to its 15 digits less what rtol 1e-10 leaves.
TEST_CASE("rigid walkers: a heel strike as the section", "[cycle][walker]") {
  const auto gait = [](const std::vector<std::string>& more) {
    std::vector<std::string> overrides = {"run.formulation=\"baumgarte\""};
    overrides.insert(overrides.end(), more.begin(), more.end());
    return rigid_gait("point_feet.toml", overrides, true);
  };
  const std::string strike = "cycle.section=\"contact.left touch\"";
  const CycleResult stance = gait({});
  // From its start, which is just behind an impact, and from elsewhere, from where the next impact is met first.
  for (const std::vector<std::string>& from :
       {std::vector{strike}, {strike, "body.left.angle_rad=0.185", "body.left.angular_velocity_rad_per_s=-0.203"}}) {
    const CycleResult r = gait(from);
    REQUIRE(r.names == std::vector<std::string>{"left.angle", "right.angle", "left.angle_dot", "right.angle_dot"});
    CHECK(std::abs(r.x[0] - 0.19116107216975) <= 1e-8);
    CHECK(std::abs(r.x[1] + 0.209161072169762) <= 1e-8);
    CHECK(std::abs(r.x[2] + 0.199906060087682) <= 1e-8);
    CHECK(std::abs(r.x[3] + 0.184100586859717) <= 1e-8);
    CHECK(std::abs(r.period.value - stance.period.value) <= 4e-8);  // 1e2 rtol of it
    CHECK(std::abs(r.multipliers[0] - stance.multipliers[0]) <= 1e-6);
    CHECK(std::abs(r.period_rho[0] - stance.period_rho[0]) <= 1e-6 * std::abs(stance.period_rho[0]));
    REQUIRE(r.events.size() == 1);
    CHECK(r.events[0].name == "contact.right touch");
  }
  // The multiplier's derivative: behind the impact by its second derivatives, in mid-stance without it.
  const auto by_slope = [](const std::vector<std::string>& section) {
    const Scene scene = Scene::load(kRigidWalkers + "point_feet.toml", section);
    const Problem p = make_problem(scene, {"slope"});
    CycleOptions with;
    with.estimate = false;
    with.multiplier = true;
    const CycleResult r = find_cycle(p, *scene.cycle, p.parameters.values(), with);
    CHECK_THAT(r.multiplier_method, Catch::StartsWith("exact second derivatives"));
    return r.multiplier_rho[0];
  };
  const double in_stance = by_slope({});
  CHECK(std::abs(by_slope({strike}) - in_stance) <= 1e-6 * std::abs(in_stance));
  // psi on it by an adjoint through the impact that ends the cycle, and by tangents.
  const Scene scene = Scene::load(kRigidWalkers + "point_feet.toml", {strike, "run.cycle=true"});
  Problem p = make_problem(scene, {"slope"});
  p.formulation = "baumgarte";
  const GradientResult forward = gradient(p, "cvodes-forward", p.parameters.values());
  for (const char* method : {"cvodes-adjoint", "idas-adjoint"}) {
    const GradientResult r = gradient(p, method, p.parameters.values());
    CHECK(r.psi == Approx(forward.psi).epsilon(1e-8));
    CHECK(r.gradient[0] == Approx(forward.gradient[0]).epsilon(1e-6));
  }
  // The scene starts on the fixed point, which neither tolerance's search leaves: errors are what they would still
  // change.
  const Scene known = Scene::load(kRigidWalkers + "point_feet.toml", {"run.formulation=\"baumgarte\"", strike});
  const Problem of_known = make_problem(known, {"slope"});
  const CycleResult estimated = find_cycle(of_known, *known.cycle, of_known.parameters.values(), {});
  CHECK(estimated.x_error.minCoeff() > 0);
  CHECK(std::abs(estimated.x[0] - 0.19116107216975) <= 10 * estimated.x_error[0]);
  CHECK_THROWS_WITH(gait({"cycle.section=\"contact.left release\""}), Catch::Contains("contact.left touch"));
}

// Legs without mass (float128, digits beyond 1e-20): at 1e-6 of the hip's mass the step is 5.3e-7 s and multipliers
// are 1.4e-5 away from it, and a tenth of that at a tenth of the mass: first order.
TEST_CASE("rigid walkers: the simplest is the limit of small feet", "[cycle][walker]") {
  const double period = 3.8824637528513741, re = -0.19009984106588815, im = 0.55759877668206827;
  double before = 0;
  for (const char* m : {"1e-4", "1e-5", "1e-6"}) {
    const CycleResult r =
        rigid_gait("simplest.toml", {fmt::format("body.left.mass_kg={}", m), fmt::format("body.right.mass_kg={}", m)});
    const double off = std::abs(r.period.value - period),
                 of_multiplier = std::hypot(r.multipliers[0].real() - re, std::abs(r.multipliers[0].imag()) - im);
    CAPTURE(m, off, of_multiplier);
    CHECK(off <= 0.54 * std::stod(m) + 2e-9);
    CHECK(of_multiplier <= 15 * std::stod(m));
    if (before > 0) CHECK(std::abs(before / off - 10) <= 0.1);  // second order is some 1e-4 of it; rtol 1e-10 2e-3
    before = off;
  }
}

// Both gaits of the walker without leg mass on three slopes (float128, digits beyond 1e-20): the leg's angle behind
// heel strike and its derivative by the slope, the time of a step, and the multipliers. A step's way is 2 sin(angle)
// along the slope. Feet of 1e-6 add errors of first order in their mass, which those of 2e-6 take out.
TEST_CASE("rigid walkers: the simplest's short and long gaits", "[cycle][walker]") {
  struct Gait {
    double slope, angle, rate, swing_rate, time, angle_by_slope;
    std::complex<double> first, second;
  };
  using C = std::complex<double>;
  const Gait gaits[] = {
      {0.009, 2.00310900544247e-01, -1.99832473004952e-01, -1.58229999483093e-02, 3.88246375285137, 7.29782021162264,
       C(-0.190099841065888, 0.557598776682068), C(-0.190099841065888, -0.557598776682068)},
      {0.004, 1.53389564876236e-01, -1.56080146675682e-01, -7.28719744912350e-03, 3.85261346181251, 12.6600866707502,
       C(0.228889962888464, 0.591155194683486), C(0.228889962888464, -0.591155194683486)},
      {0.009, 1.93937369810182e-01, -2.03866927442007e-01, -1.51442608531916e-02, 3.09610586807816, 7.00159654271101,
       C(4.00386435892971, 0), C(0.459589589797672, 0)},
      {0.004, 1.48778386969620e-01, -1.58806673457606e-01, -6.97865449899189e-03, 3.11650559834801, 12.2186022228289,
       C(3.21276938763343, 0), C(0.591552246984475, 0)},
      {0.001, 9.41319616448393e-02, -1.01773995720216e-01, -1.79828252719127e-03, 3.13215299578722, 31.1995323903296,
       C(2.52913096118358, 0), C(0.774251625304803, 0)},
  };
  for (const Gait& g : gaits) {
    const auto found = [&](double m) {
      const double swing = g.angle - g.slope - 2 * g.angle;
      return rigid_gait("simplest.toml",
                        {fmt::format("body.left.mass_kg={}", m), fmt::format("body.right.mass_kg={}", m),
                         fmt::format("body.left.angle_rad={:.15g}", g.angle - g.slope),
                         fmt::format("body.right.angle_rad={:.15g}", swing),
                         fmt::format("body.left.angular_velocity_rad_per_s={:.15g}", g.rate),
                         fmt::format("body.right.angular_velocity_rad_per_s={:.15g}", g.rate - g.swing_rate),
                         fmt::format("contact.left.ground_angle_rad={}", -g.slope),
                         fmt::format("contact.right.ground_angle_rad={}", -g.slope), "cycle.travel=hip.x",
                         "cycle.travel_angle_rad=contact.left.ground_angle_rad", "run.rtol=1e-12"},
                        true);
    };
    const CycleResult one = found(1e-6), two = found(2e-6);
    const auto limit = [](auto a, auto b) { return 2. * a - b; };
    CAPTURE(g.slope, g.time);
    const double way = limit(one.travel.value, two.travel.value), by = limit(one.travel_rho[0], two.travel_rho[0]);
    CHECK(std::abs(limit(one.period.value, two.period.value) - g.time) <= 1e-9);
    CHECK(std::abs(way - 2 * std::sin(g.angle)) <= 1e-9);
    CHECK(std::abs(by / (2 * std::cos(g.angle)) - g.angle_by_slope) <= 1e-7);
    CHECK(std::abs(limit(one.multipliers[0], two.multipliers[0]) - g.first) <= 1e-7);
    CHECK(std::abs(limit(one.multipliers[1], two.multipliers[1]) - g.second) <= 1e-7);
    CHECK(one.stable() == (std::abs(g.first) < 1));
  }
}

// At a slope of 0.015 the walker without leg mass has 3.9120039364 s and -0.98046440, -0.30419866, and near
// 0.0150884379 a flip; the feet's mass moves these by some 1e-6 of order one.
TEST_CASE("rigid walkers: the simplest is about to flip", "[cycle][walker]") {
  const std::vector<std::string> steep = {"contact.left.ground_angle_rad=-0.015",
                                          "contact.right.ground_angle_rad=-0.015"};
  const CycleResult r = rigid_gait("simplest.toml", steep);
  CHECK(std::abs(r.period.value - 3.9120039364216083) <= 1e-6);
  CHECK(std::abs(r.multipliers[0].real() + 0.98046439833454667) <= 5e-5);
  CHECK(std::abs(r.multipliers[1].real() + 0.30419865500814944) <= 5e-5);
  const Scene scene = Scene::load(kRigidWalkers + "simplest.toml", steep);
  const Problem p = make_problem(scene, {"slope"});
  BranchOptions range;
  range.from = 0.0149;
  range.to = 0.0152;
  const Branch branch = follow_cycles(p, *scene.cycle, p.parameters.values(), range);
  REQUIRE(branch.bifurcations.size() == 1);
  CHECK(branch.bifurcations[0].kind == BifurcationKind::flip);
  CHECK(std::abs(branch.bifurcations[0].at.parameter - 0.01508843794111946) <= 1e-6);
  CHECK(branch.interrupted == 0);
  // What had been found when a signal came stands.
  int seen = 0;
  range.progress = [&](const BranchPoint&) {
    if (++seen == 3) throw Interrupted(SIGTERM);
  };
  const Branch part = follow_cycles(p, *scene.cycle, p.parameters.values(), range);
  CHECK(part.interrupted == SIGTERM);
  REQUIRE(part.points.size() == 3);  // that which it was begun with, and two
  CHECK(part.points[2].parameter == branch.points[branch.first + 2].parameter);
  CHECK(part.ended_last == "it was interrupted");
}

// One scene, one key: on ground of 1e8 N/m^1.5 arcs walk as on rigid ground, where feet bounce ever less until they
// close. The stiff ground's steps are within 1e-4 of the rigid one's (models/walker/README.md), the first from where
// both fall.
TEST_CASE("rigid walkers: one scene runs as both kinds", "[walker]") {
  const auto touches = [](bool rigid, const std::string& file, double end, double K) {
    std::vector<std::string> overrides = {"parameter.stiffness.upper=1e13", "parameter.restitution.lower=0",
                                          "parameter.friction.upper=10"};
    if (file == "soft_points.toml") overrides.resize(1);
    for (const char* foot : {"left", "right"}) {
      overrides.push_back(fmt::format("contact.{}.kind={}", foot, rigid ? "rigid" : "compliant"));
      overrides.push_back(fmt::format("contact.{}.stiffness_N_per_m_n={:g}", foot, K));
      overrides.push_back(fmt::format("contact.{}.restitution=0.002", foot));
      overrides.push_back(fmt::format("contact.{}.friction_coefficient=3", foot));
      overrides.push_back(fmt::format("contact.{}.transition_velocity_m_per_s=3e-4", foot));
    }
    Problem p = make_problem(Scene::load(kRigidWalkers + file, overrides), {"slope"});
    p.solver.t_end = end;
    std::vector<double> first;  // of each step
    double last = -1;
    for (const RunEvent& e : simulate(p, p.parameters.values()).events) {
      if (e.name.find("touch") == std::string::npos) continue;
      if (e.t - last > 0.5) first.push_back(e.t);
      last = e.t;
    }
    return first;
  };
  for (const auto& [file, end, K] :
       {std::tuple{std::string("arc_feet.toml"), 5.2, 1e8}, {std::string("soft_points.toml"), 4.5, 1e11}}) {
    const std::vector<double> rigid = touches(true, file, end, K), soft = touches(false, file, end, K);
    CAPTURE(file, rigid, soft);
    REQUIRE(rigid.size() == soft.size());
    REQUIRE(rigid.size() >= 2);
    for (std::size_t i = 0; i < rigid.size(); ++i) CHECK(std::abs(rigid[i] - soft[i]) <= 2e-3);
  }
}
