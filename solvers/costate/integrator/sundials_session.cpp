#include "costate/integrator/sundials_session.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>
#include <utility>

#include "costate/integrator/stiffness_watch.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/sundials/failure.h"
#include "costate/sundials/finite_values.h"

namespace costate {

template <class Api>
SundialsSession<Api>::~SundialsSession() {
  if (memory_) Api::free(&memory_);
}

template <class Api>
void SundialsSession<Api>::open(void* memory) {
  if (!memory) throw SolverError(std::string(Api::name) + " could not be created.");
  memory_ = memory;
  Api::capture_messages(memory_, message_);
}

template <class Api>
void SundialsSession<Api>::set_up() {
  check(Api::set_user_data(memory_, self()), "the user's data");
  check(Api::set_max_steps(memory_, options_.max_steps), "the limit of steps");
  check(Api::set_max_error_test_failures(memory_, kMostFailedErrorTests), "the limit of failed error tests");
  if (options_.max_step_s > 0) check(Api::set_max_step(memory_, options_.max_step_s), "the largest step");
  check(Api::set_stop_time(memory_, stop()), "the end");
  newton_ = std::make_unique<NewtonOperator>(context_, guard_, [this](double* b) { solve_newton(b); });
  check(Api::set_linear_solver(memory_, newton_->solver(), newton_->matrix()), "Newton's operator");
}

template <class Api>
void SundialsSession<Api>::check(int flag, const char* what) {
  if (flag >= 0) return;
  guard_.rethrow();
  throw SolverError(fmt::format("{}: {} failed [{}]. {}", Api::name, what, flag_name_of<Api>(flag), message_));
}

template <class Api>
void SundialsSession<Api>::fail(bool backward, int flag, const std::string& what) {
  guard_.rethrow();
  const std::vector<Unknown> unknowns = backward ? names_back() : names();
  void* m = backward ? back_->memory : memory_;
  Vector weights(unknowns.size(), context_), errors(unknowns.size(), context_), rates(unknowns.size(), context_);
  FailureContext c;
  c.what = std::string(Api::name) + " " + what;
  c.flag = flag_name_of<Api>(flag);
  const std::string& refused = guard_.last_step_error();
  c.message = Api::is_evaluation(flag) && !refused.empty() ? refused : message_;
  if (!refused.empty() && (flag == Api::no_progress || flag == Api::too_much_work))
    c.message = "The last evaluation that failed: " + refused;
  Api::weights(m, weights);
  Api::local_errors(m, errors);
  Api::current_time(m, &c.t);
  Api::current_step(m, &c.step);
  Api::steps(m, &c.steps);
  c.weights = weights.data();
  c.errors = errors.data();
  if (Api::dky(m, c.t, 1, rates) >= 0) c.rates = rates.data();
  const auto state = [&](double t) { return Api::dky(m, t, 0, y_) >= 0 ? y() : nullptr; };
  c.elements = backward ? elements_at(system_, forward_.time(), forward_.last())
                        : elements_at(system_, {c.t, c.t - last_step(c.t)}, state);
  const std::string report = failure_report(c, unknowns);
  guard_.throw_not_finite(c.t, not_finite_reach(options_.t_end - options_.t_start, c.step), report);
  // Where Adams' method does not get on BDF may: of stiffness as short as the stop of a slip it is not told apart.
  if (!Api::implicit && !backward && flag == Api::too_much_work && options_.cvodes_method == "adams")
    throw StiffError(report);
  if (flag == Api::too_much_work) throw TooMuchWork(report);
  throw SolverError(report);
}

template <class Api>
void SundialsSession<Api>::limit_steps() {
  if (start_.steps + steps(memory_) >= options_.max_steps)
    fail(false, Api::too_much_work, "reached its limit of steps");
}

template <class Api>
void SundialsSession<Api>::watch_forward() {
  if (watch_) watch_->forward(steps(memory_));
}

template <class Api>
void SundialsSession<Api>::poll(double t, bool backward) {
  if (stall_.stalled(t)) fail(backward, Api::no_progress, "no longer gets on");
  const long taken = backward ? steps_back_ + steps(back_->memory) : steps(memory_);
  const double to = backward ? options_.t_start : options_.t_end;
  if (const double all = (backward ? pace_back_ : pace_).projected(t, taken, to, options_.max_steps); all > 0)
    fail(backward, Api::too_much_work, pace_message(all, options_.max_steps));
  if (backward) watch_noise_back(taken);
  if (!monitor_ || ++polls_ % 64 != 0) return;
  monitor_(t, steps(memory_), backward);
}

template <class Api>
void SundialsSession<Api>::follow(std::shared_ptr<const StepPlan> plan) {
  plan_ = plan && !plan->empty() ? std::move(plan) : nullptr;
  plan_back_ = plan_;
  if (!Api::implicit || !bounded()) return;
  // Without an evaluation IDAS chooses its first step; the first evaluation lifts this bound (look_ahead).
  const double first = limit(t_, y()) - t_;
  if (std::isfinite(first) && !(options_.max_step_s > 0 && options_.max_step_s < first))
    check(Api::set_max_step(memory_, first), "the first step's bound");
}

template <class Api>
double SundialsSession<Api>::limit(double t, const double* y) {
  const double end = plan_ ? plan_->limit(system_, t, y, false) : std::numeric_limits<double>::infinity();
  if (!(t < start_.look.to)) return end;
  return std::min(end, t < start_.look.from ? start_.look.from : t + start_.look.step);
}

template <class Api>
void SundialsSession<Api>::look_ahead(double t, const double* y) {
  if (!bounded()) return;
  if (Api::implicit) Api::set_max_step(memory_, std::max(0.0, options_.max_step_s));
  if (same_time(t, ahead_)) place_ = t;
  ahead_of_ = t;
  ahead_ = limit(t, y);
  Api::set_stop_time(memory_, std::min(stop(), ahead_));
}

template <class Api>
bool SundialsSession<Api>::was_too_long(double t) const {
  if (!bounded() || t != ahead_of_) return false;
  return last_step(t) > kLongAgainstNext * (ahead_ - t);
}

template <class Api>
double SundialsSession<Api>::last_step(double t) const {
  double h = 0;
  if (t > start_time_) Api::last_step(memory_, &h);
  return h;
}

template <class Api>
long SundialsSession<Api>::error_test_failures() const {
  long count = 0;
  Api::error_test_failures(memory_, &count);
  return count;
}

template <class Api>
bool SundialsSession<Api>::fell(double before, long failures) const {
  if (!(before > 0) || error_test_failures() == failures) return false;
  double h = 0;
  Api::last_step(memory_, &h);
  return before > kLongAgainstNext * h;
}

template <class Api>
void SundialsSession<Api>::remember(double t) {
  const double known = t_;
  interpolate(t);
  restart_ = true;
  begun_.emplace();
  jump(begun_->first, begun_->second);
  restart_ = false;
  t_ = known;
}

template <class Api>
void SundialsSession<Api>::enable_cost() {
  if (!system_.has_running_cost() || cost_is_unknown()) return;
  q_ = Vector(1, context_);
  q_.data()[0] = start_.cost;
  check(Api::init_quadrature(memory_, quadrature_function(), q_), "psi's quadrature");
  check(Api::set_quadrature_tolerances(memory_, options_.rtol, cost_tolerance(system_, options_)), "psi's tolerances");
  check(Api::set_quadrature_error_control(memory_, SUNTRUE), "psi's error control");
}

template <class Api>
void SundialsSession<Api>::enable_adjoint(const CheckpointPlan& plan) {
  adjoint_ = true;
  adjoint_scale_.measure_forces_in(force_size(system_.assembly().mechanism()));
  watch_.emplace(system_, plan);
  checkpoint_steps_ = plan.steps;
  // IDAS restarts the quadratures wrongly when it repeats the first segment (corrected in 2026, llnl/sundials#888), so
  // that under error control its steps may differ from the original's.
  if (Api::implicit && plan.repeats && system_.has_running_cost())
    check(Api::set_quadrature_error_control(memory_, SUNFALSE), "psi's error control");
}

template <class Api>
double SundialsSession<Api>::cost() {
  if (!system_.has_running_cost()) return 0;
  if (cost_is_unknown()) return y_.data()[system_.size()];
  // A segment that begins where the run ends has no step.
  if (steps(memory_) == 0) return start_.cost;
  check(Api::quadrature_dky(memory_, within_last_step(memory_, t_), 0, q_), "psi");
  return q_.data()[0];
}

template <class Api>
double SundialsSession<Api>::running_cost(double t, const double* x) {
  const double g = system_.running_cost(t, x);
  if (!adjoint_ || !adjoint_scale_.is_due(t, g)) return g;
  if constexpr (Api::implicit)
    system_.running_cost_gradient(t, x, g_y_.data(), 0, nullptr);
  else
    system_.running_cost_gradient(t, x, g_y_.data());
  adjoint_scale_.sample(x, g_y_, system_.unknowns());
  return g;
}

template <class Api>
void SundialsSession<Api>::solve(double to, double* reached, bool one_step) {
  int checkpoints = 0;
  // Not before: IDAS frees what a session without a step has never allocated.
  if (checkpoint_steps_ > 0) check(Api::init_adjoint(memory_, std::exchange(checkpoint_steps_, 0)), "the adjoint");
  const int flag = Api::solve(memory_, to, reached, y_, yp_, one_step, adjoint_ ? &checkpoints : nullptr);
  if (flag < 0) fail(false, flag, "could not continue the simulation");
  if (adjoint_) counters_.checkpoints = checkpoints;
}

template <class Api>
void SundialsSession<Api>::interpolate(double t) {
  check(Api::dky(memory_, t, 0, y_), "interpolation");
  if (Api::implicit) check(Api::dky(memory_, t, 1, yp_), "interpolation");
  t_ = t;
}

template <class Api>
void SundialsSession<Api>::advance(double t) {
  if (t <= t_) return;
  solve(t, &t_, false);
  if (t_ >= options_.t_end) complete_end();
}

template <class Api>
void SundialsSession<Api>::repeat_segment(double end) {
  while (step_end_ < end) {
    limit_steps();
    if (bounded() && adjoint_) Api::set_stop_time(memory_, stop());
    solve(options_.t_end, &step_end_, true);
    step_end_ = std::min(step_end_, end);
  }
  interpolate(end);
}

template <class Api>
bool SundialsSession<Api>::advance_segment(double t, Trajectory* trajectory, const StepSink& after_step) {
  const double known = step_end_;  // y_ may hold an earlier time of the step that ends there
  while (step_end_ < t && !(steps(memory_) == 0 && same_time(step_end_, t))) {  // no step fits in there
    if (ended_) {
      interpolate(step_end_);
      return false;
    }
    limit_steps();
    const double begin = step_end_;
    // What the repetitions begin with is the end of all; the next step is bounded already.
    if (bounded() && adjoint_) Api::set_stop_time(memory_, stop());
    const double before = same_time(begin, place_) ? last_step(begin) : 0;
    const long failures = error_test_failures();
    if (Api::implicit && before > 0) remember(begin);
    solve(options_.t_end, &step_end_, true);
    if (fell(before, failures)) {
      step_end_ = begin;
      ended_ = restart_ = true;
      continue;
    }
    begun_.reset();
    const double own_end = step_end_;
    looks_.forget();
    if (passed_over(begin) && step_end_ <= begin) continue;
    auto event = system_.find_event(begin, step_end_, [&](double at) { return within_step(at, own_end); });
    if (event && *event >= options_.events_until) {
      system_.forget_event();
      event.reset();
    }
    if (event) {
      step_end_ = *event;
      passed_.reset();
    }
    if (step_end_ != own_end) interpolate(step_end_);
    ended_ = event || system_.segment_ends(step_end_, y());
    const bool led = asks_for_lead();
    restart_ = !ended_ && step_end_ < options_.t_end && (led || passed_ || was_too_long(step_end_));
    start_.led = start_.led || (restart_ && led);
    ended_ = ended_ || restart_;
    if (trajectory) record_step(begin, step_end_, *trajectory);
    // Last: it may throw, and the run be gone on with.
    if (after_step) after_step(step_end_, y());
  }
  if (t < step_end_ || (t_ < t && t == known)) interpolate(t);
  t_ = t;
  if (t_ >= options_.t_end) complete_end();
  return true;
}

template <class Api>
const double* SundialsSession<Api>::within_step(double t, double own_end) {
  const auto interpolate = [&](double at, N_Vector state) { check(Api::dky(memory_, at, 0, state), "interpolation"); };
  return t == own_end ? y() : looks_.at(t, interpolate).data();
}

template <class Api>
bool SundialsSession<Api>::passed_over(double begin) {
  if (!touches_) return false;
  passed_ = touches_->look(begin, step_end_, [&](double t) {
    return look_state(system_, t, within_step(t, step_end_), touches_->needs_accelerations());
  });
  if (passed_) step_end_ = system_.begins_at_step_ends() ? begin : passed_->from;
  if (passed_ && step_end_ <= begin) ended_ = restart_ = true;
  return passed_.has_value();
}

template <class Api>
void SundialsSession<Api>::record_step(double begin, double end, Trajectory& trajectory) {
  if (!(begin < end)) return;  // an event at the beginning
  int order = 0;
  Api::last_order(memory_, &order);
  Vector at(y_.size(), context_);
  const auto derivative = [&](double t, int k) { check(Api::dky(memory_, t, k, at), "interpolation"); };
  if (!system_.begins_with_motion()) {
    trajectory.add_step(begin, end, order, [&](double t) {
      derivative(t, 0);
      return system_.look_state(t, at.data());
    });
    return;
  }
  std::vector<std::vector<double>> d(static_cast<std::size_t>(order) + 1);
  for (int k = 0; k <= order; ++k) {
    derivative(end, k);
    d[static_cast<std::size_t>(k)].assign(at.data(), at.data() + trajectory.width());
  }
  trajectory.add_step(begin, end, d, order);
}

template <class Api>
void SundialsSession<Api>::jump(Jump& jump, SegmentStart& start) {
  if (ended_ && begun_) {
    std::tie(jump, start) = std::move(*begun_);
    return;
  }
  jump.t = t_;
  start.steps = start_.steps + steps(memory_);
  start.restart = restart_;
  start.led = start_.led;
  // A look goes on behind a restart of another cause.
  if (passed_)
    start.look = *passed_;
  else if (t_ < start_.look.to)
    start.look = start_.look;
  jump.event = restart_ ? -1 : system_.pending_event();
  start.t = restart_ ? t_ : system_.segment_start(t_);
  jump.before = system_.mode();
  jump.y.assign(y(), y() + system_.size());
  start.y.assign(y(), y() + y_.size());
  if constexpr (Api::implicit) {
    jump.yp.assign(yp_.data(), yp_.data() + system_.size());
    start.yp.assign(yp_.data(), yp_.data() + yp_.size());
    if (!restart_) system_.jump(t_, start.y.data(), start.yp.data());
  } else if (!restart_) {
    system_.jump(t_, start.y.data());
  }
  jump.after = system_.mode();
  if (!restart_ && jump.event < 0) system_.require_contacts_follow(jump, start.t, start.y.data());
  if (jump.event >= 0) look_at_hop(start, start.t, system_.event_hop());
  start.cost = cost();
  if (!restart_) system_.forget_event();
  if (yS_.count() == 0) return;
  check(Api::sensitivity_dky(memory_, t_, 0, yS_.handles()), "sensitivities");
  for (int j = 0; j < yS_.count(); ++j) start.s.emplace_back(yS_.data(j), yS_.data(j) + y_.size());
  jump_sensitivities(jump, start);
}

template <class Api>
void SundialsSession<Api>::read_forward_counters() {
  Counters& c = counters_;
  Api::steps(memory_, &c.steps);
  Api::evaluations(memory_, &c.residuals);
  Api::newton_iterations(memory_, &c.newton_iterations);
  Api::error_test_failures(memory_, &c.error_test_failures);
  Api::convergence_failures(memory_, &c.convergence_failures);
  if (yS_.count() > 0) Api::sensitivity_evaluations(memory_, &c.sensitivity_residuals);
  c.jacobians = newton_setups_;
  c.factorizations = system_.factorizations();
  c.position_iterations = system_.position_iterations();
  c.simulations = 1;
}

template class SundialsSession<IdaApi>;
template class SundialsSession<CvodeApi>;

}  // namespace costate
