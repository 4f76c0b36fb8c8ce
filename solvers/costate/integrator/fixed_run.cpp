#include "costate/integrator/fixed_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/event_notices.h"
#include "costate/integrator/run_end.h"
#include "costate/problem/known_error.h"
#include "costate/problem/scaled_gradient.h"

namespace costate {

namespace {
constexpr long kPollSteps = 64;  // between calls of the monitor
}  // namespace

FixedRun::FixedRun(const Problem& problem, const std::vector<double>& rho, long steps, StartDerivative wanted)
    : problem_(problem),
      wanted_(wanted),
      scheme_(problem.make_discrete()),
      steps_(steps),
      grazing_(*problem.mechanism),
      offsets_(*problem.mechanism),
      idle_(*problem.mechanism),
      formulas_(*problem.mechanism, problem.objective, FormulaJumpWatch::Looks::whole),
      own_jumps_(*problem.mechanism, problem.objective) {
  scheme_->set_parameters(rho.data());
  const SolverOptions& o = problem.solver;
  scheme_->start(o.t_start, (o.t_end - o.t_start) / static_cast<double>(steps), wanted);
  plan_ = std::make_unique<StepPlan>(scheme_->assembly(), problem.objective, o.t_start, o.t_end, scheme_->state());
  WatchSettings s;
  s.rtol = o.rtol;
  s.formulation = problem.formulation;
  s.objective = problem.objective;
  s.fixed_steps = true;
  watch_ = std::make_unique<MotionWatch>(problem.mechanism, problem.parameters, rho.data(), std::move(s));
  touches_ = std::make_unique<FixedTouches>(scheme_->assembly(), scheme_->objective(), o);
  moving_ =
      moving_instants(*problem.mechanism, problem.objective, problem.parameters, scheme_->assembly().numbers(), true);
  find_places();
  cuts_possible_ = scheme_->has_events() || problem.ends_when || !places_.empty();
  running_ = scheme_->has_running_cost();
  kinks_ = driver_kinks(*problem.mechanism, scheme_->assembly().numbers());
  if (!cuts_possible_) return;
  scheme_->keep_beginnings();
  scheme_->carry_slips_from_rest();  // each step is differentiated with the direction that it found
  course_ = std::make_unique<StepInterpolant>(*scheme_);
  length_ = std::make_unique<StepLength>(*scheme_);
  crossing_ = std::make_unique<CutCrossing>(*scheme_);
  if (problem.ends_when) end_search_ = std::make_unique<EndSearch>(*problem.ends_when, o.t_start);
}

double FixedRun::forward(const std::function<void(long k)>& at) {
  Follower follower;
  if (at) follower.step = [&](long k, const StepCut*) { at(k); };
  return forward(follower);
}

double FixedRun::forward(const Follower& follower) {
  begin(follower);
  while (!finished_) {
    if (problem_.monitor && scheme_->index() % kPollSteps == 0)
      problem_.monitor(scheme_->time(), scheme_->index(), false);
    take_step();
    if (!finished_) accept(follower);
  }
  const StateView last = scheme_->state();
  watch_->finish(last.t, last.q, last.v);
  if (end_search_) conclude_end();
  const DiscreteCounters& c = scheme_->counters();
  last_ = scheme_->index();
  counters_.steps = steps_;
  counters_.newton_iterations = c.newton_iterations;
  counters_.residuals = c.residuals;
  counters_.jacobians = scheme_->matrices().step_factorizations();
  counters_.jumps = static_cast<long>(cuts_.size()) - (end_ ? 1 : 0);
  return psi_ + scheme_->objective().terminal_value(scheme_->state(), scheme_->assembly());
}

void FixedRun::begin(const Follower& follower) {
  const StateView start = scheme_->state();
  looked_ = start.t;
  if (scheme_->has_events()) scheme_->begin_events(start.t, start.q);  // a record begins with (q, v, z)
  if (end_search_) end_search_->begin(start, scheme_->assembly());
  touches_->step(start);
  watch_->begin(start.t, start.q, start.v);
  look_besides(start);
  if (follower.step) follower.step(0, nullptr);
  node(follower);
}

void FixedRun::look(const StateView& here) {
  touches_->step(here);
  watch_->step(here.t, here.q, here.v);
  look_besides(here);
}

void FixedRun::look_besides(const StateView& s) {
  if (!grazing_.empty()) grazing_.look(s, scheme_->assembly());
  if (!offsets_.empty()) offsets_.look(s, scheme_->assembly());
  if (idle_.asks(s.z) && s.lambda) idle_.look(s, scheme_->assembly());
  if (!formulas_.empty()) formulas_.look(s, scheme_->assembly());
  if (!own_jumps_.empty()) own_jumps_.look(s, scheme_->assembly());
}

void FixedRun::node(const Follower& follower) {
  if (!running_) return;
  cost_at_beginning_ = cost_;
  cost_ = scheme_->objective().running_value(scheme_->state(), scheme_->assembly());
  if (follower.node) follower.node();
}

void FixedRun::weigh(const Follower& follower, double weight) {
  if (!running_) return;
  psi_ += weight * cost_;
  if (follower.weigh) follower.weigh(weight);
}

void FixedRun::accept(const Follower& follower) {
  const double h = scheme_->length();
  const bool instant = found_ && found_->instant;
  weigh(follower, 0.5 * (last_length_ + h));
  last_length_ = h;
  StepCut* begun = std::exchange(begins_at_cut_, false) ? &cuts_.back() : nullptr;
  if (begun) begun->length_behind = h;
  if (differentiates() && (begun || found_)) {
    if (!instant) length_->calc();
    if (begun) begun->next_by_beginning = instant ? length_->of_instant() : length_->by_beginning();
  }
  if (!instant) {
    if (follower.step) follower.step(scheme_->index(), begun);
    look(scheme_->state());
  }
  if (found_) {
    complete_cut();
    if (follower.cut) follower.cut(*found_);
  }
  node(follower);
  const double mean = 0.5 * (cost_at_beginning_ + cost_);
  if (begun && differentiates()) begun->cost_rate += 0.5 * h * cost_by_time_ - mean;
  if (!found_) {
    finished_ = !(scheme_->time() < grid_time(steps_));
    if (finished_) weigh(follower, 0.5 * h);
    return;
  }
  weigh(follower, 0.5 * h);
  last_length_ = 0;
  if (differentiates()) found_->cost_rate = mean + 0.5 * h * time_change(scheme_->objective().running);
  cuts_.push_back(std::move(*found_));
  found_.reset();
  StepCut& cut = cuts_.back();
  if (cut.kind == StepCut::Kind::end) {
    if (differentiates()) cut.cost_rate += time_change(scheme_->objective().terminal);
    finished_ = true;
    return;
  }
  scheme_->load(cut.index, cut.after.data());
  begins_at_cut_ = true;
  touches_->begin_anew(scheme_->state());
  if (follower.behind) follower.behind(cut);
  node(follower);
  if (differentiates()) cost_by_time_ = time_change(scheme_->objective().running);
}

std::vector<double> FixedRun::backward(StepArchive& archive, DiscreteAdjoint& adjoint) {
  const DiscreteCounters before = scheme_->counters();
  const long jacobians_before = scheme_->matrices().step_factorizations(), last = last_;
  adjoint.clear();
  std::size_t left = cuts_.size();
  double length_behind = 0, by_beginning = 0;  // of the step behind; the weight of the time at which it begins
  for (long k = last;; --k) {
    bool factored = archive.bring_back(k);
    if (k == last) {
      if (end_) scheme_->load(k, cuts_.back().before.data());
      adjoint.add_terminal_cost();
    }
    if (left == 0 || cuts_[left - 1].index != k) adjoint.add_running_cost(0.5 * (scheme_->length() + length_behind));
    for (; left > 0 && cuts_[left - 1].index == k; --left) {
      by_beginning = cross_back(cuts_[left - 1], by_beginning, adjoint);
      factored = false;
    }
    if (problem_.monitor && k % kPollSteps == 0) problem_.monitor(scheme_->time(), last - k, true);
    if (k == 0) {
      counters_.backward_steps = last;
      counters_.backward_residuals = scheme_->counters().residuals - before.residuals;
      counters_.backward_newton_iterations = scheme_->counters().newton_iterations - before.newton_iterations;
      counters_.backward_jacobians = scheme_->matrices().step_factorizations() - jacobians_before;
      counters_.checkpoints = archive.checkpoints();
      return adjoint.finish(factored);
    }
    length_behind = scheme_->length();
    by_beginning = 0;
    if (left > 0 && cuts_[left - 1].index == k - 1) by_beginning = -adjoint.along(cuts_[left - 1].next_by_beginning);
    adjoint.step_back(factored);
  }
}

/// `by_beginning` is the weight of the time at which what is behind begins; returns that of what is before.
double FixedRun::cross_back(const StepCut& cut, double by_beginning, DiscreteAdjoint& adjoint) {
  double weight = cut.cost_rate + by_beginning;
  if (cut.kind != StepCut::Kind::end) {
    scheme_->load(cut.index, cut.after.data());
    adjoint.add_running_cost(0.5 * cut.length_behind);
    weight += crossing_->pass_back(cut, adjoint);
  }
  adjoint.add_running_cost(0.5 * cut.length_before);
  weight += adjoint.along(cut.by_end);
  CutCrossing::give_time(cut, weight, adjoint);
  if (!cut.instant) return 0;
  const double before = -adjoint.along(cut.by_end);
  adjoint.forget_rates();
  return before;
}

void FixedRun::conclude(Simulation& result) const {
  result.events = events_;
  result.end = end_;
  for (const auto& text : watch_->warnings()) notice(text);
  if (const double drift = watch_->told_drift(); drift > 0) widen_error(result, drift * result.psi);
  if (const double part = tell_of_offset(offsets_, problem_.solver.rtol); part > 0) widen_by_what_stays(result, part);
  tell_of_own_jumps(own_jumps_);
  tell_of_grazing(grazing_, scheme_->motion_events(), problem_.solver.rtol);
  tell_of_end(problem_, result, kinks_);
  tell_of_impulses(problem_, result, kinks_);
  require_finite(result);
}

void FixedRun::conclude(GradientResult& result) const {
  refuse_grazing(grazing_, problem_.solver.rtol);
  for (const auto& why : {watch_->without_derivative(), formulas_.met(), own_jumps_.met()})
    if (why) throw SolverError(*why);
  conclude(static_cast<Simulation&>(result));
  tell_of_start(problem_, result);
  tell_of_idle(idle_);
  tell_of_coincident(problem_, scheme_->assembly().numbers(), result.events);
  widen_by_drift(result, problem_.parameters, watch_->told_drift());
  require_finite(problem_, result);
}

Counters FixedRun::counters() const {
  Counters c = counters_;
  c.simulations = 1;
  c.factorizations = scheme_->matrices().step_factorizations() + scheme_->matrices().projection_factorizations();
  return c;
}

}  // namespace costate
