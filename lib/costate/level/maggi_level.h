// The kernel of Maggi's formulations (lib/README.md (5)): positions, velocities, accelerations and multipliers of a
// state in independent coordinates y = B q, and the derivatives of them all.
//   q from Phi(q, t) = 0, B q = y;   v = R yd - S Phi_t;   a = R w + S c,  c = -Phidd at a = 0;
//   lambda = -S^T (M a - Q);   R^T (M a - Q) = 0 determines w = ydd, with the matrix My = R^T M R.
// Since d(R^T) h = R^T dPhi_q^T lambda for any h = M a - Q, the derivative of the last line is R^T times that of
// R1 = M a + Phi_q^T lambda - Q at constant lambda, along the derivatives of q, v and a:
//   [Phi_q; B] dq = [-Phi_rho; dy],  [Phi_q; B] dv = [-(Phid_q dq + Phid_rho); dyd],
//   [Phi_q; B] da = [-(Phidd_q dq + 2 Phid_q dv + Phidd_rho); dw].
// Where contacts slide R_r and S_r of (5.14) stand for R and S there, and multipliers along the ground follow those of
// the gaps; in space K and C hold how they turn (5.15).
//
// Assumes that My is regular (every motion moves some mass). With redundant, consistent constraints the multipliers are
// those of least norm, and parameters must keep the constraints consistent.
#pragma once

#include "costate/assembly/evaluation_point.h"
#include "costate/level/acceleration_level.h"
#include "costate/level/branch_watch.h"
#include "costate/level/maggi_mass.h"
#include "costate/objective/output.h"

namespace costate {

class MaggiLevel {
 public:
  explicit MaggiLevel(Assembly& assembly);

  int freedoms() const { return f_; }

  // Charts keep their numbers until the next start().
  void start(const StateView& s);
  int chart() const { return positions_.chart_index(); }
  void use_chart(int chart);
  /// The coordinates that y consists of, and the rows whose places stand behind them (maggi_rows.h).
  const std::vector<int>& independent() const { return positions_.chart().independent(); }
  const std::vector<int>& places() const { return positions_.rows().closed; }
  /// Behind an event that has left (t, q, v, z): the chart in force is one of the rows that z has, this one unless it
  /// is to be found.
  void enter_rows(const StateView& s, int chart = -1);
  /// How far the chart is from the best one at the solved point: 1 is best, infinite is singular.
  double chart_ratio() { return mass_.chart_ratio(); }
  /// The best chart at the solved point comes into force.
  void change_chart();
  /// Keeps the solved positions as a first guess for times nearby; to be called in order of time.
  void remember();
  /// After solve() and accelerations, of a step since what was remembered last, at t = from: the coordinate that is no
  /// longer on its branch (branch_watch.h), by more than this part of its velocity; or -1.
  int turned(double from, double part) const {
    return branch_.kept() == from ? branch_.turned(state(), part, positions_.sizes(), independent()) : -1;
  }
  void go_back() { positions_.go_back(); }
  double remembered() const { return branch_.kept(); }
  /// Velocities jump here.
  void forget_branch() { branch_.forget(); }
  /// Whether accelerations are known at the solved point.
  bool accelerated() const { return accelerated_.id() != 0; }
  /// Nothing of earlier evaluations plays a part from here on, and a repeated run is the same to the bit.
  void forget_history();

  /// Whether the last solve() was for this time and this chart.
  bool solved_at(double t) const { return point_.id() != 0 && solved_at_ == point_.id() && point_.t() == t; }
  /// Positions and velocities at (t; y, yd, z), all terms of the equations of motion, and the factored chart. Repeated
  /// calls at the same point are free as long as the assembly is there. Throws StepError when the positions cannot be
  /// reached.
  void solve(double t, const double* y, const double* yd, const double* z);
  /// Positions and velocities alone; what comes later is as if this had not been asked for. Valid until the next one.
  StateView look(double t, const double* y, const double* yd, const double* z);
  /// After solve(): w from the equations of motion, and a; or a for a given w.
  void solve_accelerations();
  void set_accelerations(const double* w);
  /// After those: lambda, and motion() = R^T (M a - Q).
  void solve_multipliers();
  /// Derivative blocks at the solved point, multipliers included.
  void linearize();
  /// The identity of the point of the last solve().
  long point() const { return point_.id(); }
  const double* w() const { return w_.data(); }
  const double* motion() const { return reaction_.data() + m_; }
  /// Pointers to the solved point; a and lambda are those of the last calls above.
  StateView state() const;
  /// Whether contacts that are closed hold a body more often than determines who bears what. Then the multipliers above
  /// are some of many, and those of the motion are shared out as in the equations with multipliers
  /// (acceleration_level.h).
  bool shares() const { return !positions_.rows().left_out.empty(); }
  /// The solved point with these; until the next call. And the gradient of a cost at it becomes one of (q, v, z) and
  /// rho alone.
  StateView shared_state();
  void eliminate_shares(ScalarGradient& g);
  /// The equations with multipliers; where rows come and go.
  AccelerationLevel& with_multipliers() { return *with_multipliers_; }

  // Derivatives along columns s_j = (dy, dyd, dz) or, `with_w`, (dy, dyd, dz, dw), plus those with respect to
  // parameter j on request. Afterwards, for column j: dq(j), dv(j), da(j); force(j) = M da + K dq + C dv - Q_z dz
  // (+ F_rho), that is dR1 at constant lambda; state_rate(j) = df.
  void push(const double* const* s, int count, bool with_w, bool with_parameters);
  const double* dq(int j) const { return dq_.data() + static_cast<std::ptrdiff_t>(j) * rows_; }
  const double* dv(int j) const { return dv_.data() + static_cast<std::ptrdiff_t>(j) * rows_; }
  const double* da(int j) const { return da_.data() + static_cast<std::ptrdiff_t>(j) * rows_; }
  const double* force(int j) const { return force_.data() + static_cast<std::ptrdiff_t>(j) * n_; }
  const double* state_rate(int j) const { return rate_.data() + static_cast<std::ptrdiff_t>(j) * nz_; }
  /// out = R_r^T x, out = R y, and b := My^-1 b.
  void project(const double* x, double* out) { mass_.project(x, out); }
  void expand(const double* y, double* out) { mass_.expand(y, out); }
  void solve_mass(double* b) { mass_.solve(point_.t(), b); }
  /// b := [M, Phi_q^T; Phi_q, 0]^-1 b (n + m entries) at the solved positions, with the mass matrix there; of the
  /// multipliers of redundant rows those of least norm.
  void solve_impulses(double* b);

  // The transpose of push(): the gradient of
  //   L = g(q, v, a, lambda, z, rho) - sigma^T R1 + mu_f^T f
  // with respect to (y, yd, w, z) and rho, for sigma in the range of R. The calls come in this order.
  /// Starts with the weights of g; those of the multipliers go over to the others.
  void pull(const ScalarGradient& g, bool with_multipliers);
  /// sigma += R_r x.
  void add_force_weight(const double* x);
  /// sigma += R_r x, x = My^-T (mu + L_w), so that L_w = -mu afterwards: L + mu^T ydd no longer depends on w. `mu` may
  /// be null (zero); x is copied out unless null.
  void eliminate_accelerations(const double* mu, double* x = nullptr);
  void finish_pull(const double* mu_f);  // mu_f may be null
  const double* pulled_y() const { return reaction_q_.data() + m_; }
  const double* pulled_yd() const { return reaction_v_.data() + m_; }
  const double* pulled_w() const { return reaction_a_.data() + m_; }
  const double* pulled_z() const { return g_z_.data(); }
  /// gradient += c (dL/drho - g_rho).
  void add_pulled_parameters(double c, double* gradient);

  Assembly& assembly() { return assembly_; }
  MaggiChart& factored_chart() { return positions_.chart(); }
  /// R and R_r (n x f, columns one after the other) and My (f x f) at the solved point.
  const double* null_space() { return mass_.null_space(); }
  const double* reaction_null_space() { return mass_.reaction_null_space(); }
  bool slides() const { return positions_.slides(); }
  const double* mass_matrix() { return mass_.matrix(point_.t()); }
  /// Whether these are more than should be put into full matrices (maggi_mass.h).
  bool sparse() const { return mass_.sparse(); }

  long factorizations() const { return positions_.factorizations() + (looks_ ? looks_->factorizations() : 0); }
  long position_iterations() const { return positions_.iterations() + (looks_ ? looks_->iterations() : 0); }

 private:
  /// Nothing is known at the point yet.
  void clear();
  /// Of what solves with [Phi_q; B] have left of weights of q: that of a place is that of its row.
  void pull_to_places();

  Assembly& assembly_;
  MaggiPositions positions_;
  MaggiMass mass_;
  std::unique_ptr<AccelerationLevel> with_multipliers_;  // where rows come and go
  BranchWatch branch_;
  int n_, m_, f_, nz_, rows_;

  // The solved point.
  EvaluationPoint point_;  // (y, yd, z), in the chart in force
  long solved_at_ = 0;
  std::vector<double> v_, a_, w_, work_;
  std::unique_ptr<MaggiPositions> looks_;  // at the positions of look()
  EvaluationPoint look_point_;
  std::vector<double> look_v_;
  std::vector<double> reaction_;  // [S^T h; R^T h], h = M a - Q
  std::vector<double> lambda_, normal_;
  EvaluationPoint accelerated_;  // w, at point_
  // What is known there; dynamic_: w is that of the equations of motion.
  bool dynamic_ = false, has_multipliers_ = false;

  // push
  Assembly::ParameterColumns columns_;
  std::vector<double> dq_, dv_, da_, force_, rate_;
  // pull: weights of dq, dv, da, dz; s1 = sigma + S g_lambda; [S^T x; R^T x] of the weights x
  std::vector<double> g_q_, g_v_, g_a_, g_z_, s1_, reaction_q_, reaction_v_, reaction_a_;
  std::vector<double> null_weight_, hessian_, zero_, along_;  // along_: s1 and the cost weigh friction
  std::vector<double> slip_q_, slip_v_;                       // of friction in space (slip_directions.h), or empty
  bool weighs_null_ = false;  // the cost weighs multipliers that redundant rows leave to the least norm
  const double* mu_f_ = nullptr;
};

}  // namespace costate
