#include "costate/tradeoff/accurate_run.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/formulation/formulation.h"
#include "costate/integrator/integrators.h"
#include "costate/integrator/run_budget.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/problem/redundant_rows.h"
#include "costate/problem/scaled_gradient.h"
#include "costate/sensitivity/confirmation.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/trade_reference.h"

namespace costate {

namespace {

constexpr int kSamples = 60;
// At so tight a tolerance a failure is not due to it.
constexpr double kGivenUp = 1e-9;
constexpr double kOrder = 0.5;
// The first tolerance against the accuracy, of explicit schemes so much more, and the bounds of both.
constexpr double kFirst = 0.02, kSchemes = 5, kLoosest = 2e-4, kTightest = 1e-13;
// What a gradient of a scheme's steps takes against a simulation, as a part of what those of the others do.
constexpr double kSchemeGradient = 0.7;
// The first run in full is given up for the next best choice at so many times what that one's short run took: four for
// the whole time, three and more for a gradient, and a margin of three.
constexpr double kPatience = 40;
// A tolerance is not chosen to just meet a request.
constexpr double kAim = 0.4;
// Two loose runs may agree by chance, over stick and slip above all: the first two have to do so much better than
// asked, or a third one tells.
constexpr double kFirstTwo = 0.25;
// Tangents cost about 0.6 of a simulation for each parameter, an adjoint about 3.
constexpr std::size_t kTangents = 3;
// Psi is as wrong as the outputs are, or a little less, and as scaled derivatives: a difference that is a smaller part
// of theirs is so by chance.
constexpr double kByChance = 0.3;
// Of the accuracy: errors by absolute tolerances, of the run that tells what they are.
constexpr double kSmallPart = 0.3;
// How far pilots may be from the result: errors up to so many tolerances are common along a motion.
constexpr double kPilotError = 1e4;
// Of the square of the mechanism's length: costs are squares of coordinates, or of their size.
constexpr double kZero = 1e-12;

/// The gradient method that goes with an integrator, or null.
const SensitivityMethod* method_on(const Integrator& integrator, bool adjoint) {
  using Needs = SensitivityMethod::Needs;
  const Needs needs = integrator.discrete                             ? Needs::discrete
                      : integrator.form == Integrator::Form::residual ? Needs::dae
                                                                      : Needs::ode;
  return first_method(
      [&](const SensitivityMethod& m) { return m.needs == needs && m.adjoint == adjoint && !m.perturbs; });
}

class Chooser {
 public:
  Chooser(const Problem& problem, const std::vector<double>& rho, const AccuracyRequest& request)
      : request_(request), problem_(watched(problem)), probe_(problem_, rho, request.outputs, kSamples) {
    require_choice();
    first_ = std::clamp(kFirst * request.accuracy, kTightest, kLoosest);
  }

  AccurateRun run(const BeginRecording& begin) {
    AccurateRun r;
    PilotRace race(problem_, probe_.rho(), !redundant_rows(problem_, probe_.rho()).empty(),
                   [this](const Formulation& f, const Integrator& i) { return serves(f, i); },
                   {kSchemes, request_.gradient ? kSchemeGradient : 1});
    const std::vector<AccuracyPilot> ended = race.run(std::min(10 * first_, kLoosest));
    r.pilots = race.pilots();
    for (std::size_t k = 0; k < ended.size(); ++k) {
      // What was slower in the first part may be faster in the rest.
      const bool last = k + 1 == ended.size();
      try {
        tighten(with_method(ended[k].what), last ? 0 : kPatience * ended[k + 1].time_s, begin, r);
        break;
      } catch (const Cut&) {
        if (last || budget_s_ <= 0) throw;
      } catch (const CapabilityError&) {
        if (last) throw;
      } catch (const SolverError&) {
        if (last) throw;
      }
    }
    r.problem.monitor = outer_;
    r.problem.solver.confirm = false;
    compare_pilots(r);
    if (const double psi = std::abs(r.result.psi); psi > 0 && psi < psi_unit_)
      notice(fmt::format(
          "psi = {:.3g} is less than what counts as nothing in a mechanism of this size, {:.1g}: the accuracy "
          "is that of the latter, and no digit of psi is promised. Take larger units, or a small atol.",
          r.result.psi, psi_unit_));
    return r;
  }

 private:
  Problem watched(Problem problem) {
    outer_ = problem.monitor;
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
      if (const SensitivityMethod* adjoint = method_on(i, true);
          i.step_control && std::find(can.begin(), can.end(), adjoint->name) == can.end())
        can.push_back(adjoint->name);
    throw CapabilityError(fmt::format("Method '{}' cannot be held to an accuracy; those of the integrators can ({}).",
                                      m.name, fmt::join(can, ", ")));
  }

  /// Of the user's choices and the problem's own demands; which formulations hold their constraints is the race's.
  bool serves(const Formulation& f, const Integrator& i) const {
    if (!request_.integrator.empty() && request_.integrator != i.name) return false;
    if (!request_.formulation.empty() && request_.formulation != f.name) return false;
    if (problem_.cycle && i.discrete) return false;
    if (!request_.gradient) return true;
    if (request_.method.empty()) return !method_of(f, i).empty();
    const std::vector<std::string> on = integrators_of(find_sensitivity_method(request_.method), f);
    return std::find(on.begin(), on.end(), i.name) != on.end();
  }

  /// The gradient method of an integrator that costs the least here; empty where there is none.
  std::string method_of(const Formulation& f, const Integrator& i) const {
    const bool adjoint = problem_.parameters.parameters.size() > kTangents;
    for (const bool a : {adjoint, !adjoint})
      if (const SensitivityMethod* m = method_on(i, a); m && refusal(*m, f).empty()) return m->name;
    return {};
  }

  Combination with_method(Combination c) const {
    if (!request_.gradient) return c;
    c.method = request_.method.empty() ? method_of(find_formulation(c.formulation), find_integrator(c.integrator))
                                       : request_.method;
    return c;
  }

  /// Until the request is met. `patience_s`: of the first run; 0: without an end.
  void tighten(const Combination& what, double patience_s, const BeginRecording& begin, AccurateRun& r) {
    const double first = find_integrator(what.integrator).discrete ? kSchemes * first_ : first_;
    double rtol = std::min(first, kLoosest), looser = 10 * rtol;
    TradeReference coarse, fine;
    const auto coarse_at = [&](double at) {
      budget_s_ = patience_s;
      budget_.unlimited();  // that of a choice before was left where it was cut
      if (budget_s_ > 0) budget_.begin(budget_s_, 0);
      coarse.values = probe_.run(what, at, 0);
      budget_.unlimited();
    };
    const auto fine_at = [&](double at) {
      TradeProbe::Recording recording;
      if (begin && what.method.empty()) recording = begin(probe_.prepared(what, at, 0));
      fine.values = probe_.run(what, at, 0, &r.result, recording.sink ? &recording : nullptr);
    };
    // A tolerance may be too loose for the motion itself.
    const auto tried = [&](const auto& run, double at) {
      ++r.runs;
      try {
        run(at);
        return true;
      } catch (const SolverError&) {
        budget_.unlimited();
        if (at <= kGivenUp) throw;
        return false;
      }
    };
    while (!tried(coarse_at, looser)) looser /= 10, rtol = looser / 10;
    for (bool first_two = true;;) {
      if (!tried(fine_at, rtol)) {
        rtol /= 10;
        continue;
      }
      r.looser = looser;
      r.problem = probe_.prepared(what, rtol, 0);
      judge(coarse, fine, rtol, r);
      judge_small_psi(what, fine, rtol, r);
      r.met = r.relative <= request_.accuracy;
      const bool sure = !first_two || r.relative <= kFirstTwo * request_.accuracy;
      if ((r.met && sure) || rtol <= kTightest) break;
      first_two = false;
      // Errors as small as that need a tolerance smaller by their ratio, or by three powers of ten at once.
      const double next = std::clamp(rtol * kAim * request_.accuracy / r.relative, 1e-3 * rtol, 0.2 * rtol);
      looser = rtol;
      rtol = std::max(next, kTightest);
      std::swap(coarse, fine);
    }
    r.what = what;
  }

  void judge(const TradeReference& coarse, TradeReference& fine, double rtol, AccurateRun& r) {
    if (fine.values.motion) {
      fine.measure(probe_);
    } else {
      const double size = largest_scaled(problem_.parameters, fine.values.gradient);
      fine.psi_unit = std::abs(fine.values.psi);
      fine.gradient_unit = size > 1e-9 * fine.psi_unit ? size : fine.psi_unit;
    }
    // What is below rounding's part of a cost of this size is zero.
    const double zero = kZero * cost_size(*problem_.mechanism);
    fine.psi_unit = std::max(fine.psi_unit, zero);
    fine.gradient_unit = std::max(fine.gradient_unit, zero);
    TradeRow row;
    fine.judge(coarse.values, probe_, row);
    // An error that passes through zero is small by chance: not below the tolerance itself, nor rounding.
    const double share = 1 / (std::pow(r.looser / rtol, kOrder) - 1), least = std::max(rtol, 1e-14);
    const auto error = [&](TradeMeasure m) {
      return row.error_of(m) ? std::max(share * *row.error_of(m), least) : 0.0;
    };
    const double outputs = error(TradeMeasure::outputs), gradient = error(TradeMeasure::gradient),
                 of_psi = gradient * std::min(1.0, fine.gradient_unit / fine.psi_unit);
    const double psi =
        row.error_of(TradeMeasure::psi) ? std::max({error(TradeMeasure::psi), kByChance * outputs, of_psi}) : 0;
    r.psi_error = psi * fine.psi_unit;
    if (std::abs(fine.values.psi) < zero) r.psi_error = std::max(r.psi_error, std::abs(fine.values.psi));
    psi_unit_ = fine.psi_unit;
    r.outputs_error = outputs;
    r.relative = std::max({psi, outputs, gradient});
    r.worst = r.relative == psi && psi > 0 ? "psi" : row.worst;
    r.gradient_error.clear();
    for (std::size_t j = 0; j < fine.values.gradient.size(); ++j)
      r.gradient_error.push_back(std::max({share * std::abs(fine.values.gradient[j] - coarse.values.gradient[j]),
                                           kByChance * r.relative * std::abs(fine.values.gradient[j]),
                                           least * fine.gradient_unit / problem_.parameters.parameters[j].scale}));
  }

  /// Of a psi that is small against its absolute tolerances two runs may have the same errors: by smaller ones.
  void judge_small_psi(const Combination& what, const TradeReference& fine, double rtol, AccurateRun& r) {
    Problem p = probe_.prepared({what.formulation, what.integrator, ""}, rtol, 0);
    if (problem_.objective.running.empty() || problem_.cycle ||
        !resolve_small_psi(p, std::abs(fine.values.psi), kSmallPart * request_.accuracy))
      return;
    try {
      const double change = std::abs(probe_.run(p, "").psi - fine.values.psi);
      r.psi_error = std::max(r.psi_error, change);
      if (change <= r.relative * psi_unit_) return;
      r.relative = change / psi_unit_;
      r.worst = "psi";
    } catch (const SolverError&) {
      // Nothing more is known.
    }
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
  double first_ = 0, psi_unit_ = 1, budget_s_ = 0;
};

}  // namespace

AccurateRun run_to_accuracy(const Problem& problem, const std::vector<double>& rho, const AccuracyRequest& request,
                            const BeginRecording& begin) {
  return Chooser(problem, rho, request).run(begin);
}

std::string text_of(const AccurateRun& run) {
  return fmt::format("{}, rtol {:.1e}; errors by a run at rtol {:.1e}", run.what.name(), run.problem.solver.rtol,
                     run.looser);
}

}  // namespace costate
