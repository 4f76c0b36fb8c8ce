// Places of laws that parameters move, and where nothing jumps but derivatives: ends of sweeps, of bumps under tyres
// that hold the rate of the ground, and of quintic steps. Against closed forms.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/integrator/simulate.h"
#include "costate/objective/output.h"
#include "costate/sensitivity/hessian.h"
#include "costate/sensitivity/method.h"
#include "property/hessian_compare.h"
#include "support/cases.h"

using namespace costate;
using costate::test::apart;

// The end of the sweep, start + length in floating point, belongs to what is behind it, whatever x - start says. Right
// is what differences of psi say, known to some 1e-9 of it; a lost end is 2e-2 and more.
TEST_CASE("moved places: the end of a sweep by all roundings", "[laws]") {
  for (const auto& [start, length] :
       {std::pair{0.35, 0.6}, {0.3503, 0.6}, {0.3502, 0.6}, {0.3606, 0.4366}, {0.1375, 0.2085}, {0.2653, 0.3707}}) {
    CAPTURE(start, length);
    Problem p = problem_of_case("moved_sweep", {fmt::format("driver.push.law.start_m={}", start),
                                                fmt::format("driver.push.law.length_m={}", length)});
    const auto rho = p.parameters.values();
    p.formulation = "index2";
    const double right = gradient(p, "differences", rho).gradient[0];
    for (const auto& [formulation, method] : {std::pair{"index1", "idas-adjoint"},
                                              {"baumgarte", "cvodes-forward"},
                                              {"index1", "hand-adjoint"},
                                              {"index2", "idas-forward"},
                                              {"maggi", "cvodes-adjoint"},
                                              {"baumgarte", "discrete-adjoint"}}) {
      CAPTURE(formulation, method);
      p.formulation = formulation;
      CHECK(std::abs(gradient(p, method, rho).gradient[0] - right) <= 1e-5 * std::max(1.0, std::abs(right)));
    }
  }
}

// A later bump is the same motion later: of the integral of a^2 from rest dpsi/dt0 = -a(T)^2. Discrete methods
// differentiate steps of rtol 1e-9; a stage on the wrong side of the bump's end is 1 here.
TEST_CASE("moved places: a bump whose curvature jumps under a damped tyre", "[laws]") {
  Problem p = problem_of_case("moved_post");
  p.formulation = "baumgarte";
  const auto rho = p.parameters.values();
  double a = 0;
  const auto output = make_output(*p.mechanism, "body.z_ddot");
  simulate(p, rho, {2.0}, [&](const MechanismState& s, System& system) { a = output->value(s, system.assembly()); });
  const double right = -a * a / 4.0774;
  CHECK(std::abs(right + 3.832e-4) <= 1e-7);
  for (const auto& [formulation, method, integrator] :
       {std::tuple<const char*, const char*, const char*>{"baumgarte", "discrete-adjoint", ""},
        {"baumgarte", "discrete-tangent", "dopri5"},
        {"index1", "discrete-adjoint", "radau5"},
        {"index3", "discrete-adjoint", "radau9"},
        {"baumgarte", "idas-forward", ""},
        {"maggi", "hand-adjoint", ""}}) {
    CAPTURE(formulation, method, integrator);
    p.formulation = formulation;
    p.solver.integrator = integrator;
    CHECK(std::abs(gradient(p, method, rho).gradient[0] - right) <= 1e-5);
  }
}

// x(T) = int_0^T w sin(w (T - s)) y(s) ds, w^2 = k/m: its derivatives by both times, with 30 digits. The acceleration
// is smooth, its derivative by either time is not.
TEST_CASE("moved places: a quintic step", "[laws][hessian]") {
  Problem p = problem_of_case("moved_step");
  const auto rho = p.parameters.values();
  const double psi = 0.781709026045812, by[] = {-3.9945042557826, -3.6090722073885};
  Eigen::MatrixXd right(2, 2);
  right << -1.8354236934171, 3.854320483956, 3.854320483956, 11.590060641683;
  for (const auto& [formulation, method] : {std::pair{"baumgarte", "discrete-adjoint"},
                                            {"index1", "discrete-adjoint"},
                                            {"index1", "idas-adjoint"},
                                            {"baumgarte", "cvodes-forward"}}) {
    CAPTURE(formulation, method);
    p.formulation = formulation;
    const GradientResult r = gradient(p, method, rho);
    CHECK(std::abs(r.psi - psi) <= 1e-7);
    for (std::size_t j = 0; j < 2; ++j) CHECK(std::abs(r.gradient[j] - by[j]) <= 1e-6);
  }
  for (const char* formulation : {"index1", "baumgarte", "penalty", "augmented-lagrangian"}) {
    CAPTURE(formulation);
    p.formulation = formulation;
    const Hessian h = hessian(p, rho);
    INFO(h.matrix);
    CHECK(apart(p, h.matrix, right) <= 1e-5);
  }
}

// A sweep's end where a course looks anyway, halfway to the end of the run, and one that moves nothing: both were taken
// for jumps that open. Right is what differences say, and zero.
TEST_CASE("moved places: ends of sweeps that are no jumps", "[laws]") {
  Problem p = problem_of_case("moved_sweep", {"driver.push.law.start_m=0.3", "driver.push.law.length_m=0.5",
                                              "parameter.st.number=\"driver.push.law.length_m\""});
  const auto rho = p.parameters.values();
  p.formulation = "baumgarte";
  const double right = gradient(p, "differences", rho).gradient[0];
  for (const auto& [formulation, method] : {std::pair{"index1", "idas-adjoint"}, {"baumgarte", "cvodes-forward"}}) {
    p.formulation = formulation;
    CHECK(std::abs(gradient(p, method, rho).gradient[0] - right) <= 1e-5 * std::max(1.0, std::abs(right)));
  }
  p = problem_of_case("moved_sweep",
                      {"driver.push.law.n_end_1_per_m=0.8", "parameter.st.number=\"driver.push.law.length_m\""});
  p.formulation = "baumgarte";
  CHECK(std::abs(gradient(p, "cvodes-adjoint", p.parameters.values()).gradient[0]) <= 1e-7);
}

// Powers of what is zero on one side, and of what is negative, by exponents that are names: (x - 7)^3 and max(x, 0)^1.5
// by hand.
TEST_CASE("moved places: powers with named exponents", "[laws]") {
  const auto scene = [](const char* formula, double k) {
    return make_problem(Scene::parse(
        fmt::format("[point.P]\nx_m = -0.5\ny_m = 0\nvx_m_per_s = 1.3\n[mass.P]\npoint = \"P\"\nmass_kg = "
                    "0.5\n[driver.y]\ncoordinate = \"P.y\"\nlaw = 0\n[force.F]\npoint = \"P\"\nc = 30\nk = {}\n"
                    "formula_x_N = \"{}\"\n[start]\ngiven = [\"P.x\"]\n[run]\nt_end_s = 0.6\nrtol = "
                    "1e-10\nparameters = [\"force.F.c\"]\n[[cost.terminal]]\nkind = \"value\"\noutput = \"P.x\"\n",
                    k, formula),
        "powers.toml"));
  };
  for (const auto& [named, plain, k] : {std::tuple{"-c*P.x^k", "-c*P.x*P.x*P.x + 0*k", 3.0},
                                        {"-c*max(P.x,0)^k", "-c*max(P.x,0)*sqrt(max(P.x,1e-300)) + 0*k", 1.5}}) {
    CAPTURE(named);
    Problem p = scene(named, k);
    p.formulation = "baumgarte";
    const GradientResult r = gradient(p, "idas-adjoint", p.parameters.values());
    Problem other = scene(plain, 1);
    other.formulation = "index1";
    const GradientResult right = gradient(other, "cvodes-forward", other.parameters.values());
    CHECK(std::abs(r.psi - right.psi) <= 1e-8);
    CHECK(std::abs(r.gradient[0] - right.gradient[0]) <= 1e-8);
  }
}

// Fixed steps are cut at these places, so that what they leave falls with the square of the step, 256 times over 16, by
// a factor that the cut's place in its step decides (1 to 3); uncut it falls with the step, 16 times.
TEST_CASE("moved places: fixed steps", "[laws]") {
  const auto errors = [](const std::string& name, double step, const std::vector<double>& right) {
    // The mass starts elsewhere, which these derivatives do not see.
    Problem p = problem_of_case(
        name, name == "moved_step" ? std::vector<std::string>{"point.P.x_m=0.05"} : std::vector<std::string>{});
    p.formulation = "index3";
    p.solver.integrator = "fixed";
    p.solver.step_s = step;
    const GradientResult r = gradient(p, "discrete-adjoint", p.parameters.values());
    std::vector<double> off;
    for (std::size_t j = 0; j < right.size(); ++j) off.push_back(std::abs(r.gradient[j] - right[j]));
    return off;
  };
  for (const auto& [name, step, right] : {std::tuple<const char*, double, std::vector<double>>{
                                              "moved_step", 1.3 / 350, {-3.9945042557826, -3.6090722073885}},
                                          {"moved_post", 1e-3, {-3.83204e-4}}}) {
    CAPTURE(name);
    const std::vector<double> coarse = errors(name, step, right), fine = errors(name, step / 16, right);
    for (std::size_t j = 0; j < right.size(); ++j) {
      CAPTURE(j, coarse[j], fine[j]);
      CHECK(fine[j] <= coarse[j] / 64);
    }
  }
}
