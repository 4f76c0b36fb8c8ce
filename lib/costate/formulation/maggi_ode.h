// Maggi's equations as an ordinary differential equation for CVODES (lib/README.md (5)):
//   (y, yd, z)' = (yd, My^-1 R^T (Q - M S c), f), y = B q the independent coordinates, z the states of forces.
// Constraints hold to rounding. Explicit first-order adjoint (mu_y, mu_yd, mu_z). Where the independent coordinates
// come near a singular choice the trajectory jumps to better ones: (B2 q, B2 v, z).
#pragma once

#include <limits>

#include "costate/formulation/maggi_kink.h"
#include "costate/formulation/segmented_system.h"
#include "costate/formulation/stage_adjoint.h"
#include "costate/level/maggi_newton.h"

namespace costate {

class MaggiOde final : public SegmentedOde, public StageAdjoint {
 public:
  MaggiOde(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective);

  bool begins_with_motion() const override { return false; }
  void forget_history() override { level_.forget_history(); }
  MechanismState mechanism_state(double t, const double* y) override;
  bool carries_events() const override { return true; }
  MechanismState kinematic_state(double t, const double* y) override;
  MechanismState look_state(double t, const double* y) override { return level_.look(t, y, y + f_, y + 2 * f_); }
  void rhs(double t, const double* y, double* f) override;
  void factor(double t, const double* y, double gamma) override;
  void solve(double* b) override;
  void solve_transposed(double* b) override;
  long factorizations() const override { return level_.factorizations(); }
  long position_iterations() const override { return level_.position_iterations(); }
  void tangent(double t, const double* y, const double* const* s, double* const* out, int count,
               bool with_parameters) override;
  void tangent_running_cost(double t, const double* y, const double* const* s, double* out, int count) override;
  void tangent_terminal_cost(double t, const double* y, const double* const* s, double* out, int count) override;
  void running_cost_gradient(double t, const double* y, double* g_y) override;
  void adjoint_rhs(double t, const double* y, const double* mu, double* mup) override;
  void adjoint_integrand(double t, const double* y, const double* mu, double* out) override;
  void pull_stage(double t, const double* y, const double* w, double c, double* pulled, double* gradient) override;
  void terminal_adjoint(double t, const double* y, double* mu, double* gradient) override;
  void start(double t, double* y, Eigen::MatrixXd* y_rho) override;

  void adjoint_at(double t, const double* y, const double* w, double* mu, double* gradient) override;
  void spread_start_weights(const StateView& start, const double* mu, double* w_q, double* w_v, double* w_z,
                            double* gradient) override;
  int mode() const override { return level_.chart(); }
  void use_mode(int mode) override;
  void try_step() override { level_.go_back(); }
  bool keeps_branch(double from, double t, const double* y) override;

 protected:
  bool changes_coordinates() const override { return f_ > 0; }
  bool wants_other_coordinates(double t, const double* y) override;
  void cross_event(int event, double t, double* y) override;
  void cross_event_tangent(const Jump& jump, double* const* s, int count) override;
  void cross_event_adjoint(const Jump& jump, double* mu, double* gradient) override;
  void cross_kink(double t, double t_after, double* y) override;
  void cross_kink_tangent(const Jump& before, double t_after, double* const* s, int count) override;
  void cross_kink_adjoint(const Jump& before, double t_after, double* mu, double* gradient) override;
  void change_coordinates(double t, double* y) override;
  void change_coordinates_tangent(const Jump& jump, double* const* s, int count) override;
  void change_coordinates_adjoint(const Jump& jump, double* mu, double* gradient) override;

 private:
  void solve_point(double t, const double* y);
  /// The unknowns, after the chart in force.
  void rename();
  /// cross_event() into this chart, or -1.
  void cross_event(int event, double t, double* y, int chart);
  void linearize(double t, const double* y);
  /// Pulls a cost back to (y, yd, z) and rho, with mu^T f when mu is given.
  void pull_running(const double* mu);
  void pull_terminal();
  void copy_pulled(double c, double* out) const;
  /// mu of the weights of (q, v, z) in cost_gradient_ at (t, y).
  void pull_weights(double t, const double* y, double* mu, double* gradient);
  void calc_running_gradient();

  double evaluated_at_ = std::numeric_limits<double>::quiet_NaN();  // the right-hand side, last
  MaggiLevel level_;
  MaggiNewton newton_;
  MaggiKink kink_;
  int f_, nz_;
  std::vector<double> y_buffer_, rho_buffer_;
  long cost_gradient_at_ = 0;  // the point that cost_gradient_ belongs to
};

}  // namespace costate
