// One run of IDAS on a DAE system: set-up with exact Jacobians, cost quadrature, forward sensitivities, and the
// adjoint module with checkpoints. The methods in sensitivity/ are short programs on this.
#pragma once

#include <optional>

#include "costate/integrator/solved_algebraic.h"
#include "costate/integrator/sundials_session.h"
#include "costate/sundials/judged_newton.h"

namespace costate {

class IdaSession final : public SundialsSession<IdaApi> {
 public:
  /// Starts from the system's consistent start; with its derivative as wanted.
  IdaSession(DaeSystem& system, const SolverOptions& options, Monitor monitor, StartDerivative wanted);
  /// Begins with a given state, in the mode that the system is in; options.t_start is replaced.
  IdaSession(DaeSystem& system, const SolverOptions& options, Monitor monitor, const SegmentStart& start);

  void enable_sensitivities();
  /// The adjoint's end values; the gradient of the start; the way across a jump. All add to the gradient.
  AdjointState end_adjoint(std::vector<double>& gradient);
  void add_start_gradient(const AdjointState& mu, std::vector<double>& gradient) const;
  static void transfer_adjoint(DaeSystem& system, const Jump& jump, AdjointState& mu, std::vector<double>& gradient);
  std::vector<double> sensitivity_gradient();
  /// Of the terminal cost here alone.
  std::vector<double> terminal_gradient();  // of running and terminal part at the current time

 private:
  static IdaSession& self_of(void* p) { return *static_cast<IdaSession*>(p); }
  void* self() override { return this; }
  std::vector<Unknown> names() const override;
  std::vector<Unknown> names_back() const override;
  void solve_newton(double* b) override;
  void solve_newton_back(double* b) override;
  IDAQuadRhsFn quadrature_function() const override { return quadrature; }
  IDAQuadRhsFnB backward_quadrature_function() const override { return backward_quadrature; }
  void create_backward() override;
  void set_backward_matrix() override;
  int attempts_back() const override;
  void begin_attempt_back(int attempt) override;
  void complete_backward(const AdjointStop& stop) override;
  bool asks_for_lead() override;
  void complete_end() override { solve_algebraic(system_, t_, y_.data()); }
  void jump_sensitivities(const Jump& jump, SegmentStart& start) override;

  void create_memory();
  /// Whether the accelerations are in the norm of Newton's iterations; they are not unknowns at index 2 and 3.
  bool iterates_on_accelerations() const;
  /// Whether some unknowns are in no norm at all.
  bool some_outside_norm() const;
  Vector absolute_tolerances(double scale) const;
  // A clock beside the unknowns, for the choice of the order alone (ida_lead.cpp).
  int led() const { return y_.size() - system_.size(); }
  bool states_have_no_error();
  void begin_lead();
  double clock_rate(double t) const;
  /// The state at which a running cost is taken; until the next call.
  const double* cost_state(double t, const double* y);
  /// Calculates g_y and g_rho in a backward callback.
  void backward_cost_gradient(double t, const double* x);
  int summed_back() const { return system_.parameter_count() > 0 ? 1 : 0; }
  void begin_sum();
  void backward_integrand(double t, const double* x, const double* mu, double* q);
  double backward_sum_rate(double t, const double* x, const double* mu);
  void solve_sum(double* x);

  /// The residual in Newton's method with factors at another coefficient than IDAS's: cj.
  static void scale_newton(void* memory, double cj, const Vector& id, double* b);
  static int residual(double t, N_Vector y, N_Vector yp, N_Vector r, void* self);
  static int jacobian(double t, double cj, N_Vector y, N_Vector yp, N_Vector r, SUNMatrix J, void* self, N_Vector,
                      N_Vector, N_Vector);
  static int quadrature(double t, N_Vector y, N_Vector yp, N_Vector q, void* self);
  static int sensitivity_residual(int count, double t, N_Vector y, N_Vector yp, N_Vector r, N_Vector* yS, N_Vector* ypS,
                                  N_Vector* rS, void* self, N_Vector, N_Vector, N_Vector);
  static int sensitivity_quadrature(int count, double t, N_Vector y, N_Vector yp, N_Vector* yS, N_Vector* ypS,
                                    N_Vector q, N_Vector* qS, void* self, N_Vector, N_Vector, N_Vector);
  static int backward_residual(double t, N_Vector y, N_Vector yp, N_Vector yB, N_Vector ypB, N_Vector rB, void* self);
  static int backward_jacobian(double t, double cj, N_Vector y, N_Vector yp, N_Vector yB, N_Vector ypB, N_Vector rB,
                               SUNMatrix J, void* self, N_Vector, N_Vector, N_Vector);
  static int backward_quadrature(double t, N_Vector y, N_Vector yp, N_Vector yB, N_Vector ypB, N_Vector qB, void* self);

  std::optional<JudgedNewton> iterations_, iterations_S_, iterations_back_;
  Vector id_, id_back_, atol_;
  Eigen::MatrixXd y_rho_, yp_rho_, F_rho_;
  VectorArray qS_;
  std::vector<Vector> atol_S_;
  SolvedAlgebraic solved_, solved_cost_;  // the forward state as the adjoint's equations and as the cost takes it
  // On the way back: the running cost's gradient, kept for further calls at the same time (Newton's iterations and the
  // integrand of the gradient come back to it), and what the last unknown is a sum of.
  double cost_time_ = std::numeric_limits<double>::quiet_NaN();
  std::vector<double> g_y_back_, g_rho_;
  double cj_ = 1, cj_back_ = 1;  // Newton's coefficients at the factors
  std::vector<double> sum_weights_, integrand_;
  long low_ = 0;  // steps since the order was high
};

}  // namespace costate
