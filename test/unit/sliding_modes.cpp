// Modes of what slides on a rigid contact, whose friction follows the normal force: against equations written out here,
// linearized by differences, and a closed form in space.
#include <fmt/format.h>
#include <support/differences.h>

#include <Eigen/Dense>
#include <algorithm>
#include <catch2/catch.hpp>
#include <complex>
#include <vector>

#include "costate/analysis/modes.h"
#include "costate/scene/scene.h"

using namespace costate;
using namespace costate::test;
using Complex = std::complex<double>;
using Eigen::VectorXd;

namespace {

Modes modes_of(const std::string& text) {
  const Scene scene = Scene::parse(text, "slides.toml");
  Assembly assembly(scene.mechanism(), ParameterSelection{});
  return find_modes(assembly, 0, find_start(assembly, 0, false));
}

/// All eigenvalues, by the size of their imaginary, then their real parts.
std::vector<Complex> sorted(std::vector<Complex> x) {
  std::sort(x.begin(), x.end(), [](const Complex& a, const Complex& b) {
    return std::abs(a.imag() - b.imag()) > 1e-6 ? a.imag() < b.imag() : a.real() < b.real();
  });
  return x;
}
std::vector<Complex> all_of(const Modes& modes) {
  std::vector<Complex> x;
  for (const Mode& m : modes.modes) {
    x.push_back(m.eigenvalue);
    if (m.oscillates()) x.push_back(std::conj(m.eigenvalue));
  }
  return sorted(x);
}

/// A body that a cart pulls at 2 m/s over a rough ground: a pin-on-disc model of squeal.
struct Pulled {
  double mu = 0.4, foot = 0.05, k = 120, c = 0.4, kv = 300, kt = 12, ct = 0.02;
  double x = -0.049, angle = -0.195;  // near where it slides on steadily
  static constexpr double m = 2, I = 0.03, g = 9.81, speed = 2, up = 0.1, down = -0.2, apart = 0.04, height = 0.3;

  static Eigen::Vector2d turned(double a, double x, double y) {
    return {std::cos(a) * x - std::sin(a) * y, std::sin(a) * x + std::cos(a) * y};
  }
  /// (x - speed t, angle, and their rates) by time: Newton and Euler with N and -mu N at the foot, whose height is 0.
  VectorXd rates(const VectorXd& s) const {
    const Eigen::Vector2d f = turned(s[1], foot, down), a = turned(s[1], 0, up);
    const double w = s[3], Fx = -k * (s[0] + a[0] - apart) - c * (s[2] - a[1] * w), Fy = -kv * (a[1] - f[1] - height);
    Eigen::Matrix4d A;
    A << m, 0, 0, mu, 0, 0, m, -1, 0, I, 0, -(f[0] + mu * f[1]), 0, f[0], 1, 0;
    const Eigen::Vector4d b(Fx, Fy - m * g, a[0] * Fy - a[1] * Fx - kt * s[1] - ct * w, f[1] * w * w);
    const Eigen::Vector4d by = A.fullPivLu().solve(b);
    return Eigen::Vector4d(s[2], w, by[0], by[1]);
  }
  /// By Newton's method.
  VectorXd steady() const {
    VectorXd s = Eigen::Vector4d(x, angle, 0, 0);
    for (int i = 0; i < 50; ++i) {
      const Eigen::MatrixXd J = jacobian(s);
      s.head(2) -= J.block(2, 0, 2, 2).fullPivLu().solve(rates(s).tail(2));
    }
    REQUIRE(rates(s).norm() < 1e-9);
    return s;
  }
  Eigen::MatrixXd jacobian(const VectorXd& s) const {
    return difference_jacobian([&](const VectorXd& x) { return rates(x); }, s, 1e-3);
  }
  std::string scene(const VectorXd& s) const {
    return fmt::format(R"toml(
[gravity]
y_m_per_s2 = -9.81
[body.cart]
mass_kg = 1
inertia_kg_m2 = 1
x_m = 0
y_m = 0.5
vx_m_per_s = 2
[body.A]
mass_kg = 2
inertia_kg_m2 = 0.03
x_m = {:.17g}
y_m = {:.17g}
angle_rad = {:.17g}
vx_m_per_s = 2
[point.O]
ground = true
x_m = 0
y_m = 0.5
[point.cc]
on = "cart"
x_m = 0
y_m = 0
[prismatic.rail]
points = ["O", "cc"]
axis_angle_rad = 0
[driver.v]
coordinate = "cart.x"
law = {{ kind = "polynomial", coefficients = [0, 2] }}
[point.foot]
on = "A"
x_m = {:.17g}
y_m = -0.2
[point.as]
on = "A"
x_m = 0
y_m = 0.1
[force.pull]
point = "as"
formula_x_N = "-k*(as.x - cart.x - 0.04) - c*(as.x_dot - cart.x_dot)"
formula_y_N = "-kv*(as.y - 0.3)"
k = {:.17g}
c = {}
kv = {:.17g}
[couple.t]
angle = "A.angle"
formula = "-kt*A.angle - ct*A.angle_dot"
kt = {:.17g}
ct = {}
[contact.c]
kind = "rigid"
point = "foot"
friction = "coulomb"
friction_coefficient = {:.17g}
closed = true
sliding = "forward"
[start]
given = ["A.x", "A.angle"]
)toml",
                       s[0], -turned(s[1], foot, down)[1], s[1], foot, k, c, kv, kt, ct, mu);
  }
};

}  // namespace

// Friction was left out: 1.1387 Hz for 1.1482, a rate of -0.022 for a flutter of +14.4 1/s, and "not steady".
TEST_CASE("sliding modes: a body that is pulled over rough ground, damped and in flutter") {
  const Pulled damped, flutter{0.993083009469446,
                               0.136090001868488,
                               6286.35114845388,
                               0.05,
                               216.889726489654,
                               71.1760602796654,
                               0.002,
                               0.031,
                               -0.053};
  for (const Pulled& p : {damped, flutter}) {
    CAPTURE(p.mu);
    const VectorXd s = p.steady();
    const Modes found = modes_of(p.scene(s));
    CHECK(found.acceleration.norm() < 1e-8);
    const Eigen::VectorXcd values = Eigen::EigenSolver<Eigen::MatrixXd>(p.jacobian(s)).eigenvalues();
    const std::vector<Complex> expected = sorted({values.data(), values.data() + 4}), own = all_of(found);
    REQUIRE(own.size() == 4);
    // Of the differences: 1e-9 of entries up to 1e5 1/s^2, over eigenvalues of 7 1/s at the least.
    for (std::size_t i = 0; i < 4; ++i) CHECK(std::abs(own[i] - expected[i]) < 1e-5);
  }
  const std::vector<Complex> squeal = all_of(modes_of(flutter.scene(flutter.steady())));
  CHECK(std::any_of(squeal.begin(), squeal.end(), [](const Complex& x) { return x.real() > 14.4; }));
}

// In space friction turns with the slip: a point that is pulled at V has, across, m y'' + mu N/V y' + k y = 0; along,
// m x'' + k x = 0, as friction does not change.
TEST_CASE("sliding modes: across its way friction damps what slides in space, by mu N / V") {
  constexpr double m = 1.5, k = 80, mu = 0.3, V = 1.2, weight = m * 9.81;
  const std::string text = fmt::format(R"toml(
[gravity]
z_m_per_s2 = -9.81
[point.P]
x_m = {:.17g}
y_m = 0
z_m = 0
vx_m_per_s = 1.2
[mass.P]
point = "P"
mass_kg = 1.5
[contact.c]
kind = "rigid"
point = "P"
friction = "coulomb"
friction_coefficient = 0.3
closed = true
sliding = "forward"
[force.pull]
point = "P"
formula_x_N = "-80*(P.x - 1.2*t)"
formula_y_N = "-80*P.y"
[start]
given = ["P.x", "P.y"]
given_velocities = ["P.x", "P.y"]
)toml",
                                       -mu * weight / k);
  const Modes found = modes_of(text);
  REQUIRE(found.modes.size() == 2);
  CHECK(found.acceleration.norm() < 1e-12);
  const double across = mu * weight / V / (2 * m);
  const std::vector<Complex> own = all_of(found), expected = sorted({{0, std::sqrt(k / m)},
                                                                     {0, -std::sqrt(k / m)},
                                                                     {-across, std::sqrt(k / m - across * across)},
                                                                     {-across, -std::sqrt(k / m - across * across)}});
  for (std::size_t i = 0; i < 4; ++i) CHECK(std::abs(own[i] - expected[i]) < 1e-10);
}
