// What acts briefly where something turns by radians within a step, against closed forms: a point Q at radius 1 of a
// free wheel, whose motion every integrator follows exactly by steps of any length, or a sine of where a point is. With
// 1000 (cos x - (1 - e)) over |x| < w, cos w = 1 - e, a passage at rate s makes 2000 (sin w - (1 - e) w)/s.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/error_estimate.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using Catch::Detail::Approx;

namespace {

constexpr const char* kFlight = R"([point.P]
x_m = 0
y_m = 0
vx_m_per_s = 1
vy_m_per_s = 0.1
[mass.bob]
point = "P"
mass_kg = 1
)";

// {}: rad/s
constexpr const char* kWheel = R"([body.wheel]
x_m = 0
y_m = 0
angle_rad = 0.1
angular_velocity_rad_per_s = {}
mass_kg = 1
inertia_kg_m2 = 1
[point.Q]
on = "wheel"
x_m = 1
y_m = 0
)";

constexpr const char* kWheelGiven = "\"wheel.x\", \"wheel.y\", \"wheel.angle\"";

template <class... Parts>
std::string joined(const Parts&... parts) {
  std::string all;
  ((all += parts), ...);
  return all;
}

constexpr const char* kFlightInSpace = R"([point.P]
x_m = 0
y_m = 0
z_m = 0
vx_m_per_s = 1
vy_m_per_s = 0.1
[mass.bob]
point = "P"
mass_kg = 1
)";

double passage(double e, double rate) {
  const double w = std::acos(1 - e);
  return 2 * (std::sin(w) - (1 - e) * w) / rate;
}

struct Way {
  const char *formulation, *integrator;
};
constexpr Way kWays[] = {{"baumgarte", "idas"}, {"index2", "idas"},     {"baumgarte", "cvodes"}, {"maggi", "cvodes"},
                         {"index1", "dopri5"},  {"maggi", "dop853"},    {"index1", "radau5"},    {"index2", "radau9"},
                         {"index1", "idas"},    {"baumgarte", "dop853"}};

Simulation run(const Way& way, const std::string& scene, double rtol, const std::vector<std::string>& set = {}) {
  Problem p = make_problem(Scene::parse(scene, "turning.toml", set));
  p.formulation = way.formulation;
  p.solver.integrator = way.integrator;
  p.solver.rtol = rtol;
  return simulate(p, p.parameters.values());
}

std::string with_wheel(double rate, const std::string& more, const std::string& given = "") {
  return joined(kFlight, fmt::format(fmt::runtime(kWheel), rate), more,
                fmt::format("[start]\ngiven = [\"P.x\", \"P.y\", {}]\n", kWheelGiven), given);
}

constexpr const char* kFinal = "[[cost.terminal]]\nkind = \"value\"\noutput = \"P.y_dot\"\n";

}  // namespace

TEST_CASE("brief forces: points of what turns within a step", "[touch][turning]") {
  // Four passages in 10 s at 3 rad/s, 31 at 20: of the angle, of the point, of a product, as a force and as a cost.
  // Each is met by some fifty steps between two bends, which are right to the tolerance of the velocity.
  const auto rate = GENERATE(3.0, 20.0);
  const double expected = (rate > 10 ? 31 : 4) * 1000 * passage(1e-3, rate);
  for (const Way& way : kWays)
    for (const char* formula : {"max(0, (Q.x - 0.999)*1000)", "max(0, (cos(wheel.angle) - 0.999)*1000)",
                                "max(0, (Q.x^2 - Q.y^2 - 0.996004)*250.25025025)"}) {
      CAPTURE(way.formulation, way.integrator, formula, rate);
      const bool product = formula[8] == 'Q' && formula[11] == '^';
      // cos 2x beyond cos 2w of the same w, twice a turn; its integral by the same formula at twice the rate.
      const double e = 1 - 0.996004, k = 250.25025025;
      const double turns = rate > 10 ? 63 : 9;
      const double value = product ? turns * k * passage(e, 2 * rate) : expected;
      const Simulation force = run(
          way,
          joined(with_wheel(rate, fmt::format("[force.f]\npoint = \"P\"\nformula_y_N = \"{}\"\n", formula)), kFinal),
          1e-8, {"run.t_end_s=10"});
      CHECK(std::abs(force.psi - 0.1 - value) <= 1e-8 * static_cast<double>(force.counters.steps));
      CHECK(force.counters.steps < 15000);
      const Simulation cost =
          run(way,
              joined(with_wheel(rate, fmt::format("[output.c]\nunit = \"1\"\nformula = \"{}\"\n", formula)),
                     "[[cost.running]]\nkind = \"value\"\noutput = \"c\"\n"),
              1e-8, {"run.t_end_s=10"});
      CHECK(std::abs(cost.psi - value) <= 1e-8 * static_cast<double>(cost.counters.steps));
    }
}

TEST_CASE("brief forces: gradients of what turns within a step", "[touch][turning]") {
  // By the radius r of Q: psi has r cos x for cos x, d(psi)/dr = 4 1000 (2 sin w)/3.
  const double expected = 4 * 2000 * std::sin(std::acos(0.999)) / 3;
  for (const auto& [formulation, method] : {std::pair{"baumgarte", "idas-adjoint"},
                                            {"baumgarte", "cvodes-adjoint"},
                                            {"maggi", "cvodes-forward"},
                                            {"index1", "discrete-adjoint"}}) {
    CAPTURE(formulation, method);
    Problem p = make_problem(
        Scene::parse(joined(with_wheel(3, "[force.f]\npoint = \"P\"\nformula_y_N = \"max(0, (Q.x - 0.999)*1000)\"\n"),
                            kFinal, "[parameter.r]\nnumber = \"point.Q.x_m\"\n"),
                     "turning.toml", {"run.t_end_s=10"}),
        {"r"});
    p.formulation = formulation;
    if (std::string(method) == "discrete-adjoint") p.solver.integrator = "dopri5";
    p.solver.rtol = 1e-8;
    const GradientResult r = gradient(p, method, p.parameters.values());
    CHECK(r.psi == Approx(0.1 + 4000 * passage(1e-3, 3)).epsilon(1e-6));
    CHECK(r.gradient.at(0) == Approx(expected).epsilon(1e-5));
  }
}

TEST_CASE("brief forces: sines of what moves far, and where an oscillation turns", "[touch][turning]") {
  const std::string start = "[start]\ngiven = [\"P.x\", \"P.y\"]\n";
  for (const Way& way : kWays) {
    CAPTURE(way.formulation, way.integrator);
    const Simulation far =
        run(way,
            joined(kFlight, "[force.f]\npoint = \"P\"\nformula_y_N = \"max(0, sin(P.x*2*pi/100) - 0.99999)*1e5\"\n",
                   start, kFinal),
            1e-8, {"run.t_end_s=1000"});
    // The place is known to rtol of 1000 m, of a passage 0.14 m long.
    CHECK(far.psi - 0.1 == Approx(10e5 * passage(1e-5, 2 * std::acos(-1.0) / 100)).epsilon(1e-5));
    // O.x = cos t beyond -0.9999 at pi and 3 pi: what the amplitude is off by, some hundred rtol, is felt 1.5e4 times.
    const Simulation turned = run(way,
                                  joined(kFlight,
                                         "[point.O]\nx_m = 1\ny_m = 0\n[mass.o]\npoint = \"O\"\nmass_kg = 1\n"
                                         "[force.k]\npoint = \"O\"\nformula_x_N = \"-O.x\"\n"
                                         "[force.f]\npoint = \"P\"\nformula_y_N = \"1e5*max(0, -O.x - 0.9999)\"\n"
                                         "[start]\ngiven = [\"P.x\", \"P.y\", \"O.x\", \"O.y\"]\n",
                                         kFinal),
                                  1e-8, {"run.t_end_s=10"});
    CHECK(turned.psi - 0.1 == Approx(2e5 * passage(1e-4, 1)).epsilon(1.5e4 * 1e-6));
  }
}

TEST_CASE("brief forces: a spring on what turns, by a law that acts over two short parts of a turn",
          "[touch][turning]") {
  // From Q on a wheel that nothing brakes to G at 3 m: its length is sqrt(10 - 6 cos x), up to 4 m; the law is a tent
  // of 1000 N from 0.998 to 0.999 m beyond 3 m. Its integral over the angle by Simpson's rule between its bends.
  const auto angle = [](double length) { return std::acos((10 - length * length) / 6); };
  const auto integral = [&](double from, double to) {
    const double a = angle(from), b = angle(to);
    double sum = 0;
    constexpr int kParts = 200;
    for (int k = 0; k <= kParts; ++k) {
      const double length = std::sqrt(10 - 6 * std::cos(a + (b - a) * k / kParts));
      const double f = 1000 * std::max(0.0, 1 - std::abs(length - 3.9985) / 0.0005);
      sum += (k == 0 || k == kParts ? 1 : k % 2 ? 4 : 2) * f;
    }
    return sum * (b - a) / (3 * kParts);
  };
  const double turn = 2 * (integral(3.998, 3.9985) + integral(3.9985, 3.999));
  const std::string scene = joined(fmt::format(fmt::runtime(kWheel), 3), R"([point.G]
ground = true
x_m = 3
y_m = 0
[spring.s]
from = "Q"
to = "G"
natural_length_m = 3
spring_law = { kind = "data", x = [-2, 0.998, 0.9985, 0.999, 2], y = [0, 0, 1000, 0, 0], between = "lines", beyond = "hold" }
[point.O]
ground = true
x_m = 0
y_m = 0
[point.C]
on = "wheel"
x_m = 0
y_m = 0
[revolute.r]
points = ["O", "C"]
[start]
given = ["wheel.angle"]
[[cost.running]]
kind = "value"
output = "s.force"
)");
  // Passed at pi, 3 pi, 5 pi, 7 pi and 9 pi of 30.1 rad; 1 kJ of the spring against the wheel's 4.5 MJ.
  for (const Way& way : kWays) {
    CAPTURE(way.formulation, way.integrator);
    const Simulation r = run(way, scene, 1e-8, {"body.wheel.inertia_kg_m2=1e10", "run.t_end_s=10"});
    CHECK(r.psi == Approx(5 * turn / 3).epsilon(2e-6));
  }
}

TEST_CASE("brief forces: a point of a body that turns in space", "[touch][turning]") {
  // Spherical, about a skew axis n: Q = r + sin(x) n x r + (1 - cos x) n x (n x r). A bell over Q.x, by Simpson's rule.
  // index2 begins anew at ends of steps, where its constraints hold: one run in four failed behind a cut.
  const double n[3] = {0.48, -0.6, 0.64}, r[3] = {0.7, 0.4, -1.1}, rate = 7.65, centre = 0.6, width = 0.07;
  const double a = n[1] * r[2] - n[2] * r[1], along = n[0] * r[0] + n[1] * r[1] + n[2] * r[2], b = n[0] * along - r[0];
  constexpr int kParts = 400000;
  double sum = 0;
  for (int k = 0; k <= kParts; ++k) {
    const double x = rate * 5.0 * k / kParts, u = (r[0] + a * std::sin(x) + b * (1 - std::cos(x)) - centre) / width;
    sum += (k == 0 || k == kParts ? 1 : k % 2 ? 4 : 2) * std::exp(-u * u);
  }
  const double expected = sum * 5.0 / (3 * kParts);
  REQUIRE(expected > 0.1);
  const std::string scene =
      joined(kFlightInSpace,
             fmt::format("[rigid_body.body]\nx_m = 0\ny_m = 0\nz_m = 0\nmass_kg = 1\ninertia_xx_kg_m2 = 1\n"
                         "inertia_yy_kg_m2 = 1\ninertia_zz_kg_m2 = 1\nomega_x_rad_per_s = {:.17g}\n"
                         "omega_y_rad_per_s = {:.17g}\nomega_z_rad_per_s = {:.17g}\n",
                         rate * n[0], rate * n[1], rate * n[2]),
             "[point.Q]\non = \"body\"\nx_m = 0.7\ny_m = 0.4\nz_m = -1.1\n"
             "[force.f]\npoint = \"P\"\nformula_y_N = \"exp(-((Q.x - 0.6)/0.07)^2)\"\n"
             "[start]\ngiven = [\"body\", \"P.x\", \"P.y\", \"P.z\"]\n",
             kFinal);
  for (const Way& way : kWays)
    for (const double rtol : {4e-8, 1e-8, 3e-9}) {
      CAPTURE(way.formulation, way.integrator, rtol);
      const Simulation run_of = run(way, scene, rtol, {"run.t_end_s=5"});
      // Where Q is known to some steps' tolerances, a slope of 1/0.07.
      CHECK(std::abs(run_of.psi - 0.1 - expected) <= 0.5 * static_cast<double>(run_of.counters.steps) * rtol);
    }
}

TEST_CASE("brief forces: a run ends where a point that turns is first beyond its level", "[turning][free_end]") {
  const double e = GENERATE(1e-4, 1e-8);
  for (const Way& way : kWays)
    for (const bool formula : {false, true}) {
      CAPTURE(way.formulation, way.integrator, e, formula);
      const Simulation r = run(way,
                               joined(with_wheel(3, formula ? "[output.c]\nunit = \"m\"\nformula = \"Q.x\"\n" : ""),
                                      "[[cost.terminal]]\nkind = \"value\"\noutput = \"time\"\n"),
                               1e-8,
                               {"run.t_end_s=10", fmt::format("run.ends_when={{output='{}', above={:.17g}}}",
                                                              formula ? "c" : "Q.x", 1 - e)});
      // Where Q.x is known to rtol the time is to rtol/sqrt(2 e).
      CHECK(r.psi == Approx((2 * std::acos(-1.0) - 0.1 - std::acos(1 - e)) / 3).epsilon(1e-7 / std::sqrt(2 * e)));
    }
}

TEST_CASE("brief forces: what spins by thousands of radians in a step bounds the steps", "[touch][turning]") {
  for (const Way& way : kWays) {
    CAPTURE(way.formulation, way.integrator);
    const Simulation r = run(way,
                             joined(with_wheel(1000, "[output.c]\nunit = \"1\"\nformula = \"1 + 0*Q.x\"\n"),
                                    "[[cost.running]]\nkind = \"value\"\noutput = \"c\"\n"),
                             1e-8, {"run.t_end_s=10"});
    CHECK(r.psi == Approx(10).epsilon(1e-9));
    CHECK(r.counters.steps > 10000 / 256);
    CHECK(r.counters.steps < 4000);
  }
}

TEST_CASE("brief forces: a large short force hides no small long one, and costs of accelerations are followed",
          "[touch]") {
  const std::string start = "[start]\ngiven = [\"P.x\", \"P.y\"]\n";
  for (const Way& way : kWays) {
    CAPTURE(way.formulation, way.integrator);
    const Simulation hidden = run(way,
                                  joined(kFlight,
                                         "[force.f]\npoint = \"P\"\nformula_y_N = \"1e7*max(0, 1 - abs(P.x - 2)/1e-8) "
                                         "+ max(0, 1 - abs(P.x - 6.1)/0.05)\"\n",
                                         start, kFinal),
                                  1e-6, {"run.t_end_s=10"});
    // The width of the first is known to rtol of where it is, half of itself where rtol is 1e-8: psi is what it is.
    CHECK(hidden.psi == Approx(0.25).epsilon(1e-4));
    const Simulation falling = run(way,
                                   joined(kFlight,
                                          "[gravity]\ny_m_per_s2 = -9.81\n[output.c]\nunit = \"1\"\n"
                                          "formula = \"max(0, 1 - abs(P.x - 6.1)/0.05)*P.y_ddot\"\n",
                                          start, "[[cost.running]]\nkind = \"value\"\noutput = \"c\"\n"),
                                   1e-8, {"run.t_end_s=10"});
    CHECK(falling.psi == Approx(-0.05 * 9.81).epsilon(1e-6));
  }
}

TEST_CASE("brief forces: one that divides by zero where it begins", "[touch]") {
  // Of 0.2 N between 6.1 and 6.2 m, by a quotient whose rounding knows no bound beside its zero.
  for (const Way& way : kWays)
    for (const double rtol : {1e-6, 1e-8, 1e-10}) {
      CAPTURE(way.formulation, way.integrator, rtol);
      const std::string scene = joined(kFlight,
                                       "[force.f]\npoint = \"P\"\nformula_y_N = \"0.1*(abs(P.x - 6.1)/(P.x - 6.1) - "
                                       "abs(P.x - 6.2)/(P.x - 6.2))\"\n[start]\ngiven = [\"P.x\", \"P.y\"]\n",
                                       kFinal);
      // A step that ends at the zero itself is refused by name.
      try {
        const double psi = run(way, scene, rtol, {"run.t_end_s=10"}).psi;
        CHECK(std::abs(psi - 0.12) <= 30 * rtol);
      } catch (const SolverError& e) {
        CHECK_THAT(e.what(), Catch::Contains("not a finite number"));
      }
    }
}

TEST_CASE("late laws: schemes of high order end a step where a law of time does", "[explicit][radau]") {
  // A pendulum on a carriage that is moved by a smooth step, after a rest. Against one of order 5, whose steps are
  // shorter by far, at a tighter tolerance: radau9 was off by 1,700 rtol, passing the step's end within a step.
  const std::string scene = R"([gravity]
y_m_per_s2 = -9.81
[point.C]
x_m = 0
y_m = 0
[point.B]
x_m = 0
y_m = -1
[mass.C]
point = "C"
mass_kg = 2
[mass.B]
point = "B"
mass_kg = 1
[bar.rod]
from = "C"
to = "B"
mass_kg = 0
length_m = 1.0
[driver.y]
coordinate = "C.y"
law = 0
[driver.x]
coordinate = "C.x"
law = { kind = "smooth_step", from = 3.7, to = 3.8, before = 0, after = 1.0 }
[start]
given = ["B.x"]
[[cost.running]]
kind = "square"
output = "B.x"
)";
  const double expected = run({"baumgarte", "dopri5"}, scene, 1e-12, {"run.t_end_s=4.5"}).psi;
  for (const char* formulation : {"index1", "maggi-implicit", "index2"})
    for (const double rtol : {1e-6, 1e-8, 2.5e-10}) {
      CAPTURE(formulation, rtol);
      CHECK(run({formulation, "radau9"}, scene, rtol, {"run.t_end_s=4.5"}).psi == Approx(expected).epsilon(10 * rtol));
    }
}

TEST_CASE("error estimate: two runs by the same steps tell nothing", "[estimate]") {
  // A swinging pendulum by radau9: from 1e-5 to 1e-7 it takes nearly the same steps.
  Problem p = make_problem(Scene::parse(R"([gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0.6
y_m = -0.8
[bar.rod]
from = "O"
to = "P"
mass_kg = 2
[start]
given = ["P.x"]
[[cost.terminal]]
kind = "value"
output = "P.x"
)",
                                        "pendulum.toml", {"run.t_end_s=1"}));
  p.formulation = "index1";
  p.solver.integrator = "radau9";
  p.solver.rtol = 1e-13;
  const double exact = simulate(p, p.parameters.values()).psi;
  for (const double rtol : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9}) {
    p.solver.rtol = rtol;
    const Simulation r = simulate(p, p.parameters.values());
    const double error = std::abs(r.psi - exact), estimate = estimate_error(p, p.parameters.values(), r).psi;
    CAPTURE(rtol, error, estimate);
    CHECK(estimate >= 0.5 * error);
    CHECK(estimate >= 1e-2 * rtol * std::abs(r.psi));
  }
}
