// Maggi's equations in implicit first-order form for IDAS (lib/README.md (5), (6)):
//   (y, yd, z, w) with y = B q the independent coordinates, rows: y' - yd, yd' - w, z' - f, R^T (M a - Q) with a = R w
//   + S c.
// Index 1; constraints hold to rounding. Adjoint unknowns in the same layout: (mu_y, mu_yd, mu_z, mu) with
// My mu = mu_yd + g_w. Changes its independent coordinates as the explicit form does.
#pragma once

#include "costate/formulation/maggi_kink.h"
#include "costate/formulation/segmented_system.h"
#include "costate/formulation/solved_state.h"
#include "costate/level/maggi_newton.h"

namespace costate {

class MaggiDae final : public SegmentedDae, public SolvedState {
 public:
  MaggiDae(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective);

  bool begins_with_motion() const override { return false; }
  void forget_history() override { level_.forget_history(); }
  MechanismState mechanism_state(double t, const double* y) override;
  bool carries_events() const override { return true; }
  MechanismState kinematic_state(double t, const double* y) override;
  MechanismState look_state(double t, const double* y) override { return level_.look(t, y, y + f_, y + 2 * f_); }
  MechanismState solved_state(double t, const double* y) override;
  void solve_unknowns(double t, double* y) override;
  void residual(double t, const double* y, const double* yp, double* r) override;
  const SparsePattern& jacobian_pattern() const override { return jacobian_.pattern(); }
  void jacobian(double t, const double* y, const double* yp, double cj, double* values) override;
  void factor(double t, const double* y, const double* yp, double cj) override;
  void solve(double* b) override;
  void solve_transposed(double* b) override;
  long factorizations() const override { return level_.factorizations(); }
  long position_iterations() const override { return level_.position_iterations(); }
  void linearize(double t, const double* y, const double* yp) override;
  void add_product(double c, const double* x, double* out) override;
  void add_transposed_product(double c, const double* x, double* out) override;
  void parameter_columns(Eigen::MatrixXd& F_rho) override;
  void add_parameter_gradient(double c, const double* mu, double* gradient) override;
  void start(double t, double* y, double* yp, Eigen::MatrixXd* y_rho, Eigen::MatrixXd* yp_rho) override;
  void running_cost_gradient(double t, const double* y, double* g_y, double c, double* gradient) override;
  void terminal_cost_gradient(double t, const double* y, double* w_y, double c, double* gradient) override;
  void terminal_adjoint(double t, const double* y, const double* yp, double* mu, double* mup,
                        double* gradient) override;

  void adjoint_at(double t, const double* y, const double* w, double* mu, double* mup, double* gradient) override;
  void spread_start_weights(const StateView& start, const double* mu, double* w_q, double* w_v, double* w_z,
                            double* gradient) override;
  int mode() const override { return level_.chart(); }
  void use_mode(int mode) override;
  void try_step() override { level_.go_back(); }
  bool keeps_branch(double from, double t, const double* y) override;

 protected:
  bool changes_coordinates() const override { return f_ > 0; }
  bool wants_other_coordinates(double t, const double* y) override;
  void cross_event(int event, double t, double* y, double* yp) override;
  void cross_event_tangent(const Jump& jump, double* const* s, double* const* sp, int count) override;
  void cross_event_adjoint(const Jump& jump, double* mu, double* mup, double* gradient) override;
  void cross_kink(double t, double t_after, double* y, double* yp) override;
  void cross_kink_tangent(const Jump& before, double t_after, double* const* s, double* const* sp, int count) override;
  void cross_kink_adjoint(const Jump& before, double t_after, double* mu, double* mup, double* gradient) override;
  void change_coordinates(double t, double* y, double* yp) override;
  void change_coordinates_tangent(const Jump& jump, double* const* s, double* const* sp, int count) override;
  void change_coordinates_adjoint(const Jump& jump, double* mu, double* mup, double* gradient) override;

 private:
  /// The unknowns, after the chart in force.
  void rename();
  /// cross_event() into this chart, or -1.
  void cross_event(int event, double t, double* y, double* yp, int chart);
  /// The point (t, y) with its w.
  void solve_point(double t, const double* y);
  /// The point (t; y, yd, z) of the unknowns with w from the equations of motion, linearized.
  void linearize_motion(double t, const double* y);
  /// Back to the point of the last linearize(); free when nothing was evaluated since.
  void require_linearized();
  void copy_pulled(double c, double* out) const;
  /// mu, mu' of weights of (q, v, z) at (t, y).
  void pull_weights(double t, const double* y, const ScalarGradient& weights, double* mu, double* mup,
                    double* gradient);
  /// (y, yd, z, w) and its rate from the motion solved for, in another chart, whose places stay.
  void load_state(const StateView& s, double* y, double* yp) const;
  /// mu and mu' from mu_y, mu_yd, mu_z at the linearized point.
  void complete_adjoint(double* mu, double* mup);
  void pull_cost(bool terminal);
  /// dw and the rates of columns (dy, dyd, dz), at the linearized motion.
  void complete_columns(double* const* s, double* const* sp, int count);
  /// For rows of columns (dq, dv, da, df) pushed without dw: dw from the equations of motion, added to da.
  void solve_pushed_accelerations(int j, Eigen::VectorXd& da);

  MaggiLevel level_;
  MaggiNewton newton_;
  MaggiKink kink_;
  int f_, nz_;
  BlockMatrix jacobian_;
  struct Blocks {
    int identity_y, y_yd, identity_yd, yd_w, identity_z, z_y, z_yd, z_z, w_y, w_yd, w_z, w_w, idle;
  } at_{};
  std::vector<double> linearized_at_, motion_;
  std::vector<double> zero_column_;  // the tangent of nothing but the parameters
  std::vector<const double*> zero_columns_;
};

}  // namespace costate
