// The mechanisms that the tests share, each with parameters and a cost.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate::test {

struct TestModel {
  std::string name;
  std::shared_ptr<const Mechanism> mechanism;
  Objective objective;
  double t_end = 1;  // s

  /// With the parameters named, or the mechanism's default ones.
  Problem problem(const std::string& formulation, double rtol, const std::vector<std::string>& parameters = {}) const;
  ParameterSelection all_parameters() const;
};

/// The five-bar of the project's reference numbers: A(0,0), B(1,0), uniform bars of 1, 1.5, 1.5 and 1 kg, two springs
/// of 100 N/m, g = 9.81 m/s^2; psi = integral over 5 s of |r2 - r2(0)|^2. Parameters: L01 L02 (default), k1 k2,
/// m1 ... m4, and A1_length.
enum class FiveBarGeometry {
  hanging,  // points 1(-1,-1), 2(0.5,-2), 3(2,-1); springs, at their natural lengths
  standing  // points 1(-0.5,1), 2(0.5,2), 3(1.5,1); springs from point 2 to (-0.5,0) and B, at their natural lengths
};
TestModel five_bar(FiveBarGeometry geometry = FiveBarGeometry::hanging);

/// N uniform bars of 0.1 m hung in a row from the ground, starting at rest along a diagonal; psi = integral of the
/// squared height of the tip. Parameter m<i> is the mass of bar i; by default all.
TestModel chain(int bars, double t_end);

/// A planar pendulum: a point mass of 1 kg on a massless rod of 1 m, horizontal at rest; psi = integral of (y + L)^2.
/// Parameters: g, L. `side` is +1 or -1: the start's x.
TestModel pendulum(double side, double t_end);

/// The N-four-bar of the multibody benchmark library (A02): N windows of uniform bars of 1 m and 1 kg, upright,
/// v = 1 m/s. Singular where the bars lie horizontally. Points B0 ... BN on top.
TestModel four_bars(int windows, double t_end);

/// A rigid body and a mass that fly freely, joined by a spring and pushed: no constraint at all.
TestModel free_flight();

/// Every kind of body, joint, driver and force at once, with 4 degrees of freedom, 4 force states,
/// time-dependent constraints and 39 parameters of every kind. The cost holds q, v, a, lambda, z, t and parameters in
/// its running and its terminal part.
TestModel kitchen_sink();
/// The same mechanism with a cost of positions, velocities and force states only.
TestModel kitchen_sink_without_accelerations();

}  // namespace costate::test
