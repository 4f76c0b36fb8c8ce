// A tyre on a wheel that is put where one likes, for the tests of tyres.
#pragma once

#include <fmt/format.h>

#include <Eigen/Dense>

#include "costate/base/error.h"
#include "costate/element/force/tyre_force.h"
#include "costate/kind/body/body.h"
#include "costate/kind/body/point.h"
#include "costate/kind/body/rigid_body.h"
#include "costate/kind/road/road_laws.h"
#include "costate/kind/tyre/magic_formula.h"
#include "costate/scene/scene.h"

namespace costate::test {

using Vector = Eigen::Vector3d;

inline constexpr double kPi = 3.14159265358979323846;
inline constexpr CalspanOptions kIltis = {2625,     14.47, 12930,    2.29,   18175,    1,
                                          -4.64e-5, 1.216, 2.18e-11, 1.0274, -1.71e-5, 1.71e-5};

/// A wheel on a body at a state, and what its tyre does there.
class Wheel {
 public:
  MechanismBuilder builder;
  TyreOptions tyre;
  Vector position{0.4, -0.2, 0.5}, hub{0.1, -0.6, -0.15}, velocity{9, 0.7, -0.3}, omega{0.2, -0.1, 0.4};
  std::array<double, 4> euler = euler_parameters({1, -0.6, 2.5}, 0.4);
  double t = 0.3;
  std::vector<double> z;

  Wheel() {
    tyre.wheel = "hub";
    tyre.road = "ground";
    tyre.axis = {0.05, 1.3, -0.1};
    tyre.radius_m = 0.55;
    tyre.stiffness_N_per_m = 46000;
  }
  /// Call before a tyre is added.
  void place() {
    RigidBodyOptions o;
    o.mass_kg = 50;
    o.inertia_kg_m2 = {1, 1, 1, 0, 0, 0};
    o.euler = euler;
    add_rigid_body(builder, "carrier", o);
    add_spatial_point(builder, "hub", "carrier", {hub[0], hub[1], hub[2]});
  }
  void finish() {
    mechanism = builder.build();
    const Vector4 p(euler.data());
    const Vector4 pd = global_rate_matrix(p.data()).transpose() * omega / 2;
    for (int i = 0; i < 3; ++i) {
      q[i] = position[i];
      v[i] = velocity[i];
    }
    for (int i = 0; i < 4; ++i) {
      q[3 + i] = p[i];
      v[3 + i] = pd[i];
    }
    const Force& f = *mechanism->forces()[0];
    for (const int k : f.numbers()) numbers.push_back(mechanism->numbers()[k].value);
    for (const double x : q) dual_q.push_back(PathDual(x));
    for (const double x : v) dual_v.push_back(PathDual(x));
    for (const double x : numbers) dual_p.push_back(PathDual(x));
    for (const double x : z) dual_z.push_back(PathDual(x));
    double Q[8] = {};
    zdot.assign(2, 0.0);
    f.calc_force({t, q, v, nullptr, nullptr, z.data(), numbers.data()}, Q, zdot.data());
    force = Vector(Q);
    moment = global_rate_matrix(p.data()) * Vector4(Q + 3) / 2;  // Q_p = 2 E^T M, E E^T = 1
  }
  double measure(const std::string& name) const {
    const Force& f = *mechanism->forces()[0];
    const auto names = f.measures();
    for (std::size_t i = 0; i < names.size(); ++i)
      if (names[i].name == name)
        return f
            .measure(static_cast<int>(i),
                     {PathDual(t), dual_q.data(), dual_v.data(), nullptr, nullptr, dual_z.data(), dual_p.data()})
            .v.c0;
    FAIL("no measure " << name);
    return 0;
  }
  Eigen::Matrix3d rotation() const {
    return Eigen::Quaterniond(euler[0], euler[1], euler[2], euler[3]).toRotationMatrix();
  }
  Vector axis() const { return rotation() * Vector(tyre.axis.data()).normalized(); }
  Vector center() const { return position + rotation() * hub; }
  Vector center_velocity() const { return velocity + omega.cross(rotation() * hub); }

  std::shared_ptr<const Mechanism> mechanism;
  double q[8] = {}, v[8] = {};
  std::vector<double> numbers, zdot;
  std::vector<PathDual> dual_q, dual_v, dual_p, dual_z;
  Vector force, moment;  // moment about the body's origin
};

inline double calspan_mu(double F) { return (kIltis.B1 * F + kIltis.B3 + kIltis.B4 * F * F) * kIltis.SN; }

/// The formulas as the data sheet prints them.
inline double calspan_lateral(double F, double alpha, double gamma) {
  const auto& c = kIltis;
  double phi, abar;
  if (F <= c.A_omega * c.A2) {
    const double D = c.A1 * F * (F - c.A2) - c.A0 * c.A2;
    phi = -c.A2 * c.A3 * (c.A4 - F) * F * gamma / (c.A4 * D);
    abar = D / (c.A2 * calspan_mu(F) * F) * (alpha + phi);
  } else {
    phi = c.A2 * c.A3 * (c.A4 - c.A2) / (c.A0 * c.A4) * gamma;
    abar = -c.A0 / (calspan_mu(F) * F) * (alpha + phi);
  }
  const double g =
      std::abs(abar) < 3 ? abar - abar * std::abs(abar) / 3 + abar * abar * abar / 27 : (abar > 0 ? 1.0 : -1.0);
  return calspan_mu(F) * F * g;
}

}  // namespace costate::test
