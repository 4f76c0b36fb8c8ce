// One step of a Radau IIA scheme on F(t, y, y') = 0 with F_y' = E, 1 for differential unknowns and 0 for algebraic
// ones; psi' = g(t, y) is summed with the scheme's own weights. Newton's iteration runs on one Jacobian of the middle
// of the step (stage_matrix.h), started by extrapolation of the last step's polynomial, until corrections are of
// rounding size: the stages then are those whose derivative radau_derivative.h takes.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "costate/discrete/stage_matrix.h"
#include "costate/discrete/step_estimate.h"
#include "costate/formulation/system.h"

namespace costate {

/// The step as it was taken: stages Y_i, each of `stride` entries, the system's unknowns first.
struct RadauStages {
  double t = 0, h = 0, t_end = 0;
  const double* y = nullptr;
  std::ptrdiff_t stride = 0;
  // Where what the step was factored with is kept: of which matrix, and its numbers.
  StageMatrix* matrix = nullptr;
  const double* factors = nullptr;
};

class RadauStep {
 public:
  /// Writes F(t, y, y') into r, of size() entries without psi. Throws StepError, NotFinite where it has no value.
  using Residual = std::function<void(double t, const double* y, const double* yp, double* r)>;
  /// has_cost: psi is one more entry of every state. atol: of the unknowns; what is far below it need not converge.
  RadauStep(const RadauScheme& scheme, DaeSystem& system, bool has_cost, std::vector<double> atol, Residual residual);
  ~RadauStep();

  const RadauScheme& scheme() const { return scheme_; }
  int size() const { return size_; }

  /// The next step begins at (t, y), size() entries; evaluates there.
  void begin(double t, const double* y);
  /// It begins where the last one has ended.
  void go_on();
  /// The step over h > 0, which ends at t_end; all stages. May be repeated with another h. Throws StepError where
  /// Newton's iteration does not converge.
  void attempt(double h, double t_end);
  /// The stages of a step that was taken are known: the next one goes on from there.
  void resume(const RadauStages& stages);

  double t() const { return t_; }
  double h() const { return h_; }
  double t_end() const { return t_end_; }
  const double* start() const { return y_.data(); }
  const double* end() const { return stage(scheme_.stages - 1); }
  /// Y_i, i < stages; psi's entry is meant in the last one only.
  const double* stage(int i) const { return y_.data() + static_cast<std::ptrdiff_t>(i + 1) * size_; }
  RadauStages stages() const { return {t_, h_, t_end_, stage(0), size_}; }
  /// Of the step just attempted.
  std::shared_ptr<StageMatrix> matrix() const { return matrix_; }
  /// y' at the end of the step, 0 for algebraic unknowns.
  void end_rates(double* yp) const;
  /// y' at its beginning.
  const double* start_rates() const { return rates_.data(); }
  /// Of the step just attempted; its state are the differential unknowns.
  StepEstimate estimate(double rtol, const double* atol);
  /// The power of h of its error.
  int error_order() const { return scheme_.stages + 1; }
  /// By how much the next step may be longer for Newton's iteration to take the least work in all.
  double growth() const;
  /// A first step from (t, y), which has been begun, for a run of `span`.
  double first_step(double rtol, const double* atol, double span) const;

  /// y at t + x h, 0 <= x <= 1, by the polynomial through the stages: of order s only.
  void dense(double x, double* y) const;
  /// By a step that ends there: of the scheme's own order.
  void within(double x, double* y);

  long evaluations() const { return evaluations_; }
  long factorizations() const { return matrix_->factorizations(); }

 private:
  double* stage(int i) { return y_.data() + static_cast<std::ptrdiff_t>(i + 1) * size_; }
  const double* increment(int i) const { return z_.data() + static_cast<std::ptrdiff_t>(i) * n_; }
  double* increment(int i) { return z_.data() + static_cast<std::ptrdiff_t>(i) * n_; }
  /// Z of all stages, at the times `at` of a step of 1 with the increments `from`, from its beginning or from its end;
  /// by the polynomial through its stages and, of differential unknowns, its beginning.
  void extrapolate(const std::vector<double>& from, const std::vector<double>& at, bool from_end, bool start_known);
  /// From the increments that stand as a first guess.
  void finish();
  void factor();
  void iterate();
  /// Y_i and Y'_i of the present increments.
  void form_stage(int i);
  /// The largest correction, against the largest unknown of its role.
  double correction_size(const double* corrections) const;
  void set_sizes();
  void evaluate_start();

  const RadauScheme& scheme_;
  DaeSystem& system_;
  int n_, size_;
  bool has_cost_;
  std::vector<double> atol_;
  Residual residual_;
  std::shared_ptr<StageMatrix> matrix_;
  double t_ = 0, h_ = 0, t_end_ = 0;
  bool known_ = false;            // old_ has the increments of the step before, of old_h_
  bool old_start_known_ = false;  // and they are from its beginning
  double old_h_ = 0;
  std::vector<double> y_, z_, old_, right_, rates_, start_residual_, jacobian_, stage_rates_, sizes_, zero_;
  std::vector<double> costs_;  // g at the beginning and at the stages
  std::vector<double> role_size_;
  CostPace cost_pace_;
  std::unique_ptr<RadauStep> inner_;
  double contraction_ = 0;  // of the last iteration
  long evaluations_ = 0;
};

}  // namespace costate
