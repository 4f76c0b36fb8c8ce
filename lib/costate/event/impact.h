// Impacts of rigid contacts: the jump u = v+ - v- of the velocities, with the impulses P of the constraints and p of
// the contacts' rows r(q), one J_i = r_i,q each (element/unilateral_force.h):
//   M u + Phi_q^T P - J^T p = 0,   Phi_q u = 0,   J_i u + f_i J_i v- = 0,   f_i = 1 + e_i of a gap that strikes, else 1
// where a contact slides behind the impact p_t + s mu p_n = 0 in place of the row along the ground, in space of both
// with s = w/|w|, w = J_t v+, and where an impulse is given p_n = g in place of the gap's. By the formulation's own
// balance of impulses, bordered, and with the exact derivatives of u (lib/README.md (19)).
#pragma once

#include <Eigen/Core>
#include <cmath>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/assembly/variation.h"
#include "costate/element/unilateral_force.h"
#include "costate/level/impulse_balance.h"

namespace costate {

/// A row that takes part: of a contact that strikes with restitution, or at rest behind the impact.
struct ImpactRow {
  const Force* force = nullptr;
  const UnilateralForce* contact = nullptr;
  int row = 0;           // of the contact's own
  bool bounces = false;  // whether its speed is given back by its restitution
  bool rests = false;    // whether it has no speed before the impact: what it has is drift, and stays, f = 0
};

/// A row in force, and by which equation.
struct ActiveRow {
  enum class Law { held, slides, given };
  int row = 0;  // of those of prepare()
  Law law = Law::held;
  double direction = 0;  // of sliding, with p_t = -direction mu p_n
  double given = 0;      // impulse
  int component = 0;     // of the direction in space, 1 or 2: it turns with the speed behind the impact
  /// The contact's gap is the row in force as many before one that slides.
  std::size_t from_gap() const { return component == 2 ? 2 : 1; }
};

class Impact {
 public:
  Impact(Assembly& assembly, ImpulseBalance& balance) : assembly_(assembly), balance_(balance) {}

  ImpulseBalance& balance() { return balance_; }

  /// The rows in play at (t, q, v, z) before an impact; z with all contacts open. solve() is for some of them.
  void prepare(const StateView& before, std::vector<ImpactRow> rows);
  /// u, P and p with these rows in force.
  void solve(const std::vector<ActiveRow>& active);
  const std::vector<ActiveRow>& active() const { return active_; }
  const ImpactRow& row(int i) const { return rows_[static_cast<std::size_t>(i)].of; }
  /// J K^-1 J^T of the rows in play, K = [M Phi_q^T; Phi_q 0].
  const Eigen::MatrixXd& response() const { return W_; }
  const double* u() const { return solution_.data(); }
  /// Of row i, active or not: p_i, J_i v- and J_i (v- + u).
  double impulse(int i) const { return impulse_[static_cast<std::size_t>(i)]; }
  double speed_before(int i) const { return before_rate_[static_cast<std::size_t>(i)]; }
  double speed_after(int i) const { return after_rate_[static_cast<std::size_t>(i)]; }
  /// By how much the speed of a row that is held changes.
  double change_of_gap(int i) const { return -rows_[static_cast<std::size_t>(i)].factor * speed_before(i); }
  /// By how much J_i u + f_i J_i v- misses zero, as it may where rows depend on each other.
  double misses(int i) const {
    const double factor = rows_[static_cast<std::size_t>(i)].factor;
    return std::abs(speed_after(i) - speed_before(i) + factor * speed_before(i));
  }
  /// What the impact takes from the kinetic energy [J]: p^T (J v- + J v+)/-2 where constraints do not move.
  double energy_lost();

  /// The derivatives of u at what solve() found; `columns` with those by parameters. Throws SolverError where a slip in
  /// space has no direction, or more than one in the end.
  void linearize(bool columns);
  /// u along (dq, dv), a change of the parameters and dt, added to du (n). `given`: the changes of given impulses, one
  /// an active row; `dp` := those of the impulses, `dP` := those of the constraints'.
  void tangent(const double* dq, const double* dv, const Eigen::VectorXd& drho, double dt, double* du,
               const Eigen::VectorXd* given = nullptr, Eigen::VectorXd* dp = nullptr, Eigen::VectorXd* dP = nullptr);
  /// For weights w of u, and w_p of the impulses of the active rows: those of q and v are added, and the gradient's;
  /// returns that of t. `by_given` := those of given impulses.
  double adjoint(const double* w, double* w_q, double* w_v, double* gradient, const Eigen::VectorXd* w_p = nullptr,
                 Eigen::VectorXd* by_given = nullptr);
  /// The changes along d, whose parameters change by drho and given impulses by `given`, of what adjoint() finds at
  /// fixed w and w_p: those of q, v and the parameters are added, that of t is returned, `by_given` := those of its own
  /// (event/impact_second_terms.cpp).
  double gradient_change(const double* w, const Variation& d, const Eigen::VectorXd& drho, double* w_q, double* w_v,
                         double* gradient, const Eigen::VectorXd* w_p = nullptr, const Eigen::VectorXd* given = nullptr,
                         Eigen::VectorXd* by_given = nullptr);
  /// What it takes is compared to this: the sum of |p| (|J v-| + |J v+|) [J].
  double energy_scale() const;

 private:
  struct Row {
    ImpactRow of;
    std::vector<double> J;        // of the element's coordinates
    Eigen::MatrixXd H;            // r_qq
    std::vector<int> parameters;  // numbers of the element that are some
    Eigen::MatrixXd J_p;          // of these
    double factor = 1;            // f_i
  };
  void evaluate(Row& row, bool second);
  double along(const Row& row, const double* x) const;  // J x
  const Row& row_of(const ActiveRow& a) const { return rows_[static_cast<std::size_t>(a.row)]; }
  double friction(const Row& row) const;
  /// f_i of its speed before the impact; 1 of what slides, whose law has the speed behind it.
  double speed_factor(const ActiveRow& a) const { return a.law == ActiveRow::Law::slides ? 1 : row_of(a).factor; }
  /// p_n of what slides, the active row a.
  double gap_impulse(std::size_t a) const { return impulse(active_[a - active_[a].from_gap()].row); }
  /// The columns by which row i's friction coefficient is a parameter.
  const std::vector<std::pair<int, double>>& friction_columns(const Row& row) const;
  /// What the direction of a slip in space adds to active_W_ and speeds_, at what solve() found.
  void turn_slips();
  /// Of the active rows, that laws of impulses stand beside those of speeds in their unit, whatever the masses: else
  /// one of them would be rounding.
  Eigen::VectorXd row_scales() const;
  /// [u; P; p] of a right-hand side (n + m; active rows), in place.
  void solve_bordered(std::vector<double>& b, Eigen::VectorXd& c);
  /// The same with the transposed equations: the multipliers of the balance and of the laws of the rows.
  void solve_bordered_transposed(std::vector<double>& s, Eigen::VectorXd& y);
  double factor(const ImpactRow& r) const;

  Assembly& assembly_;
  ImpulseBalance& balance_;
  StateView before_;
  std::vector<Row> rows_;
  std::vector<ActiveRow> active_;
  std::vector<std::vector<double>> response_;  // KKT^-1 [J_i^T; 0]
  // J KKT^-1 J^T; B and E of the rows in force, E J u + B p = c with J u where p = 0: 1 of what is held, of a slip in
  // space mu p_n (1 - s s^T)/|w|.
  Eigen::MatrixXd W_, active_W_, speeds_;
  std::vector<double> solution_, impulse_, before_rate_, after_rate_, after_;
  std::vector<double> hessian_, phid_q_, phid_t_;
  Eigen::MatrixXd force_, phid_;
};

}  // namespace costate
