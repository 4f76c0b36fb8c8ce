#include "costate/integrator/segmented_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "costate/assembly/packed_state.h"
#include "costate/integrator/session_counters.h"
#include "costate/integrator/unknown_sizes.h"

namespace costate {

namespace {

// A mechanism that changes its segment this often without getting on, by more than this part of the time, is stuck.
constexpr std::size_t kMostJumpsInARow = 1000;
constexpr double kGettingOn = 1e-12;
// Segments may be too short for a session to ask whether the run is to end.
constexpr std::size_t kJumpsToPoll = 16;

/// Where the adjoint's rate jumps between a segment's beginning and its end, among what is there already in descending
/// order of time.
void add_bends(const std::vector<double>& times, double from, double to, std::vector<AdjointStop>& stops) {
  const std::size_t others = stops.size();
  const auto is_free = [&](double t) {
    return std::none_of(stops.begin(), stops.begin() + static_cast<std::ptrdiff_t>(others),
                        [&](const AdjointStop& s) { return s.to <= t && t <= s.t; });
  };
  const auto first = std::upper_bound(times.begin(), times.end(), from);
  for (auto t = std::lower_bound(times.begin(), times.end(), to); t-- > first;)
    if (is_free(*t)) stops.push_back({*t, *t, nullptr, nullptr, [](AdjointState&, std::vector<double>&) {}});
  std::inplace_merge(stops.begin(), stops.begin() + static_cast<std::ptrdiff_t>(others), stops.end(),
                     [](const AdjointStop& a, const AdjointStop& b) { return a.t > b.t; });
}

}  // namespace

template <class Session, class SystemType>
void SegmentedRun<Session, SystemType>::advance_segments(double t, Trajectory* trajectory) {
  std::size_t in_a_row = 0;
  double last = t_start_;
  StepSink sink = after_step_;
  if (slow_)
    sink = [this](double at, const double* y) {
      slow_->step(at, y, session().yp());
      if (after_step_) after_step_(at, y);
    };
  while (!session().advance_segment(t, trajectory, sink)) {
    Jump jump;
    SegmentStart start;
    session().jump(jump, start);
    if (jump.t - last > kGettingOn * std::max(std::abs(jump.t), options_.t_end - t_start_)) {
      in_a_row = 0;
      last = jump.t;
    }
    if (monitor_ && links_.size() % kJumpsToPoll == 0) monitor_(jump.t, start.steps, false);
    if (++in_a_row > kMostJumpsInARow)
      throw SolverError(fmt::format("The run does not get beyond t = {:.9g} s: one segment follows another{}.", jump.t,
                                    events_.empty() ? "" : fmt::format(", by {} in turn", last_events(events_))));
    if (jump.event >= 0) {
      events_.push_back({jump.t, system_.event_name(jump.event), system_.event_mode(jump.event), system_.event_jump(),
                         system_.event_loss(), system_.cost_of_unseen_bounces(start.t, start.y.data())});
      chatter_.look(events_, options_.t_end);
      if (trajectory) keep_met(jump);
    }
    if (slow_) slow_->jump(jump, start.t, start.y.data(), start.yp.empty() ? nullptr : start.yp.data());
    links_.push_back({std::move(jump), start.restart});
    session().read_forward_counters();
    if (adjoint_) note_length(session().counters());
    if (!adjoint_) {
      add_session(past_, session().counters());
      sessions_.clear();
    }
    begin_segment(start, sessions_.emplace_back());
    if (!adjoint_) continue;
    starts_.push_back(std::move(start));
    drop_segments();
  }
}

template <class Session, class SystemType>
void SegmentedRun<Session, SystemType>::begin_segment(const SegmentStart& start, std::unique_ptr<Session>& session) {
  // That a repetition takes the same pivots; in every adjoint run, whether or not it repeats something.
  if (adjoint_) system_.forget_history();
  session = make_session_(start);
  session->follow(plan_of_steps_);
  touches_->begin_segment();
  session->follow(touches_.get());
  if (smooth_) session->follow_smooth_motion();
  if (cost_) session->enable_cost();
  if (sensitivities_) session->enable_sensitivities();
  if (adjoint_) session->enable_adjoint(plan_);
}

template <class Session, class SystemType>
void SegmentedRun<Session, SystemType>::drop_segments() {
  while (sessions_.size() - scales_.size() > most_kept_ && scales_.size() + 2 < sessions_.size()) {
    std::unique_ptr<Session>& oldest = sessions_[scales_.size() + 1];
    oldest->read_forward_counters();
    add_session(past_, oldest->counters());
    ++past_.checkpoints;
    scales_.push_back(oldest->adjoint_scale());
    oldest.reset();
  }
}

template <class Session, class SystemType>
std::vector<double> SegmentedRun<Session, SystemType>::solve_adjoint(const SampleAdjoint& cross) {
  std::vector<double> gradient(static_cast<std::size_t>(system_.parameter_count()), 0);
  AdjointScale scale;
  for (std::size_t k = 0; k < sessions_.size(); ++k)
    scale.add_segment(sessions_[k] ? sessions_[k]->adjoint_scale() : scales_[k - 1],
                      (k < links_.size() ? links_[k].jump.t : t_) - (k > 0 ? links_[k - 1].jump.t : t_start_));
  AdjointSize size = scale.with_terminal(system_.terminal_cost(t_, session().y()), session().y(), system_.unknowns());
  const auto cost_gradient = [&](const double* y, double* g_y) {
    if constexpr (std::is_same_v<SystemType, OdeSystem>)
      system_.running_cost_gradient(t_, y, g_y);
    else
      system_.running_cost_gradient(t_, y, g_y, 0, nullptr);
  };
  // A bend of the cost just there would pass for rounding: no more than what is nothing in psi.
  if (scale.position() > 0)
    size.least = std::min(
        (t_ - t_start_) * rounding_of_cost_gradient(system_, session().y(), options_.absolute(), cost_gradient),
        negligible_cost(system_.assembly().mechanism(), system_.objective(), options_) / scale.position());
  AdjointState mu = session().end_adjoint(gradient);
  // A sample makes it jump.
  if (samples_.empty()) invariant_.end(system_, t_start_, t_, session().y(), mu.mu.data());
  const std::shared_ptr<const StepPlan> plan = plan_back();
  const std::vector<double> bends = touches_->passages();
  auto next = samples_.rbegin();
  if (SlowStretches* slow = slow_slips(t_)) slow->leave_out_long_ones(options_.rtol);
  std::size_t left = slow_ ? slow_->all().size() : 0;  // stretches that are not crossed yet
  const auto stretch_of = [&](std::size_t k) {
    return left > 0 && slow_->all()[left - 1].session == k ? &slow_->all()[left - 1] : nullptr;
  };
  for (std::size_t k = sessions_.size(); k-- > 0;) {
    const bool again = !sessions_[k];
    if (again) {  // in the mode that the jump behind it has left in force
      begin_segment(starts_[k - 1], sessions_[k]);
      sessions_[k]->repeat_segment(links_[k].jump.t);
    }
    std::vector<AdjointStop> stops;
    const auto add_stretches_behind = [&](double t) {
      for (const auto* s = stretch_of(k); s && (s->end > t || s->begin >= t); s = stretch_of(k)) {
        const std::size_t i = --left;
        stops.push_back({s->end, s->begin, s->y.data(), s->yp.data(),
                         [this, i](AdjointState& m, std::vector<double>& g) { cross_slowly(i, m, g); }});
      }
    };
    for (; next != samples_.rend() && next->session == k; ++next) {
      add_stretches_behind(next->t);
      stops.push_back({next->t, next->t, next->y.data(), next->yp.data(),
                       [&cross, sample = &*next](AdjointState& m, std::vector<double>& g) {
                         cross(sample->index, sample->t, sample->y, sample->yp, m, g);
                       }});
    }
    add_stretches_behind(-std::numeric_limits<double>::infinity());
    add_bends(bends, k > 0 ? links_[k - 1].jump.t : t_start_, k < links_.size() ? links_[k].jump.t : t_, stops);
    sessions_[k]->follow_back(plan);
    sessions_[k]->solve_backward(mu, size, gradient, stops);
    if (again) {
      if (!(sessions_[k]->adjoint_growth().change() <= growth_.change())) growth_ = sessions_[k]->adjoint_growth();
      add_session(past_, sessions_[k]->counters());
      sessions_[k].reset();
    }
    if (k == 0 || links_[k - 1].restart) continue;
    const Jump& jump = links_[k - 1].jump;
    if (const auto* stretch = stretch_of(k - 1); stretch && stretch->stop >= 0)
      system_.use_mode(jump.before);  // it crosses its stop itself
    else
      Session::transfer_adjoint(system_, jump, mu, gradient);
  }
  invariant_.start(system_, t_start_, start_y_.data(), mu.mu.data());
  sessions_.front()->add_start_gradient(mu, gradient);  // last: it leaves the system at no point of the motion
  return gradient;
}

template <class Session, class SystemType>
void SegmentedRun<Session, SystemType>::cross_slowly(std::size_t stretch, AdjointState& mu,
                                                     std::vector<double>& gradient) {
  const SlowStretches::Stretch& s = slow_->all()[stretch];
  std::vector<double> w(static_cast<std::size_t>(2 * system_.assembly().n() + system_.assembly().nz()));
  system_.use_mode(s.mode_after);
  system_.weights_at(s.end, s.y_after.data(), mu.mu.data(), w.data(), gradient.data());
  slow_->map(stretch, options_.rtol).pull(w.data(), gradient.data());
  system_.use_mode(s.mode);
  if constexpr (std::is_same_v<SystemType, OdeSystem>)
    system_.adjoint_at(s.begin, s.y.data(), w.data(), mu.mu.data(), gradient.data());
  else
    system_.adjoint_at(s.begin, s.y.data(), w.data(), mu.mu.data(), mu.mup.data(), gradient.data());
}

/// While the run is there: the positions that go with independent coordinates are those near the last ones.
template <class Session, class SystemType>
void SegmentedRun<Session, SystemType>::keep_met(const Jump& jump) {
  const int mode = system_.mode(), n = system_.assembly().n(), nz = system_.assembly().nz();
  system_.use_mode(jump.before);
  met_.push_back({jump.t, jump.event, packed(system_.kinematic_state(jump.t, jump.y.data()), n, nz)});
  system_.use_mode(mode);
}

template <class Session, class SystemType>
Counters SegmentedRun<Session, SystemType>::counters() const {
  Counters sum = past_;
  for (const auto& s : sessions_)
    if (s) add_session(sum, s->counters());
  sum.jumps = std::count_if(links_.begin(), links_.end(), [](const Link& l) { return !l.restart; });
  return sum;
}

template class SegmentedRun<IdaSession, DaeSystem>;
template class SegmentedRun<CvodeSession, OdeSystem>;

}  // namespace costate
