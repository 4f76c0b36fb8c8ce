// Natural frequencies, damping and mode shapes against closed forms, and against differences of the
// accelerations.
#include "costate/analysis/modes.h"

#include <fmt/format.h>
#include <support/differences.h>
#include <support/hanging_beam.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <catch2/catch.hpp>
#include <complex>

#include "scene_texts.h"
#include "support/paths.h"

using namespace costate;
using namespace costate::test;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Complex = std::complex<double>;

namespace {

// Eigenvalues of matrices of a few rows, whose start is known to rounding.
constexpr double kRounding = 1e-11;

Modes modes_of(const Scene& scene) {
  Assembly assembly(scene.mechanism(), ParameterSelection{});
  return find_modes(assembly, 0, find_start(assembly, 0, false));
}
Modes modes_of(const std::string& text) { return modes_of(Scene::parse(text, "s.toml")); }

/// A number, to all its digits.
std::string text_of(double x) { return fmt::format("{:.17g}", x); }

/// Two masses in a row along x: ground - k1 - m1 - k2 - m2.
std::string chain(double m1, double m2, double k1, double k2, double c1, double c2) {
  std::string s = R"(
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1
y_m = 0
[point.R]
x_m = 2
y_m = 0
[driver.p]
coordinate = "P.y"
law = { kind = "polynomial", coefficients = [0] }
[driver.r]
coordinate = "R.y"
law = { kind = "polynomial", coefficients = [0] }
[start]
given = ["P.x", "R.x"]
)";
  s += "[mass.p]\npoint = \"P\"\nmass_kg = " + text_of(m1) + "\n[mass.r]\npoint = \"R\"\nmass_kg = " + text_of(m2) +
       "\n";
  const auto spring = [&](const std::string& name, const std::string& from, const std::string& to, double k, double c) {
    s += "[spring." + name + "]\nfrom = \"" + from + "\"\nto = \"" + to +
         "\"\nnatural_length_m = 1\nstiffness_N_per_m = " + text_of(k) + "\ndamping_N_s_per_m = " + text_of(c) + "\n";
  };
  spring("one", "A", "P", k1, c1);
  spring("two", "P", "R", k2, c2);
  return s;
}

}  // namespace

TEST_CASE("modes: two masses in a row", "[modes]") {
  const double m1 = 2, m2 = 3, k1 = 100, k2 = 40;
  const Modes r = modes_of(chain(m1, m2, k1, k2, 0, 0));
  // m1 m2 w^4 - (m1 k2 + m2 (k1 + k2)) w^2 + k1 k2 = 0
  const double a = m1 * m2, b = m1 * k2 + m2 * (k1 + k2), root = std::sqrt(b * b - 4 * a * k1 * k2);
  REQUIRE(r.modes.size() == 2);
  CHECK(r.degrees_of_freedom == 2);
  CHECK(r.zero_eigenvalues == 0);
  const double w2[2] = {(b - root) / (2 * a), (b + root) / (2 * a)};
  const auto at = [&](const std::string& name) {
    const auto found =
        std::find_if(r.directions.begin(), r.directions.end(), [&](const auto& d) { return d.name == name; });
    REQUIRE(found != r.directions.end());
    return found - r.directions.begin();
  };
  for (std::size_t k = 0; k < 2; ++k) {
    const Mode& mode = r.modes[k];
    CHECK(mode.frequency_Hz() == Approx(std::sqrt(w2[k]) / 6.283185307179586).epsilon(kRounding));
    CHECK(mode.damping_ratio() == Approx(0).margin(kRounding));
    // The first row of the shape: (k1 + k2 - m1 w^2) P = k2 R.
    const Complex P = mode.shape[at("P.x")], R = mode.shape[at("R.x")];
    CHECK(std::abs((k1 + k2 - m1 * w2[k]) * P - k2 * R) < 1e-9 * k1);
    const double energy = m1 * std::norm(P) + m2 * std::norm(R);
    CHECK(mode.share[at("P.x")] == Approx(m1 * std::norm(P) / energy));
    CHECK(std::abs(mode.shape[at("P.y")]) < kRounding);
  }
}

TEST_CASE("modes: damping ratios and real roots", "[modes]") {
  // Damping in proportion to the stiffness: damping ratio = c/k w/2.
  const Modes proportional = modes_of(chain(2, 3, 100, 40, 1, 0.4)), undamped = modes_of(chain(2, 3, 100, 40, 0, 0));
  REQUIRE(proportional.modes.size() == 2);
  for (std::size_t k = 0; k < 2; ++k)
    CHECK(proportional.modes[k].damping_ratio() ==
          Approx(0.01 * undamped.modes[k].eigenvalue.imag() / 2).epsilon(kRounding));
  // A mass alone with too much damping: two real roots of m s^2 + c s + k. The other mass floats: two zeros.
  const Modes creeping = modes_of(chain(2, 3, 8, 0, 30, 0));
  REQUIRE(creeping.modes.size() == 2);
  CHECK(creeping.zero_eigenvalues == 2);
  for (std::size_t k = 0; k < 2; ++k) {
    CHECK_FALSE(creeping.modes[k].oscillates());
    const double root = std::sqrt(30.0 * 30 - 4 * 2 * 8);
    CHECK(creeping.modes[k].eigenvalue.real() == Approx((-30 + (k == 0 ? root : -root)) / 4).epsilon(kRounding));
  }
}

TEST_CASE("modes: critical damping is a double root, no zero", "[modes]") {
  // (s + w)^2 with one vector for both; counted as zero eigenvalues, "rigid motion", at some numbers and not at others.
  for (const double w : {10.0, 3.0, 0.7, 1e3, 1e-4}) {
    for (const double other : {0.0, 1000.0, 1e6}) {
      INFO(w << " beside " << other);
      const Modes m = modes_of(chain(1, 1, w * w, 0, 2 * w, 0) + fmt::format(R"(
[point.B]
ground = true
x_m = 1
y_m = 0
[spring.own]
from = "B"
to = "R"
natural_length_m = 1
stiffness_N_per_m = {}
)",
                                                                             other));
      CHECK(m.zero_eigenvalues == (other > 0 ? 0 : 2));
      std::size_t found = 0;
      for (const auto& mode : m.modes)
        // A double root moves as the root of what rounding does.
        if (!mode.oscillates() && std::abs(mode.eigenvalue.real() + w) < 1e-5 * w) ++found;
      CHECK(found == 2);
    }
  }
}

TEST_CASE("modes: a pendulum, hanging and standing", "[modes]") {
  const auto at = [](const char* y) {
    return modes_of(R"(
[gravity]
y_m_per_s2 = -9.81
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0
y_m = )" + std::string(y) +
                    R"(
[bar.arm]
from = "A"
to = "P"
mass_kg = 2
[start]
equilibrium = true
)");
  };
  const double w = std::sqrt(1.5 * 9.81 / 0.7);  // of a uniform bar of 0.7 m
  const Modes hanging = at("-0.7"), standing = at("0.7");
  REQUIRE(hanging.modes.size() == 1);
  CHECK(hanging.modes[0].eigenvalue.imag() == Approx(w).epsilon(kRounding));
  REQUIRE(standing.modes.size() == 2);
  CHECK(standing.modes[0].eigenvalue.real() == Approx(-standing.modes[1].eigenvalue.real()).epsilon(kRounding));
  CHECK(std::abs(standing.modes[0].eigenvalue.real()) == Approx(w).epsilon(kRounding));
}

TEST_CASE("modes: a force state makes a third root", "[modes]") {
  const double m = 2, k = 100, km = 60, c = 9;
  const Scene scene = Scene::parse(chain(m, 1, k, 50, 0, 0) + R"(
[driver.still]
coordinate = "R.x"
law = { kind = "polynomial", coefficients = [2] }
[maxwell.M]
from = "A"
to = "P"
natural_length_m = 1
stiffness_N_per_m = 60
damping_N_s_per_m = 9
)",
                                   "s.toml", {"start.given=['P.x']"});
  const Modes modes = modes_of(scene);
  REQUIRE(modes.modes.size() == 2);
  CHECK(modes.zero_eigenvalues == 0);
  for (const Mode& mode : modes.modes) {
    const Complex s = mode.eigenvalue;
    const Complex residual = (m * s * s + (k + 50)) * (s + km / c) + km * s;
    CHECK(std::abs(residual) < 1e-10 * k * std::abs(s + km / c));
  }
}

TEST_CASE("modes: redundant rows change nothing", "[modes]") {
  const Modes r = modes_of(hanging_beam), redundant = modes_of(hanging_beam + middle_post);
  REQUIRE(r.modes.size() == 1);
  REQUIRE(redundant.modes.size() == 1);
  CHECK(redundant.lambda.size() == 3);
  CHECK(std::abs(r.modes[0].eigenvalue - redundant.modes[0].eigenvalue) < 1e-9 * std::abs(r.modes[0].eigenvalue));
  CHECK(r.modes[0].damping_ratio() > 0.01);
}

TEST_CASE("modes: a body that spins freely nutates", "[modes]") {
  const double Jx = 0.5, Jz = 0.8, spin = 12;
  const Modes r = modes_of(R"(
[rigid_body.disc]
x_m = 0.3
y_m = 0.1
z_m = -0.2
rotation_axis = [0, 0, 1]
angle_rad = 0.4
vx_m_per_s = 2
omega_z_rad_per_s = 12
mass_kg = 3
inertia_xx_kg_m2 = 0.5
inertia_yy_kg_m2 = 0.5
inertia_zz_kg_m2 = 0.8
[start]
given = ["disc"]
)");
  // Seen from space the axis nutates with Jz / Jx times the spin; all else is rigid motion.
  REQUIRE(r.degrees_of_freedom == 6);
  REQUIRE(r.modes.size() == 1);
  CHECK(r.zero_eigenvalues == 10);
  CHECK(r.modes[0].eigenvalue.imag() == Approx(Jz / Jx * spin).epsilon(kRounding));
  CHECK(r.modes[0].damping_ratio() == Approx(0).margin(kRounding));
  std::vector<std::string> moving;
  for (std::size_t i = 0; i < r.directions.size(); ++i)
    if (std::abs(r.modes[0].shape[static_cast<Eigen::Index>(i)]) > 1e-9) moving.push_back(r.directions[i].name);
  CHECK(moving == std::vector<std::string>{"disc.turn_x", "disc.turn_y"});
}

TEST_CASE("modes: a top that sleeps upright", "[modes]") {
  const double m = 2, l = 0.3, g = 9.81, Jx = 0.05 + m * l * l, Jz = 0.04, spin = 150;
  const Modes r = modes_of(R"(
[gravity]
z_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
z_m = 0
[rigid_body.top]
x_m = 0
y_m = 0
z_m = 0.3
rotation_axis = [0, 0, 1]
angle_rad = 1.1
omega_z_rad_per_s = 150
mass_kg = 2
inertia_xx_kg_m2 = 0.05
inertia_yy_kg_m2 = 0.05
inertia_zz_kg_m2 = 0.04
[point.tip]
on = "top"
x_m = 0
y_m = 0
z_m = -0.3
[spherical.foot]
points = ["O", "tip"]
[start]
given = ["top.e1", "top.e2", "top.e3"]
given_velocities = ["top.omega_x", "top.omega_y", "top.omega_z"]
)");
  // Jx s^2 -+ i Jz spin s - m g l = 0: two frequencies, the slow one of precession, the fast one of nutation.
  const double root = std::sqrt(Jz * Jz * spin * spin - 4 * Jx * m * g * l);
  REQUIRE(r.modes.size() == 2);
  CHECK(r.zero_eigenvalues == 2);
  CHECK(r.modes[0].eigenvalue.imag() == Approx((Jz * spin - root) / (2 * Jx)).epsilon(1e-9));
  CHECK(r.modes[1].eigenvalue.imag() == Approx((Jz * spin + root) / (2 * Jx)).epsilon(1e-9));
  CHECK(std::abs(r.modes[0].damping_ratio()) < 1e-9);
}

TEST_CASE("modes: the five-bar against differences of its accelerations", "[modes]") {
  const std::string file = COSTATE_MODELS_DIR "/five_bar/five_bar.toml";
  const std::vector<std::string> rest = {"start.equilibrium=true", "start.given=[]", "spring.S1.damping_N_s_per_m=5",
                                         "run.parameters=[]"};
  const Scene scene = Scene::load(file, rest);
  const Modes r = modes_of(scene);
  REQUIRE(r.modes.size() == 2);
  // The same mechanism in P1.x and P3.x, given, and accelerations by a matrix of this test's own.
  std::vector<std::string> given = {"start.given=['P1.x', 'P3.x']", "spring.S1.damping_N_s_per_m=5",
                                    "run.parameters=[]"};
  const auto& coordinates = scene.mechanism()->coordinates();
  for (std::size_t i = 0; i < coordinates.size(); ++i)
    given.push_back(scene.mechanism()->numbers()[static_cast<std::size_t>(coordinates[i].position_number)].path + "=" +
                    text_of(r.q[static_cast<Eigen::Index>(i)]));
  // The lengths stay those of the file while its points vary.
  for (const char* bar : {"A1", "B12", "B23", "B3B"}) {
    const std::string length = std::string("bar.") + bar + ".length_m";
    given.push_back(length + "=" + text_of(scene.mechanism()->numbers()[scene.mechanism()->number(length)].value));
  }
  const Scene minimal = Scene::load(file, given);
  const auto m = minimal.mechanism();
  Assembly assembly(m, m->select({"point.P1.x_m", "point.P3.x_m", "point.P1.vx_m_per_s", "point.P3.vx_m_per_s"}));
  const int i = m->coordinate("P1.x"), j = m->coordinate("P3.x"), n = assembly.n(), rows = assembly.m();
  const auto rates = [&](const VectorXd& x) {
    assembly.set_parameters(x.data());
    const Start s = find_start(assembly, 0, false);
    assembly.calc_dynamics({0, s.q.data(), s.v.data(), nullptr, nullptr, s.z.data()});
    MatrixXd A = MatrixXd::Zero(n + rows, n + rows);
    VectorXd b(n + rows);
    for (int c = 0; c < n; ++c) {
      const auto& M = assembly.square();
      for (auto k = M.column_start[static_cast<std::size_t>(c)]; k < M.column_start[static_cast<std::size_t>(c) + 1];
           ++k)
        A(M.row[static_cast<std::size_t>(k)], c) = assembly.M[static_cast<std::size_t>(k)];
      const auto& J = assembly.jacobian();
      for (auto k = J.column_start[static_cast<std::size_t>(c)]; k < J.column_start[static_cast<std::size_t>(c) + 1];
           ++k) {
        const auto row = n + J.row[static_cast<std::size_t>(k)];
        A(row, c) = A(c, row) = assembly.phi_q[static_cast<std::size_t>(k)];
      }
      b[c] = assembly.Q[static_cast<std::size_t>(c)];
    }
    for (int k = 0; k < rows; ++k) b[n + k] = -assembly.bias[static_cast<std::size_t>(k)];
    const VectorXd a = A.fullPivLu().solve(b);
    return VectorXd(Eigen::Vector4d(x[2], x[3], a[i], a[j]));
  };
  const MatrixXd A = difference_jacobian(rates, Eigen::Vector4d(r.q[i], r.q[j], 0, 0));
  std::vector<Complex> expected;
  const Eigen::VectorXcd values = Eigen::EigenSolver<MatrixXd>(A).eigenvalues();
  for (const Complex& w : values)
    if (w.imag() > 0) expected.push_back(w);
  std::sort(expected.begin(), expected.end(), [](Complex a, Complex b) { return std::abs(a) < std::abs(b); });
  REQUIRE(expected.size() == 2);
  // Differences of order h^6 with h = 1e-3.
  for (std::size_t k = 0; k < 2; ++k)
    CHECK(std::abs(r.modes[k].eigenvalue - expected[k]) < 1e-7 * std::abs(expected[k]));
  CHECK(r.modes[0].damping_ratio() > 1e-3);
}

TEST_CASE("modes: too many coordinates for full matrices", "[modes]") {
  std::string s = "[start]\nequilibrium = true\ngiven = []\n";
  for (int i = 0; i < 251; ++i)
    s += fmt::format("[point.P{0}]\nx_m = {0}\ny_m = 0\n[mass.m{0}]\npoint = \"P{0}\"\nmass_kg = 1\n", i);
  const Scene scene = Scene::parse(s, "s.toml");
  Assembly assembly(scene.mechanism(), ParameterSelection{});
  CHECK_THROWS_WITH(find_modes(assembly, 0, Start{}),
                    Catch::Matchers::Contains("up to 500 coordinates") && Catch::Matchers::Contains("502"));
}

// What is constant along a motion is not said to change: a hanging top that spins about its axis some hundred times
// faster than it swings. It was told by the square of that.
TEST_CASE("modes: a fast spin about an axis of symmetry changes no coefficient", "[modes]") {
  const auto change = [](double spin, double other_inertia) {
    const Scene scene = Scene::parse(fmt::format(R"(
[gravity]
z_m_per_s2 = -9.81
[rigid_body.top]
x_m = 0
y_m = 0
z_m = -0.6
mass_kg = 2
inertia_xx_kg_m2 = 0.2
inertia_yy_kg_m2 = {}
inertia_zz_kg_m2 = 0.02
omega_z_rad_per_s = {}
[point.O]
ground = true
x_m = 0
y_m = 0
z_m = 0
[point.foot]
on = "top"
x_m = 0
y_m = 0
z_m = 0.6
[spherical.b]
points = ["O", "foot"]
[start]
given = ["top.e1", "top.e2", "top.e3"]
given_velocities = ["top.omega_x", "top.omega_y", "top.omega_z"]
)",
                                                 other_inertia, spin),
                                     "top.toml");
    Assembly assembly(scene.mechanism(), ParameterSelection{});
    return coefficient_change(assembly, 0, find_modes(assembly, 0, find_start(assembly, 0, false)));
  };
  for (const double spin : {10.0, 100.0, 300.0, 1000.0}) {
    CAPTURE(spin);
    CHECK(change(spin, 0.2) < 1e-5);   // from where the command warns
    CHECK(change(spin, 0.21) > 1e-3);  // about an axis of no symmetry they do change
  }
}
