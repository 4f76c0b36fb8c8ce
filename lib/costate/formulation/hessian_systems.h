// The two passes behind Hessian-vector products as ordinary differential equations for an integrator: the
// motion with its tangents forward in time, then, along the stored motion, the adjoint with its changes and
// the integrals that the gradient and the products are (lib/README.md (13)). Both pass the Newton matrix of
// the motion alone: it is the diagonal block of every column, and what lies below the diagonal converges in
// one more iteration.
#pragma once

#include <functional>
#include <limits>

#include "costate/adjoint/hessian_equations.h"
#include "costate/formulation/acceleration_ode.h"
#include "costate/level/velocity_jump.h"

namespace costate {

struct SecondStretchMap;

/// What both passes share: columns of the motion's size, and no sensitivities of their own.
class HessianPass : public OdeSystem {
 public:
  void set_parameters(const double* rho) override;
  void forget_history() override { newton_.forget_history(); }
  long factorizations() const override { return newton_.factorizations(); }

  void tangent(double, const double*, const double* const*, double* const*, int, bool) final;
  void tangent_running_cost(double, const double*, const double* const*, double*, int) final;
  void tangent_terminal_cost(double, const double*, const double* const*, double*, int) final;
  void running_cost_gradient(double, const double*, double*) final;
  void adjoint_rhs(double, const double*, const double*, double*) final;
  void adjoint_integrand(double, const double*, const double*, double*) final;
  void terminal_adjoint(double, const double*, double*, double*) final;

 protected:
  explicit HessianPass(HessianEquations& equations);
  /// Names of the columns' unknowns behind `prefix` (the first column) or `prefix`, the direction's number
  /// and a dot.
  void append_columns(const std::string& first, const std::string& others);
  void solve_columns(double* b, bool transposed);

  HessianEquations& equations_;
  AccelerationOde newton_;
  int columns_;
};

/// y = (q, v, z, then the same of each tangent).
class TangentMotion final : public HessianPass {
 public:
  explicit TangentMotion(HessianEquations& equations);

  /// As MotionEvents has it; to be called before the start.
  void end_slow_slips(double part) {
    if (events_) events_->end_slow_slips(part);
  }
  /// Segments end at these times, too; nothing jumps there.
  void end_segments_at(const std::vector<double>& times);
  bool carries_events() const override { return true; }
  void jump(double t, double* y) override;
  /// The events met since the start and the known times at which laws jump, in order, with what is there at their
  /// times.
  const std::vector<HessianEquations::Event>& met() const { return met_; }
  HessianEquations::Jumps jumps() { return {events_.get(), &instant_}; }
  /// "contact.floor: touch".
  std::string name_of(const HessianEquations::Event& event) const;
  /// Whether a slip in space begins from rest there.
  bool begins_from_rest(const HessianEquations::Event& event);
  /// Or whether one stops.
  bool stops_slip(const HessianEquations::Event& event) const;

  MechanismState mechanism_state(double t, const double* y) override { return newton_.mechanism_state(t, y); }
  MechanismState kinematic_state(double t, const double* y) override { return newton_.kinematic_state(t, y); }
  void rhs(double t, const double* y, double* f) override;
  void factor(double t, const double* y, double gamma) override { newton_.factor(t, y, gamma); }
  void solve(double* b) override { solve_columns(b, false); }
  void solve_transposed(double* b) override { solve_columns(b, true); }
  void start(double t, double* y, Eigen::MatrixXd* y_rho) override;

 private:
  [[noreturn]] static void refuse(double t, const std::string& why);
  void refuse_sliding(double t, const double* y);
  // Of impulses, whose balance is that of this assembly.
  AccelerationLevel level_;
  VelocityJump velocity_jump_;
  KnownInstant instant_;
  std::vector<double> smooth_ends_;
  std::vector<HessianEquations::Event> met_;
};

/// In the time that is left, tau = t_end - t:
///   y = (mu, dmu of each direction, gradient, products),
/// all divided by `scale`, the gradient's entries and the products' multiplied by the parameters' scales: integrators
/// then keep errors against one and the same size.
class HessianAdjoint final : public HessianPass {
 public:
  /// Writes (q, v, z, tangents) at t.
  using Motion = std::function<void(double t, double* y)>;
  HessianAdjoint(HessianEquations& equations, Motion motion, double t_end, double scale);

  void set_parameters(const double* rho) override;
  MechanismState mechanism_state(double tau, const double* y) override;
  void rhs(double tau, const double* y, double* f) override;
  void factor(double tau, const double* y, double gamma) override;
  // d(mu)/d(tau) = f_y^T mu + ...: the Newton matrix is the transpose of the motion's.
  void solve(double* b) override { solve_columns(b, true); }
  void solve_transposed(double* b) override { solve_columns(b, false); }
  /// From here on the motion is that between these times, whatever the time that is left stands for: a step that ends
  /// at a bend is not to see what is behind it.
  void keep_within(double from, double to) {
    from_ = from;
    to_ = to;
  }
  /// Between these times the integrator's clock runs so that t - begin, or end - t, is as the fourth power of the
  /// clock's: rates that grow without bound towards that end, slower than t^(-3/4), vanish there. Second derivatives of
  /// a contact's d^n, 5/4 < n < 2, do so where it closes and opens.
  /// With x that clock from there on, of length 1, the rates are as a x^(4 n - 5) + b x^3; so near that the depth is
  /// rounding, x < x0 (kNearest), they are so with a and b from those at x0 and 2 x0.
  enum class Steep { nowhere, at_begin, at_end };
  void run_clock(double begin, double end, Steep steep, double exponent) {
    begin_ = begin;
    end_ = end;
    steep_ = steep;
    power_ = 4 * exponent - 5;
  }
  /// y behind a bend, or behind an event, becomes that before it.
  void cross(const HessianEquations::Bend& bend, double* y);
  void cross(const HessianEquations::Jumps& jumps, const HessianEquations::Event& event, double* y);
  /// y behind a stretch becomes that before it.
  void cross(const SecondStretchMap& map, double* y);
  /// The end of the motion.
  void start(double tau, double* y, Eigen::MatrixXd* y_rho) override;
  /// psi gains w_q^T q at the motion's start.
  void weigh_start(const Eigen::VectorXd& w_q) { start_weights_ = w_q; }
  /// The whole gradient (np) and products (np x k), from y at the motion's start t.
  void finish(double t, const double* y, double* gradient, double* products);

 private:
  /// carry(mu and its changes, what gradient and products gain), of y.
  void cross(double* y, const std::function<void(double* mu, double* added)>& carry);
  /// The motion's time, and the motion there in point_.
  double at(double tau);
  double at_time(double t);
  /// The rates of y at this time of the motion, times that of the clock.
  void rates(double t, double clock, const double* y, double* f);
  /// How far the integrator's clock is from the steep end, 0 to 1.
  double from_steep(double clock) const;
  /// The time that is left by the integrator's clock, and its rate.
  double left_at(double clock) const;
  double left_from(double x) const;
  double clock_rate(double clock) const;

  Motion motion_;
  double t_end_, scale_;
  double begin_ = 0, end_ = 0, power_ = 3;
  Steep steep_ = Steep::nowhere;
  double from_ = -std::numeric_limits<double>::infinity(), to_ = std::numeric_limits<double>::infinity();
  Eigen::VectorXd start_weights_;  // or none
  std::vector<double> parameter_scale_, point_, unscaled_, rates_, further_;
};

}  // namespace costate
