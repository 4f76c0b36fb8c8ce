// One step of an explicit Runge-Kutta scheme on y' = f(t, y), psi' = g(t, y): psi is an unknown of its own behind
// those of the system, summed with the scheme's own weights, in the error test like the others.
#pragma once

#include <functional>
#include <vector>

#include "costate/discrete/explicit_scheme.h"
#include "costate/discrete/step_estimate.h"

namespace costate {

/// The step as it was taken: stages Y_i, each of `stride` entries, the system's unknowns first.
struct ExplicitStages {
  double t = 0, h = 0, t_end = 0;
  const double* y = nullptr;
  std::ptrdiff_t stride = 0;
  // What the system has kept of each stage (StageAdjoint), `record` numbers each, or null.
  const double* records = nullptr;
  std::size_t record = 0;
};

class ExplicitStep {
 public:
  /// Writes f(t, y) into the first `unknowns` entries of k and, where `cost` says so, g behind them.
  using Rates = std::function<void(double t, const double* y, double* k, bool cost)>;
  /// has_cost: psi is one more entry of every state and of every k.
  ExplicitStep(const ExplicitScheme& scheme, int unknowns, bool has_cost, Rates rates);

  /// From here on: keep(i) after the evaluation at stage i <= stages, which is the first one of the next step.
  using Keep = std::function<void(int stage)>;
  void keep(Keep keep) { keep_ = std::move(keep); }

  const ExplicitScheme& scheme() const { return scheme_; }
  /// Entries of a state, psi included.
  int size() const { return size_; }

  /// The next step begins at (t, y), size() entries; evaluates there.
  void begin(double t, const double* y);
  /// It begins where the last one has ended.
  void go_on();
  /// The step over h > 0, which ends at t_end: all stages, and the evaluation at its end. May be repeated with another
  /// h. t_end is t + h but for rounding, which decides where a law has a kink there; no evaluation is behind it.
  void attempt(double h, double t_end);
  /// Only the stages that its derivative needs, with an evaluation at its beginning; end() is made, too.
  void repeat(double t, const double* y, double h, double t_end);

  double t() const { return t_; }
  double h() const { return h_; }
  double t_end() const { return t_end_; }
  const double* start() const { return stage(0); }
  const double* end() const { return stage(scheme_.stages); }
  /// Y_i, i <= stages; psi's entry is meant in the first and the last one only.
  const double* stage(int i) const { return y_.data() + static_cast<std::ptrdiff_t>(i) * size_; }
  const double* rate(int i) const { return k_.data() + static_cast<std::ptrdiff_t>(i) * size_; }
  /// Of the step just attempted.
  StepEstimate estimate(double rtol, const double* atol);
  /// The power of h of its error, and y' at the step's beginning.
  int error_order() const { return scheme_.order; }
  const double* start_rates() const { return rate(0); }
  ExplicitStages stages() const { return {t_, h_, t_end_, y_.data(), size_}; }
  /// |h lambda| of the fastest decay that the last two stages have seen.
  double stiffness() const;
  /// A first step from (t, y), which has been begun, for a run of `span`.
  double first_step(double rtol, const double* atol, double span);

  /// y at t + x h, 0 <= x <= 1, size() entries.
  void dense(double x, double* y);
  void within(double x, double* y) { dense(x, y); }

  /// Evaluations so far, without those of the dense output.
  long evaluations() const { return evaluations_; }

 private:
  /// Of the combined errors, by root mean square over some entries, in tolerances.
  double error_of(int from, int count, double rtol, const double* atol) const;
  double* stage(int i) { return y_.data() + static_cast<std::ptrdiff_t>(i) * size_; }
  double* rate(int i) { return k_.data() + static_cast<std::ptrdiff_t>(i) * size_; }
  void form_stage(int i, double h, int entries);
  void evaluate(int i);
  /// out := h times the sum of weights.
  void combine(const std::vector<double>& weights, double* out) const;

  const ExplicitScheme& scheme_;
  int unknowns_, size_;
  bool has_cost_;
  Rates rates_;
  Keep keep_;
  struct Term {
    int of;
    double a;
  };
  std::vector<std::vector<Term>> rows_;  // the entries of a that are not zero
  std::vector<char> needs_cost_;         // whether psi or its estimates weigh the stage
  double t_ = 0, h_ = 0, t_end_ = 0;
  bool dense_ready_ = false;
  std::vector<double> y_, k_, dense_;
  std::vector<double> error_, error_low_;  // the scheme's estimates, error_low_ where it has one
  CostPace cost_pace_;
  long evaluations_ = 0;
};

}  // namespace costate
