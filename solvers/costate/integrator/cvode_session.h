// One run of CVODES on an ODE system: Newton with the system's exact I - gamma f_y, cost quadrature, forward
// sensitivities, and the adjoint module with checkpoints. The methods in sensitivity/ are short programs on this.
#pragma once

#include "costate/integrator/stiffness_watch.h"
#include "costate/integrator/sundials_session.h"

namespace costate {

class CvodeSession final : public SundialsSession<CvodeApi> {
 public:
  /// What psi's running part is to CVODES: a quadrature, or a state of its own behind those of the system. Runs with
  /// sensitivities need the state: with Adams' method CVODES (6.4 to 7) forgets the quadratures of sensitivities when
  /// it changes the order (cvAdjustAdams), so that these start from memory that was never written.
  enum class Cost { quadrature, state };
  CvodeSession(OdeSystem& system, const SolverOptions& options, Monitor monitor, StartDerivative wanted,
               Cost cost = Cost::quadrature);
  /// Begins with a given state, in the mode that the system is in; options.t_start is replaced.
  CvodeSession(OdeSystem& system, const SolverOptions& options, Monitor monitor, const SegmentStart& start,
               Cost cost = Cost::quadrature);

  void enable_sensitivities();
  /// The adjoint's end values; the gradient of the start; the way across a jump. All add to the gradient.
  AdjointState end_adjoint(std::vector<double>& gradient);
  void add_start_gradient(const AdjointState& mu, std::vector<double>& gradient) const;
  static void transfer_adjoint(OdeSystem& system, const Jump& jump, AdjointState& mu, std::vector<double>& gradient);
  std::vector<double> sensitivity_gradient();
  /// Of the terminal cost here alone.
  std::vector<double> terminal_gradient();

 private:
  static CvodeSession& self_of(void* p) { return *static_cast<CvodeSession*>(p); }
  void* self() override { return this; }
  std::vector<Unknown> names() const override;
  std::vector<Unknown> names_back() const override;
  /// Solves with I - gamma f_y, the cost's row included.
  void solve_newton(double* b) override;
  void solve_newton_back(double* b) override { system_.solve_transposed(b); }
  CVQuadRhsFn quadrature_function() const override { return quadrature; }
  CVQuadRhsFnB backward_quadrature_function() const override { return backward_quadrature; }
  void create_backward() override;
  void set_backward_matrix() override;
  bool cost_is_unknown() const override { return cost_state_; }
  void jump_sensitivities(const Jump& jump, SegmentStart& start) override;

  void create_memory();
  /// Throws StiffError where Adams' steps are bound by stability and very many of them are left.
  void watch_stiffness(double t, const double* y) { watch_stiffness(stiffness_, memory_, t, y, options_.t_end); }
  /// The same on the way back: the adjoint of a motion at rest may be stiff where the motion is not.
  void watch_stiffness_back(double t, const double* y) {
    watch_stiffness(stiffness_back_, back_->memory, t, y, options_.t_start);
  }
  void watch_stiffness(StiffnessWatch& watch, void* memory, double t, const double* y, double end);
  int linear_multistep() const;
  void choose_smooth_steps(void* memory) override;

  static int rhs(double t, N_Vector y, N_Vector f, void* self);
  static int newton_matrix(double t, N_Vector y, N_Vector f, SUNMatrix A, int jok, int* jcur, double gamma, void* self,
                           N_Vector, N_Vector, N_Vector);
  static int quadrature(double t, N_Vector y, N_Vector q, void* self);
  static int sensitivity_rhs(int count, double t, N_Vector y, N_Vector f, N_Vector* yS, N_Vector* fS, void* self,
                             N_Vector, N_Vector);
  static int backward_rhs(double t, N_Vector y, N_Vector yB, N_Vector fB, void* self);
  static int backward_newton_matrix(double t, N_Vector y, N_Vector yB, N_Vector fB, SUNMatrix A, int jok, int* jcur,
                                    double gamma, void* self, N_Vector, N_Vector, N_Vector);
  static int backward_quadrature(double t, N_Vector y, N_Vector yB, N_Vector qB, void* self);

  bool cost_state_ = false;  // the last unknown is psi' = g
  double gamma_ = 0;
  Eigen::MatrixXd y_rho_;
  std::vector<const double*> columns_in_;
  std::vector<double*> columns_out_;
  std::vector<double> g_rho_;
  StiffnessWatch stiffness_, stiffness_back_;
};

}  // namespace costate
