// Scenes whose fixed steps are cut, and gradients by them.
//
// Tolerances. kSums: tangent and adjoint are the same sums in another order; a cut divides by the length of its step,
// which costs a digit or two of the 1e-14 of discrete.cpp. kDifferences: psi carries rounding errors of some 1e-14 of
// itself, so that extrapolated differences over 1e-4 of a parameter's scale are good to 2e-10; over that range no cut
// passes one of the grid's times, where psi has a kink of the size of the steps' own errors.
#pragma once

#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <string>
#include <vector>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "property/falling_arm.h"
#include "property/gradient_compare.h"

namespace costate::test {

constexpr double kSums = 1e-10, kDifferences = 1e-9;

inline std::string falling_arm(const std::string& contact) { return falling_arm(contact, 0.9, "arm.tension", 1e-2); }
constexpr const char* kSoft = "law = \"hunt-crossley\"\nrestitution = 0.8\nstiffness_N_per_m_n = 2e4";
constexpr const char* kViscous = "law = \"kelvin-voigt\"\nstiffness_N_per_m_n = 2e4\ndamping_N_s_per_m = 20";
constexpr const char* kLinear = "law = \"hunt-crossley\"\nexponent = 1\nrestitution = 0.95\nstiffness_N_per_m_n = 5e3";
constexpr const char* kRigid = "kind = \"rigid\"\nrestitution = 0.8\nclosing_speed_m_per_s = 0";

// A ball on rigid ground: it falls, bounces, closes, and is lifted off again by a force of time.
inline const std::string kLifted = R"(
[gravity]
y_m_per_s2 = -9.81
[point.P]
x_m = 0
y_m = 0.3
vx_m_per_s = 0.5
[mass.m]
point = "P"
mass_kg = 2
[force.F]
point = "P"
formula_y_N = "a*t^3"
formula_x_N = "-3*P.x"
a = 45
[contact.floor]
kind = "rigid"
point = "P"
restitution = 0.2
closing_speed_m_per_s = 0.3
ground_height_m = 0.05
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 1.1
[[cost.running]]
kind = "square"
output = "P.y"
[[cost.running]]
kind = "square"
output = "floor.normal_force"
weight = 1e-3
[[cost.terminal]]
kind = "value"
output = "P.y"
)";

inline Problem fixed_problem(const std::string& scene, const std::vector<std::string>& numbers, double step,
                             const char* scheme = "newmark") {
  Problem p = make_problem(Scene::parse(scene, "scene.toml"), numbers);
  p.formulation = "index3";
  p.solver.integrator = "fixed";
  p.solver.step_s = step;
  p.formulation_options.set("discrete_scheme", scheme);
  p.formulation_options.set("discrete_rho_infinity", 0.7);
  return p;
}

inline std::vector<double> differences_of_steps(const Problem& p, double part = 1e-4) {
  std::vector<double> g;
  for (std::size_t j = 0; j < p.parameters.parameters.size(); ++j) {
    const double scale = p.parameters.parameters[j].scale;
    const auto along = [&](double e) {
      auto rho = p.parameters.values();
      rho[j] += e * scale;
      return simulate(p, rho).psi;
    };
    g.push_back(directional_difference(along, part) / scale);
  }
  return g;
}

/// The gradient that the tangent gives, which is the adjoint's and psi's own.
inline GradientResult exact_gradient(const Problem& p, double sums = kSums, double differences = kDifferences) {
  const auto rho = p.parameters.values();
  const GradientResult tangent = gradient(p, "discrete-tangent", rho), adjoint = gradient(p, "discrete-adjoint", rho);
  CHECK(tangent.integrator == "fixed");
  CHECK(tangent.psi == adjoint.psi);
  CHECK(tangent.psi == simulate(p, rho).psi);
  const auto transposed = gradient_mismatch(adjoint.gradient, tangent.gradient, p.parameters);
  INFO("adjoint and tangent " << transposed.text);
  CHECK(transposed.error <= sums);
  const auto own = gradient_mismatch(tangent.gradient, differences_of_steps(p), p.parameters);
  INFO("tangent and differences " << own.text);
  CHECK(own.error <= differences);
  return tangent;
}

inline const std::vector<std::string> kArm = {"contact.floor.ground_height_m", "gravity.y_m_per_s2", "bar.arm.length_m",
                                              "bar.arm.mass_kg"};

inline std::vector<std::string> arm_numbers(const std::vector<std::string>& own) {
  std::vector<std::string> all = kArm;
  for (const std::string& n : own) all.push_back("contact.floor." + n);
  return all;
}

}  // namespace costate::test
