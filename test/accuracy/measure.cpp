#include "measure.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "costate/base/notice.h"
#include "costate/integrator/run_budget.h"
#include "costate/problem/redundant_rows.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/accurate_run.h"
#include "costate/tradeoff/stopwatch.h"
#include "costate/tradeoff/trade_reference.h"

namespace costate::accuracy {

namespace {

using nlohmann::json;

constexpr int kSamples = 60;
// The reference has to be so much better than what it judges.
constexpr double kBetter = 0.2;
// Short runs are timed so many times, and their median counts.
constexpr int kRepeats = 3;
constexpr double kShort_s = 0.3;

/// No Cut: nothing in between takes it for a pilot's.
struct TooLong : std::runtime_error {
  using std::runtime_error::runtime_error;
};

double median(std::vector<double> v) {
  std::sort(v.begin(), v.end());
  return v[v.size() / 2];
}

/// Processor time of f, of short ones the median of several.
template <class F>
double timed(F&& f) {
  std::vector<double> all;
  for (int i = 0; i < kRepeats; ++i) {
    const double begin = processor_time_s();
    f();
    all.push_back(processor_time_s() - begin);
    if (all.back() > kShort_s) break;
  }
  take_notices();
  return median(all);
}

class Measurement {
 public:
  Measurement(const Variant& v, const MeasureOptions& options)
      : variant_(v),
        options_(options),
        problem_(watched(v)),
        probe_(problem_, problem_.parameters.values(), outputs(v.scene), kSamples) {}

  json run() {
    json j = {{"family", variant_.family}, {"gradient", gradient()}};
    redundant_ = !redundant_rows(problem_, probe_.rho()).empty();
    ReferenceSearch search;
    search.redundant = redundant_;
    search.gradient = gradient();
    const double seconds = options_.reference_s * (variant_.vehicle ? 20 : 1), begin = RunBudget::processor_s();
    const auto left = [=] { return seconds - (RunBudget::processor_s() - begin); };
    search.allow = [left, seconds] {
      RunBudget budget;
      budget.begin(std::max(0.1 * seconds, left()));
      return budget;
    };
    search.has_time = [left, seconds] { return left() > 0.7 * seconds; };
    reference_ = find_trade_reference(probe_, search);
    take_notices();
    j["reference"] = reference_.first.name() + " and " + reference_.second.name();
    if (!reference_.proven) {
      j["unjudged"] = "no two independent combinations agree";
      return j;
    }
    j["floor"] = floor();
    if (options_.exhaustive) find_best();
    j["requests"] = json::array();
    for (std::size_t i = 0; i < options_.requests.size(); ++i) {
      json r = request(options_.requests[i]);
      if (options_.exhaustive && i < best_.size() && !best_[i].name.empty()) {
        r["best"] = best_[i].name;
        r["best_s"] = best_[i].time_s;
      }
      j["requests"].push_back(r);
    }
    return j;
  }

 private:
  struct Best {
    std::string name;
    Combination what;
    double rtol = 0, time_s = HUGE_VAL;
  };

  bool gradient() const { return !variant_.parameters.empty(); }

  static std::vector<std::string> outputs(const Scene& scene) {
    std::vector<std::string> r = scene.run.outputs.empty() ? scene.mechanism()->coordinate_names() : scene.run.outputs;
    std::erase(r, "time");
    return r;
  }

  Problem watched(const Variant& v) {
    Problem p = make_problem(v.scene, v.parameters);
    p.monitor = [this](double t, long steps, bool backward) {
      if (limit_s_ > 0 && processor_time_s() - began_ > limit_s_)
        throw TooLong(fmt::format("more than {:g} s", limit_s_));
      budget_.look(t, steps, backward);
    };
    return p;
  }

  /// What a request is of.
  std::vector<TradeMeasure> counted() const {
    return {TradeMeasure::psi, gradient() ? TradeMeasure::gradient : TradeMeasure::outputs};
  }
  double floor() const {
    double f = 0;
    for (const TradeMeasure m : counted()) f = std::max(f, reference_.floor[static_cast<std::size_t>(m)]);
    return f;
  }
  /// The largest error and what it is of.
  std::pair<double, std::string> error_of(const TradeValues& v) const {
    TradeRow row;
    reference_.judge(v, probe_, row);
    std::pair<double, std::string> r = {0, ""};
    for (const TradeMeasure m : counted())
      if (const auto e = row.error_of(m); e && !(*e <= r.first))  // what is no number is the worst
        r = {std::isfinite(*e) ? *e : HUGE_VAL, m == TradeMeasure::psi ? "psi" : row.worst};
    return r;
  }

  json request(double accuracy) {
    AccuracyRequest asked;
    asked.accuracy = accuracy;
    asked.gradient = gradient();
    for (const auto& o : probe_.outputs()) asked.outputs.push_back(o->name());
    json j = {{"accuracy", accuracy}};
    try {
      std::optional<AccurateRun> run;
      TradeValues v;
      j["time_s"] = timed([&] {
        began_ = processor_time_s();
        limit_s_ = options_.limit_s;
        v.motion.emplace();
        run = run_to_accuracy(problem_, probe_.rho(), asked, [&](const Problem&) {
          v.motion->outputs.clear();
          return TradeProbe::Recording{probe_.times(), [&](const MechanismState& s, System& system) {
                                         std::vector<double> values;
                                         for (const auto& o : probe_.outputs())
                                           values.push_back(o->value(s, system.assembly()));
                                         v.motion->outputs.push_back(values);
                                       }};
        });
      });
      limit_s_ = 0;
      v.psi = run->result.psi;
      v.gradient = run->result.gradient;
      if (gradient() || v.motion->outputs.size() != probe_.times().size()) v.motion.reset();
      const auto [error, worst] = error_of(v);
      j["met"] = run->met;
      j["estimated"] = run->relative;
      j["runs"] = run->runs;
      double pilots = 0;
      for (const AccuracyPilot& p : run->pilots) pilots += p.time_s;
      j["pilots_s"] = pilots;
      j["choice"] = fmt::format("{}, rtol {:.1e}", run->what.name(), run->problem.solver.rtol);
      Problem result = run->problem;
      result.solver.resolve = false;  // as it was
      j["result_s"] = timed([&] { probe_.run(result, run->what.method); });
      j["error"] = floor() <= kBetter * accuracy ? json(error) : json();
      j["worst"] = worst;
    } catch (const TooLong& e) {
      j["failed"] = e.what();
    } catch (const Error& e) {
      j["failed"] = e.what();
    }
    limit_s_ = 0;
    take_notices();
    return j;
  }

  std::vector<Combination> combinations() const {
    std::vector<Combination> r;
    for (const Formulation& f : formulations()) {
      if (!f.exact_constraints() || (redundant_ && !f.carries_redundancy)) continue;
      if (!gradient()) {
        for (const Integrator* i : integrators_of(f))
          if (i->step_control) r.push_back({f.name, i->name});
        continue;
      }
      for (const SensitivityMethod& m : sensitivity_methods()) {
        if (m.perturbs || !refusal(m, f).empty()) continue;
        for (const std::string& i : integrators_of(m, f))
          if (!has_fixed_steps(i)) r.push_back({f.name, i, m.name});
      }
    }
    return r;
  }

  /// Every combination from loose to tight, as long as it can still be the best for a request.
  void find_best() {
    best_.assign(options_.requests.size(), {});
    for (const Combination& c : combinations())
      for (int k = 4; k <= 26; k += variant_.vehicle ? 2 : 1) {
        const double rtol = std::pow(10, -0.5 * k);
        double slowest = 0;
        for (std::size_t i = 0; i < best_.size(); ++i)
          if (floor() <= options_.requests[i]) slowest = std::max(slowest, best_[i].time_s);
        budget_.begin(std::isfinite(slowest) ? std::max(slowest, 1e-3) : options_.limit_s);
        try {
          const TradeValues v = probe_.run(c, rtol, 0);
          const double error = error_of(v).first;
          for (std::size_t i = 0; i < best_.size(); ++i)
            if (error <= options_.requests[i] && v.time_s < best_[i].time_s)
              best_[i] = {fmt::format("{}, rtol {:.1e}", c.name(), rtol), c, rtol, v.time_s};
          if (v.time_s > slowest) break;
        } catch (const Cut&) {
          break;
        } catch (const SolverError&) {  // too loose, or as tight as it gets
        } catch (const Error&) {
          break;
        }
      }
    budget_.unlimited();
    for (Best& b : best_)
      if (!b.name.empty()) b.time_s = timed([&] { probe_.run(b.what, b.rtol, 0); });
    take_notices();
  }

  const Variant& variant_;
  const MeasureOptions& options_;
  RunBudget budget_;
  double limit_s_ = 0, began_ = 0;
  Problem problem_;
  TradeProbe probe_;
  bool redundant_ = false;
  TradeReference reference_;
  std::vector<Best> best_;
};

}  // namespace

json measure(std::uint64_t number, const MeasureOptions& options) {
  json j;
  const double begin = processor_time_s();
  try {
    const Variant v = draw_variant(number);
    j["family"] = v.family;
    j = Measurement(v, options).run();
  } catch (const Error& e) {
    j["unjudged"] = e.what();
  } catch (const Cut& e) {
    j["unjudged"] = e.what();
  }
  j["number"] = number;
  j["spent_s"] = processor_time_s() - begin;
  take_notices();
  return j;
}

}  // namespace costate::accuracy
