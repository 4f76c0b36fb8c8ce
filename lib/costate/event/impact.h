// Impacts of rigid contacts: the jump u = v+ - v- of the velocities, with the impulses P of the constraints and p of
// the contacts' rows r(q), one J_i = r_i,q each (element/unilateral_force.h):
//   M u + Phi_q^T P - J^T p = 0,   Phi_q u = 0,   J_i u + f_i J_i v- = 0,   f_i = 1 + e_i of a gap that strikes, else 1
// by the formulation's own balance of impulses, bordered, and with the exact derivatives of u (lib/README.md (19)).
#pragma once

#include <Eigen/Core>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/element/unilateral_force.h"
#include "costate/event/impulse_balance.h"

namespace costate {

/// A row that takes part: of a contact that strikes with restitution, or at rest behind the impact.
struct ImpactRow {
  const Force* force = nullptr;
  const UnilateralForce* contact = nullptr;
  int row = 0;           // of the contact's own
  bool bounces = false;  // whether its speed is given back by its restitution
};

class Impact {
 public:
  Impact(Assembly& assembly, ImpulseBalance& balance) : assembly_(assembly), balance_(balance) {}

  ImpulseBalance& balance() { return balance_; }

  /// The rows in play at (t, q, v, z) before an impact; z with all contacts open. solve() is for some of them.
  void prepare(const StateView& before, std::vector<ImpactRow> rows);
  /// u, P and p with the rows `active` (indices into those of prepare()) in force.
  void solve(const std::vector<int>& active);
  const double* u() const { return solution_.data(); }
  /// Of row i, active or not: p_i, J_i v- and J_i (v- + u).
  double impulse(int i) const { return impulse_[static_cast<std::size_t>(i)]; }
  double speed_before(int i) const { return before_rate_[static_cast<std::size_t>(i)]; }
  double speed_after(int i) const { return after_rate_[static_cast<std::size_t>(i)]; }
  /// What the impact takes from the kinetic energy [J]: p^T (J v- + J v+)/-2 where constraints do not move.
  double energy_lost();

  /// The derivatives of u at what solve() found; `columns` with those by parameters.
  void linearize(bool columns);
  /// u along (dq, dv), the j-th parameter and dt, added to du (n).
  void tangent(const double* dq, const double* dv, int j, double dt, double* du);
  /// For weights w of u: those of q and v are added, and the gradient's; returns that of t.
  double adjoint(const double* w, double* w_q, double* w_v, double* gradient);

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
  /// [u; P; p] of a right-hand side (n + m; active rows), in place.
  void solve_bordered(std::vector<double>& b, Eigen::VectorXd& c);
  double factor(const ImpactRow& r) const;

  Assembly& assembly_;
  ImpulseBalance& balance_;
  StateView before_;
  std::vector<Row> rows_;
  std::vector<int> active_;
  std::vector<std::vector<double>> response_;  // KKT^-1 [J_i^T; 0]
  Eigen::MatrixXd W_, active_W_;               // J KKT^-1 J^T
  std::vector<double> solution_, impulse_, before_rate_, after_rate_, after_;
  std::vector<double> hessian_, phid_q_, phid_t_;
  Eigen::MatrixXd force_, phid_;
};

}  // namespace costate
