// What an integrator and a sensitivity method see of a mechanism: unknowns with names, residuals or right-hand
// sides with exact Jacobians and parameter derivatives, a consistent start, and a cost. No body and no joint.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/event/motion_events.h"
#include "costate/level/fixed_times.h"
#include "costate/level/impulse_jump.h"
#include "costate/level/unknown.h"
#include "costate/linear/sparse_pattern.h"
#include "costate/objective/objective.h"

namespace costate {

/// The mechanism's state behind a system's unknowns, for costs, outputs and files. Pointers stay valid until the
/// system is evaluated again.
using MechanismState = StateView;

/// Where one smooth segment of a trajectory ends and the next begins: the state jumps from (y, y') in the terms of mode
/// `before` to a new one in the terms of mode `after`. A mode is a set of equations or unknowns: a chart of independent
/// coordinates, ... Integrators start anew at a jump, and nothing is interpolated across it.
struct Jump {
  double t = 0;
  int before = 0, after = 0;
  int event = -1;             // of the mechanism's own (event/motion_events.h), or none
  std::vector<double> y, yp;  // at the end of the segment; yp of DAE systems only
};

/// Common to DAE and ODE systems. A system owns its scratch: one system serves one thread.
class System {
 public:
  System(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective);
  virtual ~System() = default;
  System(const System&) = delete;
  System& operator=(const System&) = delete;

  const std::vector<Unknown>& unknowns() const { return unknowns_; }
  int size() const { return static_cast<int>(unknowns_.size()); }
  int parameter_count() const { return assembly_.np(); }
  const ParameterSelection& parameters() const { return assembly_.parameters(); }
  const Objective& objective() const { return objective_; }
  Assembly& assembly() { return assembly_; }
  const Assembly& assembly() const { return assembly_; }

  virtual void set_parameters(const double* rho);

  /// Whether the unknowns begin with (q, v, z), so that an integrator's dense output is that of the motion.
  virtual bool begins_with_motion() const { return true; }

  /// Whether its equations hold constraints that dense output within a step does not meet: a run that began there would
  /// have an error that no step length makes smaller.
  virtual bool begins_at_step_ends() const { return false; }

  /// Evaluations from here on give the same bits whatever was evaluated before: to be called where a part of a run
  /// may be repeated later (checkpoints).
  virtual void forget_history() {}

  /// The mechanism's state at (t, y); accelerations and multipliers are solved for where y does not hold them.
  virtual MechanismState mechanism_state(double t, const double* y) = 0;
  /// The same for those who ask for neither accelerations nor multipliers: these may be missing.
  virtual MechanismState kinematic_state(double t, const double* y) { return mechanism_state(t, y); }

  /// The same for looks at a step, after which evaluations give the same bits as without them. Valid until
  /// the next one.
  virtual MechanismState look_state(double t, const double* y) { return kinematic_state(t, y); }

  /// gradient += mu^T E y_rho of the start at t, for mu of length size() and E the differential unknowns; without the
  /// columns of y_rho. start() has left its mode in force.
  void add_start_gradient(double t, const double* mu, double* gradient);

  /// g and w of the cost.
  double running_cost(double t, const double* y);
  double terminal_cost(double t, const double* y);
  bool has_running_cost() const { return !objective_.running.empty(); }

  // Trajectories of several segments. A system that never jumps leaves all this alone.
  // Velocities jump where a driver's law has a kink (velocity_jump.h); other jumps are those of a formulation.
  /// Whether trajectories may have jumps; if not, nothing below is called.
  virtual bool may_jump() const { return !kinks_.empty() || events_; }
  /// The times of kinks, in order, and those at which accelerations alone jump where parameters move them.
  const std::vector<double>& kinks() const { return kinks_; }
  /// Segments end at kinks of laws with numbers that parameters move, too: for derivatives of the steps themselves. To
  /// be called before set_parameters().
  void end_at_kinks_of_laws() { at_kinks_of_laws_ = true; }
  /// Moving instants are also those at which derivatives by the parameters alone jump (level/fixed_times.h). Likewise.
  void move_bends() { with_bends_ = true; }
  /// The last instant before the next kink after t, where a segment must end; infinite without one.
  double segment_limit(double t) const;
  /// The mode in force. start() leaves the first one in force; the others keep their numbers until the next start().
  virtual int mode() const { return 0; }
  virtual void use_mode(int) {}
  /// Another step is tried from the end of the last one that was accepted.
  virtual void try_step() {}
  /// Of a step that an integrator might accept: whether the motion is on the branch that it was on. Unknowns may mean
  /// more than one position.
  virtual bool keeps_branch(double /*from*/, double /*t*/, const double* /*y*/) { return true; }
  /// After each accepted step of a forward run, in order of time: whether the segment must end at (t, y).
  virtual bool segment_ends(double t, const double*) { return t >= segment_limit(t); }
  /// Where the next segment starts when one has ended at t: behind a kink, else at t.
  double segment_start(double t) const;

  /// Behind jump() at a kink, with the state there: throws SolverError where a driver's kink asks of closed contacts
  /// what they cannot do (MotionEvents::require_pushing()).
  void require_contacts_follow(const Jump& jump, double t_after, const double* y_after);

  // Events of the mechanism: contacts that touch and let go. Their times are found along the run.
  /// Whether this formulation is carried across them; where not, a mechanism that has them is refused by name.
  virtual bool carries_events() const { return false; }
  bool has_events() const { return events_ != nullptr; }
  /// A forward run begins at (t, y).
  void begin_events(double t, const double* y);
  /// After each accepted step, once and in order of time: when the first event within it happens, which is then the
  /// pending one; `at` gives y at times between.
  std::optional<double> find_event(double from, double to, const std::function<const double*(double)>& at);
  int pending_event() const { return pending_event_; }
  /// Its guard, zero where it happens.
  double pending_guard(const StateView& s) { return events_->guard(pending_event_, s); }
  void forget_event() { pending_event_ = -1; }
  /// Tangents are from here on not integrated with the motion (event/motion_events.h).
  void differentiate_between_steps() {
    if (events_) events_->differentiate_between_steps();
  }
  // Slips in space that are slow: a run back crosses those by a map of its own, in terms of (q, v, z).
  void carry_slips_from_rest() {
    if (events_) events_->carry_slips_from_rest();
  }
  bool may_slip_in_space() const { return events_ && events_->may_slip_in_space(); }
  /// Of a state of look_state().
  MotionEvents::Slowest slowest_in_space(const StateView& s) { return events_->slowest_in_space(s); }
  bool stops_slip(int event, const double* z) const { return events_->stops_slip(event, z); }
  /// w (2 n + nz) := the weights of (q, v, z) that mu stands for at (t, y), in the mode in force.
  void weights_at(double t, const double* y, const double* mu, double* w, double* gradient);
  /// Of runs whose velocities are known to these tolerances (MotionEvents::end_unresolved_slips()).
  void end_unresolved_slips(double rtol, double atol) {
    if (events_) events_->end_unresolved_slips(rtol, atol);
  }
  /// The run's events, or null.
  const MotionEvents* motion_events() const { return events_.get(); }
  const std::string& event_name(int event) const { return events_->name(event); }
  std::string event_mode(int event) const { return events_->mode(event); }
  /// Of the event that the last jump() crossed: by how much the state jumped that did so most, in its own unit.
  double event_jump() const { return events_->last_jump(); }
  double event_loss() const { return events_->last_loss(); }
  /// With the state behind it: by how much the running part of psi may be off where it has closed contacts whose
  /// bounces had died out. What they do meanwhile is not seen: a force is a steady one, not one impulse after another.
  double cost_of_unseen_bounces(double t, const double* y);
  /// How long what has just left a gap stays open (MotionEvents::last_hop()).
  double event_hop() const { return events_ ? events_->last_hop() : std::numeric_limits<double>::infinity(); }
  MotionEvents::History event_history() const { return events_ ? events_->history() : MotionEvents::History{}; }
  /// What the running part of psi gains by each parameter where the last jump_tangent() crossed an event, or a kink
  /// whose time moves; else empty.
  const std::vector<double>& jump_cost_tangent() const { return jump_cost_tangent_; }

  /// Newton iterations made inside evaluations, to find positions.
  virtual long position_iterations() const { return 0; }

 protected:
  /// What the equations and the cost say at (t, y), accelerations solved for.
  MotionEvents::Side event_side(double t, const double* y);
  /// Segments end at these times as well, until set_parameters().
  void add_kinks(const std::vector<double>& times);
  /// The weights that mu is of the start's q, v, z (n, n, nz; zero before), and what the gradient gains beside them: by
  /// default mu begins with them, and it gains nothing.
  virtual void spread_start_weights(const StateView& start, const double* mu, double* w_q, double* w_v, double* w_z,
                                    double* gradient);

  /// Where parameters move the kink at which the segment ends: how, and what the state does on either side. `cross`
  /// makes (y, y') before it those behind it.
  std::optional<MovingTime> moving_time(const Jump& jump, const std::function<void(double* y, double* yp)>& cross);
  /// dt/drho of the kink at which the next segment begins; null where it does not move.
  const std::vector<double>* moved_by(double t_after) const;
  /// jump_cost_tangent() of that.
  void set_cost_tangent(const std::optional<MovingTime>& moving);

  Assembly assembly_;
  Objective objective_;
  std::vector<Unknown> unknowns_;
  ScalarGradient cost_gradient_;
  std::unique_ptr<MotionEvents> events_;  // null without any
  std::vector<double> jump_cost_tangent_;
  int pending_event_ = -1;

 private:
  std::vector<double> kinks_;
  bool at_kinks_of_laws_ = false, with_bends_ = false;
  std::vector<MovingInstant> moving_;  // those of them that parameters move
};

/// F(t, y, y', rho) = 0 with F_y' = diag(1 for differential unknowns, 0 for algebraic ones), constant.
class DaeSystem : public System {
 public:
  using System::System;

  virtual void residual(double t, const double* y, const double* yp, double* r) = 0;

  /// Sparse J = F_y + cj F_y' on a fixed pattern.
  virtual const SparsePattern& jacobian_pattern() const = 0;
  virtual void jacobian(double t, const double* y, const double* yp, double cj, double* values) = 0;

  /// The Newton matrix J(cj) as an operator; formulations may eliminate unknowns before they factor.
  /// factor throws SolverError naming the unknown at which J is singular.
  virtual void factor(double t, const double* y, const double* yp, double cj) = 0;
  virtual void solve(double* b) = 0;
  virtual void solve_transposed(double* b) = 0;
  virtual long factorizations() const = 0;

  /// Prepares the products below at a point.
  virtual void linearize(double t, const double* y, const double* yp) = 0;
  /// out += c F_y x and out += c F_y^T x (x and out of length size()).
  virtual void add_product(double c, const double* x, double* out) = 0;
  virtual void add_transposed_product(double c, const double* x, double* out) = 0;
  /// F_rho, size() x np, at the linearized point.
  virtual void parameter_columns(Eigen::MatrixXd& F_rho) = 0;
  /// gradient += c mu^T F_rho.
  virtual void add_parameter_gradient(double c, const double* mu, double* gradient) = 0;

  /// Consistent y, y' at time t, and their derivative with respect to rho (size() x np each) on request.
  virtual void start(double t, double* y, double* yp, Eigen::MatrixXd* y_rho, Eigen::MatrixXd* yp_rho) = 0;

  /// g_y (set) and gradient += c g_rho.
  virtual void running_cost_gradient(double t, const double* y, double* g_y, double c, double* gradient) = 0;
  /// w_y (set) and gradient += c w_rho; for the forward methods (y_rho is consistent, so w_y may hold any column).
  virtual void terminal_cost_gradient(double t, const double* y, double* w_y, double c, double* gradient) = 0;

  /// (y, y') := the state after the jump at (t, y, y'), whose mode comes into force.
  virtual void jump(double t, double* y, double* yp);
  /// Columns of y_rho and y'_rho before the jump become those after it; jump.after stays in force.
  virtual void jump_tangent(const Jump& jump, double* const* s, double* const* sp, int count);
  /// The adjoint mu, mu' after the jump becomes the one before it, all equations of mu satisfied; the gradient gains
  /// the jump's own dependence on rho; jump.before stays in force.
  virtual void jump_adjoint(const Jump& jump, double* mu, double* mup, double* gradient);

  /// mu, mu' := the adjoint that the weights w of (q, v, z) are at (t, y), as behind jump_adjoint(), in the mode in
  /// force.
  virtual void adjoint_at(double t, const double* y, const double* w, double* mu, double* mup, double* gradient) = 0;

  /// Adjoint end values mu(T), mu'(T) of (mu^T F_y')' - mu^T F_y = -g_y with the cost's terminal part, and the terms
  /// that the gradient gains at T (w_rho and boundary multipliers). lib/README.md (1) to (3).
  virtual void terminal_adjoint(double t, const double* y, const double* yp, double* mu, double* mup,
                                double* gradient) = 0;
};

/// y' = f(t, y, rho).
class OdeSystem : public System {
 public:
  using System::System;

  virtual void rhs(double t, const double* y, double* f) = 0;
  /// How fast [1/s] the equations take errors of constraints back by terms of their own; 0 where they have none. A
  /// motion may hold no such error that would bound explicit steps, while its adjoint and its tangent hold them.
  virtual double stabilizing_rate() const { return 0; }

  /// The Newton matrix I - gamma f_y as an operator.
  virtual void factor(double t, const double* y, double gamma) = 0;
  virtual void solve(double* b) = 0;
  virtual void solve_transposed(double* b) = 0;
  virtual long factorizations() const = 0;

  /// columns: out_j = f_y s_j (+ f_rho e_j when with_parameters), j < count; s and out are size() x count.
  virtual void tangent(double t, const double* y, const double* const* s, double* const* out, int count,
                       bool with_parameters) = 0;
  /// The cost's integrand differentiated along tangent columns: out_j = g_y s_j + g_rho e_j.
  virtual void tangent_running_cost(double t, const double* y, const double* const* s, double* out, int count) = 0;
  virtual void tangent_terminal_cost(double t, const double* y, const double* const* s, double* out, int count) = 0;

  /// g_y = d(g)/dy with accelerations and multipliers eliminated.
  virtual void running_cost_gradient(double t, const double* y, double* g_y) = 0;
  /// mu' = -f_y^T mu - g_y^T.
  virtual void adjoint_rhs(double t, const double* y, const double* mu, double* mup) = 0;
  /// out = g_rho + mu^T f_rho.
  virtual void adjoint_integrand(double t, const double* y, const double* mu, double* out) = 0;
  /// mu(T) = w_y^T and gradient += w_rho, with accelerations and multipliers eliminated.
  virtual void terminal_adjoint(double t, const double* y, double* mu, double* gradient) = 0;

  virtual void start(double t, double* y, Eigen::MatrixXd* y_rho) = 0;

  /// y := the state after the jump at (t, y), whose mode comes into force.
  virtual void jump(double t, double* y);
  /// Columns of y_rho before the jump become those after it; jump.after stays in force.
  virtual void jump_tangent(const Jump& jump, double* const* s, int count);
  /// mu after the jump becomes mu before it; the gradient gains the jump's own dependence on rho; jump.before stays in
  /// force.
  virtual void jump_adjoint(const Jump& jump, double* mu, double* gradient);
  /// mu := the adjoint that the weights w of (q, v, z) are at (t, y), in the mode in force; by default these.
  virtual void adjoint_at(double t, const double* y, const double* w, double* mu, double* gradient);
};

}  // namespace costate
