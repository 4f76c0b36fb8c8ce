#include "costate/tradeoff/accurate_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/formulation/formulation.h"
#include "costate/integrator/run_budget.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/problem/redundant_rows.h"
#include "costate/problem/scaled_gradient.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/trade_reference.h"

namespace costate {

namespace {

constexpr int kSamples = 60;
// At so tight a tolerance a failure is not due to it.
constexpr double kGivenUp = 1e-9;
constexpr double kOrder = 0.5;
// The first tolerance against the accuracy, the pilots' against that, and the bounds of both.
constexpr double kFirst = 0.02, kPilot = 30, kLoosest = 1e-3, kTightest = 1e-13;
// A pilot is cut at so many times the time of the best one; below so many seconds none is.
constexpr double kPatience = 1.3, kShortest = 0.02;
// A tolerance is not chosen to just meet a request.
constexpr double kAim = 0.4;
// Tangents cost about 0.6 of a simulation for each parameter, an adjoint about 3.
constexpr std::size_t kTangents = 3;
// How far pilots may be from the result: errors up to so many tolerances are common along a motion.
constexpr double kPilotError = 1e4;
// Of the square of the mechanism's length: costs are squares of coordinates, or of their size.
constexpr double kZero = 1e-12;

/// The gradient method of SUNDIALS's that goes with an integrator, or null.
const SensitivityMethod* method_on(const std::string& integrator, bool adjoint) {
  using Needs = SensitivityMethod::Needs;
  const Needs needs = integrator == "idas" ? Needs::dae : Needs::ode;
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
    race(r);
    const Combination what = with_method(choice_);
    double rtol = first_, looser = std::min(10 * rtol, 0.1);
    TradeReference coarse, fine;
    const auto coarse_at = [&](double at) { coarse.values = probe_.run(what, at, 0); };
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
        if (at <= kGivenUp) throw;
        return false;
      }
    };
    while (!tried(coarse_at, looser)) looser /= 10, rtol = looser / 10;
    for (;;) {
      if (!tried(fine_at, rtol)) {
        rtol /= 10;
        continue;
      }
      r.looser = looser;
      r.problem = probe_.prepared(what, rtol, 0);
      judge(coarse, fine, rtol, r);
      r.met = r.relative <= request_.accuracy;
      if (r.met || rtol <= kTightest) break;
      // Errors as small as that need a tolerance smaller by their ratio, or by three powers of ten at once.
      const double next = std::clamp(rtol * kAim * request_.accuracy / r.relative, 1e-3 * rtol, 0.2 * rtol);
      looser = rtol;
      rtol = std::max(next, kTightest);
      std::swap(coarse, fine);
    }
    r.what = what;
    r.problem.monitor = outer_;
    r.problem.solver.confirm = false;
    compare_pilots(r);
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
    if ((m.needs == Needs::dae || m.needs == Needs::ode) && !m.perturbs) return;
    throw CapabilityError(
        fmt::format("Method '{}' cannot be held to an accuracy; those of the integrators can ({}, {}).", m.name,
                    method_on("cvodes", true)->name, method_on("idas", true)->name));
  }

  bool serves(const Formulation& f, const std::string& integrator, bool redundant) const {
    if (!(integrator == "idas" ? static_cast<bool>(f.make_dae) : static_cast<bool>(f.make_ode))) return false;
    if (!request_.integrator.empty() && request_.integrator != integrator) return false;
    if (!request_.method.empty()) {
      const SensitivityMethod& m = find_sensitivity_method(request_.method);
      if ((m.needs == SensitivityMethod::Needs::dae) != (integrator == "idas")) return false;
      if (!refusal(m, f).empty()) return false;
    }
    if (!request_.formulation.empty()) return f.name == request_.formulation;
    if (!f.exact_constraints() || (redundant && !f.carries_redundancy)) return false;
    if (f.name == problem_.formulation) return true;
    if (f.adjoint_order > 1) return false;
    // The explicit forms are cheapest where they do; of the implicit ones the first stand-in tells about stiffness.
    return integrator == "cvodes" || &f == stand_ins(redundant).front();
  }

  Combination with_method(Combination c) const {
    if (!request_.gradient) return c;
    if (!request_.method.empty()) {
      c.method = request_.method;
      return c;
    }
    const bool adjoint = problem_.parameters.parameters.size() > kTangents;
    for (const bool a : {adjoint, !adjoint})
      if (const SensitivityMethod* m = method_on(c.integrator, a);
          m && refusal(*m, find_formulation(c.formulation)).empty()) {
        c.method = m->name;
        break;
      }
    return c;
  }

  /// Short simulations by what may serve; the fastest is the choice.
  void race(AccurateRun& r) {
    const bool redundant = !redundant_rows(problem_, probe_.rho()).empty();
    std::vector<Combination> all;
    for (const Formulation* f : stand_ins(redundant))
      for (const char* integrator : {"cvodes", "idas"})
        if (serves(*f, integrator, redundant)) all.push_back({f->name, integrator});
    for (const Formulation& f : formulations())
      for (const char* integrator : {"cvodes", "idas"})
        if (f.stand_in == 0 && serves(f, integrator, redundant)) all.push_back({f.name, integrator});
    if (all.empty())
      throw CapabilityError("No formulation can be held to an accuracy here together with what else was chosen.");
    // A tolerance may be too loose for the motion itself.
    for (double rtol = std::min(kPilot * first_, 0.03); choice_.formulation.empty(); rtol /= 100)
      race(all, rtol, r.pilots);
  }

  void race(const std::vector<Combination>& all, double rtol, std::vector<AccuracyPilot>& pilots) {
    double best = 0;
    std::exception_ptr failure;
    for (const Combination& c : all) {
      AccuracyPilot p{c, rtol, 0, 0, ""};
      if (best > 0)
        budget_.begin(std::max(kPatience * best, kShortest), 0);
      else
        budget_.unlimited();
      const std::vector<std::string> said = take_notices();
      try {
        const TradeValues v = probe_.run(c, p.rtol, 0);
        p.time_s = v.time_s;
        p.psi = v.psi;
      } catch (const Cut& e) {
        p.why = std::string("cut ") + e.what();
      } catch (const CapabilityError& e) {
        p.why = e.what();
        failure = std::current_exception();
      } catch (const SolverError& e) {
        p.why = e.what();
        failure = std::current_exception();
      }
      take_notices();
      for (const auto& text : said) notice(text);
      if (p.why.empty() && !(best > 0 && p.time_s >= best)) best = p.time_s, choice_ = c;
      pilots.push_back(std::move(p));
    }
    budget_.unlimited();
    if (choice_.formulation.empty() && rtol <= kGivenUp) std::rethrow_exception(failure);
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
    const double psi = error(TradeMeasure::psi), outputs = error(TradeMeasure::outputs),
                 gradient = error(TradeMeasure::gradient);
    r.psi_error = psi * fine.psi_unit;
    if (std::abs(fine.values.psi) < zero) r.psi_error = std::max(r.psi_error, std::abs(fine.values.psi));
    psi_unit_ = fine.psi_unit;
    r.outputs_error = outputs;
    r.relative = std::max({psi, outputs, gradient});
    r.worst = r.relative == psi && psi > 0 ? "psi" : row.worst;
    r.gradient_error.clear();
    for (std::size_t j = 0; j < fine.values.gradient.size(); ++j)
      r.gradient_error.push_back(std::max(share * std::abs(fine.values.gradient[j] - coarse.values.gradient[j]),
                                          least * fine.gradient_unit / problem_.parameters.parameters[j].scale));
  }

  /// The two runs behind an estimate share a formulation; what both pass over others may have met.
  void compare_pilots(const AccurateRun& r) const {
    const double psi = r.result.psi;
    for (const AccuracyPilot& p : r.pilots) {
      if (!p.why.empty()) continue;
      const double apart = std::abs(p.psi - psi) / psi_unit_;
      if (apart <= std::max(kPilotError * p.rtol, 10 * request_.accuracy)) continue;
      notice(fmt::format(
          "A short run by {} at rtol {:.1g} gives psi = {:.6g}, {:.1g} of it away from the result: more than such a "
          "tolerance explains. 'costate check' compares all formulations.",
          p.what.name(), p.rtol, p.psi, apart));
    }
  }

  AccuracyRequest request_;
  Monitor outer_;
  RunBudget budget_;
  Problem problem_;
  TradeProbe probe_;
  Combination choice_;
  double first_ = 0, psi_unit_ = 1;
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
