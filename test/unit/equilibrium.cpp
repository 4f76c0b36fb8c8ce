// Static equilibrium against closed forms and balances written out here, its derivative against differences,
// and what it says when there is none.
#include "costate/analysis/equilibrium.h"

#include <fmt/format.h>
#include <support/differences.h>
#include <support/hanging_beam.h>

#include <Eigen/Geometry>
#include <catch2/catch.hpp>

#include "costate/analysis/start.h"
#include "costate/objective/output.h"
#include "equilibrium_scenes.h"
#include "scene_texts.h"

using namespace costate;
using namespace costate::test;
using Catch::Matchers::Contains;
using Eigen::MatrixXd;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

// Newton's method ends at rounding: eps times the condition of the stiffness, below 1e3 in these scenes.
constexpr double kRounding = 1e-12;

struct Case {
  Case(const std::string& text, const std::vector<std::string>& parameters)
      : scene(Scene::parse(text, "s.toml")), assembly(scene.mechanism(), scene.mechanism()->select(parameters)) {}
  Scene scene;
  Assembly assembly;

  Equilibrium solve(bool derivatives = false) {
    return find_equilibrium(assembly, scene.run.t_start_s, held_by_start(assembly), derivatives);
  }
  double of(const Equilibrium& e, const std::string& coordinate) const {
    return e.q[scene.mechanism()->coordinate(coordinate)];
  }
  double rate_of(const Equilibrium& e, const std::string& coordinate, int parameter) const {
    return e.q_rho(scene.mechanism()->coordinate(coordinate), parameter);
  }
  double output(const Equilibrium& e, const std::string& name) {
    const VectorXd rest = VectorXd::Zero(assembly.n());
    const StateView s{0, e.q.data(), rest.data(), rest.data(), e.lambda.data(), e.z.data()};
    return make_output(*scene.mechanism(), name)->value(s, assembly);
  }
  std::string complaint() {
    try {
      find_start(assembly, 0, true);
    } catch (const ModelError& e) {
      return scene.located(e).what();
    }
    return "no error";
  }
};

/// All of q, z, lambda and the forces on held positions by differences; h is the step relative to the
/// parameter.
void check_derivatives(const std::string& text, const std::vector<std::string>& parameters, double tolerance) {
  Case c(text, parameters);
  const Equilibrium e = c.solve(true);
  const VectorXd rho = Eigen::Map<const VectorXd>(c.assembly.rho().data(), c.assembly.np());
  MatrixXd exact(e.q_rho.rows() + e.z_rho.rows() + e.lambda_rho.rows() + e.held_rho.rows(), rho.size());
  exact << e.q_rho, e.z_rho, e.lambda_rho, e.held_rho;
  for (int j = 0; j < rho.size(); ++j) {
    CAPTURE(parameters[static_cast<std::size_t>(j)]);
    const VectorXd by_differences = directional_difference(
        [&](double s) {
          VectorXd x = rho;
          x[j] += s;
          c.assembly.set_parameters(x.data());
          const Equilibrium moved = c.solve();
          VectorXd all(exact.rows());
          all << moved.q, moved.z, moved.lambda, moved.held;
          return all;
        },
        1e-2 * std::max(0.1, std::abs(rho[j])));
    c.assembly.set_parameters(rho.data());
    const double scale = by_differences.cwiseAbs().maxCoeff();
    CHECK((exact.col(j) - by_differences).cwiseAbs().maxCoeff() <= tolerance * scale);
  }
}

}  // namespace

TEST_CASE("equilibrium: a mass on a spring hangs below it", "[equilibrium]") {
  Case c(hanging_mass, {"spring.S.stiffness_N_per_m", "mass.bob.mass_kg", "spring.S.natural_length_m"});
  const Equilibrium e = c.solve(true);
  const double k = 120, m = 1.5, g = 9.81, L = 0.9;
  CHECK(c.of(e, "P.x") == Approx(0).margin(kRounding));
  CHECK(c.of(e, "P.y") == Approx(-(L + m * g / k)).epsilon(kRounding));
  CHECK(c.rate_of(e, "P.y", 0) == Approx(m * g / (k * k)).epsilon(kRounding));
  CHECK(c.rate_of(e, "P.y", 1) == Approx(-g / k).epsilon(kRounding));
  CHECK(c.rate_of(e, "P.y", 2) == Approx(-1).epsilon(kRounding));
  CHECK(e.q_rho.row(0).cwiseAbs().maxCoeff() < kRounding);
  CHECK(e.degrees_of_freedom == 2);
  // The softer direction swings like a pendulum: g over its length, and the spring's is k / m.
  CHECK(e.lowest_stiffness == Approx(g / (L + m * g / k)).epsilon(1e-10));
  CHECK(e.residual < 1e-12 * m * g);
  // It starts at rest without given velocities.
  const Start start = find_start(c.assembly, 0, true);
  CHECK(start.q == e.q);
  CHECK(start.v.isZero(0));
  CHECK(start.v_rho.isZero(0));
  CHECK(start.q_rho == e.q_rho);
}

TEST_CASE("equilibrium: a pendulum against a torsion spring", "[equilibrium]") {
  Case c(sprung_arm, {"torsion_spring.hinge.stiffness_N_m_per_rad", "torsion_spring.hinge.natural_angle_rad",
                      "bar.arm.mass_kg", "bar.arm.length_m"});
  const Equilibrium e = c.solve(true);
  const double k = 20, phi0 = 0.5, m = 2, g = 9.81, L = 1;
  const double phi = c.of(e, "crank.angle");
  // k (phi - phi0) + m g L/2 cos phi = 0, and what follows for its derivatives.
  CHECK(k * (phi - phi0) + m * g * L / 2 * std::cos(phi) == Approx(0).margin(k * kRounding));
  const double stiffness = k - m * g * L / 2 * std::sin(phi);
  CHECK(c.rate_of(e, "crank.angle", 0) == Approx(-(phi - phi0) / stiffness).epsilon(1e-11));
  CHECK(c.rate_of(e, "crank.angle", 1) == Approx(k / stiffness).epsilon(1e-11));
  CHECK(c.rate_of(e, "crank.angle", 2) == Approx(-g * L / 2 * std::cos(phi) / stiffness).epsilon(1e-11));
  CHECK(c.rate_of(e, "crank.angle", 3) == Approx(-m * g / 2 * std::cos(phi) / stiffness).epsilon(1e-11));
  CHECK(c.rate_of(e, "P.x", 3) ==
        Approx(std::cos(phi) - std::sin(phi) * c.rate_of(e, "crank.angle", 3)).epsilon(1e-11));
  CHECK(e.lowest_stiffness == Approx(stiffness / (m * L * L / 3)).epsilon(1e-10));
}

TEST_CASE("equilibrium: a plate on four springs balances forces and moments", "[equilibrium]") {
  Case c(hanging_plate, {"spring.S0.stiffness_N_per_m"});
  const Equilibrium e = c.solve();
  const auto point = [&](const std::string& name) {
    return Vector3d(c.output(e, name + ".x"), c.output(e, name + ".y"), c.output(e, name + ".z"));
  };
  const double k[4] = {300, 400, 350, 500}, L[4] = {0.7, 0.7, 0.7, 0.75};
  const Vector3d anchors[4] = {{0.5, 0.3, 0}, {0.5, -0.3, 0}, {-0.5, 0.3, 0}, {-0.5, -0.3, 0.1}};
  const Vector3d corners[4] = {{0.5, 0.3, 0}, {0.5, -0.3, 0}, {-0.5, 0.3, 0}, {-0.5, -0.3, 0}};
  const Vector3d r(c.of(e, "plate.x"), c.of(e, "plate.y"), c.of(e, "plate.z"));
  const Eigen::Quaterniond turn(c.of(e, "plate.e0"), c.of(e, "plate.e1"), c.of(e, "plate.e2"), c.of(e, "plate.e3"));
  CHECK(turn.norm() == Approx(1).epsilon(kRounding));
  const Vector3d weight(0, 0, -12 * 9.81), centre = turn * Vector3d(0.06, 0.03, -0.1);
  Vector3d force = weight, moment = centre.cross(weight);
  for (int i = 0; i < 4; ++i) {
    const Vector3d arm = turn * corners[i], line = anchors[i] - r - arm;
    CHECK((point("B" + std::to_string(i)) - r - arm).norm() < kRounding);
    const Vector3d f = k[i] * (line.norm() - L[i]) * line.normalized();
    force += f;
    moment += arm.cross(f);
  }
  CHECK(force.norm() < 1e-11 * weight.norm());
  CHECK(moment.norm() < 1e-11 * weight.norm());
  CHECK(e.lowest_stiffness > 0);
  // The Maxwell element has crept until it carries nothing.
  CHECK(c.output(e, "M.force") == Approx(0).margin(1e-11));
  CHECK(e.z[0] != 0);
}

TEST_CASE("equilibrium: derivatives of everything equal differences", "[equilibrium]") {
  // Differences of order h^6 at h = 1e-2: 1e-9 with factors of smooth functions, and 10 eps/h of rounding.
  check_derivatives(hanging_mass, {"spring.S.stiffness_N_per_m", "mass.bob.mass_kg", "gravity.y_m_per_s2"}, 1e-8);
  check_derivatives(sprung_arm, {"torsion_spring.hinge.stiffness_N_m_per_rad", "bar.arm.mass_kg", "bar.arm.length_m"},
                    1e-8);
  check_derivatives(hanging_plate,
                    {"spring.S0.stiffness_N_per_m", "rigid_body.plate.mass_kg", "point.B1.x_m",
                     "rigid_body.plate.center_x_m", "maxwell.M.natural_length_m"},
                    1e-8);
  // Where rows are redundant the multipliers of least norm turn with the rows.
  check_derivatives(hanging_beam + middle_post,
                    {"spring.S.stiffness_N_per_m", "body.beam.mass_kg", "body.beam.center_x_m"}, 1e-8);
}

TEST_CASE("equilibrium: held positions carry what they must", "[equilibrium]") {
  const std::string text = replaced(hanging_mass, "equilibrium = true", "equilibrium = true\ngiven = [\"P.x\"]");
  Case c(text, {"point.P.x_m", "spring.S.stiffness_N_per_m"});
  const Equilibrium e = c.solve(true);
  const double x = 0.3, y = c.of(e, "P.y"), length = std::hypot(x, y);
  CHECK(c.of(e, "P.x") == 0.3);
  CHECK(120 * (length - 0.9) * -y / length == Approx(1.5 * 9.81).epsilon(kRounding));
  // Force on the mass by the spring in x is balanced by -held (reactions stand on the left).
  CHECK(e.held[0] == Approx(-120 * (length - 0.9) * x / length).epsilon(kRounding));
  check_derivatives(text, {"point.P.x_m", "spring.S.stiffness_N_per_m"}, 1e-8);
  // With all positions given there is nothing to balance, and the start is the plain one.
  Case all(replaced(hanging_mass, "equilibrium = true", "equilibrium = true\ngiven = [\"P.x\", \"P.y\"]"), {});
  CHECK(all.solve().q == VectorXd(Eigen::Vector2d(0.3, 0.4)));
}

TEST_CASE("equilibrium: redundant rows, and multipliers of least norm", "[equilibrium]") {
  Case c(hanging_beam + middle_post, {}), less(hanging_beam, {});
  const Equilibrium e = c.solve(), without = less.solve();
  CHECK((e.q - without.q).cwiseAbs().maxCoeff() < 1e-12);
  CHECK(e.degrees_of_freedom == 1);
  CHECK(e.lambda.size() == 3);
  // Three parallel rods, the middle one last: shifting the load from the outer two to the middle one by -1,
  // -1, 2 changes no resultant, so that the least multipliers have no part in it. Their sum is that of the
  // two.
  CHECK(e.lambda[0] + e.lambda[1] - 2 * e.lambda[2] == Approx(0).margin(1e-11 * e.lambda.norm()));
  CHECK(e.lambda.sum() == Approx(without.lambda.sum()).epsilon(1e-11));
}

TEST_CASE("equilibrium: a force state stays where the scene holds it", "[equilibrium]") {
  Case free(hanging_plate, {});
  CHECK_THROWS_WITH(free.scene.mechanism()->select({"maxwell.M.initial_stroke_m"}),
                    Contains("cannot vary") && Contains("finds this force state by equilibrium"));
  const std::string held =
      replaced(hanging_plate, "damping_N_s_per_m = 40", "damping_N_s_per_m = 40\ninitial_stroke_m = 0.02");
  Case c(held, {"maxwell.M.initial_stroke_m"});
  const Equilibrium e = c.solve();
  CHECK(e.z[0] == 0.02);
  CHECK(std::abs(c.output(e, "M.force")) > 1);
  check_derivatives(held, {"maxwell.M.initial_stroke_m", "spring.S2.natural_length_m"}, 1e-8);
}

TEST_CASE("equilibrium: velocities are given as before", "[equilibrium]") {
  const std::string moving =
      replaced(replaced(hanging_mass, "y_m = 0.4", "y_m = 0.4\nvx_m_per_s = 2"), "equilibrium = true",
               "equilibrium = true\ngiven_velocities = [\"P.x\", \"P.y\"]");
  Case c(moving, {"point.P.vx_m_per_s", "mass.bob.mass_kg"});
  const Start start = find_start(c.assembly, 0, true);
  CHECK(start.v[0] == 2);
  CHECK(start.v[1] == 0);
  CHECK(start.v_rho(0, 0) == 1);
  CHECK(start.q_rho(1, 1) == Approx(-9.81 / 120));
  // At rest, but not if a parameter says otherwise.
  Case half(replaced(hanging_mass, "equilibrium = true", "equilibrium = true\ngiven_velocities = [\"P.x\"]"),
            {"point.P.vx_m_per_s"});
  CHECK(find_start(half.assembly, 0, false).v.isZero(0));
  CHECK_THAT(half.complaint(), Contains("'point.P.vx_m_per_s' sets the mechanism in motion"));
  // A driver moves it: the rest must be said.
  Case driven(hanging_mass +
                  "[driver.shake]\ncoordinate = \"P.x\"\n"
                  "law = { kind = \"sine\", amplitude = 0.1, angular_frequency_rad_per_s = 3 }\n",
              {});
  CHECK_THAT(driven.complaint(), Contains("Too few given velocities") && Contains("starts at rest by itself"));
}

TEST_CASE("equilibrium: the stable one, unless the guess is exactly one that is not", "[equilibrium]") {
  // An arm that stands: exactly upright it stays, a little aside it falls to the other side of its spring.
  const std::string soft = replaced(replaced(sprung_arm, "stiffness_N_m_per_rad = 20", "stiffness_N_m_per_rad = 2"),
                                    "natural_angle_rad = 0.5", "natural_angle_rad = 1.5707963267948966");
  const auto from = [&](double angle) {
    std::string text = replaced(soft, "x_m = 0.6", fmt::format("x_m = {:.17g}", std::cos(angle)));
    text = replaced(text, "y_m = 0.8", fmt::format("y_m = {:.17g}", std::sin(angle)));
    Case c(text, {});
    const Equilibrium e = c.solve();
    return std::pair(c.of(e, "crank.angle"), e.lowest_stiffness);
  };
  const double upright = 1.5707963267948966;
  CHECK(from(upright).first == Approx(upright).epsilon(1e-12));
  CHECK(from(upright).second < 0);
  const auto [angle, stiffness] = from(upright - 0.01);
  CHECK(stiffness > 0);
  CHECK(angle < 0);
  CHECK(from(upright + 0.01).first == Approx(2 * upright - angle).epsilon(1e-10));
}

TEST_CASE("equilibrium: what nothing holds is named", "[equilibrium]") {
  {
    // The arm turns freely when there is neither spring nor weight.
    Case c(replaced(replaced(sprung_arm, "y_m_per_s2 = -9.81", "y_m_per_s2 = 0"), "stiffness_N_m_per_rad = 20",
                    "stiffness_N_m_per_rad = 0"),
           {});
    CHECK_THAT(c.complaint(), Contains("s.toml:") && Contains("nothing holds crank.angle") && Contains("[start]"));
  }
  {
    // A mass beside the springs falls, another one floats sideways.
    Case c(replaced(hanging_mass, "[start]",
                    "[point.Q]\nx_m = 1\ny_m = 1\n[mass.stone]\npoint = \"Q\"\nmass_kg = 1\n[start]"),
           {});
    CHECK_THAT(c.complaint(), Contains("nothing holds") && Contains("Q.x") && Contains("Q.y"));
  }
  {
    Case c(replaced(sprung_arm, "equilibrium = true", "equilibrium = true\ngiven = [\"P.x\", \"P.y\"]"), {});
    CHECK_THAT(c.complaint(), Contains("Too many given positions") && Contains("at most 1"));
  }
  {
    Case c(replaced(sprung_arm, "equilibrium = true", "equilibrium = true\ngiven = [\"P.x\"]") +
               "\n[distance.far]\nfrom = \"A\"\nto = \"P\"\nlength_m = 3\n",
           {});
    CHECK_THAT(c.complaint(), Contains("cannot be reached") && Contains("distance.far.length"));
  }
}

TEST_CASE("equilibrium: the scene's text comes back, and its mistakes have places", "[equilibrium]") {
  const Scene scene = Scene::parse(hanging_plate, "s.toml");
  CHECK(scene.mechanism()->starts_at_equilibrium());
  const Scene again = Scene::parse(scene.dump(), "s.toml");
  CHECK(again.dump() == scene.dump());
  CHECK(again.mechanism()->starts_at_equilibrium());
  CHECK(complaint(replaced(hanging_mass, "equilibrium = true", "equilibrium = 1")) ==
        "s.toml:26:15: 'equilibrium' in [start] must be true or false, found the number 1.");
  CHECK_THAT(complaint(replaced(hanging_mass, "equilibrium = true", "equilibrum = true\ngiven = []")),
             Contains("s.toml:26:1") && Contains("Did you mean 'equilibrium'?"));
  CHECK_THAT(complaint(replaced(hanging_mass, "equilibrium = true", "equilibrium = false")),
             Contains("[start] needs 'given'"));
}
