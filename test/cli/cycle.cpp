// Limit cycles from outside: what is printed, the JSON object, flags, and what is said where there is none.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "process.h"
#include "support/paths.h"

using costate::test::costate_json;
using costate::test::file_text;
using costate::test::run_costate;
using costate::test::WorkingDirectory;
using costate::test::write_text;
using Json = nlohmann::json;
using Catch::Contains;

namespace {
const std::string kRayleigh = COSTATE_MODELS_DIR "/cycles/rayleigh.toml";
const std::string kPendulum = COSTATE_MODELS_DIR "/cycles/forced_pendulum.toml";
const std::string kForced = COSTATE_MODELS_DIR "/cycles/forced_oscillator.toml";
}  // namespace

TEST_CASE("cycle: the summary") {
  const WorkingDirectory here;
  const Json j = costate_json({"cycle", kRayleigh, "--output", "out"}, here.path());
  CHECK(j.at("status") == "ok");
  CHECK(std::abs(j.at("period_s").get<double>() - 6.6632868593231) < 1e-7);
  CHECK(j.at("stable") == true);
  REQUIRE(j.at("multipliers").size() == 1);
  CHECK(std::abs(j.at("multipliers")[0][0].get<double>() - 0.00085969506) < 1e-7);
  CHECK(j.at("multipliers")[0][1] == 0);
  CHECK(j.at("fixed_point").contains("disk.angle"));
  CHECK(j.at("fixed_point").contains("disk.angle_dot"));
  CHECK(j.at("section_errors").at("disk.angle_dot").get<double>() < 1e-7);
  REQUIRE(j.at("events").size() == 1);
  CHECK(j.at("events")[0].at("t") == j.at("period_s"));
  CHECK(j.at("fixed_point_gradient").at("disk.angle_dot").contains("push"));
  CHECK(std::abs(j.at("period_gradient").at("stiffness").get<double>() + 3.69744172839) < 1e-5);
  const double by_stiffness = j.at("gradient").at("stiffness"), within = j.at("gradient_error").at("stiffness");
  CHECK(std::abs(by_stiffness + 25.5959353195) <= 2 * within + 1e-9);
  CHECK(within < 1e-5);
  CHECK(j.at("period_gradient_error").at("push").get<double>() > 0);
  CHECK(j.at("fixed_point_gradient_error").at("disk.angle_dot").at("push").get<double>() > 0);
  CHECK(run_costate({"cycle", kRayleigh, "--no-files"}, here.path()).out.find("6.663286") != std::string::npos);
}

TEST_CASE("cycle: motions that conserve are called neither stable nor unstable") {
  // Without dampers the multipliers are on the unit circle, by whatever a run makes of them: in these the change
  // between two tolerances was less than their distance from it.
  const WorkingDirectory here;
  const std::string of_shaft = "torsion_spring.shaft.", of_hinge = "torsion_spring.hinge.damping_N_m_s_per_rad=0";
  for (const char* formulation : {"baumgarte", "index1"}) {
    const auto about = [&](std::vector<std::string> arguments) {
      arguments.insert(arguments.end(), {"--no-files", "--formulation", formulation});
      const Json j = costate_json(arguments, here.path());
      INFO(j.at("multipliers") << " " << j.at("multiplier_error"));
      CHECK(j.at("stable").is_null());
    };
    about({"cycle", kForced, "--set", of_shaft + "damping_N_m_s_per_rad=0", "--set",
           of_shaft + "stiffness_N_m_per_rad=40"});
    for (const char* mass : {"1", "5", "7.7"})
      about({"cycle", kPendulum, "--set", of_hinge, "--set", std::string("body.rod.mass_kg=") + mass});
  }
  const auto o = run_costate({"cycle", kPendulum, "--no-files", "--set", of_hinge}, here.path());
  CHECK_THAT(o.out, Contains("stability is not decided: the largest multiplier is 1 within"));
}

TEST_CASE("cycle: at a resonance without damping there is none") {
  // Both multipliers are 1: I - P has no large singular value beside which the small one would be small.
  const WorkingDirectory here;
  const std::string of_shaft = "torsion_spring.shaft.";
  for (const char* stiffness : {"4.934802200544679", "4.9348022"}) {
    const auto o = run_costate({"cycle", kForced, "--no-files", "--set", of_shaft + "damping_N_m_s_per_rad=0", "--set",
                                of_shaft + "stiffness_N_m_per_rad=" + stiffness},
                               here.path());
    CHECK(o.status == 1);
    CHECK_THAT(o.err, Contains("A cycle is not determined"));
  }
  // Beside it the answer is M sin(0.4) / (k - I w^2), to what the multipliers' errors leave.
  const Json j = costate_json({"cycle", kForced, "--no-files", "--set", of_shaft + "damping_N_m_s_per_rad=0", "--set",
                               of_shaft + "stiffness_N_m_per_rad=4.9348"},
                              here.path());
  CHECK(j.at("fixed_point").at("disk.angle").get<double>() == Approx(-212355).epsilon(3e-3));
}

TEST_CASE("cycle: along a branch that conserves nothing crosses the unit circle") {
  // Multipliers are on it, by whatever a run makes of them: five crossings "within 1e-7" before.
  const WorkingDirectory here;
  const std::string free = "torsion_spring.hinge.damping_N_m_s_per_rad=0";
  const Json j = costate_json({"cycle", kPendulum, "--no-files", "--set", free, "--continue", "body.rod.mass_kg=1..8"},
                              here.path());
  CHECK(j.at("bifurcations").empty());
  for (const Json& p : j.at("branch")) CHECK(p.at("stable").is_null());
}

TEST_CASE("cycle: flags stand for what the scene does not say") {
  const WorkingDirectory here;
  const Json j =
      costate_json({"cycle", kForced, "--period", "4", "--no-files", "--no-derivatives", "--no-estimate"}, here.path());
  CHECK(j.at("period_s") == 4);
  CHECK(j.at("gradient").is_null());
  CHECK(run_costate({"cycle", kForced, "--no-files", "--relabel", "left"}, here.path()).status != 0);
}

TEST_CASE("cycle: what cannot be found is said by name") {
  const WorkingDirectory here;
  const auto wrong = run_costate({"cycle", kForced, "--no-files", "--period", "1.7"}, here.path());
  CHECK(wrong.status == 1);
  CHECK_THAT(wrong.err, Contains("this is no period of theirs") && Contains("override 'cycle.period_s=1.7'"));
  const auto kept = run_costate(
      {"cycle", kRayleigh, "--no-files", "--set", "torsion_spring.shaft.damper_law.coefficients=[0, 0, 0, 0]"},
      here.path());
  CHECK(kept.status == 1);
  CHECK_THAT(kept.err, Contains("A cycle is not determined") && Contains("apps/README.md#no-cycle"));
  // Where the damper brakes at every speed the motion dies out.
  const std::string brakes = "torsion_spring.shaft.damper_law.coefficients=[0, 1, 0, 0.3333333333333333]";
  const auto rest = run_costate({"cycle", kRayleigh, "--no-files", "--set", brakes}, here.path());
  CHECK(rest.status == 1);
  CHECK_THAT(rest.err, Contains("the motion comes to rest") && Contains("apps/README.md#no-cycle"));
  // With forces that repeat themselves rest is a periodic motion, whose multipliers may be asked for.
  std::string periodic = file_text(kRayleigh);
  const std::string section = "section = { output = \"disk.angle\", above = 0.0 }";
  REQUIRE(periodic.find(section) != std::string::npos);
  write_text(here / "p.toml", periodic.replace(periodic.find(section), section.size(), "period_s = 2") +
                                  "\n[couple.pump]\nangle = \"disk\"\n"
                                  "formula = \"depth*sin(3.141592653589793*t)*disk.angle\"\ndepth = 0.1\n");
  const Json still =
      costate_json({"cycle", "p.toml", "--no-files", "--set", brakes, "--set", "body.disk.angle_rad=0.1"}, here.path());
  CHECK(still.at("stable") == true);
  CHECK_THAT(still.at("warnings").dump(), Contains("This cycle is rest"));
  const auto none = run_costate({"cycle", COSTATE_MODELS_DIR "/five_bar/five_bar.toml", "--no-files"}, here.path());
  CHECK(none.status != 0);
  CHECK_THAT(none.err, Contains("has no [cycle]"));
}

namespace {
Json branch_of(const std::string& scene, const std::string& request, std::vector<std::string> options,
               const WorkingDirectory& here) {
  options.insert(options.begin(), {"cycle", scene, "--continue", request});
  return costate_json(options, here.path());
}

/// The forced pendulum at another damping, angular frequency and amplitude to begin with.
std::vector<std::string> pendulum_at(const std::string& damping, const std::string& omega, const std::string& period,
                                     const std::string& amplitude) {
  return {"--set",    "torsion_spring.hinge.damping_N_m_s_per_rad=" + damping,
          "--set",    "couple.drive.torque_N_m.angular_frequency_rad_per_s=" + omega,
          "--set",    "couple.drive.torque_N_m.amplitude=" + amplitude,
          "--period", period};
}
}  // namespace

// The numbers are those of an independent program: shooting with DOP853 of scipy 1.10 (rtol 1e-12) and its variational
// equations, fsolve on x = P(x) with det(I - P_x) = 0 (fold), det(I + P_x) = 0 (flip), det P_x = 1 (Neimark-Sacker).
TEST_CASE("cycle: a branch is followed around its folds") {
  const WorkingDirectory here;
  std::vector<std::string> options = pendulum_at("0.12", "3.490658503988659", "1.8", "0.3");
  options.insert(options.end(), {"--output", "out"});
  const Json j = branch_of(kPendulum, "amplitude=0.2..3", options, here);
  CHECK(j.at("parameter") == "amplitude");
  const Json& points = j.at("branch");
  CHECK(points.front().at("parameter") == 0.2);
  CHECK(points.back().at("parameter") == 3);
  REQUIRE(j.at("bifurcations").size() == 2);
  double right[] = {1.05843388196992, 0.61446724385084};
  for (int i = 0; i < 2; ++i) {
    const Json& f = j.at("bifurcations")[i];
    CHECK(f.at("kind") == "fold");
    // What it is said to be within, at rtol 1e-9 some 1e-7.
    CHECK(f.at("parameter_error").get<double>() < 2e-7);
    CHECK(std::abs(f.at("parameter").get<double>() - right[i]) <= f.at("parameter_error").get<double>());
    CHECK(std::abs(f.at("multiplier")[0].get<double>() - 1) < 1e-5);
  }
  // Between the folds the parameter runs back and cycles are not stable.
  for (std::size_t i = 1; i + 1 < points.size(); ++i) {
    const double before = points[i - 1].at("parameter"), here_at = points[i].at("parameter"),
                 after = points[i + 1].at("parameter");
    if (before > here_at && here_at > after) CHECK(points[i].at("stable") == false);
  }
  const std::string drawing = costate::test::file_text(here.path() / "out/branch.svg");
  CHECK_THAT(drawing, Contains("<svg") && Contains("fold at 1.0584") && Contains("not stable"));
}

TEST_CASE("cycle: flips and Neimark-Sacker points are named") {
  const WorkingDirectory here;
  std::vector<std::string> options = pendulum_at("0.9148", "2.6808257310632905", "2.34375", "7.7");
  options.insert(options.end(), {"--settle", "60", "--no-files"});
  const Json flip = branch_of(kPendulum, "amplitude=7.6..8", options, here);
  REQUIRE(flip.at("bifurcations").size() == 1);
  CHECK(flip.at("bifurcations")[0].at("kind") == "flip");
  CHECK(std::abs(flip.at("bifurcations")[0].at("parameter").get<double>() - 7.84563105703477) <
        flip.at("bifurcations")[0].at("parameter_error").get<double>());
  const Json torus = branch_of(COSTATE_SOURCE_DIR "/test/cases/forced_rayleigh.toml", "amplitude=1..3",
                               {"--settle", "50", "--no-files"}, here);
  REQUIRE(torus.at("bifurcations").size() == 1);
  const Json& f = torus.at("bifurcations")[0];
  CHECK(f.at("kind") == "Neimark-Sacker");
  CHECK(std::abs(f.at("parameter").get<double>() - 1.2160967775576) < f.at("parameter_error").get<double>());
  const double re = f.at("multiplier")[0], im = f.at("multiplier")[1];
  CHECK(std::abs(std::hypot(re, im) - 1) < 1e-6);
  // The branch was begun at the end of its range: that point is there once.
  const Json& points = torus.at("branch");
  CHECK(points[points.size() - 2].at("parameter") != points.back().at("parameter"));
}

// Of x'' = (mu - x^2) x' - x, whose cycle shrinks like 2 sqrt(mu) to the equilibrium at mu = 0 (Hopf).
TEST_CASE("cycle: a branch that shrinks to rest ends there") {
  const WorkingDirectory here;
  write_text(here / "oscillator.toml", R"([point.P]
x_m = 0
y_m = 0
vx_m_per_s = 1.5
[mass.bob]
point = "P"
mass_kg = 1
[driver.y]
coordinate = "P.y"
law = { kind = "polynomial", coefficients = [0] }
[force.feed]
point = "P"
formula_x_N = "(mu - P.x^2)*P.x_dot - P.x"
mu = 0.5
[start]
given = ["P.x"]
[cycle]
section = { output = "P.x", above = 0.0 }
settle = 3
[parameter.mu]
number = "force.feed.mu"
[run]
t_end_s = 20
parameters = ["mu"]
)");
  const Json b = branch_of("oscillator.toml", "mu=-0.2..0.6", {"--no-files"}, here);
  CHECK_THAT(b.at("ended").dump(), Contains("the motion comes to rest") && Contains("the end of the range"));
  for (const Json& p : b.at("branch")) {
    const double mu = p.at("parameter"), v = p.at("fixed_point").at("P.x_dot");
    CAPTURE(mu);
    CHECK(v > 1e-6);  // behind that all is rest
    if (mu < 1e-5) continue;
    // The amplitude is 2 sqrt(mu) (1 + O(mu)).
    CHECK(v == Approx(2 * std::sqrt(mu)).epsilon(0.2 * mu + 5e-3));
    CHECK(p.at("stable") == true);
  }
  CHECK(b.at("branch").front().at("parameter").get<double>() < 1e-5);
  CHECK(b.at("branch").back().at("parameter") == 0.6);
}

TEST_CASE("cycle: what cannot be followed is refused") {
  const WorkingDirectory here;
  const auto refused = [&](const std::string& request) {
    const auto outcome = run_costate({"cycle", kForced, "--no-files", "--continue", request}, here.path());
    CHECK(outcome.status != 0);
    CHECK(outcome.out.empty());
    return outcome.err;
  };
  for (const char* wrong :
       {"amplitude", "amplitude=1", "amplitude=1..1", "=1..2", "amplitude=1..inf", "amplitude=a..b"})
    CHECK_THAT(refused(wrong), Contains("NAME=FROM..TO"));
  CHECK_THAT(refused("nothing=1..2"), Contains("nothing"));
  // Numbers that no scene may have at either end.
  CHECK_THAT(refused("body.disk.mass_kg=1..-1"), Contains("--continue body.disk.mass_kg=1..-1") && Contains("must"));
}

// The gait follows the design, with the cycle's own values in cost and constraint; the motions shown begin on it.
TEST_CASE("cycle: a gait is optimized, to a minimum with its certificate") {
  const WorkingDirectory here;
  const Json j =
      costate_json({"optimize", COSTATE_MODELS_DIR "/walker/gait_energy.toml", "--output", "out"}, here.path());
  CHECK(j.at("converged") == true);
  CHECK(j.at("failed_evaluations") == 0);
  CHECK(j.at("initial").at("psi").get<double>() == Approx(0.0412938967).epsilon(1e-6));
  CHECK(j.at("psi").get<double>() == Approx(0.0347199270).epsilon(1e-6));
  const Json& certificate = j.at("certificate");
  CHECK_THAT(certificate.at("verdict").get<std::string>(), Catch::StartsWith("strict local minimum"));
  CHECK(certificate.at("hessian_formulation") == "index1");  // exact, (18.10)
  CHECK(certificate.at("hessian_note").is_null());
  CHECK(std::find(j.at("bounds_active").begin(), j.at("bounds_active").end(), "slope") == j.at("bounds_active").end());
  for (const char* file : {"out/before.h5", "out/after.h5", "out/report.html", "out/optimized.toml"})
    CHECK(std::filesystem::exists(here.path() / file));
  CHECK(run_costate({"animate", "out/optimized.toml", "--output", "gait.html"}, here.path()).status == 0);
  // What does not need the cost of the motion does not ask for the cycle.
  CHECK(run_costate({"explain", "out/optimized.toml"}, here.path()).status == 0);
  const auto refused = run_costate({"simulate", "out/optimized.toml", "--no-files"}, here.path());
  CHECK(refused.status != 0);
  CHECK_THAT(refused.err, Contains("which this run does not look for"));
}

TEST_CASE("cycle: a plain run says that its psi is not that over the cycle") {
  const WorkingDirectory here;
  const std::vector<std::string> run = {"simulate", kRayleigh, "--set", "run.cycle=true", "--no-files"};
  const auto plain = run_costate(run, here.path());
  CHECK(plain.status == 0);
  CHECK_THAT(plain.err, Contains("This run begins where the scene does"));
}

// Two returns as one cycle have m^2, whose derivative is 2 m m'. Both by exact second derivatives, at 1e-12 of errors.
// Index-2 has none of its own.
TEST_CASE("cycle: the largest multiplier's gradient over several returns, and by other formulations") {
  const WorkingDirectory here;
  const std::vector<std::string> run = {"cycle", kRayleigh, "--no-files"};
  const auto with = [&](std::vector<std::string> more) {
    more.insert(more.begin(), run.begin(), run.end());
    const Json j = costate_json(more, here.path());
    CHECK_THAT(j.at("multiplier_gradient_method").get<std::string>(), Contains("exact second derivatives"));
    return j;
  };
  const Json once = with({}), twice = with({"--count", "2"}), index2 = with({"--formulation", "index2"});
  const double m = once.at("multipliers")[0][0];
  for (const char* parameter : {"push", "stiffness"}) {
    const auto of = [&](const Json& j) { return j.at("multiplier_gradient").at(parameter).get<double>(); };
    CHECK(std::abs(of(twice) - 2 * m * of(once)) <= 1e-8 * std::abs(of(once)));
    CHECK(std::abs(of(index2) - of(once)) <= 1e-7 * std::abs(of(once)));
  }
}

// The multiplier of Rayleigh's oscillator depends on c/sqrt(k J) alone, c the push: m_k = -c/(2 k) m_c, here c = -1 and
// k = 1. And against a central difference of two cycles, whose truncation is 1e-6 of third derivatives of order 0.1.
TEST_CASE("cycle: the largest multiplier's gradient says what it is within") {
  const WorkingDirectory here;
  const Json j = costate_json({"cycle", kRayleigh, "--no-files"}, here.path());
  const double by_push = j.at("multiplier_gradient").at("push"),
               by_stiffness = j.at("multiplier_gradient").at("stiffness");
  CHECK(std::abs(by_stiffness - by_push / 2) <= 1e-8);
  CHECK(j.at("multiplier_gradient_error").at("push").get<double>() < 1e-8);
  CHECK_THAT(j.at("multiplier_gradient_method").get<std::string>(), Contains("exact second derivatives"));
  const auto at = [&](const char* push) {
    const std::string law =
        std::string("torsion_spring.shaft.damper_law.coefficients=[0, ") + push + ", 0, 0.3333333333333333]";
    return costate_json({"cycle", kRayleigh, "--no-files", "--no-derivatives", "--set", law}, here.path())
        .at("multipliers")[0][0]
        .get<double>();
  };
  CHECK(std::abs((at("-0.999") - at("-1.001")) / 0.002 - by_push) <= 2e-7);
}

// By Floquet's theory: solutions of the linearized equations by Dormand and Prince at 1e-12, differences of their
// multipliers.
TEST_CASE("cycle: what rests on its cycle has multipliers whose derivatives are no zero") {
  const WorkingDirectory here;
  const auto derivatives = [&](const std::string& name, const std::string& parameters) {
    return costate_json({"cycle", std::string(COSTATE_SOURCE_DIR "/test/cases/") + name + ".toml", "--no-files",
                         "--parameters", parameters},
                        here.path())
        .at("multiplier_gradient");
  };
  const Json shaken = derivatives("mathieu", "driver.shake.law.amplitude,body.bob.mass_kg");
  CHECK(shaken.at("driver.shake.law.amplitude").get<double>() == Approx(6.534272320).epsilon(1e-6));
  CHECK(shaken.at("body.bob.mass_kg").get<double>() == Approx(0.017153684).epsilon(1e-6));
  const Json rod = derivatives("shaken_rod", "spring.s.stiffness_N_per_m,spring.s.damping_N_s_per_m,mass.m.mass_kg");
  CHECK(rod.at("spring.s.stiffness_N_per_m").get<double>() == Approx(1.0897188).epsilon(1e-6));
  CHECK(rod.at("spring.s.damping_N_s_per_m").get<double>() == Approx(-0.0753959).epsilon(1e-5));
  CHECK(rod.at("mass.m.mass_kg").get<double>() == Approx(-32.5407721).epsilon(1e-6));
}
