#include "costate/tradeoff/accurate_run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/unsaid.h"
#include "costate/formulation/formulation.h"
#include "costate/integrator/bent_motion.h"
#include "costate/integrator/integrators.h"
#include "costate/integrator/run_budget.h"
#include "costate/integrator/run_watch.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/problem/redundant_rows.h"
#include "costate/problem/scaled_gradient.h"
#include "costate/sensitivity/confirmation.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/error_order.h"
#include "costate/tradeoff/gradient_price.h"
#include "costate/tradeoff/trade_reference.h"
#include "costate/tradeoff/two_runs.h"

namespace costate {

namespace {

constexpr int kSamples = 60;
// At so tight a tolerance a failure is not due to it.
constexpr double kGivenUp = 1e-9;
// The tolerance that is expected to serve against the accuracy, of explicit schemes so much more, and the bounds of
// both.
constexpr double kFirst = 0.02, kSchemes = 2.5, kLoosest = 5e-5, kLoosestOfSchemes = 2e-5, kTightest = 1e-13;
// Errors are told by a run ErrorOrder::kApart times looser, but no looser than that.
constexpr double kLoosestRun = 5e-3;
// What a scheme's run counts against those of the others, whose errors are larger at a tolerance of this ratio still,
// those of gradients more so.
constexpr double kSchemeRun = 0.7, kSchemeGradient = 0.47;
// The first run in full is given up for the next best choice at so many times what that one's short run took: seven for
// the whole time, three and more for a gradient, and a margin of three.
constexpr double kPatience = 65;
// A tolerance is not chosen to just meet a request.
constexpr double kAim = 0.4;
// Psi is as wrong as the outputs are, or a little less, and as scaled derivatives: less of a difference is chance.
constexpr double kByChance = 0.3;
// A psi that is small has absolute tolerances of which 30 are no more than that part of accuracy psi, in the units of
// the mechanism's size (resolve_small_psi()): two runs with larger ones may have the same errors.
constexpr double kSmallPart = 0.3;
// How far pilots may be from the result: errors up to so many tolerances are common along a motion.
constexpr double kPilotError = 1e4;
// Of the square of the mechanism's length: costs are squares of coordinates, or of their size.
constexpr double kZero = 1e-12;

class Chooser {
 public:
  Chooser(const Problem& problem, const std::vector<double>& rho, const AccuracyRequest& request)
      : request_(request),
        problem_(watched(problem)),
        probe_(problem_, rho, request.outputs, kSamples, request.besides),
        bends_(request.gradient && may_bend(problem)) {
    require_choice();
    first_ = std::clamp(kFirst * request.accuracy, kTightest, kLoosest);
  }

  AccurateRun run(const BeginRecording& begin) {
    AccurateRun r = chosen(begin);
    r.problem.monitor = outer_;
    r.problem.solver.confirm = false;
    r.problem.solver.resolve = true;
    for (const std::string& sentence : said_) notice(sentence);
    compare_pilots(r);
    if (const double psi = std::abs(r.result.psi); psi > 0 && psi < psi_unit_)
      notice(fmt::format(
          "psi = {:.3g} is less than what counts as nothing in a mechanism of this size, {:.1g}: the accuracy "
          "is that of the latter, and no digit of psi is promised. Take larger units, or a small atol.",
          r.result.psi, psi_unit_));
    return r;
  }

 private:
  /// Where those that ended serve for no result the integrators that have not been tried have their turn.
  AccurateRun chosen(const BeginRecording& begin) {
    const Unsaid judging;
    AccurateRun r;
    const bool redundant = !redundant_joints(problem_, probe_.rho()).empty();
    for (std::exception_ptr first;;) {
      PilotRace race(problem_, probe_.rho(), redundant,
                     [this](const Formulation& f, const Integrator& i) { return serves(f, i); },
                     {kSchemes, [this](const Formulation& f, const Integrator& i) { return weight(f, i); }});
      try {
        const std::vector<AccuracyPilot> ended = race.run(std::min(10 * first_, kLoosest));
        r.pilots.insert(r.pilots.end(), race.pilots().begin(), race.pilots().end());
        if (first_that_serves(ended, begin, r)) break;
      } catch (const Error&) {
        if (nearest_) {
          nearest_->pilots = r.pilots;
          nearest_->runs = r.runs;
          r = *nearest_;
          said_ = nearest_said_;
          recorded_ = false;
          break;
        }
        if (first) std::rethrow_exception(first);
        throw;
      }
      if (!first) first = failure_;
    }
    if (!recorded_ && begin && r.what.method.empty()) run_as(Problem(r.problem), r.what.method, begin, r);
    return r;
  }

  /// Whether one of them meets the request; what they run on is left out from then on, and failure_ or nearest_ set,
  /// where none does.
  bool first_that_serves(const std::vector<AccuracyPilot>& ended, const BeginRecording& begin, AccurateRun& r) {
    for (std::size_t k = 0; k < ended.size(); ++k) {
      // What was slower in the first part may be faster in the rest.
      const bool last = k + 1 == ended.size();
      try {
        if (tighten(with_method(ended[k].what), last ? 0 : kPatience * ended[k + 1].time_s, begin, r)) return true;
        if (!nearest_ || r.relative < nearest_->relative) {
          nearest_ = r;
          nearest_said_ = said_;
        }
        for (const Integrator& i : integrators())
          if (i.discrete) left_out_.push_back(i.name);
      } catch (const Cut&) {
        if (!patient_) throw;  // the caller's
        budget_.unlimited();
      } catch (const CapabilityError&) {
        failure_ = std::current_exception();
      } catch (const SolverError&) {
        failure_ = std::current_exception();
      }
      left_out_.push_back(ended[k].what.integrator);
    }
    return false;
  }

  Problem watched(Problem problem) {
    outer_ = problem.monitor;
    problem.solver.resolve = false;  // errors are looked at here
    problem.monitor = [this](double t, long steps, bool backward) {
      if (outer_) outer_(t, steps, backward);
      budget_.look(t, steps, backward);
    };
    return problem;
  }

  void require_choice() const {
    const double a = request_.accuracy;
    if (!(a > 0 && a < 1)) throw Error(fmt::format("An accuracy must lie between 0 and 1, found {}.", a));
    if (!request_.formulation.empty() && !find_formulation(request_.formulation).exact_constraints())
      throw CapabilityError(fmt::format(
          "Formulation '{}' has soft constraints, whose part in the error no tolerance takes away: it cannot "
          "be held to an accuracy. Leave the formulation out, or ask for a tolerance.",
          request_.formulation));
    if (request_.integrator == "fixed")
      throw CapabilityError(
          "Fixed steps follow no tolerance: they cannot be held to an accuracy. Leave the integrator out, or ask for a "
          "step.");
    if (request_.method.empty()) return;
    const SensitivityMethod& m = find_sensitivity_method(request_.method);
    using Needs = SensitivityMethod::Needs;
    if ((m.needs == Needs::dae || m.needs == Needs::ode || m.needs == Needs::discrete) && !m.perturbs) return;
    std::vector<std::string> can;
    for (const Integrator& i : integrators())
      if (const std::string adjoint = adjoint_on(i);
          i.step_control && std::find(can.begin(), can.end(), adjoint) == can.end())
        can.push_back(adjoint);
    throw CapabilityError(fmt::format("Method '{}' cannot be held to an accuracy; those of the integrators can ({}).",
                                      m.name, fmt::join(can, ", ")));
  }

  /// Of the user's choices and the problem's own demands; which formulations hold their constraints is the race's.
  bool serves(const Formulation& f, const Integrator& i) const {
    if (!request_.integrator.empty() && request_.integrator != i.name) return false;
    if (std::find(left_out_.begin(), left_out_.end(), i.name) != left_out_.end()) return false;
    if (!request_.formulation.empty() && request_.formulation != f.name) return false;
    if (problem_.cycle && i.discrete) return false;
    if (!request_.gradient) return true;
    if (request_.method.empty()) return !price_of(f, i).method.empty();
    const std::vector<std::string> on = integrators_of(find_sensitivity_method(request_.method), f);
    return std::find(on.begin(), on.end(), i.name) != on.end();
  }

  GradientPrice price_of(const Formulation& f, const Integrator& i) const {
    return least_price(f, i, problem_.parameters.parameters.size(), bends_);
  }
  /// Of a run on this integrator, in the time of one without a gradient.
  double weight(const Formulation& f, const Integrator& i) const {
    if (!request_.gradient) return i.discrete ? kSchemeRun : 1;
    return (i.discrete ? kSchemeGradient : 1) * (1 + price_of(f, i).runs);
  }

  Combination with_method(Combination c) const {
    if (!request_.gradient) return c;
    c.method = request_.method.empty() ? price_of(find_formulation(c.formulation), find_integrator(c.integrator)).method
                                       : request_.method;
    return c;
  }

  /// Until the request is met, or no tolerance meets it; false where it may be that of another integrator: the
  /// derivative of a scheme's steps hardly gets better where laws bend within them. `patience_s`: of the first run; 0:
  /// without an end.
  bool tighten(const Combination& what, double patience_s, const BeginRecording& begin, AccurateRun& r) {
    const bool scheme = find_integrator(what.integrator).discrete;
    const double first = scheme ? std::min(kSchemes * first_, kLoosestOfSchemes) : std::min(first_, kLoosest);
    ErrorOrder order(scheme);
    fall_ = {};
    TradeReference coarse, fine;
    double looser = loose_run(what, std::min(ErrorOrder::kApart * first, kLoosestRun), patience_s, coarse, r);
    double rtol = std::min(first, 0.1 * looser);
    long before = r.result.counters.steps;
    r.what = what;
    r.looser = 0;
    for (bool first_two = true;; first_two = false) {
      try {
        attempt(what, rtol, begin, fine, r);
      } catch (const SolverError&) {
        // Where there is a result, this is tighter than the motion's rounding lets it be: the result stands for what
        // it is known to.
        if (r.looser > 0) return r.met || !scheme;
        if (rtol <= kGivenUp) throw;
        rtol /= 10;
        continue;
      }
      r.looser = looser;
      judge(coarse, fine, rtol, order, r);
      r.met = r.relative <= request_.accuracy;
      const TwoRuns two{before, r.result.counters.steps, first_two, r.relative, request_.accuracy};
      before = r.result.counters.steps;
      if (r.met && two.tell()) {
        r.widen(two.chance());
        return true;
      }
      if (rtol <= kTightest) return true;
      if (scheme && request_.gradient && order.slow()) return false;
      const double step = order.step(kAim * request_.accuracy),
                   next = rtol * (two.other_steps() ? step : std::min(step, TwoRuns::kFurther));
      looser = rtol;
      rtol = std::max(next, kTightest);
      std::swap(coarse, fine);
    }
  }

  /// The first run, which tells the errors of the next one: at rtol, or, as that may be too loose for the motion
  /// itself, at the first power of ten below at which it ends; returns which.
  double loose_run(const Combination& what, double rtol, double patience_s, TradeReference& into, AccurateRun& r) {
    psi_size_ = -1;
    for (;; rtol /= 10) {
      patient_ = patience_s > 0;
      budget_.unlimited();
      if (patient_) budget_.begin(patience_s);
      try {
        attempt(what, rtol, {}, into, r);
      } catch (const SolverError&) {
        if (rtol <= kGivenUp) throw;
        continue;
      }
      patient_ = false;
      budget_.unlimited();
      return rtol;
    }
  }

  /// One run, which is the result from then on. Of a psi that is small against its absolute tolerances two runs may
  /// have the same errors: the size of psi once known, they are smaller.
  void attempt(const Combination& what, double rtol, const BeginRecording& begin, TradeReference& into,
               AccurateRun& r) {
    ++r.runs;
    const Problem p = probe_.prepared(what, rtol, 0);
    if (Problem finer = p; psi_size_ >= 0 && !problem_.objective.running.empty() && !problem_.cycle &&
                           resolve_small_psi(finer, psi_size_, kSmallPart * request_.accuracy)) {
      try {
        into.values = run_as(finer, what.method, begin, r);
        return;
      } catch (const SolverError&) {  // out of reach
      }
    }
    into.values = run_as(p, what.method, begin, r);
  }

  TradeValues run_as(const Problem& p, const std::string& method, const BeginRecording& begin, AccurateRun& r) {
    TradeProbe::Recording recording;
    if (begin && method.empty()) recording = begin(p);
    recorded_ = !recording.sink;  // until it has ended, what is recorded is not the result
    take_notices();
    TradeValues v = probe_.run(p, method, &r.result, recording.sink ? &recording : nullptr);
    recorded_ = true;
    said_ = take_notices();
    r.problem = p;
    psi_size_ = std::abs(v.psi);
    for (const RunEvent& e : r.result.events) v.event_times.push_back(e.t);
    return v;
  }

  void judge(const TradeReference& coarse, TradeReference& fine, double rtol, ErrorOrder& order, AccurateRun& r) {
    if (fine.values.motion) {
      fine.measure(probe_);
    } else {
      const double size = largest_scaled(problem_.parameters, fine.values.gradient);
      fine.psi_unit = std::abs(fine.values.psi);
      fine.gradient_unit = size > 1e-9 * fine.psi_unit ? size : fine.psi_unit;
    }
    // What is below rounding's part of a cost of this size is zero.
    const double zero = kZero * cost_size(problem_);
    fine.psi_unit = std::max(fine.psi_unit, zero);
    fine.gradient_unit = std::max(fine.gradient_unit, zero);
    TradeRow row;
    fine.judge(coarse.values, probe_, row);
    std::vector<double> apart;
    for (const TradeMeasure m : kTradeMeasures) apart.push_back(row.error_of(m).value_or(0));
    order.look(r.looser, rtol, *std::max_element(apart.begin(), apart.end()));
    const std::size_t components = apart.size();
    for (std::size_t j = 0; j < fine.values.gradient.size(); ++j)
      apart.push_back(std::abs(fine.values.gradient[j] - coarse.values.gradient[j]));
    apart.push_back(row.besides);
    fall_.look(r.looser, rtol, apart);
    // An error that passes through zero is small by chance: not below the tolerance itself, nor rounding.
    const double share = order.share(), least = std::max(rtol, 1e-14);
    const auto error = [&](TradeMeasure m) {
      const auto i = static_cast<std::size_t>(m);
      return row.error_of(m) ? std::max({share * apart[i], fall_.least(i), least}) : 0.0;
    };
    const double outputs = error(TradeMeasure::outputs), gradient = error(TradeMeasure::gradient),
                 of_psi = gradient * std::min(1.0, fine.gradient_unit / fine.psi_unit);
    const double psi =
        row.error_of(TradeMeasure::psi) ? std::max({error(TradeMeasure::psi), kByChance * outputs, of_psi}) : 0;
    r.psi_error = psi * fine.psi_unit;
    if (std::abs(fine.values.psi) < zero) r.psi_error = std::max(r.psi_error, std::abs(fine.values.psi));
    psi_unit_ = fine.psi_unit;
    r.outputs_error = outputs;
    r.besides_error =
        row.worst_besides.empty() ? 0 : std::max({share * row.besides, fall_.least(apart.size() - 1), least});
    r.worst_besides = row.worst_besides;
    r.times_error = times_apart(coarse.values.event_times, fine.values.event_times);
    if (r.times_error) *r.times_error *= share;
    r.relative = std::max({psi, outputs, gradient});
    r.worst = r.relative == psi && psi > 0 ? "psi" : row.worst;
    r.gradient_error.clear();
    for (std::size_t j = 0; j < fine.values.gradient.size(); ++j)
      r.gradient_error.push_back(std::max({share * apart[components + j], fall_.least(components + j),
                                           kByChance * r.relative * std::abs(fine.values.gradient[j]),
                                           least * fine.gradient_unit / problem_.parameters.parameters[j].scale}));
  }

  /// The two runs behind an estimate share a formulation; what both pass over others may have met.
  void compare_pilots(const AccurateRun& r) const {
    const auto same = [&](const AccuracyPilot& p) {
      return p.why.empty() && p.what.formulation == r.what.formulation && p.what.integrator == r.what.integrator;
    };
    const auto chosen = std::find_if(r.pilots.begin(), r.pilots.end(), same);
    for (const AccuracyPilot& p : r.pilots) {
      if (!p.why.empty()) continue;
      const double apart = std::abs(p.psi - chosen->psi) / psi_unit_;
      if (apart <= std::max(kPilotError * p.rtol, 10 * request_.accuracy)) continue;
      notice(
          fmt::format("A run by {} at rtol {:.1g} to t = {:.4g} s gives psi = {:.6g} where {} gives {:.6g}, {:.1g} of "
                      "the result apart: "
                      "more than such a tolerance explains. 'costate check' compares all formulations.",
                      p.what.name(), p.rtol, p.until, p.psi, chosen->what.name(), chosen->psi, apart));
    }
  }

  AccuracyRequest request_;
  Monitor outer_;
  RunBudget budget_;
  Problem problem_;
  TradeProbe probe_;
  bool bends_;
  double first_ = 0, psi_unit_ = 1;
  FastestFall fall_;                          // of the run that is tightened
  double psi_size_ = -1;                      // of the last run; below 0: there is none
  bool patient_ = false;                      // the run may be cut for the next best choice
  bool recorded_ = true;                      // what was recorded last is the result
  std::vector<std::string> left_out_, said_;  // integrators; of the result's run
  std::exception_ptr failure_;
  std::optional<AccurateRun> nearest_;  // of those that did not meet the request
  std::vector<std::string> nearest_said_;
};

}  // namespace

AccurateRun run_to_accuracy(const Problem& problem, const std::vector<double>& rho, const AccuracyRequest& request,
                            const BeginRecording& begin) {
  AccurateRun r = Chooser(problem, rho, request).run(begin);
  r.add_what_stays(request.accuracy);
  return r;
}

}  // namespace costate
