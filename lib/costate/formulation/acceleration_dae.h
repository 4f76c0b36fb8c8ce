// Acceleration-level formulations as a semi-explicit index-1 DAE for IDAS (lib/README.md (3), (4), (6)):
//   y = (q, v, z, a, lambda), rows: q' - v, v' - a, z' - f, R1, R2.
// Adjoint unknowns in the same layout: (mu_q, mu_v, mu_z, s1, s2).
#pragma once

#include "costate/formulation/consistent_state.h"
#include "costate/formulation/parameter_point.h"
#include "costate/formulation/solved_state.h"
#include "costate/formulation/system.h"
#include "costate/level/acceleration_level.h"

namespace costate {

class AccelerationDae final : public DaeSystem, public SolvedState, public ParameterPoint {
 public:
  AccelerationDae(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective,
                  Stabilization stabilization);

  void forget_history() override {
    level_.forget_history();
    point_.forget();
  }
  MechanismState mechanism_state(double t, const double* y) override { return view(t, y); }
  MechanismState solved_state(double t, const double* y) override;
  void residual(double t, const double* y, const double* yp, double* r) override;
  const SparsePattern& jacobian_pattern() const override { return jacobian_.pattern(); }
  void jacobian(double t, const double* y, const double* yp, double cj, double* values) override;
  void factor(double t, const double* y, const double* yp, double cj) override;
  void solve(double* b) override;
  void solve_transposed(double* b) override;
  long factorizations() const override { return level_.factorizations(); }
  void linearize(double t, const double* y, const double* yp) override;
  void add_product(double c, const double* x, double* out) override;
  void add_transposed_product(double c, const double* x, double* out) override;
  void parameter_columns(Eigen::MatrixXd& F_rho) override;
  void add_parameter_gradient(double c, const double* mu, double* gradient) override;
  void go_to_parameters(double t, const double* y, const double* yp) override;
  void start(double t, double* y, double* yp, Eigen::MatrixXd* y_rho, Eigen::MatrixXd* yp_rho) override;
  void running_cost_gradient(double t, const double* y, double* g_y, double c, double* gradient) override;
  void terminal_cost_gradient(double t, const double* y, double* w_y, double c, double* gradient) override;
  void terminal_adjoint(double t, const double* y, const double* yp, double* mu, double* mup,
                        double* gradient) override;
  bool carries_events() const override { return true; }
  void jump(double t, double* y, double* yp) override;
  void jump_tangent(const Jump& jump, double* const* s, double* const* sp, int count) override;
  void jump_adjoint(const Jump& jump, double* mu, double* mup, double* gradient) override;
  void adjoint_at(double t, const double* y, const double* w, double* mu, double* mup, double* gradient) override;

 private:
  /// The algebraic part of mu, and mu', for the (mu_q, mu_v, mu_z) that mu holds, at the linearized point s.
  void complete_adjoint(const StateView& s, double* mu, double* mup);
  StateView view(double t, const double* y) const { return state_.view(t, y); }
  void place_jacobian();

  AccelerationLevel level_;
  ConsistentState state_;
  BlockMatrix jacobian_;
  struct Blocks {
    int identity_q, q_v, identity_v, v_a, identity_z, z_q, z_v, z_z, K, C, Q_z, M, phi_t, R2_q, R2_v, phi_q, corner;
  } at_{};
  int n_, m_, nz_;
  Assembly::ParameterColumns columns_;
  std::vector<double> reduced_;
  EvaluationPoint point_;  // all of y, where it was linearized
};

}  // namespace costate
