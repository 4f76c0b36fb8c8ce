#include "costate/integrator/explicit_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "costate/base/error.h"
#include "costate/event/guard_value.h"
#include "costate/formulation/solved_state.h"
#include "costate/integrator/stiffness_watch.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/sundials/callback_guard.h"
#include "costate/sundials/failure.h"
#include "costate/sundials/finite_values.h"

namespace costate {

namespace {
// Of the step that the estimate allows, the part that is taken; and by how much one step may differ from the next.
constexpr double kSafety = 0.9, kLeast = 0.2, kMost = 6;
// Of rates, in rtol: what a step may get wrong of them where the run is differentiated and forces bend.
constexpr double kBend = 10;
constexpr double kBefore = 0.05;  // of a touch
// A trial step without numbers, or without a solution, is shortened to this.
constexpr double kShortened = 0.25;
// A mechanism that changes its segment this often without getting on is stuck.
constexpr std::size_t kMostJumpsAtOnce = 1000;
constexpr long kPollEvaluations = 64;  // evaluations between calls of the monitor
// Steps at the border of stability in a row that make a run stiff, as many that are not to forget them, and how many
// may as well be taken.
constexpr long kStiff = 15, kNotStiff = 6;
constexpr double kFew = 2e5;
// Free flight is exact by steps of any length: one could pass over a hop, and its guard be behind its end again. Steps
// that begin with this part of the run and grow by kMost have an end within whatever lasts longer than the first one.
constexpr double kBehindEvent = 1e-6;
// The step that ends at an event: of the step that went past it the part over which its dense output tells the guard's
// rate, and how often the length is corrected by that.
constexpr double kAside = 1e-3;
constexpr int kCorrections = 8;
}  // namespace

ExplicitRun::ExplicitRun(OdeSystem& system, const SolverOptions& options, Monitor monitor, StartDerivative wanted)
    : system_(system), options_(options), monitor_(std::move(monitor)), t_start_(options.t_start) {
  const ExplicitScheme* scheme = find_explicit_scheme(options.integrator);
  if (!scheme) throw CapabilityError(fmt::format("There is no explicit Runge-Kutta scheme '{}'.", options.integrator));
  const int n = system.size();
  const bool cost = system.has_running_cost();
  step_ = std::make_unique<ExplicitStep>(
      *scheme, n, cost, [this](double t, const double* y, double* k, bool with) { evaluate(t, y, k, with); });
  y_.assign(static_cast<std::size_t>(step_->size()), 0);
  const bool derivative = system.parameter_count() > 0 && needs_start_columns(system.assembly(), wanted);
  system.start(t_start_, y_.data(), derivative ? &y_rho_ : nullptr);
  atol_.resize(y_.size());
  fill_absolute_tolerances(system, options.absolute(), step_->size(), atol_.data());
  system.begin_events(t_start_, y_.data());
  plan_ = std::make_unique<StepPlan>(system, system.objective(), t_start_, options.t_end, y_.data());
  touches_ = std::make_unique<TouchWatch>(system.assembly(), options.rtol, options.absolute());
  begin_segment(t_start_, y_);
}

ExplicitRun::~ExplicitRun() = default;

void ExplicitRun::evaluate(double t, const double* y, double* k, bool cost) {
  require_trial_state(system_, t, y);
  system_.rhs(t, y, k);
  require_values(system_, t, y, k);
  if (cost) k[system_.size()] = system_.running_cost(t, y);
}

void ExplicitRun::begin_segment(double t, const std::vector<double>& y) {
  segment_start_ = begin_ = end_time_ = t;
  end_ = y;
  ended_ = pending_step_ = false;
  h_ = 0;
}

double ExplicitRun::ahead(double t) const {
  const double stop = std::min(options_.t_end, system_.segment_limit(segment_start_));
  const double end = plan_->empty() ? stop : std::min(stop, plan_->limit(system_, t, end_.data(), false));
  return t < look_.to ? std::min(end, t + look_.step) : end;
}

const double* ExplicitRun::within_step(double begin, double t) {
  // Its ends need no dense output.
  if (t == step_->t_end()) return std::as_const(*step_).end();
  if (t == begin) return std::as_const(*step_).start();
  step_->dense((t - begin) / step_->h(), y_.data());
  return y_.data();
}

bool ExplicitRun::passed_over(double& limit) {
  if (touches_->empty()) return false;
  const auto look = touches_->look(end_time_, step_->t_end(),
                                   [&](double at) { return system_.kinematic_state(at, within_step(end_time_, at)); });
  if (!look) return false;
  // From where it begins, or to there. Whoever resolves bends meets this one within a step: at a step's end the first
  // stage would be on the one side and all others on the other, which no error estimate sees.
  look_ = *look;
  if (resolve_bends_) look_.from -= kBefore * (look_.to - look_.from);
  limit = look_.from > end_time_ ? look_.from : std::min(limit, end_time_ + look_.step);
  h_ = limit - end_time_;
  return true;
}

void ExplicitRun::fail(const std::string& what, const char* flag) {
  std::string name = scheme().name;
  std::transform(name.begin(), name.end(), name.begin(), [](unsigned char c) { return std::toupper(c); });
  FailureContext c;
  c.what = name + " " + what;
  c.flag = flag;
  c.message = last_step_error_;
  c.t = end_time_;
  c.step = h_;
  c.steps = steps_;
  std::vector<double> weights(static_cast<std::size_t>(system_.size()));
  for (std::size_t i = 0; i < weights.size(); ++i) weights[i] = 1 / (atol_[i] + options_.rtol * std::abs(end_[i]));
  c.weights = weights.data();
  c.rates = std::as_const(*step_).rate(0);
  const std::string report = failure_report(c, system_.unknowns());
  if (not_finite_ &&
      std::abs(not_finite_->t - c.t) <= not_finite_reach(options_.t_end - options_.t_start, std::abs(h_)))
    throw RunNotFinite(*not_finite_, report);
  throw SolverError(report);
}

void ExplicitRun::find_step(double h, double limit) {
  const double order = scheme().order;
  for (bool shortened = false;; shortened = true) {
    // What would be left over for the next one is taken at once.
    const bool to_the_limit = h > 0.99 * (limit - end_time_);
    if (to_the_limit) h = limit - end_time_;
    if (!(end_time_ + 0.1 * h > end_time_) && !to_the_limit) fail("no longer gets on", "TOO_SMALL_STEP");
    double factor = kShortened;
    try {
      step_->attempt(h, to_the_limit ? limit : end_time_ + h);
      double error = step_->error(options_.rtol, atol_.data());
      if (resolve_bends_)
        error = std::max(error, step_->rate_error(options_.rtol, atol_.data()) / (kBend * options_.rtol));
      if (std::isfinite(error)) {
        factor = error > 0 ? kSafety * std::pow(error, -1 / order) : kMost;
        if (error <= 1) {
          const double next = h * std::clamp(factor, kLeast, shortened ? 1.0 : kMost);
          // Of a step that was cut short for another reason than its error, the length that was in force stays.
          h_ = to_the_limit && !shortened ? std::max(h_, next) : next;
          return;
        }
        ++rejected_;
        factor = std::clamp(factor, kLeast, 1.0);
      } else {
        ++failed_;
      }
    } catch (const NoNumber& e) {
      if (last_step_error_.empty()) last_step_error_ = e.what();
      ++failed_;
    } catch (const StepError& e) {
      last_step_error_ = e.what();
      ++failed_;
    } catch (const NotFinite& e) {
      not_finite_.emplace(e);
      ++failed_;
    }
    h *= factor;
    h_ = h;
  }
}

void ExplicitRun::begin_step() {
  if (pending_step_) {
    step_->go_on();
    pending_step_ = false;
    return;
  }
  try {
    step_->begin(end_time_, end_.data());
    if (h_ <= 0) h_ = step_->first_step(options_.rtol, atol_.data(), ahead(end_time_) - end_time_);
    if (system_.has_events()) h_ = std::min(h_, kBehindEvent * (options_.t_end - options_.t_start));
  } catch (const StepError& e) {
    last_step_error_ = e.what();
    fail("could not begin", "FIRST_EVALUATION");
  } catch (const NotFinite& e) {
    not_finite_.emplace(e);
    fail("could not begin", "FIRST_EVALUATION");
  }
}

void ExplicitRun::take_step() {
  if (steps_ >= options_.max_steps) fail("reached its limit of steps", "TOO_MUCH_WORK");
  if (const double all = pace_.projected(end_time_, steps_, options_.t_end, options_.max_steps); all > 0)
    fail(pace_message(all, options_.max_steps), "TOO_MUCH_WORK");
  if (monitor_ && step_->evaluations() - polled_ >= kPollEvaluations) {
    polled_ = step_->evaluations();
    monitor_(end_time_, steps_, false);
  }
  begin_step();
  double limit = ahead(end_time_);
  if (options_.max_step_s > 0) limit = std::min(limit, end_time_ + options_.max_step_s);
  do find_step(h_, limit);
  while (passed_over(limit));
  ++steps_;
  begin_ = end_time_;
  end_time_ = step_->t_end();
  std::copy(step_->end(), step_->end() + step_->size(), end_.begin());
  pending_step_ = true;
  if (system_.has_events()) {
    auto event = system_.find_event(begin_, end_time_, [&](double at) { return within_step(begin_, at); });
    if (event && *event >= options_.events_until) {
      system_.forget_event();
      event.reset();
    }
    if (event) {
      end_step_at_event(*event);
      ended_ = true;
    }
  }
  ended_ = system_.segment_ends(end_time_, end_.data()) || ended_;
  const ExplicitStages stages{begin_, step_->h(), step_->t_end(), step_->start(), step_->size()};
  if (tape_) tape_->add_step(*step_);
  if (follower_.step) follower_.step(stages);
  watch_stiffness();
}

void ExplicitRun::end_step_at_event(double t) {
  const double whole = step_->h();
  double h = std::max(0.0, t - begin_), moved = whole;
  const auto guard = [&](double at, const double* y) {
    return guard_value(system_.pending_event(), solved_state(system_, at, y), system_.assembly());
  };
  const auto guard_within = [&](double length) {
    step_->dense(length / whole, y_.data());
    return guard(begin_ + length, y_.data());
  };
  // The guard's rate, by which the length is corrected: the dense output is smooth on either side of the event.
  const double aside = h < 0.5 * whole ? kAside * whole : -kAside * whole;
  const double rate = whole > 0 ? (guard_within(h + aside) - guard_within(h)) / aside : 0;
  const auto end_at = [&](double length) {
    h = length;
    end_time_ = begin_ + h;
    step_->attempt(h, end_time_);
    return guard(end_time_, step_->end());
  };
  double value = end_at(h);
  for (int k = 0; k < kCorrections && h > 0; ++k) {
    const double change = -value / rate;
    // To rounding, or as far as it gets on.
    if (!(std::abs(change) < 0.5 * moved) || !(end_time_ + change != end_time_)) break;
    moved = std::abs(change);
    value = end_at(std::max(0.0, h + change));
  }
  // Its far side: a force that begins there has begun, with its derivatives.
  double further = std::numeric_limits<double>::epsilon() * std::max(std::abs(end_time_), h);
  for (int k = 0; k < kCorrections && h > 0 && !(value * rate > 0); ++k, further *= 2) value = end_at(h + further);
  std::copy(step_->end(), step_->end() + step_->size(), end_.begin());
}

void ExplicitRun::watch_stiffness() {
  if (step_->stiffness() > scheme().stability) {
    not_stiff_ = 0;
    ++stiff_;
  } else if (++not_stiff_ >= kNotStiff) {
    stiff_ = 0;
  }
  const double h = step_->h(), left = options_.t_end - end_time_;
  if (stiff_ < kStiff || !(left > kFew * h)) return;
  throw StiffError(
      fmt::format("The motion is stiff at t = {:.6g} s: after {} steps the explicit scheme '{}' still takes steps of "
                  "{:.3g} s, the size at which it is stable; about {:.2g} more would follow. Take an implicit "
                  "integrator (--integrator idas, or cvodes with --cvodes-method bdf).",
                  end_time_, steps_, scheme().name, h, left / h));
}

void ExplicitRun::cross() {
  Jump jump;
  jump.t = end_time_;
  jump.event = system_.pending_event();
  jump.before = system_.mode();
  jump.y.assign(end_.begin(), end_.begin() + system_.size());
  std::vector<double> y = end_;
  const double t_after = system_.segment_start(end_time_);
  system_.jump(end_time_, y.data());
  jump.after = system_.mode();
  system_.forget_event();
  jumps_in_a_row_ = end_time_ > segment_start_ ? 0 : jumps_in_a_row_ + 1;
  if (jumps_in_a_row_ > kMostJumpsAtOnce)
    throw SolverError(fmt::format("The run does not get beyond t = {:.9g} s: one segment follows another.", jump.t));
  if (jump.event >= 0)
    events_.push_back({jump.t, system_.event_name(jump.event), system_.event_mode(jump.event), system_.event_jump(),
                       system_.event_loss()});
  ++jumps_;
  if (follower_.jump) follower_.jump(jump);
  if (tape_) tape_->add_jump(jump, {y.begin(), y.begin() + system_.size()});
  begin_segment(t_after, y);
}

void ExplicitRun::advance(double t) {
  while (end_time_ < t) {
    if (ended_) {
      cross();
      continue;
    }
    take_step();
    // Last: it may throw, and the run be gone on with.
    if (after_step_) after_step_(end_time_, end_.data());
  }
  if (t < end_time_ && pending_step_)
    step_->dense(std::max(0.0, (t - begin_) / step_->h()), y_.data());
  else
    y_ = end_;
}

Counters ExplicitRun::counters() const {
  Counters c;
  c.steps = steps_;
  c.residuals = step_->evaluations();
  c.error_test_failures = rejected_;
  c.convergence_failures = failed_;
  c.factorizations = system_.factorizations();
  c.position_iterations = system_.position_iterations();
  c.jumps = jumps_;
  c.simulations = 1;
  return c;
}

}  // namespace costate
