#include "costate/tradeoff/pilot_race.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/base/unsaid.h"
#include "costate/formulation/formulation.h"
#include "costate/integrator/simulate.h"
#include "costate/objective/sampled_cost.h"
#include "costate/tradeoff/stopwatch.h"

namespace costate {

namespace {

// Of the time that is asked for.
constexpr double kPart = 0.15;
// One that has taken so many times what the best one took to the same time is given up, but not before a part of what
// the best one took in all: methods of many steps begin with small ones. Nor before what a clock can tell.
constexpr double kBehind = 1.3, kBeginning = 0.15, kShortest_s = 1e-4;
// Where one is as fast as that, going on with the race costs more than it saves.
constexpr double kNoRace_s = 5e-4;
// What each has before another one's turn at first, how much more in the next round, and what part of the leader's way
// it must have come by then.
constexpr double kSlice_s = 2e-3, kLonger = 4, kNear = 0.4;
// At so tight a tolerance a failure is not due to it.
constexpr double kTightPilot = 1e-9, kLoosestPilot = 0.03;

}  // namespace

double PilotRace::Pace::at(double t) const {
  const auto later = std::lower_bound(points.begin(), points.end(), std::pair(t, 0.0));
  return later == points.end() ? (points.empty() ? 0 : points.back().second) : later->second;
}

PilotRace::PilotRace(const Problem& problem, const std::vector<double>& rho, bool redundant, Serves serves, Terms terms)
    : problem_(problem), rho_(rho), redundant_(redundant), serves_(std::move(serves)), terms_(std::move(terms)) {
  problem_.solver.confirm = false;
  // A cost of the cycle is none of a run from the scene's start.
  if (problem_.cycle) {
    problem_.objective = {};
    problem_.cycle.reset();
  }
  // Where an event ends the run nobody knows what part of the time it takes, and t_end is no more than a bound; samples
  // have their times.
  if (!problem_.ends_when && !has_samples(problem_.objective))
    problem_.solver.t_end = problem_.solver.t_start + kPart * (problem_.solver.t_end - problem_.solver.t_start);
  problem_.monitor = [this, outer = problem.monitor](double t, long steps, bool backward) {
    if (outer) outer(t, steps, backward);
    const double spent = weight_ * (processor_time_s() - began_);
    if (mine_.points.empty() || t > mine_.points.back().first) mine_.points.emplace_back(t, spent);
    if (slice_ > 0 && spent > weight_ * slice_) {
      sliced_ = true;
      throw Cut(fmt::format("at t = {:.4g} s after {:.2g} s, when another one had ended", t, slice_));
    }
    if (!best_.points.empty() &&
        spent > std::max({kBehind * best_.at(t), kBeginning * best_.points.back().second, kShortest_s}))
      throw Cut(fmt::format("at t = {:.4g} s, {:.2g} times behind the best", t, spent / best_.at(t)));
  };
}

/// On each integrator the first formulation that serves, the problem's own before all, the explicit schemes' best order
/// alone. Or all others.
std::vector<Combination> PilotRace::candidates(bool preferred) const {
  std::vector<const Formulation*> order = {&find_formulation(problem_.formulation)};
  for (const Formulation* f : stand_ins(redundant_))
    if (f != order.front()) order.push_back(f);
  for (const Formulation& f : formulations())
    if (f.stand_in == 0 && f.adjoint_order < 2 && &f != order.front()) order.push_back(&f);
  std::vector<Combination> first, others;
  // The highest order first: it is what most motions are fastest by, and what the others are then given up by.
  const auto& all = integrators();
  bool scheme = false;
  for (auto i = all.rbegin(); i != all.rend(); ++i) {
    bool found = i->discrete && scheme;  // of lower order
    for (const Formulation* f : order)
      if (may(*f, *i)) {
        (found ? others : first).push_back({f->name, i->name});
        found = true;
        scheme = scheme || i->discrete;
      }
  }
  return preferred ? first : others;
}

bool PilotRace::may(const Formulation& f, const Integrator& i) const {
  return i.step_control && i.carries(f) && f.exact_constraints() && (f.carries_redundancy || !redundant_) &&
         serves_(f, i);
}

AccuracyPilot PilotRace::one(const Combination& c, double rtol) {
  AccuracyPilot p;
  p.what = c;
  const Integrator& integrator = find_integrator(c.integrator);
  weight_ = terms_.weight ? terms_.weight(find_formulation(c.formulation), integrator) : 1;
  if (integrator.discrete) rtol = std::min(terms_.schemes_rtol * rtol, kLoosestPilot);
  p.rtol = rtol;
  p.until = problem_.solver.t_end;
  Problem problem = problem_;
  problem.formulation = c.formulation;
  problem.solver.integrator = c.integrator;
  problem.solver.set_rtol(rtol);
  const Unsaid judging;
  mine_.points.clear();
  began_ = processor_time_s();
  try {
    p.psi = simulate(problem, rho_).psi;
  } catch (const Cut& e) {
    if (best_.points.empty() && !sliced_) throw;  // the caller's
    p.why = std::string("given up ") + e.what();
  } catch (const CapabilityError& e) {
    p.why = e.what();
    failure_ = std::current_exception();
  } catch (const SolverError& e) {
    p.why = e.what();
    failure_ = std::current_exception();
  }
  p.time_s = processor_time_s() - began_;
  p.cost_s = weight_ * p.time_s;
  if (p.why.empty() && (best_.points.empty() || p.cost_s < best_.points.back().second)) {
    mine_.points.emplace_back(problem.solver.t_end, p.cost_s);
    best_ = mine_;
  }
  return p;
}

/// Until one has ended each has a slice of time, then a longer one: none that hardly gets on keeps the others waiting.
/// Those far behind the leader of a round wait until all before them have failed.
void PilotRace::heat(std::vector<Combination> waiting, double rtol, std::vector<AccuracyPilot>& ended) {
  std::vector<Combination> behind;
  for (double slice = kSlice_s; !waiting.empty() && ended.empty(); slice *= kLonger) {
    std::vector<std::pair<Combination, double>> again;  // and how far it came
    std::vector<AccuracyPilot> slow;
    double leader = 0;
    for (const Combination& c : waiting) {
      slice_ = ended.empty() ? slice : 0;
      sliced_ = false;
      const AccuracyPilot p = one(c, rtol);
      if (sliced_) {
        again.emplace_back(c, mine_.points.back().first - problem_.solver.t_start);
        leader = std::max(leader, again.back().second);
        slow.push_back(p);
        continue;
      }
      pilots_.push_back(p);
      if (!p.why.empty()) continue;
      ended.push_back(p);
      if (p.time_s < kNoRace_s) break;
    }
    if (!ended.empty()) pilots_.insert(pilots_.end(), slow.begin(), slow.end());
    waiting.clear();
    for (const auto& [c, came] : again) (came < kNear * leader ? behind : waiting).push_back(c);
    if (waiting.empty()) waiting.swap(behind);
  }
}

std::vector<AccuracyPilot> PilotRace::run(double rtol) {
  std::vector<AccuracyPilot> ended;
  for (; ended.empty(); rtol /= 100) {
    bool any = false;
    for (const bool preferred : {true, false}) {
      if (!ended.empty()) break;
      const std::vector<Combination> all = candidates(preferred);
      any = any || !all.empty();
      heat(all, rtol, ended);
    }
    const auto faster = [](const auto& a, const auto& b) { return a.cost_s < b.cost_s; };
    std::stable_sort(ended.begin(), ended.end(), faster);
    if (!any)
      throw CapabilityError("No formulation can be held to an accuracy here together with what else was chosen.");
    if (ended.empty() && rtol <= kTightPilot) std::rethrow_exception(failure_);
  }
  return ended;
}

}  // namespace costate
