// The exact derivative of one step of a Radau IIA scheme, forward along columns and transposed; the step itself is held
// fixed (lib/README.md (9)). With J_i = F_y at stage i the stages' derivatives solve
//   A S = (w 1 (x) E) S_0 / h - F_rho,   A = (w (x) E)/h + diag(J_i),
// by iteration with the matrix of one mean Jacobian (stage_matrix.h) until corrections are of rounding size; where the
// Jacobians differ too much for that, A is factored as it is.
#pragma once

#include <memory>
#include <vector>

#include "costate/discrete/radau_step.h"
#include "costate/formulation/parameter_point.h"

namespace costate {

class StageDerivative {
 public:
  StageDerivative(const RadauScheme& scheme, DaeSystem& system);

  /// Of these stages, in the mode in force; `at_stage` is called with the system linearized at each, the last one
  /// first. What the step was factored with serves here again, where that is at hand.
  void linearize(const RadauStages& stages, const std::function<void(int stage)>& at_stage);
  /// x := A^-1 x and A^-T x, all stages one after the other. Throws SolverError where A is singular.
  void solve(double* x) { solve(x, false); }
  void solve_transposed(double* x) { solve(x, true); }
  /// sum over j of w_ij / h: what the beginning weighs in stage i.
  double start_weight(int i) const { return start_weight_[static_cast<std::size_t>(i)] / h_; }
  const std::vector<char>& differential() const { return matrix_.differential(); }
  long whole_factorizations() const { return whole_ ? whole_->counters().factorizations : 0; }

 private:
  void solve(double* x, bool transposed);
  void factor_mean();
  [[noreturn]] void throw_singular(int unknown);
  /// Whether the iteration has converged to x = A^-1 b.
  bool iterate(const double* b, double* x, bool transposed);
  void solve_whole(double* x, bool transposed);
  /// out -= A x or A^T x.
  void subtract_product(const double* x, double* out, bool transposed) const;

  const RadauScheme& scheme_;
  DaeSystem& system_;
  int n_;
  StageMatrix matrix_;            // of the mean Jacobian
  StageMatrix* used_ = nullptr;   // that, or the step's own
  Eigen::VectorXd differential_;  // 1 and 0
  double t_ = 0, h_ = 0;
  std::vector<double> start_weight_, zero_, mean_;
  std::vector<double> at_;  // the first stage, for messages
  std::vector<std::vector<double>> jacobians_;
  std::vector<double> right_, residual_;
  std::vector<std::vector<std::size_t>> kinds_;  // unknowns of one role: corrections are measured against their largest
  bool whole_factored_ = false;
  std::unique_ptr<BlockMatrix> whole_matrix_;
  std::unique_ptr<KluSolver> whole_;
  std::vector<std::vector<int>> blocks_;
};

class RadauTangent {
 public:
  RadauTangent(DaeSystem& system, const RadauScheme& scheme);
  /// Columns s_j (size() entries; the differential ones are read) and psi's derivatives (np) before the step become
  /// those behind it.
  void step(const RadauStages& stages, double* const* s, double* psi);

 private:
  DaeSystem& system_;
  const RadauScheme& scheme_;
  StageDerivative derivative_;
  int n_, np_;
  std::vector<Eigen::MatrixXd> F_rho_;
  std::vector<double> x_, g_, rho_;
};

class RadauAdjoint {
 public:
  RadauAdjoint(DaeSystem& system, const RadauScheme& scheme);
  /// mu behind the step, of all unknowns, becomes mu before it, which algebraic ones have no part in; the gradient
  /// gains the step's own dependence on rho.
  void step_back(const RadauStages& stages, double* mu, double* gradient);

 private:
  DaeSystem& system_;
  const RadauScheme& scheme_;
  StageDerivative derivative_;
  ParameterPoint* parameter_point_;  // null where linearize() has to serve
  int n_;
  std::vector<double> x_, g_, zero_;
};

}  // namespace costate
