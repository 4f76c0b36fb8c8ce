#include "costate/integrator/runge_kutta_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "costate/base/error.h"
#include "costate/formulation/solved_state.h"
#include "costate/integrator/bend_bound.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/sundials/callback_guard.h"
#include "costate/sundials/failure.h"
#include "costate/sundials/finite_values.h"

namespace costate {

namespace {
// Of the step that the estimate allows, the part that is taken; and by how much one step may differ from the next.
constexpr double kStepSafety = 0.9, kLeast = 0.2, kMost = 6;
// Implicit steps begin where the last one's polynomial leads, which does not lead far.
constexpr double kMostImplicit = 3;
// Implicit steps divide by their length; of the run, or of the time, less than this is none.
constexpr double kInstant = 8 * std::numeric_limits<double>::epsilon();
// Steps over a touch begin so much of its length before it where bends are resolved.
constexpr double kBeforeTouch = 0.05;
// A trial step without numbers, or without a solution, is shortened to this.
constexpr double kShortened = 0.25;
// So often the time of a bend is sought anew.
constexpr int kMostSearches = 12;
// And so often an event whose step has no solution is gone towards by a part of the way.
constexpr int kMostNearer = 20;
constexpr long kPollEvaluations = 64;  // evaluations between calls of the monitor
// Free flight is exact by steps of any length: one could pass over a hop, and its guard be behind its end again. Steps
// that begin with this part of the run and grow by kMost have an end within whatever lasts longer than the first one.
constexpr double kBehindEvent = 1e-6;
// To this part of a step where a force only bends: less than what is behind a step's begin (event/touch_watch.cpp).
constexpr double kNearTouch = 1e-7;
// An error estimate below so many roundings of the state is nothing, up to what steps that have a say have.
constexpr double kIdleRounding = 0.1, kRoundings = 16;
// Of velocities, the rounding of an estimate.
constexpr double kEstimated = 64 * std::numeric_limits<double>::epsilon();
// Of the way to the stop of a slip in space the longest step, and of the largest velocity the slip that is at its end.
constexpr double kOfSlip = 0.5, kSlowestSlip = 1e-9;
constexpr const char* kTooMuchWork = "TOO_MUCH_WORK";
}  // namespace

template <class Kind>
RungeKuttaRun<Kind>::RungeKuttaRun(SystemType& system, const SolverOptions& options, Monitor monitor,
                                   StartDerivative wanted)
    : system_(system), options_(options), monitor_(std::move(monitor)), t_start_(options.t_start) {
  const Scheme* scheme = Kind::find(options.integrator);
  if (!scheme) throw CapabilityError(fmt::format("There is no Runge-Kutta scheme '{}'.", options.integrator));
  y_.assign(static_cast<std::size_t>(system.size()) + (system.has_running_cost() ? 1 : 0), 0);
  atol_.resize(y_.size());
  fill_absolute_tolerances(system, options, static_cast<int>(y_.size()), atol_.data());
  start(system.parameter_count() > 0 && needs_start_columns(system.assembly(), wanted));
  step_ = make_step(*scheme);
  longest_ = std::min(Kind::longest_step(system, *scheme), options.max_step_s > 0 ? options.max_step_s : HUGE_VAL);
  system.end_unresolved_slips(options.rtol, options.absolute());
  system.begin_events(t_start_, y_.data());
  plan_ = std::make_unique<StepPlan>(system, system.objective(), t_start_, options.t_end, y_.data());
  watch_touches(LeftBends::none);
  // A step across the kink of a force has an error that falls as a low power of its length, and each kink takes several
  // of them; one that ends there has the scheme's own. Implicit ones resolve bends.
  if (!Kind::implicit) touches_->end_steps_at_touches();
  begin_segment(t_start_, y_);
}

template <class Kind>
RungeKuttaRun<Kind>::~RungeKuttaRun() = default;

template <class Kind>
void RungeKuttaRun<Kind>::start(bool derivative) {
  if constexpr (Kind::implicit) {
    std::vector<double> yp(static_cast<std::size_t>(system_.size()));
    Eigen::MatrixXd yp_rho;
    system_.start(t_start_, y_.data(), yp.data(), derivative ? &y_rho_ : nullptr, derivative ? &yp_rho : nullptr);
  } else {
    system_.start(t_start_, y_.data(), derivative ? &y_rho_ : nullptr);
  }
}

template <class Kind>
std::unique_ptr<typename Kind::Step> RungeKuttaRun<Kind>::make_step(const Scheme& scheme) {
  const bool has_cost = system_.has_running_cost();
  if constexpr (Kind::implicit) {
    const auto residual = [this](double t, const double* y, const double* yp, double* r) {
      require_trial_state(system_, t, y);
      system_.residual(t, y, yp, r);
      require_values(system_, t, y, r);
    };
    return std::make_unique<Step>(scheme, system_, has_cost, atol_, residual);
  } else {
    const auto rates = [this](double t, const double* y, double* k, bool cost) {
      require_trial_state(system_, t, y);
      system_.rhs(t, y, k);
      require_values(system_, t, y, k);
      if (cost) k[system_.size()] = system_.running_cost(t, y);
    };
    return std::make_unique<Step>(scheme, system_.size(), has_cost, rates);
  }
}

template <class Kind>
void RungeKuttaRun<Kind>::begin_segment(double t, const std::vector<double>& y) {
  segment_start_ = begin_ = end_time_ = t;
  end_ = y;
  ended_ = pending_step_ = false;
  h_ = 0;
  if (touches_) touches_->begin_segment();
}

template <class Kind>
double RungeKuttaRun<Kind>::ahead(double t) const {
  const double stop = std::min(options_.t_end, system_.segment_limit(segment_start_));
  const double end =
      plan_->empty() ? stop : std::min({stop, plan_->limit(system_, t, end_.data(), false), plan_->next_time(t)});
  if (!(t < look_.to)) return end;
  return std::min(end, t < look_.from ? look_.from : t + look_.step);
}

template <class Kind>
const double* RungeKuttaRun<Kind>::within_step(double begin, double t) {
  // Its ends need no dense output.
  if (t == step_->t_end()) return std::as_const(*step_).end();
  if (t == begin) return std::as_const(*step_).start();
  step_->dense((t - begin) / step_->h(), y_.data());
  return y_.data();
}

template <class Kind>
bool RungeKuttaRun<Kind>::left_branch() {
  if (system_.keeps_branch(end_time_, step_->t_end(), std::as_const(*step_).end())) return false;
  h_ = kShortened * step_->h();
  ++failed_;
  return true;
}

template <class Kind>
bool RungeKuttaRun<Kind>::passed_over(double& limit) {
  if (touches_->empty()) return false;
  const auto look = touches_->look(end_time_, step_->t_end(), states_within());
  if (!look) return false;
  if (look->crossed) {
    const auto gap = [&](double at, const double* y) {
      return look->crossed->look(look_state(system_, at, y, false), system_.assembly()).m.gap;
    };
    end_step_at(end_time_, look->from, gap, kNearTouch);
    return false;
  }
  // From where it begins, or to there. Whoever resolves bends meets this one within a step: at a step's end the first
  // stage would be on the one side and all others on the other, which no error estimate sees.
  look_ = *look;
  if (resolves_bends_) look_.from -= kBeforeTouch * (look_.to - look_.from);
  limit = look_.from > end_time_ ? look_.from : std::min(limit, end_time_ + look_.step);
  h_ = limit - end_time_;
  return true;
}

template <class Kind>
void RungeKuttaRun<Kind>::fail(const std::string& what, const char* flag) {
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
  c.rates = step_->start_rates();
  c.elements = elements_at(system_, end_time_, end_.data());
  const std::string report = failure_report(c, system_.unknowns());
  if (not_finite_ &&
      std::abs(not_finite_->t - c.t) <= not_finite_reach(options_.t_end - options_.t_start, std::abs(h_)))
    throw RunNotFinite(*not_finite_, report);
  if (c.flag == kTooMuchWork) throw TooMuchWork(report);
  throw SolverError(report);
}

template <class Kind>
double RungeKuttaRun<Kind>::largest_velocity() const {
  double largest = 0;
  for (std::size_t i = 0; i < system_.unknowns().size(); ++i)
    if (system_.unknowns()[i].role == Unknown::Role::velocity) largest = std::max(largest, std::abs(end_[i]));
  return largest;
}

template <class Kind>
double RungeKuttaRun<Kind>::allowed_by_slip() const {
  return std::isfinite(slip_) ? options_.rtol * slip_ + kEstimated * largest_velocity() : HUGE_VAL;
}

template <class Kind>
double RungeKuttaRun<Kind>::most_by_slip() {
  if (!resolves_slips_) return HUGE_VAL;
  const double before =
                   std::exchange(slip_, system_.slowest_in_space(system_.look_state(end_time_, end_.data())).speed),
               step = end_time_ - std::exchange(slip_at_, end_time_);
  if (!(slip_ < before) || !std::isfinite(before) || slip_ < kSlowestSlip * largest_velocity()) return HUGE_VAL;
  return kOfSlip * slip_ * step / (before - slip_);
}

template <class Kind>
bool RungeKuttaRun<Kind>::is_idle(double h, double error) const {
  // Newton's iteration has a say, too.
  if constexpr (Kind::implicit)
    if (step_->growth() < kMostImplicit) return false;
  // It would let the step be longer than the run.
  if (error < std::pow(h / (options_.t_end - t_start_), step_->error_order())) return true;
  if (!(error < kIdleRounding)) return false;
  double largest = 0, least = HUGE_VAL;
  for (std::size_t i = 0; i < end_.size(); ++i) {
    largest = std::max(largest, std::abs(end_[i]));
    least = std::min(least, atol_[i] + options_.rtol * std::abs(end_[i]));
  }
  return error * least < kRoundings * std::numeric_limits<double>::epsilon() * largest;
}

template <class Kind>
void RungeKuttaRun<Kind>::find_step(double h, double limit) {
  const double order = step_->error_order(), by_slip = allowed_by_slip();
  BendBound bend(options_.rtol, order);
  for (bool shortened = false;; shortened = true) {
    // What would be left over for the next one is taken at once.
    const bool to_the_limit = h > 0.99 * (limit - end_time_);
    if (to_the_limit) h = limit - end_time_;
    if (!(end_time_ + 0.1 * h > end_time_) && !to_the_limit) fail("no longer gets on", "TOO_SMALL_STEP");
    double factor = kShortened;
    try {
      system_.try_step();
      step_->attempt(h, to_the_limit ? limit : end_time_ + h);
      const StepEstimate estimate = step_->estimate(options_.rtol, atol_.data());
      double error = estimate.error;
      if (bends_ != Bends::none && may_bend()) error = std::max(error, bend.excess(estimate.rate_error));
      error = std::max(error, estimate.velocity / by_slip);
      if (std::isfinite(error)) {
        factor = error > 0 ? kStepSafety * std::pow(error, -1 / order) : kMost;
        if constexpr (Kind::implicit) factor = std::min({factor, kMostImplicit, step_->growth()});
        if (error <= 1) {
          const bool idle = is_idle(h, error);
          // By more than what is taken at once where it would be left over.
          if (idle && h > 1.05 * idle_bound_) {
            h_ = h = idle_bound_;
            continue;
          }
          // What ends at a place in the scene is as long as that is near.
          if (!to_the_limit || !(limit < options_.t_end) || h > 0.99 * longest_) {
            double& longest = idle ? longest_idle_ : longest_judged_;
            longest = std::max(longest, h);
            if (idle) idle_time_ += h;
          }
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

template <class Kind>
void RungeKuttaRun<Kind>::begin_step() {
  if (pending_step_) {
    // What led over an instant does not lead further.
    if (Kind::implicit && bend_behind_)
      step_->begin(end_time_, end_.data());
    else
      step_->go_on();
    pending_step_ = false;
    return;
  }
  try {
    step_->begin(end_time_, end_.data());
    if (h_ <= 0) h_ = step_->first_step(options_.rtol, atol_.data(), ahead(end_time_) - end_time_);
    // At rest a damper with branches stands on its bend: the first stage may take the derivative of the wrong one.
    if (system_.has_events() || resolves_bends_) h_ = std::min(h_, kBehindEvent * (options_.t_end - options_.t_start));
  } catch (const StepError& e) {
    last_step_error_ = e.what();
    fail("could not begin", "FIRST_EVALUATION");
  } catch (const NotFinite& e) {
    not_finite_.emplace(e);
    fail("could not begin", "FIRST_EVALUATION");
  }
}

template <class Kind>
void RungeKuttaRun<Kind>::take_step() {
  if (steps_ >= options_.max_steps) fail("reached its limit of steps", kTooMuchWork);
  if (const double all = pace_.projected(end_time_, steps_, options_.t_end, options_.max_steps); all > 0)
    fail(pace_message(all, options_.max_steps), kTooMuchWork);
  if (monitor_ && step_->evaluations() - polled_ >= kPollEvaluations) {
    polled_ = step_->evaluations();
    monitor_(end_time_, steps_, false);
  }
  if constexpr (Kind::implicit) {
    // To the last instant before something, or behind it: no length for a step.
    const double next = ahead(end_time_), span = options_.t_end - options_.t_start;
    if (next - end_time_ <= kInstant * std::max(std::abs(next), span)) {
      begin_ = end_time_ = next;
      pending_step_ = false;
      ended_ = system_.segment_ends(end_time_, end_.data());
      return;
    }
  }
  begin_step();
  double limit = std::min(ahead(end_time_), end_time_ + std::min(longest_, most_by_slip()));
  int searches = 0;
  do find_step(h_, limit);
  while ((searches < kMostSearches && passed_bend(limit) && ++searches) || passed_over(limit) || left_branch());
  bend_behind_ = follows_bends() && bend_watch_->across(step_->t_end() - end_time_);
  ++steps_;
  begin_ = end_time_;
  stand_at_end();
  pending_step_ = true;
  if (system_.has_events()) {
    auto event = event_within();
    if (event && *event >= options_.events_until) {
      system_.forget_event();
      event.reset();
    }
    for (int nearer = 0; event && !ended_; ++nearer) {
      ended_ = end_step_at_event(*event);
      if (!ended_ && nearer == kMostNearer) fail("does not get to an event", "EVENT");
      if (!ended_) event = step_towards(*event);
    }
  }
  if (follower_.step) {
    system_.try_step();  // from the step's beginning on, as the stages were found
    follower_.step(step_->stages());
  }
  // A formulation judges by its last evaluation where it has come to: events and followers have evaluated elsewhere.
  system_.keeps_branch(begin_, end_time_, end_.data());
  ended_ = system_.segment_ends(end_time_, end_.data()) || ended_;
  if (tape_) tape_->add_step(*step_);
  if constexpr (!Kind::implicit)
    stiffness_.look(step_->stiffness(), scheme().stability, end_time_, step_->h(), options_.t_end - end_time_, steps_,
                    scheme().name);
}

template <class Kind>
void RungeKuttaRun<Kind>::advance(double t) {
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
    step_->within(std::max(0.0, (t - begin_) / step_->h()), y_.data());
  else
    y_ = end_;
}

template <class Kind>
Counters RungeKuttaRun<Kind>::counters() const {
  Counters c;
  c.steps = steps_;
  c.residuals = step_->evaluations();
  c.error_test_failures = rejected_;
  c.convergence_failures = failed_;
  c.factorizations = system_.factorizations();
  if constexpr (Kind::implicit) c.factorizations += step_->factorizations();
  c.position_iterations = system_.position_iterations();
  c.jumps = jumps_;
  c.simulations = 1;
  return c;
}

template class RungeKuttaRun<ExplicitKind>;
template class RungeKuttaRun<RadauKind>;

}  // namespace costate
