#include "costate/tradeoff/stress.h"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/formulation/formulation.h"
#include "costate/integrator/integrators.h"
#include "costate/problem/redundant_rows.h"
#include "costate/record/jobs.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/motion_confirmation.h"

namespace costate {

namespace {

constexpr int kSampleCount = 30;
// A halved step may not make errors larger; so much is forgiven.
constexpr double kSoftFall = 0.4;
constexpr double kStepRise = 3, kStepNoise = 1e-6;
// Of an error that a run states: what it may be off by and has said so.
constexpr double kStated = 2;

}  // namespace

const char* name_of(StressVerdict verdict) {
  switch (verdict) {
    case StressVerdict::held:
      return "held";
    case StressVerdict::warned:
      return "warned";
    case StressVerdict::refused:
      return "refused";
    case StressVerdict::cut:
      return "cut";
    case StressVerdict::unjudged:
      return "not judged";
    case StressVerdict::wrong:
      break;
  }
  return "WRONG in silence";
}

double StressClaim::allowed(double rtol) const {
  return std::max({floor, MotionClaim::of(rtol), std::min(MotionClaim::kMost, kAmplified * amplification * rtol)});
}

StressCase::StressCase(const Problem& problem, const std::vector<double>& rho, const std::vector<std::string>& outputs,
                       double limit_s, std::function<bool()> time_left)
    : problem_(problem),
      rho_(rho),
      outputs_(outputs),
      limit_s_(limit_s),
      time_left_(std::move(time_left)),
      probe_(problem_, rho, outputs, kSampleCount) {}

void StressCase::find_reference(double seconds, bool with_gradient) {
  redundant_ = redundant_joints(problem_, rho_);
  ReferenceSearch search;
  search.redundant = !redundant_.empty();
  search.gradient = with_gradient;
  // By the wall's clock, as the budget of all is: runs may be on several threads.
  const auto begin = std::chrono::steady_clock::now();
  const auto left = [=] {
    return seconds - std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  };
  search.allow = [this, left] {
    RunBudget budget;
    budget.begin(std::max(0.1 * limit_s_, left()));
    return budget;
  };
  search.has_time = [left] { return left() > 0; };
  reference_ = find_trade_reference(probe_, search);
  const double rtol = problem_.solver.rtol;
  for (const Combination& c : {reference_.first, reference_.second}) {
    if (c.formulation.empty()) continue;
    TradeRow row;
    RunBudget budget;
    budget.begin(limit_s_);
    try {
      reference_.judge(probe_.run(c, rtol, 0, budget), probe_, row);
    } catch (const Cut&) {
    } catch (const SolverError&) {
    }
    for (std::size_t m = 0; m < claims_.size(); ++m)
      if (row.error[m]) claims_[m].amplification = std::max(claims_[m].amplification, *row.error[m] / rtol);
  }
  for (std::size_t m = 0; m < claims_.size(); ++m) claims_[m].floor = reference_.floor[m];
  take_notices();
}

std::string StressCase::unjudged() const {
  if (reference_.proven) return {};
  return reference_.second.formulation.empty()
             ? "no second combination of another formulation and integrator carries it"
             : fmt::format("{} and {} agree to less than two digits, the motion amplifies errors too much",
                           reference_.first.name(), reference_.second.name());
}

std::vector<Combination> StressCase::combinations() const {
  std::vector<Combination> r;
  for (const auto& f : formulations()) {
    if (!redundant_.empty() && !f.carries_redundancy) continue;
    for (const Integrator& i : integrators())
      if (i.step_control && i.carries(f)) r.push_back({f.name, i.name, "", !f.exact_constraints()});
  }
  return r;
}

double StressCase::allowed_at(double rtol) const {
  return std::max(claim(TradeMeasure::psi).allowed(rtol), claim(TradeMeasure::outputs).allowed(rtol));
}

StressEntry StressCase::run(const TradeProbe& probe, const Combination& c, double rtol, double step_s, double allowed,
                            const std::function<void(TradeValues&)>& back) {
  StressEntry e;
  e.what = c;
  e.allowed = allowed;
  RunBudget budget;
  budget.begin(limit_s_);
  take_notices();
  const auto end = [&](StressVerdict v, const std::string& why) {
    e.verdict = v;
    e.why = why;
  };
  try {
    Problem prepared = watched(probe.prepared(c, rtol, step_s), budget);
    prepared.solver.confirm = !c.method.empty();
    GradientResult result;
    TradeValues v = probe.run(prepared, c.method, &result);
    if (c.method.empty() && motion_is_confirmed(prepared)) {
      RunBudget another;
      another.begin(limit_s_);
      confirm_motion(probe, watched(probe.prepared(c, rtol, step_s), another), v, &result);
    }
    if (v.motion) e.drift = v.motion->position_drift;
    if (back) back(v);
    const std::vector<std::string> said = take_notices();
    TradeRow row;
    reference_.judge(v, probe_, row);
    for (const TradeMeasure m : kTradeMeasures) {
      const auto error = row.error_of(m);
      if (!error || (*error <= e.error && !e.measure.empty())) continue;  // what is no number is the worst
      e.error = *error;
      e.measure =
          m == TradeMeasure::psi ? "psi" : (m == TradeMeasure::gradient ? "the derivative by " : "") + row.worst;
    }
    if (!said.empty())
      end(StressVerdict::warned, said.front());
    else if (!(e.error <= allowed)) {
      e.verdict = StressVerdict::wrong;
      // What it prints beside its psi.
      const double stated = result.known_error ? result.known_error->psi / reference_.psi_unit : 0;
      if (e.measure == "psi" && e.error <= kStated * stated)
        end(StressVerdict::warned, fmt::format("psi is off by {:.1e}, and states {:.1e}", e.error, stated));
    }
  } catch (const Cut& cut) {
    end(StressVerdict::cut, cut.what());
  } catch (const CapabilityError& error) {
    end(StressVerdict::refused, error.what());
  } catch (const SolverError& error) {
    end(StressVerdict::refused, error.what());
  } catch (const ModelError& error) {
    end(StressVerdict::refused, error.what());
  }
  if (e.verdict == StressVerdict::wrong && !unjudged().empty()) end(StressVerdict::unjudged, unjudged());
  return e;
}

void StressCase::beside_each_other(std::vector<StressEntry>& entries, const std::vector<Combination>& list,
                                   const std::function<void(const Combination&, std::vector<StressEntry>&)>& work) {
  std::vector<std::vector<StressEntry>> done(list.size());
  const auto keep = [&] {
    for (auto& own : done) entries.insert(entries.end(), own.begin(), own.end());
  };
  try {
    for_each_job(list.size(), jobs(), [&](std::size_t i) {
      if (time_left_()) work(list[i], done[i]);
    });
  } catch (...) {  // an interruption: what has been run stands
    keep();
    throw;
  }
  keep();
}

/// At a tolerance, against what it claims.
StressEntry StressCase::run_at(const TradeProbe& probe, const Combination& c, double rtol, const std::string& axis,
                               const std::string& value) {
  StressEntry e = run(probe, c, rtol, 0, std::max(allowed_at(rtol), c.soft ? StressClaim::kSoft : 0));
  e.axis = axis;
  e.value = value;
  return e;
}

void StressCase::every_combination(std::vector<StressEntry>& entries, const std::string& axis,
                                   const std::string& value) {
  beside_each_other(entries, combinations(), [&](const Combination& c, std::vector<StressEntry>& own) {
    own.push_back(run_at(probe_, c, problem_.solver.rtol, axis, value));
  });
}

void StressCase::gradients(std::vector<StressEntry>& entries, const std::string& axis, const std::string& value) {
  const Formulation& formulation = find_formulation(problem_.formulation);
  std::vector<Combination> list;
  for (const auto& m : sensitivity_methods()) {
    const bool dae = m.needs == SensitivityMethod::Needs::dae;
    if (m.perturbs || (!dae && m.needs != SensitivityMethod::Needs::ode) || !refusal(m, formulation).empty()) continue;
    list.push_back({formulation.name, dae ? "idas" : "cvodes", m.name});
  }
  beside_each_other(entries, list, [&](const Combination& c, std::vector<StressEntry>& own) {
    own.push_back(run_at(probe_, c, problem_.solver.rtol, axis, value));
  });
}

void StressCase::tolerances(std::vector<StressEntry>& entries, const std::vector<double>& rtols) {
  for (const double rtol : rtols)
    beside_each_other(entries, combinations(), [&](const Combination& c, std::vector<StressEntry>& own) {
      own.push_back(run_at(probe_, c, rtol, "tolerance", fmt::format("rtol {:g}", rtol)));
    });
}

/// With a step of the user's nothing is claimed of the first; but smaller ones must not be worse.
void StressCase::steps(std::vector<StressEntry>& entries, const std::vector<long>& counts) {
  const double span = problem_.solver.t_end - problem_.solver.t_start;
  std::vector<Combination> fixed;
  for (const auto& f : formulations())
    if (f.make_discrete && (redundant_.empty() || f.carries_redundancy)) fixed.push_back({f.name, "fixed"});
  beside_each_other(entries, fixed, [&](const Combination& c, std::vector<StressEntry>& own) {
    double before = HUGE_VAL;
    for (const long n : counts) {
      if (!time_left_()) return;
      const double allowed = std::max(kStepRise * before, kStepNoise);
      StressEntry e = run(probe_, c, 0, span / static_cast<double>(n), allowed);
      e.axis = "step";
      e.value = fmt::format("{} steps", n);
      const bool ended =
          e.verdict == StressVerdict::held || e.verdict == StressVerdict::wrong || e.verdict == StressVerdict::warned;
      if (ended) before = std::min(before, e.error);
      own.push_back(std::move(e));
    }
  });
}

void StressCase::weights(std::vector<StressEntry>& entries, const std::vector<double>& alphas) {
  const double rtol = problem_.solver.rtol;
  for (const double alpha : alphas) {
    Problem p = problem_;
    p.formulation_options.set("penalty_alpha", alpha);
    const TradeProbe probe(p, rho_, outputs_, kSampleCount);
    std::vector<Combination> weighted = combinations();
    std::erase_if(weighted, [](const Combination& c) { return !find_formulation(c.formulation).weighted; });
    beside_each_other(entries, weighted, [&](const Combination& c, std::vector<StressEntry>& own) {
      StressEntry e = run_at(probe, c, rtol, "penalty weight", fmt::format("{:g}", alpha));
      if (e.verdict == StressVerdict::wrong && c.soft) {
        // As soft as the user's weight makes it? Then ten times the weight takes most of the error away.
        Problem firm = p;
        firm.formulation_options = find_formulation(c.formulation).firmer(p.mechanism, p.formulation_options);
        const StressEntry f = run(TradeProbe(firm, rho_, outputs_, kSampleCount), c, rtol, 0, e.allowed);
        if (!f.measure.empty() && f.error < kSoftFall * e.error) {
          e.verdict = StressVerdict::held;
          e.why = "as soft as its weight makes it";
        }
      }
      own.push_back(std::move(e));
    });
  }
}

void StressCase::stabilizations(std::vector<StressEntry>& entries) {
  const double rtol = problem_.solver.rtol;
  for (const auto& [xi, omega] : {std::pair(0.0, 1e-6), std::pair(0.0, 10.0), std::pair(1.0, 1e-2), std::pair(1.0, 1e3),
                                  std::pair(1.0, 1e5), std::pair(1.0, 1e7), std::pair(100.0, 10.0)}) {
    Problem p = problem_;
    constexpr const char* kDamping = "baumgarte_xi";
    p.formulation_options.set(kDamping, xi);
    p.formulation_options.set("baumgarte_omega_rad_per_s", omega);
    const TradeProbe probe(p, rho_, outputs_, kSampleCount);
    std::vector<Combination> stabilized = combinations();
    std::erase_if(stabilized, [](const Combination& c) {
      const auto& options = find_formulation(c.formulation).options;
      return std::none_of(options.begin(), options.end(), [&](const auto& o) { return o.key == kDamping; });
    });
    const std::string value = fmt::format("xi {:g}, omega {:g} rad/s", xi, omega);
    beside_each_other(entries, stabilized, [&](const Combination& c, std::vector<StressEntry>& own) {
      own.push_back(run_at(probe, c, rtol, "stabilization", value));
    });
  }
}

StressEntry StressCase::same(const Problem& other, const std::vector<double>& rho, const std::string& axis,
                             const std::string& value, const std::function<void(TradeValues&)>& back) {
  Problem p = other;
  p.monitor = problem_.monitor;
  const TradeProbe probe(p, rho, outputs_, kSampleCount);
  Combination c{p.formulation, p.solver.integrator};
  if (c.integrator.empty()) c.integrator = find_formulation(c.formulation).default_integrator;
  StressEntry e = run(probe, c, p.solver.rtol, 0, allowed_at(p.solver.rtol), back);
  e.axis = axis;
  e.value = value;
  return e;
}

}  // namespace costate
