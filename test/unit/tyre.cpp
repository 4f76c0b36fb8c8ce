// Tyres on roads: contact, models and lift-off against formulas written out here on their own, and what is
// said of mistakes. Derivatives are checked with those of all other elements.
#include "costate/kind/tyre/tyre.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <catch2/catch.hpp>

#include "costate/base/error.h"
#include "costate/scene/scene.h"
#include "support/paths.h"
#include "tyre_wheel.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;
using Catch::Detail::Approx;

TEST_CASE("tyre: a tilted disc on an inclined plane") {
  // The plane z = 0.05 + 0.2 x. Everything by projections: the direction from the contact to the centre is
  // the normal without its part along the axis. Rounding errors of a few products: 1e-13 relative.
  const double slope = 0.2;
  const Vector n = Vector(-slope, 0, 1).normalized(), on_plane(0, 0, 0.05);
  Wheel w;
  w.position[2] = 0.62;
  w.place();
  RoadOptions road;
  road.kind = Road::Kind::profile;
  road.law = polynomial_law({0.05, slope});
  add_road(w.builder, "ground", road);
  w.tyre.damping_N_s_per_m = 700;
  TyreSlipOptions slip;
  slip.slip_speed_m_per_s = 0;
  add_calspan_tyre(w.builder, "T", w.tyre, slip, kIltis);
  w.finish();

  const Vector u = w.axis(), C = w.center(), V = w.center_velocity();
  const Vector up = (n - n.dot(u) * u).normalized();
  const double loaded = (C - on_plane).dot(n) / up.dot(n);
  const Vector P = C - loaded * up;
  REQUIRE(std::abs((P - on_plane).dot(n)) < 1e-15);
  const Vector sideways = (u - u.dot(n) * n).normalized(), forward = sideways.cross(n);
  const double deflection = 0.55 - loaded, gamma = std::asin(n.dot(u));
  // The disc's point at the contact, of a disc that does not spin.
  const Vector Vc = V + (w.omega - w.omega.dot(u) * u).cross(P - C);
  const double alpha = std::atan2(Vc.dot(sideways), V.dot(forward));
  REQUIRE(deflection > 0.01);
  REQUIRE(std::abs(gamma) > 0.05);
  REQUIRE(std::abs(alpha) > 0.02);
  const double F = 46000 * deflection - 700 * Vc.dot(n) / up.dot(n), Fy = calspan_lateral(F, alpha, gamma);
  const double Mz = (kIltis.AF1 * F + kIltis.AF2 * std::abs(Fy)) * Fy;
  REQUIRE(w.measure("deflection") == Approx(deflection).epsilon(1e-12));
  REQUIRE(w.measure("camber") == Approx(gamma).epsilon(1e-12));
  REQUIRE(w.measure("slip_angle") == Approx(alpha).epsilon(1e-12));
  REQUIRE(w.measure("contact_x") == Approx(P[0]).epsilon(1e-13));
  REQUIRE(w.measure("contact_y") == Approx(P[1]).epsilon(1e-13));
  REQUIRE(w.measure("normal_force") == Approx(F).epsilon(1e-12));
  REQUIRE(w.measure("lateral_force") == Approx(Fy).epsilon(1e-12));
  REQUIRE(w.measure("longitudinal_force") == 0);
  REQUIRE(w.measure("aligning_moment") == Approx(Mz).epsilon(1e-12));
  // The balance of the whole: what the body feels is the contact's force at the contact point and the moment.
  const Vector force = F * n + Fy * sideways, moment = (P - w.position).cross(force) + Mz * n;
  REQUIRE((w.force - force).norm() < 1e-12 * force.norm());
  REQUIRE((w.moment - moment).norm() < 1e-12 * moment.norm());
}

// Both took the velocity of the wheel's centre: a wheel alone that leaned at 10 rad/s gained 15 of 55 J.
TEST_CASE("tyre: damper and side damper of a disc take work from every wheel, the damper by the deflection's rate") {
  constexpr double c = 700, D = 300, h = 1e-6;
  int leaning = 0;
  for (const auto kind : {Road::Kind::flat, Road::Kind::profile, Road::Kind::post})
    for (int i = 0; i < 20; ++i) {
      const auto some = [i](int k) { return std::sin(1.7 * i + 2.9 * k + 1.1 * i * k); };
      Wheel w;
      w.euler = euler_parameters({some(1), some(2), some(3)}, 0.7 * some(4));
      w.velocity = {5 * some(5), some(6), some(7)};
      w.omega = {9 * some(8), 8 * some(9), 7 * some(10)};
      w.tyre.axis = {0.1, 1, 0.05};
      w.tyre.stiffness_N_per_m = 0;
      w.tyre.damping_N_s_per_m = c;
      w.tyre.bilateral = true;
      w.place();
      RoadOptions road;
      road.kind = kind;
      if (kind == Road::Kind::profile) road.law = polynomial_law({0.05, 0.2});
      if (kind == Road::Kind::post) road.law = sine_law(0.02, 0.03, 5, 0.4);
      add_road(w.builder, "ground", road);
      LinearTyreOptions o;
      o.lateral_damping_N_s_per_m = D;
      add_linear_tyre(w.builder, "T", w.tyre, {}, o);
      w.finish();
      CAPTURE(static_cast<int>(kind), i);
      const double slope = kind == Road::Kind::profile ? 0.2 : 0;
      const Vector n = Vector(-slope, 0, 1).normalized(), u = w.axis(), C = w.center();
      const Vector P(w.measure("contact_x"), w.measure("contact_y"),
                     kind == Road::Kind::flat      ? 0
                     : kind == Road::Kind::profile ? 0.05 + 0.2 * w.measure("contact_x")
                                                   : 0.02 + 0.03 * std::sin(5 * w.t + 0.4));
      const double post = kind == Road::Kind::post ? 0.15 * std::cos(5 * w.t + 0.4) : 0;
      const Vector Vc = w.center_velocity() + (w.omega - w.omega.dot(u) * u).cross(P - C);
      const double normal = w.measure("normal_force"), side = w.measure("lateral_force");
      const Vector sideways = (u - u.dot(n) * n).normalized();
      // Products of speeds up to 10 m/s: 1e-12 of some 1e5 W.
      CHECK(side == Approx(-D * Vc.dot(sideways)).margin(1e-10));
      double power = 0;
      for (int k = 0; k < 7; ++k) {
        double Q[8] = {};
        w.mechanism->forces()[0]->calc_force({w.t, w.q, w.v, nullptr, nullptr, nullptr, w.numbers.data()}, Q, nullptr);
        power += Q[k] * w.v[k];
      }
      // What goes into the tyre: of a post that moves with the speed `post`, relative to it.
      const double taken = -(power - normal * post);
      CHECK(taken >= 0);
      CHECK(taken ==
            Approx(normal * normal / c * n.dot((u.cross(n).normalized()).cross(u)) + side * side / D).margin(1e-7));
      const auto deflection = [&](double s) {
        Wheel& moved = w;
        for (int k = 0; k < 7; ++k) moved.dual_q[k] = PathDual(w.q[k] + s * w.v[k]);
        moved.t = 0.3 + s;
        const double d = moved.measure("deflection");
        moved.t = 0.3;
        return d;
      };
      // Of second order in h times third derivatives up to 1e3 times the length; rounding 1e-16 / h.
      CHECK(normal / c == Approx((deflection(h) - deflection(-h)) / (2 * h)).margin(1e-7));
      if (std::abs(Vc.dot(n) - w.center_velocity().dot(n)) > 0.1) ++leaning;
    }
  CHECK(leaning > 30);  // of 60: the test is of what the centre alone does not know
}

TEST_CASE("tyre: the contact of the public Iltis model on its bump") {
  // The foot of the perpendicular from the centre to the tangent of the profile below it; the point where the
  // forces act lies in the wheel's plane at the height of that foot.
  for (const double x : {-0.5, 0.4, 1.3, 2.5}) {
    Wheel w;
    w.position = {x, -0.2, 0.5};
    w.euler = euler_parameters({1, -0.3, 0.2}, 0.1);
    w.place();
    BumpOptions bump;
    bump.height_m = 0.1;
    bump.start_m = 0.3;
    bump.length_m = 5;
    RoadOptions road;
    road.kind = Road::Kind::profile;
    road.law = bump_law(bump);
    add_road(w.builder, "ground", road);
    w.tyre.contact = TyreContact::source;
    w.tyre.road_factor = -1;
    add_ride_tyre(w.builder, "T", w.tyre);
    w.finish();
    const Vector C = w.center(), u = w.axis();
    const double y = C[0] - 0.3;
    const double zp = y > 0 ? -0.1 * (1 - std::cos(2 * kPi * y / 5)) : 0,
                 s = y > 0 ? -0.1 * 2 * kPi / 5 * std::sin(2 * kPi * y / 5) : 0;
    const double d = C[2] - zp, F = 46000 * std::max(0.0, 0.55 - d) / std::sqrt(1 + s * s);
    const Vector n = Vector(-s, 0, 1).normalized(),
                 foot(C[0] + s * d / (1 + s * s), C[1], zp + s * s * d / (1 + s * s));
    REQUIRE((C - foot).cross(n).norm() < 1e-15);
    const Vector up = (n - n.dot(u) * u).normalized(), P = C - (C[2] - foot[2]) / up[2] * up;
    INFO("x = " << x << ", F = " << F);
    REQUIRE(F > 0);
    REQUIRE((w.force - F * n).norm() < 1e-12 * F);
    REQUIRE((w.moment - (P - w.position).cross(F * n)).norm() < 1e-12 * F);
    REQUIRE(w.measure("normal_force") == Approx(F).epsilon(1e-12));
  }
}

TEST_CASE("tyre: a vertical contact pushes through the centre") {
  Wheel w;
  w.place();
  RoadOptions road;
  road.kind = Road::Kind::post;
  road.law = sine_law(0.02, 0.03, 5, 0.4);
  road.speed_m_per_s = 2;
  road.ramp = 0.8;
  add_road(w.builder, "ground", road);
  w.tyre.contact = TyreContact::vertical;
  w.tyre.damping_N_s_per_m = 300;
  w.tyre.road_shift = 0.1;
  w.tyre.road_factor = 0.9;
  add_ride_tyre(w.builder, "T", w.tyre);
  w.finish();
  const double at = w.t - 0.1, s = at / 0.8, step = s * s * s * (10 - 15 * s + 6 * s * s),
               step_rate = 30 * s * s * (1 - s) * (1 - s) / 0.8, wave = 0.02 + 0.03 * std::sin(5 * 2 * at + 0.4);
  const double height = 0.9 * step * wave, rate = 0.9 * (step_rate * wave + step * 0.3 * std::cos(10 * at + 0.4));
  const double F = 46000 * (0.55 - (w.center()[2] - height)) + 300 * (rate - w.center_velocity()[2]);
  REQUIRE(F > 0);
  REQUIRE((w.force - Vector(0, 0, F)).norm() < 1e-12 * F);
  REQUIRE((w.moment - (w.center() - w.position).cross(Vector(0, 0, F))).norm() < 1e-12 * F);
}

// With the axis (-cos g sin p, cos g cos p, sin g) and a slope s, e_z,z is cos g (cos g - s sin p sin g) but for a
// positive factor: it falls through zero at cot g = s sin p, for s = 0.3 and a yaw p of 45 degrees at g = 78.0 degrees,
// where the camber (n.e_y = sin 78.2 degrees) has not come to 90 degrees yet.
TEST_CASE("tyre: the contact of the public Iltis model ends where its point runs off, on a slope before 90 degrees") {
  const auto evaluate = [](TyreContact contact, double degrees) {
    Wheel w;
    const double g = degrees * kPi / 180, p = kPi / 4;
    w.position = {0, 0, 0.4};
    w.hub = {0, 0, 0};
    w.euler = {1, 0, 0, 0};
    w.tyre.axis = {-std::cos(g) * std::sin(p), std::cos(g) * std::cos(p), std::sin(g)};
    w.place();
    RoadOptions road;
    road.kind = Road::Kind::profile;
    road.law = polynomial_law({0, 0.3});
    add_road(w.builder, "ground", road);
    w.tyre.contact = contact;
    add_ride_tyre(w.builder, "T", w.tyre);
    w.finish();
    return w.force.norm();
  };
  CHECK(evaluate(TyreContact::source, 77) > 0);
  for (const double degrees : {77.99, 80.0}) {
    CAPTURE(degrees);
    CHECK_THROWS_AS(evaluate(TyreContact::source, degrees), StepError);
    CHECK_THROWS_WITH(evaluate(TyreContact::source, degrees),
                      Contains("The contact point of tyre 'T' runs off at t = 0.3 s: on a slope of 0.3") &&
                          Contains("degrees") && Contains("contact = \"disc\" goes on"));
    CHECK_NOTHROW(evaluate(TyreContact::disc, degrees));
    CHECK(evaluate(TyreContact::vertical, degrees) > 0);  // at the centre, wherever the contact point is
  }
}

TEST_CASE("tyre: the Calspan model in its branches") {
  // Loads below and beyond A2, slips from small to saturated, both signs, through the model itself.
  CalspanTyre model;
  const std::vector<double> p = {0,         kIltis.A0, kIltis.A1, kIltis.A2, kIltis.A3,  kIltis.A4, kIltis.A_omega,
                                 kIltis.B1, kIltis.B3, kIltis.B4, kIltis.SN, kIltis.AF1, kIltis.AF2};
  const auto lateral = [&](double F, double alpha, double gamma) {
    TyreOutput<double> out;
    model(TyreInput<double>{{F, 10, 10 * std::tan(alpha), gamma, 0}}, static_cast<const double*>(nullptr), p.data(),
          out, static_cast<double*>(nullptr));
    return out.lateral();
  };
  for (const double F : {1.0, 500.0, 3831.31, 9000.0, 12929.9, 12930.1, 20890.9})
    for (const double alpha : {-0.5, -0.2, -0.03, 1e-4, 0.02, 0.1, 0.3})
      for (const double gamma : {-0.1, 0.0, 0.05})
        REQUIRE(lateral(F, alpha, gamma) == Approx(calspan_lateral(F, alpha, gamma)).epsilon(1e-12));
  REQUIRE(lateral(0, 0.1, 0.1) == 0);
  REQUIRE(lateral(1e-9, 0.1, 0.1) == Approx(0).margin(1e-8));
  // Continuous where the branches of the load meet: within the change over 0.02 N.
  REQUIRE(lateral(12930.01, 0.05, 0.03) == Approx(lateral(12929.99, 0.05, 0.03)).margin(0.02));
  // At the static loads the slopes are the numbers of the benchmark's linear tyre: 41641 and 40162 N/rad, and
  // 6925 and 6600 N/rad of camber (printed to a unit; the load that they belong to is known to about 0.5 N,
  // which is 5 N/rad).
  const double h = 1e-7;
  REQUIRE(-lateral(3831.31, h, 0) / h == Approx(41641).margin(5));
  REQUIRE(-lateral(3591.91, h, 0) / h == Approx(40162).margin(5));
  REQUIRE(-lateral(3831.31, 0, h) / h == Approx(6925).margin(2));
  REQUIRE(-lateral(3591.91, 0, h) / h == Approx(6600).margin(2));
}

TEST_CASE("tyre: never pulls, and lifts off without a jump") {
  const auto normal = [](double height, double falling, bool bilateral) {
    Wheel w;
    w.position = {0, 0, height};
    w.hub = {0, 0, 0};
    w.tyre.axis = {0, 1, 0};
    w.euler = {1, 0, 0, 0};
    w.velocity = {0, 0, -falling};
    w.omega = {0, 0, 0};
    w.place();
    add_road(w.builder, "ground", {});
    w.tyre.damping_N_s_per_m = 500;
    w.tyre.bilateral = bilateral;
    add_ride_tyre(w.builder, "T", w.tyre);
    w.finish();
    REQUIRE(w.force[2] == w.measure("normal_force"));
    return w.force[2];
  };
  REQUIRE(normal(0.56, 1, false) == 0);
  REQUIRE(normal(0.56, 1, true) == Approx(-460 + 500));
  REQUIRE(normal(0.53, 0, false) == Approx(920));
  REQUIRE(normal(0.53, 1, false) == Approx(920 + 500));
  REQUIRE(normal(0.53, -1, false) == Approx(920 - 500));
  REQUIRE(normal(0.53, -9, false) == 0);  // the damper would pull
  // 1e-9 m on either side: the force is K delta + c delta' delta / ramp, 46e-6 + 5e-4 N.
  REQUIRE(normal(0.55 + 1e-9, 1, false) == 0);
  REQUIRE(normal(0.55 - 1e-9, 1, false) == Approx(46e-6 + 500 * 1e-6).epsilon(1e-6));
  REQUIRE(normal(0.55 - 0.5e-3, 1, false) == Approx(23 + 250));
  REQUIRE(normal(0.55 - 1e-3, 1, false) == Approx(46 + 500));
}

TEST_CASE("tyre: slip is regular at rest, lags where asked to, and equals the source's when told so") {
  const auto wheel = [](Wheel& w, double u, double v, const TyreSlipOptions& slip) {
    w.position = {0, 0, 0.5};
    w.hub = {0, 0, 0};
    w.tyre.axis = {0, 1, 0};
    w.euler = {1, 0, 0, 0};
    w.velocity = {u, v, 0};
    w.omega = {0, 0, 0};
    w.place();
    add_road(w.builder, "ground", {});
    LinearTyreOptions o;
    o.cornering_stiffness_N_per_rad = 1000;
    add_linear_tyre(w.builder, "T", w.tyre, slip, o);
    w.finish();
  };
  const auto alpha = [&](double u, double v, double width) {
    TyreSlipOptions slip;
    slip.slip_speed_m_per_s = width;
    Wheel w;
    wheel(w, u, v, slip);
    REQUIRE(w.force[1] == Approx(-1000 * w.measure("slip_angle")).margin(1e-12));
    return w.measure("slip_angle");
  };
  REQUIRE(alpha(10, 1, 0) == Approx(std::atan(0.1)));
  REQUIRE(alpha(0.09, 0.01, 0) == 0);
  REQUIRE(alpha(0, 0, 0.1) == 0);
  REQUIRE(alpha(10, 1, 0.1) == Approx(std::atan(0.1)).epsilon(1e-14));
  REQUIRE(alpha(0.5, 0.05, 0.1) == Approx(std::atan(0.1 * std::tanh(5.0))).epsilon(1e-14));
  REQUIRE(alpha(0, 0.03, 0.1) == Approx(std::atan(0.3)));
  for (const double u : {0.009999999, 0.010000001})  // where the series hands over
    REQUIRE(alpha(u, 0.02, 0.1) == Approx(std::atan(0.02 / u * std::tanh(u / 0.1))).epsilon(1e-14));
  REQUIRE(alpha(-10, 1, 0.1) == alpha(10, 1, 0.1));  // backwards, too, it opposes
  TyreSlipOptions lag;
  lag.relaxation_length_m = 0.5;
  lag.slip_speed_m_per_s = 0;
  Wheel w;
  w.z = {0.04};
  wheel(w, 8, 1.2, lag);
  REQUIRE(w.measure("slip_angle") == Approx(std::atan(0.04)));
  REQUIRE(w.zdot[0] == Approx((1.2 - 8 * 0.04) / 0.5));
}

TEST_CASE("tyre: what a side force makes about the normal turns with the direction of travel") {
  // Behind the contact is the other end of the patch, in reverse: the moments of the mirrored motion. Regular between.
  const auto moment = [](double u, double width, bool calspan) {
    Wheel w;
    w.position = {0, 0, 0.5};
    w.hub = {0, 0, 0};
    w.tyre.axis = {0, 1, 0};
    w.euler = {1, 0, 0, 0};
    w.velocity = {u, 0.5, 0};
    w.omega = {0, 0, 0};
    w.place();
    add_road(w.builder, "ground", {});
    TyreSlipOptions slip;
    slip.slip_speed_m_per_s = width;
    LinearTyreOptions o;
    o.cornering_stiffness_N_per_rad = 1000;
    o.aligning_moment_N_m_per_rad = 30;
    o.trail_m = 0.07;
    calspan ? add_calspan_tyre(w.builder, "T", w.tyre, slip, kIltis) : add_linear_tyre(w.builder, "T", w.tyre, slip, o);
    w.finish();
    return w.moment[2];
  };
  const double alpha = std::atan(0.05);
  CHECK(moment(10, 0.1, false) == Approx((30 + 1000 * 0.07) * alpha).epsilon(1e-12));
  for (const bool calspan : {false, true})
    for (const double width : {0.0, 0.1}) {
      CHECK(moment(10, width, calspan) > 0);
      CHECK(moment(-10, width, calspan) == -moment(10, width, calspan));
      CHECK(moment(0, width, calspan) == 0);
    }
  // tanh(V.e_x / w), beside that of the slip itself.
  const double slow = std::atan(0.5 / 0.05 * std::tanh(0.5));
  CHECK(moment(0.05, 0.1, false) == Approx((30 + 70) * slow * std::tanh(0.5)).epsilon(1e-12));
}
