// Radau IIA: the tables of the schemes, and exact derivatives of the steps that a run took, in every formulation that
// has a residual.
// What is asked of them, and to what tolerances: runge_kutta_gradients.h.
#include <fmt/format.h>
#include <support/models.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/discrete/radau_step.h"
#include "costate/integrator/runge_kutta_run.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/method.h"
#include "runge_kutta_gradients.h"
#include "support/paths.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;

namespace {

std::vector<std::string> with_residual() {
  std::vector<std::string> r;
  for (const auto& f : formulations())
    if (f.make_dae) r.push_back(f.name);
  return r;
}

std::vector<std::string> radau_names() {
  std::vector<std::string> r;
  for (const auto& s : radau_schemes()) r.push_back(s.name);
  return r;
}

/// psi over the steps that a run at the problem's own parameters takes.
class HeldStages {
 public:
  explicit HeldStages(const Problem& problem) : problem_(problem), system_(problem.make_dae()) {
    const auto rho = problem.parameters.values();
    system_->set_parameters(rho.data());
    RadauRun run(*system_, problem.solver, {}, StartDerivative::none);
    scheme_ = &run.scheme();
    atol_ = run.absolute_tolerances();
    run.follow({[&](const RadauStages& s) { steps_.push_back(s); }, {}});
    run.advance(problem.solver.t_end);
    REQUIRE(run.counters().jumps == 0);
  }
  double psi(const std::vector<double>& rho) {
    system_->set_parameters(rho.data());
    const bool cost = system_->has_running_cost();
    RadauStep step(*scheme_, *system_, cost, atol_,
                   [&](double t, const double* y, const double* yp, double* r) { system_->residual(t, y, yp, r); });
    std::vector<double> y(static_cast<std::size_t>(step.size()), 0), yp(y);
    system_->start(problem_.solver.t_start, y.data(), yp.data(), nullptr, nullptr);
    step.begin(problem_.solver.t_start, y.data());
    for (const RadauStages& s : steps_) {
      if (s.t > problem_.solver.t_start) step.go_on();
      step.attempt(s.h, s.t_end);
    }
    return (cost ? step.end()[system_->size()] : 0) + system_->terminal_cost(problem_.solver.t_end, step.end());
  }

 private:
  const Problem& problem_;
  std::unique_ptr<DaeSystem> system_;
  const RadauScheme* scheme_ = nullptr;
  std::vector<double> atol_;
  std::vector<RadauStages> steps_;
};

}  // namespace

TEST_CASE("Radau IIA: the tables meet the conditions of collocation, quadrature and transformation") {
  REQUIRE(radau_schemes().size() == 3);
  for (const RadauScheme& r : radau_schemes()) {
    CAPTURE(r.name);
    const int s = r.stages;
    CHECK(r.order == 2 * s - 1);
    CHECK(r.c.back() == 1);
    // sum of b_i c_i^(k-1) = 1/k up to the order; rounding of s terms of size 1.
    for (int k = 1; k <= r.order; ++k) {
      double sum = 0;
      for (int i = 0; i < s; ++i) sum += r.weight(i) * std::pow(r.c[static_cast<std::size_t>(i)], k - 1);
      CHECK(std::abs(sum - 1.0 / k) <= 4e-16 * s);
    }
    // w = T diag(shift) T^-1, within rounding times the condition of T, some 1e3 at most.
    Eigen::MatrixXd w = Eigen::MatrixXd::Zero(s, s);
    for (std::size_t k = 0; k < r.shift.size(); ++k) {
      const auto j = static_cast<Eigen::Index>(k);
      const double twice = r.shift[k].imag() == 0 ? 1 : 2;
      w += twice * (r.shift[k] * r.t.col(j) * r.t_inverse.row(j)).real();
    }
    CHECK((w - r.w).cwiseAbs().maxCoeff() <= 1e-12 * r.w.cwiseAbs().maxCoeff());
    CHECK((r.w * r.a - Eigen::MatrixXd::Identity(s, s)).cwiseAbs().maxCoeff() <= 1e-12);
    // The estimate is that of a formula of order s: polynomials y' of degree s - 1 have none.
    for (int k = 0; k < s; ++k) {
      double sum = k == 0 ? r.error[0] : 0;
      for (int i = 0; i < s; ++i)
        sum += r.error[static_cast<std::size_t>(i) + 1] * std::pow(r.c[static_cast<std::size_t>(i)], k);
      CHECK(std::abs(sum) <= 1e-13);
    }
  }
}

TEST_CASE("Radau IIA: adjoint and tangent agree to rounding, in every formulation") {
  for (const std::string& formulation : with_residual())
    for (const auto& scheme : radau_schemes())
      for (const auto& model : {five_bar(), kitchen_sink(), pendulum(1, 2), free_flight()}) {
        CAPTURE(formulation, scheme.name, model.name);
        // Tolerances so loose that the steps' own errors are large: the gradient is that of the steps all the same.
        // Maggi's positions are solved for to rounding from the last evaluation's, which may be the tangent's.
        check_transposed(on_scheme(model, formulation, scheme.name, 1e-4, std::min(model.t_end, 0.5)), 1e-12);
      }
}

TEST_CASE("Radau IIA: the gradient is that of psi over the same steps") {
  int asked = 0, held = 0;
  for (const std::string& formulation : with_residual())
    for (const auto& scheme : radau_schemes())
      for (const auto& [model, t_end] : {std::pair{five_bar(), 1.0}, {kitchen_sink(), 0.1}, {pendulum(1, 2), 0.5}}) {
        // The one with many parameters where terms differ: exact constraints at their own level, and a weight.
        const bool many = model.all_parameters().size() > 20;
        if (many && (scheme.stages != 3 || (formulation != "index2" && formulation != "penalty"))) continue;
        CAPTURE(formulation, scheme.name, model.name);
        ++asked;
        held += check_over_held_steps<HeldStages>(on_scheme(model, formulation, scheme.name, 1e-4, t_end)) ? 1 : 0;
      }
  CHECK(5 * held >= 4 * asked);  // but for some of Maggi's
}

TEST_CASE("Radau IIA: at tight tolerances the gradient is that of the motion") {
  for (const char* formulation : {"index2", "baumgarte"})
    for (const char* scheme : {"radau5", "radau9"}) {
      Problem p = on_scheme(kitchen_sink(), formulation, scheme, 1e-10, 0.5);
      const auto rho = p.parameters.values();
      const GradientResult discrete = gradient(p, "discrete-adjoint", rho);
      p.formulation = "baumgarte";
      p.solver.rtol = 1e-11;
      p.solver.integrator.clear();
      const GradientResult other = gradient(p, "idas-adjoint", rho);
      CAPTURE(formulation, scheme);
      // Errors are some 100 rtol.
      CHECK(discrete.psi == Approx(other.psi).epsilon(1e-8));
      CHECK(apart_in_scales(discrete.gradient, other.gradient, p) <= 1e-7);
    }
}

TEST_CASE("Radau IIA: steps that do not fit are taken again") {
  for (const char* formulation : {"baumgarte", "index2", "maggi-implicit"})
    for (const auto& scheme : radau_schemes()) {
      CAPTURE(formulation, scheme.name);
      // On this one Maggi changes its coordinates.
      check_computed_again(on_scheme(pendulum(1, 2), formulation, scheme.name, 1e-6), 0.002);
    }
}

TEST_CASE("Radau IIA: factors from the way forward serve the way back") {
  // A net of springs, whose factors have many entries and are kept; tangents have those of the mean Jacobian.
  constexpr int size = 7;
  std::string text = "[gravity]\ny_m_per_s2 = -9.81\n", springs, masses;
  const auto spring = [&](int i, int j, int k, int l) {
    springs += fmt::format(
        "[spring.S{0}{1}{2}{3}]\nfrom = \"P{0}{1}\"\nto = \"P{2}{3}\"\nstiffness_N_per_m = 300\nnatural_length_m = "
        "0.9\n"
        "damping_N_s_per_m = 1\n",
        i, j, k, l);
  };
  for (int i = 0; i < size; ++i)
    for (int j = 0; j < size; ++j) {
      text += fmt::format("[point.P{}{}]\nx_m = {}\ny_m = {}\n{}", i, j, j, -i, i == 0 ? "ground = true\n" : "");
      if (i > 0) masses += fmt::format("[mass.M{0}{1}]\npoint = \"P{0}{1}\"\nmass_kg = 0.2\n", i, j);
      if (j > 0 && i > 0) spring(i, j - 1, i, j);
      if (i > 0) spring(i - 1, j, i, j);
      if (i > 0 && j > 0) spring(i - 1, j - 1, i, j);
    }
  text += masses + springs + "[[cost.running]]\nkind = \"square\"\noutput = \"P66.y\"\n[run]\nt_end_s = 0.5\n";
  Problem p = make_problem(Scene::parse(text, "net.toml"),
                           {"spring.S0010.stiffness_N_per_m", "spring.S5566.natural_length_m", "mass.M66.mass_kg"});
  for (const char* formulation : {"baumgarte", "index2"}) {
    CAPTURE(formulation);
    p.formulation = formulation;
    p.solver.integrator = "radau9";
    p.solver.set_rtol(1e-6);
    p.solver.confirm = false;
    check_transposed(p, 1e-13);
  }
}

TEST_CASE("Radau IIA: steps end at the kinks of drivers, and gradients are carried across") {
  std::vector<std::string> formulations = with_residual();
  // Index 3 is on its own steps.
  std::erase_if(formulations,
                [](const std::string& f) { return static_cast<bool>(find_formulation(f).make_discrete); });
  check_kinks_met(formulations, {"radau5"});
}

TEST_CASE("Radau IIA: events are met, and what lies between steps is of the steps' own accuracy") {
  check_events_met(radau_names());
  // Samples that no step ends at, against a run of a hundredth of the tolerance.
  Problem q = five_bar().problem("baumgarte", 1e-6);
  const std::vector<double> times = {0.123, 0.777, 1.5, 2.34, 4.321};
  const auto sampled = [&](double rtol) {
    q.solver.rtol = rtol;
    q.solver.integrator = "radau9";
    std::vector<double> x;
    simulate(q, q.parameters.values(), times, [&](const MechanismState& s, System&) { x.push_back(s.q[2]); });
    return x;
  };
  const auto loose = sampled(1e-6), tight = sampled(1e-9);
  for (std::size_t i = 0; i < times.size(); ++i) CHECK(loose[i] == Approx(tight[i]).margin(1e-5));  // 10 rtol
}

TEST_CASE("Radau IIA: what it does not carry is refused by name") {
  Problem p = on_scheme(five_bar(), "maggi", "radau5", 1e-6);
  const auto rho = p.parameters.values();
  CHECK_THROWS_WITH(simulate(p, rho), Contains("maggi"));
  CHECK_THROWS_WITH(gradient(p, "discrete-adjoint", rho), Contains("maggi"));
  p.solver.integrator = "radau";
  CHECK_THROWS_WITH(simulate(p, rho), Contains("Did you mean 'radau"));
}

TEST_CASE("Radau IIA: the instant before something is no step") {
  // A law that begins with the run.
  Problem p =
      make_problem(Scene::load(fmt::format("{}/models/shortest_swing/shortest_swing.toml", COSTATE_SOURCE_DIR)));
  p.formulation = "index2";
  p.solver.rtol = 1e-8;
  const auto rho = p.parameters.values();
  const GradientResult other = gradient(p, "idas-adjoint", rho);
  for (const char* scheme : {"radau5", "radau9"}) {
    p.solver.integrator = scheme;
    const GradientResult r = gradient(p, "discrete-adjoint", rho);
    CAPTURE(scheme);
    // Both errors are some 100 rtol.
    CHECK(r.psi == Approx(other.psi).epsilon(1e-5));
    CHECK(gradient_mismatch(r.gradient, other.gradient, p.parameters).error <= 1e-4);
  }
}
