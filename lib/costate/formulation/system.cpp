#include "costate/formulation/system.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/formulation/solved_state.h"

namespace costate {

System::System(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters, Objective objective)
    : assembly_(std::move(mechanism), std::move(parameters)), objective_(std::move(objective)) {
  cost_gradient_.resize(assembly_);
  if (MotionEvents::has_any(assembly_.mechanism())) events_ = std::make_unique<MotionEvents>(assembly_);
}

void System::begin_events(double t, const double* y) {
  pending_event_ = -1;
  if (!events_) return;
  if (!carries_events()) MotionEvents::refuse(assembly_.mechanism(), "this formulation is");
  events_->begin(events_->needs_multipliers() ? solved_state(*this, t, y) : kinematic_state(t, y));
}

std::optional<double> System::find_event(double from, double to, const std::function<const double*(double)>& at) {
  if (!events_) return {};
  const MotionEvents::States places = [&](double t) { return look_state(t, at(t)); };
  const auto hit = events_->needs_multipliers()
                       ? events_->find(
                             from, to, [&](double t) { return solved_state(*this, t, at(t)); }, places)
                       : events_->find(from, to, places, places);
  if (!hit) return {};
  pending_event_ = hit->event;
  return hit->t;
}

MotionEvents::Side System::event_side(double t, const double* y) {
  const MechanismState s = solved_state(*this, t, y);
  MotionEvents::Side side;
  side.a.assign(s.a, s.a + assembly_.n());
  side.zdot = assembly_.zdot;
  side.cost = has_running_cost() ? objective_.running_value(s, assembly_) : 0;
  return side;
}

void System::set_parameters(const double* rho) {
  assembly_.set_parameters(rho);
  kinks_ = driver_kinks(assembly_.mechanism(), assembly_.numbers());
  moving_ =
      moving_instants(assembly_.mechanism(), objective_, assembly_.parameters(), assembly_.numbers(), with_bends_);
  for (const MovingInstant& at : moving_) kinks_.push_back(at.t);
  if (at_kinks_of_laws_)
    for (const double t :
         kinks_of_moved_laws(assembly_.mechanism(), objective_, assembly_.parameters(), assembly_.numbers()))
      kinks_.push_back(t);
  add_kinks({});
}

void System::add_kinks(const std::vector<double>& times) {
  kinks_.insert(kinks_.end(), times.begin(), times.end());
  std::sort(kinks_.begin(), kinks_.end());
  kinks_.erase(std::unique(kinks_.begin(), kinks_.end()), kinks_.end());
}

// A segment ends at the last number before a kink and the next one starts at the kink, so that each evaluates the
// law's own branch.
double System::segment_limit(double t) const {
  const double infinity = std::numeric_limits<double>::infinity();
  for (const double kink : kinks_)
    if (t < kink) return std::nextafter(kink, -infinity);
  return infinity;
}

double System::segment_start(double t) const {
  const double next = std::nextafter(t, std::numeric_limits<double>::infinity());
  return std::find(kinks_.begin(), kinks_.end(), next) != kinks_.end() ? next : t;
}

void System::require_contacts_follow(const Jump& jump, double t_after, const double* y_after) {
  if (!events_ || t_after == jump.t) return;
  const std::vector<double> kinks = driver_kinks(assembly_.mechanism(), assembly_.numbers());
  if (std::find(kinks.begin(), kinks.end(), t_after) == kinks.end()) return;
  use_mode(jump.before);
  const StateView before = kinematic_state(jump.t, jump.y.data());
  const std::vector<double> v_before(before.v, before.v + assembly_.n());
  use_mode(jump.after);
  events_->require_pushing(kinematic_state(t_after, y_after), v_before);
}

void System::spread_start_weights(const StateView&, const double* mu, double* w_q, double* w_v, double* w_z, double*) {
  const int n = assembly_.n();
  std::copy(mu, mu + n, w_q);
  std::copy(mu + n, mu + 2 * n, w_v);
  std::copy(mu + 2 * n, mu + 2 * n + assembly_.nz(), w_z);
}

void System::weights_at(double t, const double* y, const double* mu, double* w, double* gradient) {
  const int n = assembly_.n();
  std::fill(w, w + 2 * n + assembly_.nz(), 0.0);
  spread_start_weights(kinematic_state(t, y), mu, w, w + n, w + 2 * n, gradient);
}

void System::add_start_gradient(double t, const double* mu, double* gradient) {
  const auto n = static_cast<std::size_t>(assembly_.n());
  std::vector<double> w(2 * n + static_cast<std::size_t>(assembly_.nz()), 0);
  const Start s = find_start(assembly_, t, needs_start_columns(assembly_, StartDerivative::adjoint));
  spread_start_weights(s.state(t), mu, w.data(), w.data() + n, w.data() + 2 * n, gradient);
  costate::add_start_gradient(assembly_, t, s, w.data(), w.data() + n, w.data() + 2 * n, gradient);
}

const std::vector<double>* System::moved_by(double t_after) const {
  const auto at = std::find_if(moving_.begin(), moving_.end(), [&](const MovingInstant& m) { return m.t == t_after; });
  return at == moving_.end() ? nullptr : &at->by;
}

std::optional<MovingTime> System::moving_time(const Jump& jump,
                                              const std::function<void(double* y, double* yp)>& cross) {
  const double t_after = segment_start(jump.t);
  const std::vector<double>* by = moved_by(t_after);
  if (!by) return {};
  MovingTime moving;
  moving.by = *by;
  const auto side = [&](double t, const double* y, std::vector<double>& rates) {
    const MotionEvents::Side s = event_side(t, y);
    const MechanismState state = kinematic_state(t, y);
    rates.assign(state.v, state.v + assembly_.n());
    rates.insert(rates.end(), s.a.begin(), s.a.end());
    rates.insert(rates.end(), s.zdot.begin(), s.zdot.end());
    return s.cost;
  };
  moving.cost = side(jump.t, jump.y.data(), moving.before);
  std::vector<double> y = jump.y, yp = jump.yp;
  cross(y.data(), yp.data());
  moving.cost -= side(t_after, y.data(), moving.after);
  return moving;
}

void System::set_cost_tangent(const std::optional<MovingTime>& moving) {
  jump_cost_tangent_.clear();
  if (!moving) return;
  for (const double by : moving->by) jump_cost_tangent_.push_back(moving->cost * by);
}

double System::cost_of_unseen_bounces(double t, const double* y) {
  if (!events_ || !has_running_cost()) return 0;
  const double time = events_->unseen_bounces(t);
  if (time == 0) return 0;
  StateView open = kinematic_state(t, y);
  std::vector<double> z, x;
  events_->solve_unseen(open, z, x);
  open.z = z.data();
  open.a = x.data();
  open.lambda = x.data() + assembly_.n();
  const double bouncing = objective_.running_value(open, assembly_);
  return time * std::abs(running_cost(t, y) - bouncing);
}

double System::running_cost(double t, const double* y) {
  const bool accelerations = objective_.running_needs_accelerations();
  return objective_.running_value(accelerations ? mechanism_state(t, y) : kinematic_state(t, y), assembly_);
}

double System::terminal_cost(double t, const double* y) {
  // At one instant nothing averages what the integrator leaves in the multipliers among its unknowns.
  const bool accelerations = objective_.terminal_needs_accelerations();
  return objective_.terminal_value(accelerations ? solved_state(*this, t, y) : kinematic_state(t, y), assembly_);
}

namespace {
[[noreturn]] void no_jump() {
  throw CapabilityError(
      "A driver's law has a kink, where the velocities jump; this formulation is not carried across. Take index1, "
      "baumgarte, penalty or maggi, or a law with a continuous slope.");
}
}  // namespace

void DaeSystem::jump(double, double*, double*) { no_jump(); }
void DaeSystem::jump_tangent(const Jump&, double* const*, double* const*, int) { no_jump(); }
void DaeSystem::jump_adjoint(const Jump&, double*, double*, double*) { no_jump(); }
void OdeSystem::jump(double, double*) { no_jump(); }
void OdeSystem::jump_tangent(const Jump&, double* const*, int) { no_jump(); }
void OdeSystem::jump_adjoint(const Jump&, double*, double*) { no_jump(); }
void OdeSystem::adjoint_at(double, const double*, const double* w, double* mu, double*) {
  std::copy(w, w + 2 * assembly_.n() + assembly_.nz(), mu);
}

}  // namespace costate
