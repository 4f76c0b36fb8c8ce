// The kernel shared by all formulations that solve the constraints at acceleration level (index-1, Baumgarte,
// penalty), as DAE and as ODE (lib/README.md (3), (4)):
//   R1 = M a + Phi_q^T lambda - Q = 0
//   R2 = Phidd + 2 xi omega Phidot + omega^2 Phi - lambda / alpha = 0
// 1/alpha = 0 gives exact constraints (xi = omega = 0: index-1), 1/alpha > 0 the penalty formulation with
// lambda* = alpha (Phidd + ...) kept as an unknown: the saddle form loses no digits to alpha, and redundant rows
// are allowed because the lower right block is regular.
#pragma once

#include <cmath>
#include <memory>

#include "costate/assembly/assembly.h"
#include "costate/assembly/evaluation_point.h"
#include "costate/level/giving_rows.h"
#include "costate/linear/kkt_solver.h"

namespace costate {

struct Stabilization {
  double xi = 0;             // damping ratio
  double omega = 0;          // rad/s
  double inverse_alpha = 0;  // 1/alpha; alpha weighs the constraints against the masses
  /// Augmented Lagrangian: the penalty system is solved again with lambda_i added to its right-hand side until
  /// R2 = lambda_(i+1) - lambda_i = 0, which gives exact constraints and carries redundant rows.
  bool augmented = false;

  /// The factors of Phidot and Phi in R2.
  double by_rate() const { return 2 * xi * omega; }
  double by_value() const { return omega * omega; }
  /// The largest modulus of the roots of s^2 + 2 xi omega s + omega^2.
  double rate() const { return xi > 1 ? omega * (xi + std::sqrt(xi * xi - 1)) : omega; }
  /// R2_rho, m x np, where all rows keep positions.
  Eigen::MatrixXd columns(const Assembly::ParameterColumns& c) const {
    return c.phidd + by_rate() * c.phid + by_value() * c.phi;
  }
  /// For Assembly::add_parameter_gradient(): s1^T R1_rho + s2^T R2_rho - sz^T f_rho. sz may be null.
  Assembly::ParameterWeights weights(const double* s1, const double* s2, const double* sz = nullptr) const {
    Assembly::ParameterWeights w;
    w.force = s1;
    w.row = s2;
    w.c0 = by_value();
    w.c1 = by_rate();
    w.c2 = 1;
    w.state = sz;
    return w;
  }
};

class AccelerationLevel {
 public:
  AccelerationLevel(Assembly& assembly, Stabilization stabilization);

  const Stabilization& stabilization() const { return stabilization_; }
  /// Neither points nor pivots of earlier evaluations play a part from here on.
  void forget_history() {
    point_.forget();
    kkt_solver_->forget_pivots();
    newton_solver_->forget_pivots();
  }

  /// M, Q, Phi_q, ... and a factored KKT matrix [[M, Phi_q^T], [Phi_q, -1/alpha]] at (t, q, v, z).
  void prepare(const StateView& s);
  /// prepare(), then accelerations and multipliers; repeated calls at the same point are free as long as the assembly
  /// is there.
  void solve(const StateView& s);
  /// 1/alpha of row i, and 1 where it is not there (assembly/assembly.h): R2_i = -lambda_i then. Exact constraints have
  /// 0, but for rows of contacts that hold a rigid thing twice where they stick (level/giving_rows.h).
  double inverse_alpha(int i) const {
    if (!assembly_.is_there(i)) return 1;
    return gives(i) ? giving_rows_.inverse_alpha(i) : stabilization_.inverse_alpha;
  }
  /// Whether row i is, or may be, one of those.
  bool gives(int i) const { return giving_rows_.gives(i, assembly_); }
  /// That of row i of index 2's stabilizers, Phi - e gamma = 0, which vanish on the motion, so that e changes nothing:
  /// -1 where no position is kept, and a little, in s, where gaps hold it more often than it takes.
  double stabilizer_corner(int i) const {
    if (!assembly_.is_there(i) || !assembly_.holds_position(i)) return -1;
    return gives(i) ? -kStabilizerGives : 0;
  }
  const GivingRows& giving_rows() const { return giving_rows_; }
  bool has_corner() const { return stabilization_.inverse_alpha != 0 || assembly_.has_switched_rows(); }
  /// -1/alpha of all rows, and -s mu of those along which contacts slide, on corner_pattern().
  const double* corner();
  const SparsePattern& corner_pattern() const { return corner_pattern_; }
  /// out_m += c corner x_m, and that with its transpose.
  void add_corner(double c, const double* x, double* out) const;
  void add_corner_transposed(double c, const double* x, double* out) const;
  /// R2_rho, m x np.
  Eigen::MatrixXd constraint_columns(const Assembly::ParameterColumns& c) const;
  // Accelerations, multipliers and the factored KKT matrix of a point may be kept outside, and brought back for
  // linearize() and solve_kkt() there; the other results of a solve() are not.
  /// Numbers that a record takes; 0 before the first solve().
  std::size_t record_size() const;
  /// Of the last solve().
  void keep_record(double* to, std::size_t size) const;
  /// False when the record's pivot order has been discarded since.
  [[nodiscard]] bool bring_back(const StateView& s, const double* record);
  /// Whether that is the point that was brought back last.
  bool brought_back(const StateView& s);
  /// The identity of (t, q, v, z) of the last prepare() or solve().
  long point() const { return point_.id(); }
  const double* a() const { return solution_.data(); }
  const double* lambda() const { return solution_.data() + assembly_.n(); }
  /// The state with a and lambda of the last solve().
  StateView state() const;

  /// In place, `columns` right-hand sides of n + m entries. The matrix is symmetric but where contacts slide.
  void solve_kkt(double* b, int columns = 1);
  void solve_kkt_transposed(double* b);

  /// The right-hand side of R2 at a = 0: Phidd|_{a=0} + 2 xi omega Phidot + omega^2 Phi, from the last dynamics.
  void calc_constraint_bias(const double* v, double* out) const;
  /// Derivative blocks at (t, q, v, a, lambda, z), R2_q and R2_v among them, with the M and Phi_q that are there. Where
  /// `point` is an identity of all these values, repeated calls are free.
  void linearize(const StateView& s, long point = 0);
  /// The same where solve() was last.
  void linearize() { linearize(state(), point()); }
  /// (3.3): for columns s_j = (S_q, S_v, S_z) of a tangent, x_j = (S_a, S_lambda), n + m entries each and one behind
  /// the other, at the solved and linearized point; with `c` those along its parameters, else at fixed ones.
  void solve_tangent(const double* const* s, int count, const Assembly::ParameterColumns* c, double* x);
  const std::vector<double>& R2_q() const { return r2_q_; }
  const std::vector<double>& R2_v() const { return r2_v_; }

  // Products with the blocks of the last linearize(), x and out in the given layout:
  //   force_rows:      out_n += c (K xq + C xv - Q_z xz)
  //   constraint_rows: out_m += c (R2_q xq + R2_v xv)
  //   state_rows:      out_z += c (f_q xq + f_v xv + f_z xz)
  void add_force_rows(double c, const double* xq, const double* xv, const double* xz, double* out) const;
  void add_constraint_rows(double c, const double* xq, const double* xv, double* out) const;
  void add_state_rows(double c, const double* xq, const double* xv, const double* xz, double* out) const;
  // Their transposes, accumulated into the q, v and z columns.
  void add_transposed(double c, const double* s1, const double* s2, const double* sz, double* oq, double* ov,
                      double* oz) const;
  void add_mass(double c, const double* x, double* out) const;                 // M x
  void add_jacobian(double c, const double* x, double* out) const;             // Phi_q x
  void add_jacobian_transposed(double c, const double* x, double* out) const;  // Phi_q^T x
  // With the rows along which contacts slide, as multipliers act: Psi^T lambda, Psi x.
  void add_reactions(double c, const double* lambda, double* out) const;
  void add_reactions_transposed(double c, const double* x, double* out) const;

  /// Newton matrices of step gamma, reduced to (dv, dz, gamma dlambda):
  ///   A = [[M + gamma C + gamma^2 K, -gamma Q_z, Phi_q^T],
  ///        [-gamma (f_v + gamma f_q), 1 - gamma f_z, 0],
  ///        [Phi_q + gamma R2_v + gamma^2 R2_q, 0, -1/alpha]]
  /// It tends to the KKT matrix for gamma -> 0 and stays well scaled, for |gamma| > 1 by columns of lambda times
  /// gamma^2 (so that it tends to [[K, Phi_q^T], [R2_q, -1/alpha]]). Serves IDA (gamma = 1/cj) and CVODE.
  void factor_newton(double gamma);
  double gamma() const { return gamma_; }
  // The blocks that eliminated unknowns are recovered with, as they were at the last factor_newton().
  struct NewtonBlocks {
    std::vector<double> M, K, phi_q, R2_q, f_q;
  };
  const NewtonBlocks& newton_blocks() const { return newton_blocks_; }
  void solve_newton(double* u);
  void solve_newton_transposed(double* u);
  int newton_size() const { return assembly_.n() + assembly_.nz() + assembly_.m(); }

  long factorizations() const { return kkt_solver_->factorizations() + newton_solver_->counters().factorizations; }

 private:
  /// Augmented Lagrangian: solves without the block -corner that the factored matrix has in its lower right.
  template <class Solve>
  void iterate_multipliers(double* b, int size, double corner, Solve&& solve);
  [[noreturn]] void singular(int column) const;

  Assembly& assembly_;
  Stabilization stabilization_;
  BlockMatrix kkt_, newton_;
  std::unique_ptr<KktSolver> kkt_solver_;
  std::unique_ptr<KluSolver> newton_solver_;
  int kkt_mass_, kkt_jacobian_, kkt_transposed_, kkt_corner_ = -1;
  int newton_square_, newton_force_state_, newton_transposed_, newton_state_force_, newton_state_state_,
      newton_state_identity_, newton_jacobian_, newton_corner_ = -1;
  std::vector<double> solution_;
  std::vector<double> augmented_right_, augmented_last_;
  EvaluationPoint point_;                   // (q, v, z)
  long solved_at_ = 0, stabilized_at_ = 0;  // solution_, R2_q and R2_v
  long brought_back_at_ = 0;
  std::vector<double> r2_q_, r2_v_;
  SparsePattern corner_pattern_;
  std::vector<std::int64_t> corner_diagonal_;
  std::vector<double> corner_;
  static constexpr double kStabilizerGives = 1e-8;
  GivingRows giving_rows_;
  double gamma_ = 0, lambda_scale_ = 1;
  NewtonBlocks newton_blocks_;
};

}  // namespace costate
