#include "costate/kind/body/rigid_body.h"

#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <cmath>

#include "costate/base/error.h"
#include "costate/element/body/rigid_body.h"
#include "costate/element/constraint/euler_norm.h"
#include "costate/scene/scene_kind.h"

namespace costate {

namespace {

constexpr const char* kAxis[3] = {"x", "y", "z"};

/// The component k of the angular velocity as a rate of the coordinates e (e0 ... e3): 2 G pdot, or 2 E pdot.
std::vector<GivenStart::Term> euler_rate_terms(const std::vector<int>& e, int k, bool global) {
  const int i = k + 1, j = (k + 1) % 3 + 1, l = (k + 2) % 3 + 1;  // cyclic
  const double turn = global ? 2 : -2;                            // of e x edot
  return {{e[0], e[i], 2.0}, {e[i], e[0], -2.0}, {e[j], e[l], turn}, {e[l], e[j], -turn}};
}

}  // namespace

void check_inertia(const std::string& path, const std::array<double, 6>& j) {
  Eigen::Matrix3d J;
  J << j[0], j[3], j[4], j[3], j[1], j[5], j[4], j[5], j[2];
  const Vector3 moments = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(J, Eigen::EigenvaluesOnly).eigenvalues();
  const double slack = 1e-9 * std::abs(moments[2]);
  if (moments[0] < -slack || moments[2] > moments[0] + moments[1] + 2 * slack)
    throw ModelError(path + "inertia_xx_kg_m2",
                     fmt::format("No body has this inertia tensor: its principal moments are {:.6g}, {:.6g} and {:.6g} "
                                 "kg m^2; none may be negative or exceed the sum of the others. Check the entries and "
                                 "the signs of xy, xz, yz.",
                                 moments[0], moments[1], moments[2]));
}

std::array<double, 4> euler_parameters(const std::array<double, 3>& axis, double angle_rad) {
  const double length = std::hypot(axis[0], axis[1], axis[2]);
  if (!(length > 0)) throw ModelError("", "The axis of a rotation must not be zero.");
  const double s = std::sin(angle_rad / 2) / length;
  return {std::cos(angle_rad / 2), s * axis[0], s * axis[1], s * axis[2]};
}

std::vector<int> add_spatial_body_numbers(MechanismBuilder& builder, const std::string& path,
                                          const RigidBodyOptions& o) {
  check_inertia(path, o.inertia_kg_m2);
  const Vector4 p(o.euler.data());
  // They are first guesses but for those that the start gives, which may vary; the norm determines the rest.
  constexpr double kNearlyOne = 0.1;
  if (std::abs(p.norm() - 1) > kNearlyOne)
    throw ModelError(path + "e0", fmt::format("Euler parameters must have e0^2 + e1^2 + e2^2 + e3^2 = 1, found {:.6g}.",
                                              p.squaredNorm()));
  std::vector<int> numbers = {builder.add_number(path + "mass_kg", o.mass_kg, NumberRule::non_negative)};
  constexpr const char* entry[6] = {"xx", "yy", "zz", "xy", "xz", "yz"};
  for (std::size_t i = 0; i < 6; ++i)
    numbers.push_back(builder.add_number(fmt::format("{}inertia_{}_kg_m2", path, entry[i]), o.inertia_kg_m2[i]));
  for (std::size_t i = 0; i < 3; ++i)
    numbers.push_back(builder.add_number(fmt::format("{}center_{}_m", path, kAxis[i]), o.center_m[i]));
  for (const int g : builder.spatial_gravity_numbers()) numbers.push_back(g);
  return numbers;
}

void add_rigid_body(MechanismBuilder& builder, const std::string& name, const RigidBodyOptions& o) {
  const std::string path = "rigid_body." + name + ".";
  const auto number = [&](const std::string& key, double value) { return builder.add_number(path + key, value); };
  const std::vector<int> numbers = add_spatial_body_numbers(builder, path, o);
  const Vector4 p(o.euler.data());

  std::vector<int> q;
  std::vector<std::string> positions, velocities;
  for (std::size_t i = 0; i < 3; ++i) {
    const std::string c = fmt::format("{}.{}", name, kAxis[i]);
    q.push_back(builder.add_coordinate(c, "m", number(fmt::format("{}_m", kAxis[i]), o.position_m[i]),
                                       number(fmt::format("v{}_m_per_s", kAxis[i]), o.velocity_m_per_s[i])));
    positions.push_back(c);
    velocities.push_back(c);
  }
  // Angular velocities: those that the scene writes are numbers that can vary, what follows from them is not.
  const Matrix34 G = body_rate_matrix(p.data()), E = global_rate_matrix(p.data());
  const Vector3 omega(o.omega_rad_per_s.data());
  const Vector4 pd = (o.omega_is_global ? E : G).transpose() * omega / 2;
  std::vector<int> e, orientation;
  Eigen::Index largest;
  p.cwiseAbs().maxCoeff(&largest);
  for (int i = 0; i < 4; ++i) {
    const std::string c = fmt::format("{}.e{}", name, i);
    const int position = number(fmt::format("e{}", i), p[i]), velocity = number(fmt::format("e{}_dot_per_s", i), pd[i]);
    orientation.push_back(position);
    if (o.turned_by_axis)
      builder.fix_number(position,
                         "the scene turns the body by rotation_axis and angle_rad, or not at all; write "
                         "e0, e1, e2, e3 instead to vary them.");
    builder.fix_number(velocity, "it follows from the angular velocity, which can vary where the start gives it.");
    e.push_back(builder.add_coordinate(c, "1", position, velocity));
    if (i != largest) positions.push_back(c);  // the norm determines the largest
  }
  if (!o.turned_by_axis && !omega.isZero(0))
    for (const int c : e) builder.velocity_follows(c, orientation);
  for (const bool global : {false, true}) {
    const Vector3 rates = 2 * (global ? E : G) * pd;
    for (int k = 0; k < 3; ++k) {
      const std::string key = fmt::format("omega_{}{}", global ? "global_" : "", kAxis[k]);
      const bool written = global == o.omega_is_global;
      GivenStart rate;
      rate.name = name + "." + key;
      rate.number = number(key + "_rad_per_s", written ? omega[k] : rates[k]);
      rate.terms = euler_rate_terms(e, k, global);
      if (written)
        velocities.push_back(rate.name);
      else
        builder.fix_number(rate.number, fmt::format("the scene gives the angular velocity in the {} frame.",
                                                    global ? "body's" : "global"));
      builder.add_rate(std::move(rate));
    }
  }
  builder.add_start_group(name, positions, velocities);
  builder.add_start_group(name + ".orientation", {positions.begin() + 3, positions.end()},
                          {velocities.begin() + 3, velocities.end()});
  q.insert(q.end(), e.begin(), e.end());
  builder.add_rigid_body_frame(name, q);
  builder.add(std::make_unique<RigidBody>("rigid_body", name, q, numbers));
  builder.add(std::make_unique<EulerNormConstraint>("rigid_body", name, e));
}

namespace {

void read_orientation(SceneTable& table, RigidBodyOptions& o) {
  constexpr const char* e[4] = {"e0", "e1", "e2", "e3"};
  bool parameters = false;
  for (const char* key : e) parameters = table.has(key) || parameters;
  if (parameters) {
    if (table.has("rotation_axis")) table.fail("rotation_axis", "contradicts 'e0': give the orientation once.");
    for (std::size_t i = 0; i < 4; ++i) o.euler[i] = table.value(e[i]);
    return;
  }
  o.turned_by_axis = true;  // also where the scene leaves both out: one Euler parameter cannot be written alone
  if (!table.has("rotation_axis")) return;
  const auto axis = table.values("rotation_axis");
  if (axis.size() != 3) table.fail("rotation_axis", fmt::format("must hold x, y, z, found {} numbers.", axis.size()));
  if (axis[0] == 0 && axis[1] == 0 && axis[2] == 0) table.fail("rotation_axis", "must not be zero.");
  o.euler = euler_parameters({axis[0], axis[1], axis[2]}, table.value("angle_rad"));
}

void read_angular_velocity(SceneTable& table, RigidBodyOptions& o) {
  bool body = false;
  for (int k = 0; k < 3; ++k) {
    const std::string suffix = fmt::format("{}_rad_per_s", kAxis[k]);
    body = table.has("omega_" + suffix) || body;
    o.omega_is_global = table.has("omega_global_" + suffix) || o.omega_is_global;
  }
  if (body && o.omega_is_global)
    table.fail(
        "gives the angular velocity twice: write omega_x_rad_per_s, ... in the body's frame or "
        "omega_global_x_rad_per_s, ... in the global one.");
  for (std::size_t k = 0; k < 3; ++k)
    o.omega_rad_per_s[k] = table.value(
        fmt::format("omega_{}{}_rad_per_s", o.omega_is_global ? "global_" : "", kAxis[k]), NumberRule::any, 0);
}

}  // namespace

RigidBodyOptions read_rigid_body(SceneTable& table) {
  RigidBodyOptions o;
  o.mass_kg = table.value("mass_kg", NumberRule::non_negative);
  constexpr const char* entry[6] = {"xx", "yy", "zz", "xy", "xz", "yz"};
  for (std::size_t i = 0; i < 6; ++i) {
    const std::string key = fmt::format("inertia_{}_kg_m2", entry[i]);
    o.inertia_kg_m2[i] = i < 3 ? table.value(key, NumberRule::non_negative) : table.value(key, NumberRule::any, 0);
  }
  for (std::size_t i = 0; i < 3; ++i) {
    o.center_m[i] = table.value(fmt::format("center_{}_m", kAxis[i]), NumberRule::any, 0);
    o.position_m[i] = table.value(fmt::format("{}_m", kAxis[i]));
    o.velocity_m_per_s[i] = table.value(fmt::format("v{}_m_per_s", kAxis[i]), NumberRule::any, 0);
  }
  read_orientation(table, o);
  read_angular_velocity(table, o);
  return o;
}

std::string two_bodies_example(const std::string& kind) {
  return fmt::format(R"(
[gravity]
x_m_per_s2 = 0.3
y_m_per_s2 = -0.4
z_m_per_s2 = -9.81

[{0}.stone]
x_m = 0.2
y_m = 1.0
z_m = -0.5
e0 = 0.8
e1 = 0.4
e2 = -0.2
e3 = 0.4
vx_m_per_s = 0.5
omega_x_rad_per_s = 2.0
omega_z_rad_per_s = -0.7
mass_kg = 3.0
inertia_xx_kg_m2 = 0.7
inertia_yy_kg_m2 = 0.9
inertia_zz_kg_m2 = 0.5
inertia_xy_kg_m2 = 0.1
inertia_xz_kg_m2 = -0.05
inertia_yz_kg_m2 = 0.02
center_x_m = 0.1
center_y_m = -0.05
center_z_m = 0.2

[{0}.plate]
x_m = 1.2
y_m = 0.0
z_m = 0.5
rotation_axis = [1, 2, 0]
angle_rad = 2.5
omega_global_z_rad_per_s = 1.5
mass_kg = 1.0
inertia_xx_kg_m2 = 0.1
inertia_yy_kg_m2 = 0.2
inertia_zz_kg_m2 = 0.3
)",
                     kind);
}

namespace {

const RegisterSceneKind rigid_body_registered({
    .name = "rigid_body",
    .phase = ScenePhase::points,
    .summary = "a rigid body in space",
    .example = two_bodies_example("rigid_body") + R"(
[start]
given = ["stone", "plate"]
)",
    .add = [](const std::string& name, SceneTable& table,
              MechanismBuilder& builder) { add_rigid_body(builder, name, read_rigid_body(table)); },
});

}  // namespace

}  // namespace costate
