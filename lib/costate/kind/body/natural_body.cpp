#include "costate/kind/body/natural_body.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <cmath>

#include "costate/base/error.h"
#include "costate/element/body/natural_body.h"
#include "costate/element/constraint/natural_frame.h"
#include "costate/scene/scene_kind.h"

namespace costate {

namespace {

constexpr const char* kAxes[3] = {"x", "y", "z"};

/// The three of the nine components of the base vectors (the columns of A) that determine a turn best: a
/// small turn delta changes u_x by delta . (u x e_x), and the determinant of three such rows is largest.
std::array<int, 3> independent_components(const Eigen::Matrix3d& A) {
  Eigen::Matrix<double, 9, 3> rows;
  for (int k = 0; k < 3; ++k)
    for (int i = 0; i < 3; ++i) rows.row(3 * k + i) = cross(A.col(k), Vector3::Unit(i)).transpose();
  std::array<int, 3> best = {};
  double largest = 0;
  for (int a = 0; a < 9; ++a)
    for (int b = a + 1; b < 9; ++b)
      for (int c = b + 1; c < 9; ++c) {
        Eigen::Matrix3d D;
        D << rows.row(a), rows.row(b), rows.row(c);
        const double size = std::abs(D.determinant());
        if (size > largest * (1 + 1e-12)) {  // the first of equals, whatever the rounding
          largest = size;
          best = {a, b, c};
        }
      }
  return best;
}

/// The component k of the angular velocity as a rate of the base vectors u (nine coordinates): in the body's
/// frame u3 . u2' and so on, globally half the sum of u x u'.
std::vector<GivenStart::Term> base_rate_terms(const std::vector<int>& u, int k, bool global) {
  const auto at = [&](int vector, int component) { return u[static_cast<std::size_t>(3 * vector + component)]; };
  const int j = (k + 1) % 3, l = (k + 2) % 3;
  std::vector<GivenStart::Term> terms;
  for (int i = 0; i < 3; ++i) {
    if (!global) {
      terms.push_back({at(l, i), at(j, i), 1.0});
      continue;
    }
    terms.push_back({at(i, j), at(i, l), 0.5});
    terms.push_back({at(i, l), at(i, j), -0.5});
  }
  return terms;
}

}  // namespace

void add_natural_body(MechanismBuilder& builder, const std::string& name, const RigidBodyOptions& o) {
  const std::string path = "natural_body." + name + ".";
  const auto number = [&](const std::string& key, double value) { return builder.add_number(path + key, value); };
  const std::vector<int> numbers = add_spatial_body_numbers(builder, path, o);
  const Vector4 p(o.euler.data());

  std::vector<int> q, u;
  std::vector<std::string> place, turn, rates;
  for (std::size_t i = 0; i < 3; ++i) {
    place.push_back(fmt::format("{}.{}", name, kAxes[i]));
    q.push_back(builder.add_coordinate(place.back(), "m", number(fmt::format("{}_m", kAxes[i]), o.position_m[i]),
                                       number(fmt::format("v{}_m_per_s", kAxes[i]), o.velocity_m_per_s[i])));
  }
  Eigen::Matrix3d A;
  const Vector4 unit = p.normalized();
  for (int k = 0; k < 3; ++k) rotated(unit.data(), Vector3(Vector3::Unit(k)).data(), A.col(k).data());
  const Vector3 omega(o.omega_rad_per_s.data());
  const Vector3 global = o.omega_is_global ? omega : Vector3(A * omega), local = A.transpose() * global;
  for (int k = 0; k < 3; ++k) {
    const Vector3 rate = cross(global, A.col(k));
    for (int i = 0; i < 3; ++i) {
      const std::string c = fmt::format("u{}{}", k + 1, kAxes[i]);
      const int position = number(c, A(i, k)), velocity = number(c + "_dot_per_s", rate[i]);
      builder.fix_number(position,
                         "the scene turns the body by its Euler parameters, or by rotation_axis and angle_rad.");
      builder.fix_number(velocity, "it follows from the angular velocity, which can vary where the start gives it.");
      u.push_back(builder.add_coordinate(name + "." + c, "1", position, velocity));
    }
  }
  for (const int c : independent_components(A)) turn.push_back(fmt::format("{}.u{}{}", name, c / 3 + 1, kAxes[c % 3]));
  for (const bool is_global : {false, true})
    for (int k = 0; k < 3; ++k) {
      const std::string key = fmt::format("omega_{}{}", is_global ? "global_" : "", kAxes[k]);
      GivenStart rate;
      rate.name = name + "." + key;
      const bool written = is_global == o.omega_is_global;
      rate.number = number(key + "_rad_per_s", (written ? omega : is_global ? global : local)[k]);
      rate.terms = base_rate_terms(u, k, is_global);
      if (written)
        rates.push_back(rate.name);
      else
        builder.fix_number(rate.number, fmt::format("the scene gives the angular velocity in the {} frame.",
                                                    is_global ? "body's" : "global"));
      builder.add_rate(std::move(rate));
    }
  builder.add_start_group(name + ".orientation", turn, rates);
  const auto joined = [&](std::vector<std::string> a, const std::vector<std::string>& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  };
  builder.add_start_group(name, joined(place, turn), joined(place, rates));
  q.insert(q.end(), u.begin(), u.end());
  builder.add_natural_body_frame(name, q);
  builder.add(std::make_unique<NaturalBody>("natural_body", name, q, numbers));
  builder.add(std::make_unique<NaturalFrameConstraint>("natural_body", name, u));
}

namespace {

const RegisterSceneKind natural_body_registered({
    .name = "natural_body",
    .phase = ScenePhase::points,
    .summary = "a rigid body in space, in natural coordinates (a point and three unit vectors)",
    .example = two_bodies_example("natural_body") + R"(
[point.ear]
on = "stone"
x_m = 0.2
y_m = 0.1
z_m = -0.3

[point.rim]
on = "plate"
x_m = 0.1
y_m = 0
z_m = 0.3

[point.bob]
x_m = 0.8
y_m = 0.3
z_m = -0.2
vy_m_per_s = 0.4

[mass.bob]
point = "bob"
mass_kg = 0.3

[mass.ear]
point = "ear"
mass_kg = 0.2

[spring.tie]
from = "ear"
to = "rim"
stiffness_N_per_m = 60
natural_length_m = 0.7
damping_N_s_per_m = 2

[spring.string]
from = "bob"
to = "rim"
stiffness_N_per_m = 20
natural_length_m = 0.4

[start]
given = ["stone", "plate", "bob.x", "bob.y", "bob.z"]
)",
    .add = [](const std::string& name, SceneTable& table,
              MechanismBuilder& builder) { add_natural_body(builder, name, read_rigid_body(table)); },
});

}  // namespace

}  // namespace costate
