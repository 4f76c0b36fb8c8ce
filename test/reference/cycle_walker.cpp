// The gait of a walker as a limit cycle through touches: where it is, that it is the same by every formulation, how it
// depends on the design, and what it tends to as the ground becomes rigid.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/cycle/cycle.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;

namespace {

const std::string kWalker = COSTATE_MODELS_DIR "/walker/arc_feet.toml";

CycleResult gait(const std::vector<std::string>& overrides, const std::vector<std::string>& parameters,
                 double rtol = 1e-9, const std::string& formulation = {}, const std::string& integrator = {},
                 const CycleOptions& options = {}) {
  const Scene scene = Scene::load(kWalker, overrides);
  Problem p = make_problem(scene, parameters);
  p.solver.rtol = rtol;
  if (!formulation.empty()) p.formulation = formulation;
  p.solver.integrator = integrator;
  return find_cycle(p, *scene.cycle, p.parameters.values(), options);
}

}  // namespace

// The same cycle whatever carries the run to the section; a step that amplifies errors by less than 1e3 (the estimates
// at rtol 1e-8 are some 1e-7).
TEST_CASE("cycle: a walker's gait by several formulations", "[cycle][walker]") {
  const CycleResult r = gait({}, {"slope", "leg_center"});
  CHECK(std::abs(r.period.value - 2.4356) <= 1e-4);  // of the motion after ten steps, see property/walkers.cpp
  CHECK(r.stable() == true);
  CHECK(r.largest() < 0.7);
  REQUIRE(r.events.size() == 2);
  CHECK(r.events[0].name == "contact.right: release");
  CHECK(r.events[1].name == "contact.right touch");
  CHECK(r.residual < 1e3);
  for (const auto& [formulation, integrator] :
       {std::pair{"baumgarte", "cvodes"}, {"index1", "cvodes"}, {"maggi", "cvodes"}, {"index2", "idas"}}) {
    CAPTURE(formulation, integrator);
    CycleOptions once;
    once.estimate = false;
    const CycleResult other = gait({}, {"slope", "leg_center"}, 1e-9, formulation, integrator, once);
    CHECK(std::abs(other.period.value - r.period.value) <= 1e-6);
    CHECK(std::abs(other.travel.value - r.travel.value) <= 1e-6);
    CHECK((other.x - r.x).cwiseAbs().maxCoeff() <= 1e-6);
    CHECK(std::abs(other.largest() - r.largest()) <= 1e-4);
    CHECK((other.period_rho - r.period_rho).cwiseAbs().maxCoeff() <= 1e-4 * r.period_rho.cwiseAbs().maxCoeff());
  }
}

// The largest multiplier is 0.64 while speeds on return are ten times as sensitive to positions: units and lengths are
// no reason to call the cycle undetermined, as it was from 3e-6 on.
TEST_CASE("cycle: a walker's gait at a loose tolerance", "[cycle][walker]") {
  CycleOptions once;
  once.estimate = false;
  const CycleResult r = gait({}, {}, 3e-6, "baumgarte", "idas", once);
  CHECK(std::abs(r.period.value - 2.43554) <= 1e-4);
  CHECK(std::abs(r.largest() - 0.642) <= 1e-3);
}

// Two steps, without the legs swapping roles: twice the time, the squares of the multipliers.
TEST_CASE("cycle: a walker's step and its stride", "[cycle][walker]") {
  CycleOptions once;
  once.derivatives = false;
  const CycleResult step = gait({}, {"slope"}, 1e-9, "", "", once),
                    stride = gait({"cycle={section='contact.left touch', travel='left.x', "
                                   "travel_angle_rad='contact.left.ground_angle_rad', settle=3}"},
                                  {"slope"}, 1e-9, "", "", once);
  CHECK(std::abs(stride.period.value - 2 * step.period.value) <= 1e-6);
  CHECK(std::abs(stride.travel.value - 2 * step.travel.value) <= 1e-6);
  for (int i = 0; i < 3; ++i)
    CHECK(std::abs(stride.multipliers[static_cast<std::size_t>(i)] -
                   step.multipliers[static_cast<std::size_t>(i)] * step.multipliers[static_cast<std::size_t>(i)]) <=
          1e-5);
}

// Against central differences of the whole search: their truncation, h^2 of the third derivative, and the errors of the
// fixed points over 2 h, some 1e-8/6e-4 each of scaled derivatives of order one.
TEST_CASE("cycle: how a walker's gait depends on its design", "[cycle][walker]") {
  CycleOptions once;
  once.estimate = false;
  const std::vector<std::string> names = {"slope", "leg_center", "hip_mass", "friction"};
  const CycleResult r = gait({}, names, 1e-10, "", "", once);
  once.derivatives = false;
  const Scene scene = Scene::load(kWalker);
  const Problem p = [&] {
    Problem of = make_problem(scene, names);
    of.solver.rtol = 1e-10;
    return of;
  }();
  for (std::size_t j = 0; j < names.size(); ++j) {
    CAPTURE(names[j]);
    const double h = 3e-4 * std::abs(p.parameters.values()[j]);
    const auto at = [&](double by) {
      std::vector<double> rho = p.parameters.values();
      rho[j] += by;
      return find_cycle(p, *scene.cycle, rho, once);
    };
    const CycleResult up = at(h), down = at(-h);
    const auto k = static_cast<Eigen::Index>(j);
    const auto near = [&](double derivative, double a, double b, double size) {
      const double scaled = h / 3e-4;
      CHECK(std::abs(derivative - (a - b) / (2 * h)) * scaled <= 2e-4 * size);
    };
    near(r.period_rho[k], up.period.value, down.period.value, r.period.value);
    near(r.travel_rho[k], up.travel.value, down.travel.value, r.travel.value);
    near(r.psi_rho[k], up.psi.value, down.psi.value, std::abs(r.psi.value));
    for (Eigen::Index i = 0; i < r.x.size(); ++i) near(r.x_rho(i, k), up.x[i], down.x[i], std::abs(r.x[i]));
  }
}

// The adjoint ends where a touch is about to happen, and does not cross it; what travels, and a slope that turns the
// way. At rtol 1e-9 adjoints are off by some 1e5 of it: stiff touches, see property/walkers.cpp.
TEST_CASE("cycle: a walker's gradient on its gait by adjoints", "[cycle][walker]") {
  const Scene scene = Scene::load(kWalker, {"run.cycle=true"});
  Problem p = make_problem(scene, {"slope", "leg_center", "radius", "hip_mass", "stiffness"});
  // The adjoint meets the contact's stiffness at interpolated states, which scatters the component of the radius by up
  // to 4e6 rtol of the largest one (measured from 1e-8 to 1e-12, at tolerances 3 % apart).
  p.solver.rtol = 1e-12;
  p.solver.confirm = false;
  const std::vector<double> rho = p.parameters.values();
  const GradientResult reference = gradient(p, "cvodes-forward", rho);
  double size = 0;
  for (std::size_t j = 0; j < rho.size(); ++j) size = std::max(size, std::abs(reference.gradient[j] * rho[j]));
  for (const auto& [formulation, method] :
       {std::pair{"baumgarte", "cvodes-adjoint"}, {"baumgarte", "idas-adjoint"}, {"maggi", "cvodes-adjoint"}}) {
    CAPTURE(formulation, method);
    p.formulation = formulation;
    const GradientResult r = gradient(p, method, rho);
    CHECK(std::abs(r.psi - reference.psi) <= 1e-6 * std::abs(reference.psi));
    for (std::size_t j = 0; j < rho.size(); ++j)
      CHECK(std::abs((r.gradient[j] - reference.gradient[j]) * rho[j]) <= 3e-5 * size);
  }
}

TEST_CASE("cycle: a gradient on a gait that is off says so", "[cycle][walker]") {
  Problem p = make_problem(Scene::load(kWalker, {"run.cycle=true"}),
                           {"slope", "leg_center", "radius", "hip_mass", "stiffness"});
  p.formulation = "baumgarte";
  p.solver.rtol = 1e-10;
  const std::vector<double> rho = p.parameters.values();
  const GradientResult reference = gradient(p, "cvodes-forward", rho);
  double size = 0;
  for (std::size_t j = 0; j < rho.size(); ++j) size = std::max(size, std::abs(reference.gradient[j] * rho[j]));
  int off = 0;
  for (const double rtol : {1e-8, 0.97e-8, 1.03e-8}) {
    p.solver.rtol = rtol;
    p.solver.confirm = false;
    const GradientResult plain = gradient(p, "cvodes-adjoint", rho);
    p.solver.confirm = true;
    take_notices();
    const GradientResult r = gradient(p, "cvodes-adjoint", rho);
    const bool said = !take_notices().empty();
    CAPTURE(rtol, said);
    for (std::size_t j = 0; j < rho.size(); ++j) {
      CHECK((said || std::abs((r.gradient[j] - reference.gradient[j]) * rho[j]) <= 1e-4 * size));
      off += std::abs((plain.gradient[j] - reference.gradient[j]) * rho[j]) > 1e-4 * size ? 1 : 0;
    }
  }
  CHECK(off > 0);  // otherwise this has nothing to tell
}

// Rigid ground, plastic impacts without slip, from the same bodies by a program of its own
// (models/walker/rigid_gait.py): 2.4279558426 s and the multipliers below, state behind the impact. Ground that gives
// tends to it as it stiffens, its restitution falls and its friction grips; what is left at 1e9 N/m^1.5 is the creep
// through strong damping.
TEST_CASE("cycle: a walker's gait as the ground becomes rigid", "[cycle][walker]") {
  CycleOptions once;
  once.estimate = false;
  once.derivatives = false;
  for (const auto& [K, e, v] : {std::tuple{1e7, 0.005, 1e-3}, {1e9, 0.001, 1e-4}}) {
    std::vector<std::string> overrides = {"parameter.stiffness.upper=1e12", "parameter.restitution.lower=0",
                                          "parameter.friction.upper=10"};
    for (const char* foot : {"left", "right"})
      for (const auto& [key, x] : {std::pair{"stiffness_N_per_m_n", K},
                                   {"restitution", e},
                                   {"friction_coefficient", 3.0},
                                   {"transition_velocity_m_per_s", v}})
        overrides.push_back(fmt::format("contact.{}.{}={:g}", foot, key, x));
    const CycleResult r = gait(overrides, {"slope"}, 1e-8, "", "", once);
    CAPTURE(K, r.period.value, r.multipliers[0], r.multipliers[1], r.multipliers[2]);
    const double off = std::abs(r.period.value / 2.4279558426 - 1);
    CHECK(off <= (K < 1e9 ? 1e-3 : 2e-5));
    if (K < 1e9) continue;
    const std::complex<double> sum = r.multipliers[0] + r.multipliers[1] + r.multipliers[2];
    CHECK(std::abs(sum - 1.1743757079) <= 1e-3);  // the trace
    CHECK(std::abs(r.multipliers[3]) <= 1e-3);    // what the legs do against the ground is gone after a step
  }
}

// On points, over four decades of stiffness: 3.881939999 s on rigid ground (point_feet.toml, and an independent
// program). As penetration, restitution and creep fall with K the step time comes nearer by about a half digit a
// decade.
TEST_CASE("cycle: a walker on points as the ground becomes rigid", "[cycle][walker]") {
  CycleOptions once;
  once.estimate = once.derivatives = false;
  double before = 1;
  for (const auto& [K, e, v] : {std::tuple{1e8, 0.05, 1e-2},
                                {1e9, 0.02, 3e-3},
                                {1e10, 0.005, 1e-3},
                                {1e11, 0.002, 3e-4},
                                {1e12, 0.001, 1e-4}}) {
    std::vector<std::string> overrides;
    for (const char* foot : {"left", "right"})
      for (const auto& [key, x] :
           {std::pair{"stiffness_N_per_m_n", K}, {"restitution", e}, {"transition_velocity_m_per_s", v}})
        overrides.push_back(fmt::format("contact.{}.{}={:g}", foot, key, x));
    const Scene scene = Scene::load(COSTATE_MODELS_DIR "/walker/soft_points.toml", overrides);
    const Problem p = make_problem(scene, {"slope"});
    const CycleResult r = find_cycle(p, *scene.cycle, p.parameters.values(), once);
    const double off = std::abs(r.period.value - 3.881939999);
    CAPTURE(K, off);
    CHECK(off < before / 2);
    before = off;
  }
  CHECK(before <= 2e-4);
}
