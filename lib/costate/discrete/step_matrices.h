// The two matrices of a discrete step, on one sparsity pattern with rows and columns (n | nz | m):
//   J  = [[M + G C + B K, -G_z Q_z, Phi_q^T], [-(G f_v + B f_q), I - G_z f_z, 0], [Phi_q, 0, 0]]   the step's own
//   P  = [[M, 0, Phi_q^T], [0, I, 0], [Phi_q, 0, 0]]                                               projections
// with -1/alpha on the diagonal of a row that gives, and -1 of one that is not there (element/switched_rows.h), whose
// multiplier is 0, and -s mu beside it where a contact slides, whose row has Phi_q above alone: neither is symmetric
// then. J's row of what keeps rates alone is Phi_q + B/G Phid_q (stage_rows.h). J multiplies corrections of (a*, f*,
// lambda*) and tends to P for small steps. Each is factored once a step; the factors serve the step, its tangent and,
// transposed, its adjoint. They can be saved and brought back.
#pragma once

#include <memory>

#include "costate/assembly/assembly.h"
#include "costate/discrete/alpha_coefficients.h"
#include "costate/discrete/stage_rows.h"
#include "costate/linear/klu_solver.h"

namespace costate {

class StepMatrices {
 public:
  explicit StepMatrices(const Assembly& assembly);
  StepMatrices(const StepMatrices&) = delete;
  StepMatrices& operator=(const StepMatrices&) = delete;

  int size() const { return size_; }
  /// From the assembly's M, phi_q, K, C, Q_z, f_q, f_v, f_z and the rows at the stage. Return -1, or a column found
  /// (numerically) dependent.
  [[nodiscard]] int factor_step(const Assembly& assembly, const StepCoefficients& c, const StageRows& rows);
  /// From the assembly's M and phi_q, and the directions in which contacts slide.
  [[nodiscard]] int factor_projection(const Assembly& assembly, const StageRows& rows);

  void solve_step(double* b, int columns = 1) { step_.solve(b, columns); }
  void solve_step_transposed(double* b) { step_.solve_transposed(b); }
  /// P with J above in the rows of slips in space, which the projection of velocities leaves alone.
  void solve_velocities(double* b, int columns = 1) {
    keeps_slips_ ? velocities_->solve(b, columns) : projection_.solve(b, columns);
  }
  void solve_velocities_transposed(double* b) {
    keeps_slips_ ? velocities_->solve_transposed(b) : solve_projection_transposed(b);
  }
  void solve_projection(double* b, int columns = 1) { projection_.solve(b, columns); }
  void solve_projection_transposed(double* b) { symmetric_ ? projection_.solve(b) : projection_.solve_transposed(b); }

  long step_factorizations() const { return step_.counters().factorizations; }
  long projection_factorizations() const { return projection_.counters().factorizations; }

  /// Keeps both factorizations, without allocating. The pivot orders stay with the solvers.
  struct Saved {
    long step_order = -1, projection_order = -1;
  };
  std::size_t saved_size() const { return step_.saved_size() + projection_.saved_size(); }
  Saved save(double* to) const;
  /// False when the pivot order has been discarded since, and where contacts may slide in space.
  [[nodiscard]] bool restore(const Saved& saved, const double* from);
  void keep_pivot_orders(int at_most) {
    step_.keep_pivot_orders(at_most);
    projection_.keep_pivot_orders(at_most);
  }

 private:
  /// -1 for each row that is not there, -s mu for each that slides.
  enum class Of { step, projection, velocities };
  void add_corner(const Assembly& assembly, const StageRows& rows, Of of);

  int square_ = 0, force_state_ = 0, transposed_ = 0, state_force_ = 0, state_state_ = 0, identity_ = 0, jacobian_ = 0;
  int corner_ = -1;
  SparsePattern corner_pattern_;
  BlockMatrix matrix_;
  std::vector<double> corner_values_;
  int size_;
  bool states_, symmetric_;
  KluSolver step_, projection_;
  std::unique_ptr<KluSolver> velocities_;  // of mechanisms whose contacts may slide in space
  bool keeps_slips_ = false;
};

}  // namespace costate
