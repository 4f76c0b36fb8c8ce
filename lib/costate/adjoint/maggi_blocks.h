// Maggi's equations at one point of a motion (lib/README.md (5.9)), written out as matrices: the motion itself,
// and what its derivatives are in independent coordinates y = B q (z are the force states):
//   dq = R dy + Nr drho,   dv = R dyd + D dy + Vr drho,   da = R dydd + E dyd + A dy + Ar drho,
//   R^T dR1 = My dydd + Cy dyd + Ky dy - Qz dz + Fy drho,   df = Zv dyd + Zq dy + f_z dz + Zr drho
// with [Phi_q; B]^-1 = [S R] and
//   D = R' = -S Phid_q R,   E = 2 D,   A = R'' = -S (Phidd_q R + 2 Phid_q D),
//   Nr = -S Phi_rho,   Vr = -S (Phid_rho + Phid_q Nr),   Ar = -S (Phidd_rho + Phidd_q Nr + 2 Phid_q Vr).
// Where rows come and go (level/maggi_rows.h) the columns of places are S e of their rows in dq = Rp dy, 0 in R, and
// R_r stands for R in front of the equations of motion and of multipliers. A choice of B is a chart; charts keep their
// numbers. All this is for the hand-derived tangents and adjoints, which are to be independent of the systems that the
// integrators see: what both share is the factorization of [Phi_q; B] alone.
#pragma once

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/LU>
#include <memory>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/level/maggi_charts.h"
#include "costate/objective/output.h"

namespace costate {

class MaggiBlocks {
 public:
  explicit MaggiBlocks(Assembly& assembly);

  int freedoms() const { return f_; }
  int chart() const { return chart_; }
  void use_chart(int chart) { chart_ = chart; }
  const std::vector<int>& independent() const { return now().rates->independent(); }
  /// The rows whose places stand behind them.
  const std::vector<int>& places() const { return now().rows.closed; }
  /// Whether rows are left out that depend on others, so that the multipliers here are some of many.
  bool shares() const { return !now().rows.left_out.empty(); }
  /// The number of the best chart at (t, q, v), of the rows that z has.
  int best_chart(const StateView& s);
  /// Whether a chart is of the rows that z has.
  bool has_rows(int chart, const double* z);
  /// How far the chart is from the best one at (t, q, v, z): 1 is best, infinite is singular, or of other rows.
  double chart_ratio(int chart, const StateView& s);

  /// The motion and all blocks but those of parameters at (t, q, v, z) in the chart in force.
  void evaluate(const StateView& s);
  /// Afterwards: the point with its accelerations and multipliers.
  StateView state() const;
  /// Afterwards: R', R'' and those of R_r along the motion; R_r'' only where nothing slides in space.
  void evaluate_rates();
  /// Nr, Vr, Ar, Fy, Zr from the assembly's parameter columns there.
  void evaluate_parameters(const Assembly::ParameterColumns& c);

  Eigen::MatrixXd R, D, A;                 // n x f
  Eigen::MatrixXd Rp, E;                   // with places; E = 2 R' without them
  Eigen::MatrixXd Rr;                      // R_r
  Eigen::MatrixXd R1, R2, Rr1, Rr2;        // of evaluate_rates()
  Eigen::MatrixXd My, Cy, Ky, Qz, Zv, Zq;  // f x f, Qz f x nz, Zv and Zq nz x f
  Eigen::MatrixXd F, Nr, Vr, Ar, Fy, Zr;   // F = R1_rho: n x np; Fy f x np, Zr nz x np
  Eigen::MatrixXd Lr;                      // m x np: lambda_rho of friction at fixed normal forces
  /// My^-1 b
  Eigen::MatrixXd solve_mass(const Eigen::MatrixXd& b) const {
    if (b.size() == 0) return b;  // no motion, or no force state: nothing that Eigen should solve
    if (slides()) return slip_factor_.solve(b);
    return mass_factor_.solve(b);
  }
  /// My^T, to the bit My where nothing slides.
  Eigen::MatrixXd mass_transposed() const { return slides() ? Eigen::MatrixXd(My.transpose()) : My; }
  /// My^-T b, which is another where contacts slide
  Eigen::MatrixXd solve_mass_transposed(const Eigen::MatrixXd& b) const {
    if (b.size() == 0 || !slides()) return solve_mass(b);
    return slip_factor_.transpose().solve(b);
  }

  /// The multipliers' change with dR1 at constant multipliers: dlambda = -S^T dR1 in the range of Phi_q. With
  /// redundant rows the least norm moves out of it, see add_null_weight().
  Eigen::MatrixXd multiplier_change(const Eigen::MatrixXd& dR1);
  /// What friction changes by beyond that, at fixed normal forces, after evaluate_parameters(): Lr, and of a direction
  /// that turns (slip_directions.h).
  Eigen::MatrixXd friction_change(const Eigen::MatrixXd& dq, const Eigen::MatrixXd& dv) const;
  /// What the weights y of multipliers give beyond that with redundant rows: they move by
  /// -(1 - Phi_q S) dPhi_q u, u = (X^T X)^-1 (M a - Q), X = [Phi_q; B]; added to the weights of dq and drho.
  void add_null_weight(const Eigen::VectorXd& y, Eigen::VectorXd& q, Eigen::VectorXd& rho);

  /// The gradient of a cost in the independent variables.
  struct Reduced {
    Eigen::VectorXd y, yd, ydd, z, rho;
  };
  /// Accelerations remain variables; multipliers do not. With parameters after evaluate_parameters() only.
  Reduced reduce(const ScalarGradient& g, bool with_parameters);
  /// The same with accelerations eliminated by the equations of motion.
  Reduced reduce_and_eliminate(const ScalarGradient& g);

  /// b := [M, Phi_q^T; Phi_q, 0]^-1 b (n + m entries) at the evaluated positions, with the assembly's mass matrix
  /// there; of the multipliers of redundant rows those of least norm.
  void solve_impulses(double* b);

  /// S c for m rows c.
  Eigen::MatrixXd times_S(const Eigen::MatrixXd& c);
  long factorizations() const;

 private:
  const MaggiCharts::Chart& now() const { return charts_[chart_]; }
  bool slides() const { return now().forces != nullptr; }
  MaggiChart& reactions() const { return now().reactions(); }
  Eigen::MatrixXd null_space(MaggiChart& X) const;
  /// S c, or S_r c.
  static Eigen::MatrixXd times_S(MaggiChart& X, const Eigen::MatrixXd& c);
  [[noreturn]] void singular(const char* what) const;

  Assembly& assembly_;
  int n_, m_, f_, nz_;
  MaggiCharts charts_;
  std::vector<int> switched_;  // rows that come and go
  int chart_ = 0;
  std::vector<double> weight_;  // of coordinates, for the choice
  Eigen::LLT<Eigen::MatrixXd> mass_factor_;
  Eigen::PartialPivLU<Eigen::MatrixXd> slip_factor_;
  std::vector<double> reactions_;        // Phi_r
  std::vector<double> slip_q_, slip_v_;  // of friction in space, or empty
  double t_ = 0;
  Eigen::VectorXd q_, v_, a_, lambda_, z_;
  Eigen::VectorXd normal_;  // u, with redundant rows
};

/// A x for a matrix with values on a pattern, and A^T x.
Eigen::MatrixXd times(const SparsePattern& A, const std::vector<double>& values, const Eigen::MatrixXd& x);
Eigen::MatrixXd transposed_times(const SparsePattern& A, const std::vector<double>& values, const Eigen::MatrixXd& x);

}  // namespace costate
