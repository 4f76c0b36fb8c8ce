// Linked with the tool's own objects into a second program for the tests of `costate check`: gradient methods, and a
// formulation, with mistakes of the kinds that happen, registered as any is.
#include <limits>

#include "costate/base/error.h"
#include "costate/formulation/formulation.h"
#include "costate/problem/known_error.h"
#include "costate/sensitivity/method.h"

namespace costate {
namespace {

Problem without_confirmation(Problem problem) {
  problem.solver.confirm = false;
  return problem;
}

/// idas-adjoint with a mistake made in its result.
template <class Mistake>
SensitivityMethod method(const char* name, Mistake mistake) {
  return {name, "idas-adjoint with a mistake, for tests", SensitivityMethod::Needs::dae,
          [mistake](const Problem& problem, const std::vector<double>& rho) {
            GradientResult r = gradient(problem, "idas-adjoint", rho);
            mistake(r);
            return r;
          }};
}

const RegisterSensitivityMethod wrong(method("wrong-adjoint", [](GradientResult& r) { r.gradient.back() *= 1.0002; }));
const RegisterSensitivityMethod not_zero(method("not-zero", [](GradientResult& r) { r.gradient.front() += 1e-6; }));
const RegisterSensitivityMethod wrong_cost(method("wrong-cost", [](GradientResult& r) { r.psi *= 1.001; }));
// In the first entry, so that a later good one must not hide it.
const RegisterSensitivityMethod not_a_number(method("nan-adjoint", [](GradientResult& r) {
  r.gradient.front() = std::numeric_limits<double>::quiet_NaN();
}));
const RegisterSensitivityMethod failing(method("failing-adjoint", [](GradientResult&) {
  throw SolverError("The backward run failed at t = 1.25 s, as this test wants.");
}));
// Takes thirty times as many runs as it needs.
const RegisterSensitivityMethod slow({"slow-adjoint", "idas-adjoint many times over, for tests",
                                      SensitivityMethod::Needs::dae,
                                      [](const Problem& problem, const std::vector<double>& rho) {
                                        for (int i = 0; i < 3000; ++i) gradient(problem, "idas-adjoint", rho);
                                        return gradient(problem, "idas-adjoint", rho);
                                      }});
// Has a result at one tolerance alone, of whose error it has found a part.
const RegisterSensitivityMethod once({"once-adjoint", "idas-adjoint at rtol 1e-8 alone, for tests",
                                      SensitivityMethod::Needs::dae,
                                      [](const Problem& problem, const std::vector<double>& rho) {
                                        if (problem.solver.rtol != 1e-8)
                                          throw SolverError("Refused, as this test wants.");
                                        GradientResult r = gradient(without_confirmation(problem), "idas-adjoint", rho);
                                        widen_error(r, problem.parameters, 1e-12, 1e-12);
                                        return r;
                                      }});
const RegisterSensitivityMethod right(method("right-adjoint", [](GradientResult&) {}));

/// Baumgarte's motion with a reaction that is one per cent too large: psi and gradients of a cost of positions are
/// right.
class WrongReaction final : public OdeSystem {
 public:
  WrongReaction(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective,
                const FormulationOptions& o)
      : OdeSystem(mechanism, parameters, objective),
        right_(find_formulation("baumgarte").make_ode(mechanism, parameters, objective, o)) {
    unknowns_ = right_->unknowns();
  }
  MechanismState mechanism_state(double t, const double* y) override {
    MechanismState s = right_->mechanism_state(t, y);
    lambda_.assign(s.lambda, s.lambda + assembly_.m());
    lambda_.back() *= 1.01;
    s.lambda = lambda_.data();
    return s;
  }
  void set_parameters(const double* rho) override {
    OdeSystem::set_parameters(rho);
    right_->set_parameters(rho);
  }
  void rhs(double t, const double* y, double* f) override { right_->rhs(t, y, f); }
  void factor(double t, const double* y, double gamma) override { right_->factor(t, y, gamma); }
  void solve(double* b) override { right_->solve(b); }
  void solve_transposed(double* b) override { right_->solve_transposed(b); }
  long factorizations() const override { return right_->factorizations(); }
  void tangent(double t, const double* y, const double* const* s, double* const* out, int count, bool with) override {
    right_->tangent(t, y, s, out, count, with);
  }
  void tangent_running_cost(double t, const double* y, const double* const* s, double* out, int count) override {
    right_->tangent_running_cost(t, y, s, out, count);
  }
  void tangent_terminal_cost(double t, const double* y, const double* const* s, double* out, int count) override {
    right_->tangent_terminal_cost(t, y, s, out, count);
  }
  void running_cost_gradient(double t, const double* y, double* g) override { right_->running_cost_gradient(t, y, g); }
  void adjoint_rhs(double t, const double* y, const double* mu, double* mup) override {
    right_->adjoint_rhs(t, y, mu, mup);
  }
  void adjoint_integrand(double t, const double* y, const double* mu, double* out) override {
    right_->adjoint_integrand(t, y, mu, out);
  }
  void terminal_adjoint(double t, const double* y, double* mu, double* gradient) override {
    right_->terminal_adjoint(t, y, mu, gradient);
  }
  void start(double t, double* y, Eigen::MatrixXd* y_rho) override { right_->start(t, y, y_rho); }

 private:
  std::unique_ptr<OdeSystem> right_;
  std::vector<double> lambda_;
};

/// Another motion with gradients that are right for it, by a formulation that carries redundant rows.
const RegisterFormulation wrong_motion({
    .name = "wrong-motion",
    .summary = "a penalty that is far too soft, for tests",
    .carries_redundancy = true,
    .default_integrator = "cvodes",
    .make_ode =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          FormulationOptions slack = o;
          slack.set("penalty_alpha", 10);
          return find_formulation("penalty").make_ode(mechanism, parameters, objective, slack);
        },
});
const RegisterFormulation wrong_reaction({
    .name = "wrong-reaction",
    .summary = "baumgarte with a mistake in a reaction, for tests",
    .default_integrator = "cvodes",
    .make_ode =
        [](auto mechanism, auto parameters, auto objective, const FormulationOptions& o) {
          return std::make_unique<WrongReaction>(mechanism, parameters, objective, o);
        },
});

}  // namespace
}  // namespace costate
