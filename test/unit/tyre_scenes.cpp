// Tyres as scenes name them: power and spin, moments, mistakes.
#include <fmt/format.h>

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/scene/scene.h"
#include "support/paths.h"
#include "tyre_wheel.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;
using Catch::Detail::Approx;

namespace {
const std::string scene = R"([road.plain]
kind = "flat"
[road.rig]
kind = "post"
law = { kind = "iso8608", class = "B" }
speed_m_per_s = 10
[rigid_body.carrier]
x_m = 0
y_m = 0
z_m = 0.3
mass_kg = 50
inertia_xx_kg_m2 = 1
inertia_yy_kg_m2 = 1
inertia_zz_kg_m2 = 1
[point.hub]
on = "carrier"
x_m = 0
y_m = 0
z_m = 0
[point.stone]
ground = true
x_m = 0
y_m = 0
z_m = 0
[tyre.T]
wheel = "hub"
road = "plain"
radius_m = 0.3
stiffness_N_per_m = 1e5
model = "ride"
[start]
given = ["carrier"]
)";

std::string complaint(const std::string& place, const std::string& by) {
  std::string text = scene;
  const auto at = text.find(place);
  REQUIRE(at != std::string::npos);
  text.replace(at, place.size(), by);
  try {
    Scene::parse(text, "s.toml");
  } catch (const Error& e) {
    return e.what();
  }
  return "none";
}
}  // namespace

TEST_CASE("tyre: power, spin and the gradient by numbers") {
  // What the tyre's generalized force does along any velocities is the force on the centre's velocity and the
  // moment about the centre on the wheel's whole angular velocity, the body's and the spin's.
  Wheel w;
  w.place();
  BodyOptions rotor;
  rotor.mass_kg = 1;
  rotor.inertia_kg_m2 = 1;
  add_body(w.builder, "rotor", rotor);
  RoadOptions road;
  road.kind = Road::Kind::profile;
  road.law = polynomial_law({0.02, 0.1});
  add_road(w.builder, "ground", road);
  w.tyre.spin = "rotor.angle";
  w.tyre.damping_N_s_per_m = 300;
  MagicFormulaOptions o;
  TyreOptions usual;
  read_tir_file(COSTATE_MODELS_DIR "/tyres/formula_student_61.tir", o, usual);
  o.longitudinal_relaxation_length_m = 0.3;
  TyreSlipOptions slip;
  slip.relaxation_length_m = 0.4;
  w.z = {0.03, -0.02};
  add_magic_formula_tyre(w.builder, "T", w.tyre, slip, o);
  const double spin = 14;
  w.v[7] = spin;
  w.finish();
  const Force& f = *w.mechanism->forces()[0];
  const LocalState s{w.t, w.q, w.v, nullptr, nullptr, w.z.data(), w.numbers.data()};
  const Vector u = w.axis(), C = w.center(), n = Vector(-0.1, 0, 1).normalized(), V = w.center_velocity();
  const Vector ex = u.cross(n).normalized(), eg = n.cross(ex);
  const Vector P(w.measure("contact_x"), w.measure("contact_y"), 0.02 + 0.1 * w.measure("contact_x"));
  const Vector F =
      w.measure("normal_force") * n + w.measure("lateral_force") * eg + w.measure("longitudinal_force") * ex;
  REQUIRE(w.measure("normal_force") > 1000);
  REQUIRE(std::abs(w.measure("longitudinal_force")) > 100);
  double Q[8] = {}, rates[2] = {};
  f.calc_force(s, Q, rates);
  const Vector4 e(w.euler.data());
  const Vector moment = global_rate_matrix(e.data()) * Vector4(Q + 3) / 2 - (C - w.position).cross(F);  // about C
  REQUIRE((Vector(Q) - F).norm() < 1e-12 * F.norm());
  REQUIRE(Q[7] == Approx(moment.dot(u)).epsilon(1e-12));
  const Vector of_contact = moment - (P - C).cross(F);  // moments of the model: about e_x, e_y and n
  REQUIRE((of_contact - of_contact.dot(n) * n - of_contact.dot(ex) * ex).norm() >
          1);  // rolling resistance about the axis
  double power = 0;
  for (int i = 0; i < 8; ++i) power += Q[i] * w.v[i];
  REQUIRE(power == Approx(F.dot(V) + moment.dot(w.omega + spin * u)).epsilon(1e-12));
  // Slip rates: sideways that of the disc's point at the contact, along the difference of the rolling and the
  // travelling speed.
  const Vector at_contact = V + (w.omega - w.omega.dot(u) * u).cross(P - C);
  const double turning = w.omega.dot(u) + spin, u_x = V.dot(ex), R_e = 0.55 - w.measure("deflection") / 3;
  REQUIRE(rates[0] == Approx((at_contact.dot(eg) - u_x * 0.03) / 0.4).epsilon(1e-12));
  REQUIRE(rates[1] == Approx((turning * R_e - u_x + u_x * 0.02) / 0.3).epsilon(1e-12));
  // One pass for many numbers is the weighted sum of the partials of each.
  double w_Q[8], w_f[2] = {0.7, -1.3};
  for (int i = 0; i < 8; ++i) w_Q[i] = std::sin(1.0 + i);
  std::vector<int> all(w.numbers.size());
  for (std::size_t k = 0; k < all.size(); ++k) all[k] = static_cast<int>(k);
  std::vector<double> found(all.size(), 0.5);
  f.add_number_gradient(s, w_Q, w_f, all.data(), static_cast<int>(all.size()), found.data());
  for (std::size_t k = 0; k < all.size(); ++k) {
    double Q_p[8] = {}, f_p[2] = {}, expected = 0.5, size = 1;
    f.Force::calc_number_partial(s, all[k], Q_p, f_p);
    for (int i = 0; i < 8; ++i) expected += w_Q[i] * Q_p[i], size += std::abs(w_Q[i] * Q_p[i]);
    for (int i = 0; i < 2; ++i) expected += w_f[i] * f_p[i], size += std::abs(w_f[i] * f_p[i]);
    INFO("number " << k);
    REQUIRE(std::abs(found[k] - expected) < 1e-13 * size);
  }
}

TEST_CASE("tyre: without a spin the whole moment acts on the body of the centre, the share about the axis included") {
  Wheel w;
  w.place();
  add_road(w.builder, "ground", {});
  LinearTyreOptions o;
  o.cornering_stiffness_N_per_rad = 20000;
  o.aligning_moment_N_m_per_rad = 900;
  add_linear_tyre(w.builder, "T", w.tyre, {}, o);
  w.finish();
  const Vector u = w.axis(), n(0, 0, 1);
  const Vector about_center = w.moment - (w.center() - w.position).cross(w.force);
  // Of the linear tyre's wrench only M_z has a share about the axis: n.u, the sine of the camber.
  REQUIRE(std::abs(w.measure("aligning_moment")) > 10);
  REQUIRE(std::abs(n.dot(u)) > 0.05);
  REQUIRE(about_center.dot(u) == Approx(w.measure("aligning_moment") * n.dot(u)).epsilon(1e-10));
}

TEST_CASE("tyre: mistakes are named with their place") {
  REQUIRE(complaint("[start]", "[start]") == "none");
  CHECK_THAT(complaint("road = \"plain\"", "road = \"plane\""),
             Contains("s.toml:27:8: tyre.T.road: There is no road 'plane'. Did you mean 'plain'?"));
  CHECK_THAT(complaint("wheel = \"hub\"", "wheel = \"stone\""),
             Contains("tyre.T.wheel: 'stone' is not fixed to a rigid body, as a wheel's centre must be."));
  CHECK_THAT(complaint("wheel = \"hub\"", "wheel = \"hob\""), Contains("There is no point 'hob' in space."));
  CHECK_THAT(complaint("model = \"ride\"", "model = \"rid\""),
             Contains("must be one of calspan, linear, ") && Contains("found \"rid\". Did you mean 'ride'?"));
  CHECK_THAT(complaint("model = \"ride\"", "model = \"ride\"\nroad_delay_s = 1"),
             Contains("'road_delay_s' in [tyre.T] belongs to a post, but road 'plain' is none: give road_offset_m."));
  CHECK_THAT(complaint("model = \"ride\"", "model = \"ride\"\naxis = [0, 0, 0]"),
             Contains("tyre.T.axis: The axis must not be zero."));
  CHECK_THAT(complaint("model = \"ride\"", "model = \"ride\"\nspin = \"carrier.e1\""),
             Contains("tyre.T.spin: 'carrier.e1' belongs to the wheel's own body"));
  CHECK_THAT(complaint("model = \"ride\"", "model = \"calspan\""), Contains("[tyre.T] needs 'calspan' (a table)"));
  CHECK_THAT(complaint("class = \"B\"", "class = \"J\""), Contains("must be one of A, B, C, D, E, F, G, H"));
  CHECK_THAT(complaint("class = \"B\"", "seed = 1"), Contains("needs 'class' (A to H) or 'roughness_m3'"));
  CHECK_THAT(complaint("class = \"B\"", "class = \"B\", n_max_1_per_m = 0.01"),
             Contains("'n_max_1_per_m' must be greater than 'n_min_1_per_m', found 0.01 and 0.011."));
  CHECK_THAT(complaint("{ kind = \"iso8608\", class = \"B\" }", "{ kind = \"profile_table\", file = \"none.txt\" }"),
             Contains("none.txt: This road profile, whose path is relative to the scene, cannot be read"));
  CHECK_THAT(complaint("kind = \"post\"", "kind = \"profile\""), Contains("Unknown key 'speed_m_per_s' in [road.rig]"));
  CHECK_THAT(
      complaint("{ kind = \"iso8608\", class = \"B\" }",
                "{ kind = \"bump\", height_m = 0.1, length_m = 2, count = 3, spacing_m = 1 }"),
      Contains("'spacing_m' counts from one start to the next and must not be less than length_m = 2, found 1."));
}

TEST_CASE("tyre: a road whose sines leave the long waves of its band out says so") {
  // sqrt(0.01 G0 (1/0.001 - 1/100)) is 7.2 times what 400 even sines have, the longest of them one of 8 m.
  const auto said = [](const std::string& law) {
    take_notices();
    Scene::parse("[road.r]\nkind = \"profile\"\nlaw = " + law +
                     "\n[point.P]\nx_m = 0\ny_m = 0\n[mass.m]\npoint = "
                     "\"P\"\nmass_kg = 1\n[start]\ngiven = [\"P.x\", \"P.y\"]\n[run]\nt_end_s = 1\n",
                 "road.toml")
        .mechanism();
    std::string all;
    for (const std::string& n : take_notices()) all += n;
    return all;
  };
  CHECK(said("{ kind = \"iso8608\", class = \"B\" }").empty());
  CHECK(said("{ kind = \"noise\", roughness_m3 = 1e-6, exponent = 0, n_min_1_per_m = 1, n_max_1_per_m = 2, count = 5 }")
            .empty());
  const std::string wide = said("{ kind = \"iso8608\", class = \"B\", n_min_1_per_m = 0.001, n_max_1_per_m = 100 }");
  CHECK_THAT(wide, Contains("road.r") && Contains("0.0195 of the variance"));
}
