// Acceleration-level formulations as an ordinary differential equation for CVODES: y = (q, v, z),
// y' = (v, a, f) with a from the KKT system; explicit first-order adjoint (lib/README.md (3), (4)).
#pragma once

#include <optional>

#include "costate/assembly/pulled_partials.h"
#include "costate/formulation/stage_adjoint.h"
#include "costate/formulation/system.h"
#include "costate/level/acceleration_level.h"
#include "costate/level/velocity_jump.h"

namespace costate {

class AccelerationOde final : public OdeSystem, public StageAdjoint {
 public:
  AccelerationOde(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective,
                  Stabilization stabilization);

  void forget_history() override { level_.forget_history(); }
  MechanismState mechanism_state(double t, const double* y) override;
  MechanismState kinematic_state(double t, const double* y) override { return view(t, y); }
  void rhs(double t, const double* y, double* f) override;
  double stabilizing_rate() const override { return assembly_.m() > 0 ? level_.stabilization().rate() : 0; }
  void factor(double t, const double* y, double gamma) override;
  void solve(double* b) override;
  void solve_transposed(double* b) override;
  long factorizations() const override { return level_.factorizations(); }
  void tangent(double t, const double* y, const double* const* s, double* const* out, int count,
               bool with_parameters) override;
  void tangent_running_cost(double t, const double* y, const double* const* s, double* out, int count) override;
  void tangent_terminal_cost(double t, const double* y, const double* const* s, double* out, int count) override;
  void running_cost_gradient(double t, const double* y, double* g_y) override;
  void adjoint_rhs(double t, const double* y, const double* mu, double* mup) override;
  void adjoint_integrand(double t, const double* y, const double* mu, double* out) override;
  void pull_stage(double t, const double* y, const double* w, double c, double* pulled, double* gradient) override;
  std::size_t record_size() const override { return level_.record_size(); }
  void keep_record(double* to, std::size_t size) const override { level_.keep_record(to, size); }
  bool bring_back(double t, const double* y, const double* record) override {
    return level_.bring_back(view(t, y), record);
  }
  void terminal_adjoint(double t, const double* y, double* mu, double* gradient) override;
  void start(double t, double* y, Eigen::MatrixXd* y_rho) override;
  bool carries_events() const override { return true; }
  void jump(double t, double* y) override;
  void jump_tangent(const Jump& jump, double* const* s, int count) override;
  void jump_adjoint(const Jump& jump, double* mu, double* gradient) override;

 private:
  /// y at the end of a segment, before a kink, becomes that behind it.
  void cross_kink(double t, double* y);
  StateView view(double t, const double* y) const;
  /// Accelerations, multipliers and all derivative blocks at (t, y).
  void linearize(double t, const double* y);
  /// kkt_ = [Sa; Sl] of the tangent columns.
  void solve_tangent(const double* const* s, int count, bool with_parameters);
  void tangent_cost(bool terminal, double t, const double* y, const double* const* s, double* out, int count);
  /// The running cost's gradient at the linearized point, in cost_gradient_; repeated calls there are free.
  void calc_running_gradient();
  /// kkt_ = KKT^-1 [mu_v + g_a; g_l] with the running cost's gradient in cost_gradient_; mu may be null (zero).
  void solve_adjoint(double t, const double* y, const double* mu);

  AccelerationLevel level_;
  VelocityJump velocity_jump_;
  Assembly::ParameterColumns columns_;
  std::optional<PulledPartials> pulled_partials_;  // where no rows are switched
  std::vector<double> kkt_, reduced_;
  long cost_gradient_at_ = 0;  // the point that cost_gradient_ belongs to
};

}  // namespace costate
