// The index-3 equations in stabilised index-2 form (Gear, Gupta, Leimkuhler) for IDAS (lib/README.md (2)):
//   y = (q, v, z, a, lambda, gamma), rows: q' - v + Phi_q^T gamma, v' - a, z' - f,
//   R1 = M a + Phi_q^T lambda - Q, Phidot, Phi.  gamma = 0 on the solution.
// Adjoint unknowns in the same layout: (mu_q, P, mu_z, mu, kappa, nu). Terminal values need no time derivative.
#pragma once

#include <memory>

#include "costate/formulation/consistent_state.h"
#include "costate/formulation/parameter_point.h"
#include "costate/formulation/solved_state.h"
#include "costate/formulation/stage_parameters.h"
#include "costate/formulation/system.h"
#include "costate/level/acceleration_level.h"

namespace costate {

class Index2Dae final : public DaeSystem, public SolvedState, public StageParameters, public ParameterPoint {
 public:
  Index2Dae(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective);

  void set_parameters(const double* rho) override;
  void forget_history() override {
    level_.forget_history();
    solver_->forget_pivots();
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
  long factorizations() const override { return solver_->counters().factorizations + level_.factorizations(); }
  void linearize(double t, const double* y, const double* yp) override;
  void add_product(double c, const double* x, double* out) override;
  void add_transposed_product(double c, const double* x, double* out) override;
  void parameter_columns(Eigen::MatrixXd& F_rho) override;
  void add_parameter_gradient(double c, const double* mu, double* gradient) override;
  void go_to_parameters(double t, const double* y, const double* yp) override;
  void take_stage_parameters() override { stage_parameters_ = true; }
  void start(double t, double* y, double* yp, Eigen::MatrixXd* y_rho, Eigen::MatrixXd* yp_rho) override;
  void running_cost_gradient(double t, const double* y, double* g_y, double c, double* gradient) override;
  void terminal_cost_gradient(double t, const double* y, double* w_y, double c, double* gradient) override;
  void terminal_adjoint(double t, const double* y, const double* yp, double* mu, double* mup,
                        double* gradient) override;
  bool carries_events() const override { return true; }
  bool begins_at_step_ends() const override { return m_ > 0; }
  void jump(double t, double* y, double* yp) override;
  void jump_tangent(const Jump& jump, double* const* s, double* const* sp, int count) override;
  void jump_adjoint(const Jump& jump, double* mu, double* mup, double* gradient) override;
  void adjoint_at(double t, const double* y, const double* w, double* mu, double* mup, double* gradient) override;

 private:
  StateView view(double t, const double* y) const { return state_.view(t, y); }
  /// Weights w of (q, v, z) at the linearized level become the adjoint unknowns and their rates; the gradient gains
  /// what the multipliers of the constraints at this instant say.
  void complete_adjoint(const StateView& s, Eigen::VectorXd wq, Eigen::VectorXd wv, const double* wz, double* mu,
                        double* mup, double* gradient);
  /// Whether row i is kept as a position, with a gamma of its own; if not gamma_i = 0.
  bool kept(int i) const { return assembly_.is_there(i) && assembly_.holds_position(i); }
  /// Phi_q of the rows that are kept as positions.
  const std::vector<double>& kept_jacobian();
  // (19.7) of contacts that slide in space, whose rows stand in the place of Phidot = 0.
  void add_slips(double c, const double* xq, const double* xv, double* out) const;
  void add_slips_transposed(double c, const double* x, double* oq, double* ov) const;
  /// gamma at the linearized point, 0 where a row is not kept as a position.
  const double* kept_gamma(const StateView& s);
  void place_jacobian();
  void fill_jacobian(double cj);
  /// values := R J C with the powers of |cj| that make it tend to a regular matrix for cj -> infinity.
  void scale_jacobian(double cj);
  void scale_rows(double* x) const;
  void scale_columns(double* x) const;

  AccelerationLevel level_;  // for starts and ends, and the blocks' products
  ConsistentState state_;
  BlockMatrix jacobian_;
  std::unique_ptr<KluSolver> solver_;
  struct Blocks {
    int identity_q, hessian, q_v, phi_gamma, identity_v, v_a, identity_z, z_q, z_v, z_z, K, C, Q_z, M, phi_lambda,
        phid_q, phid_v, phi_q, corner = -1, gamma_corner = -1;
  } at_{};
  int n_, m_, nz_;
  Assembly::ParameterColumns columns_;
  std::vector<double> hessian_, kept_q_, gamma_corner_, position_weights_, friction_weights_, kept_gamma_, no_rates_,
      slip_q_, slip_v_;
  bool stage_parameters_ = false;  // with (Phi_q^T gamma)_rho
  long hessian_at_ = 0;
  double cj_scale_ = 1;
  EvaluationPoint point_;  // all of y, where it was linearized
};

}  // namespace costate
