#include "costate/tradeoff/trade_reference.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/run_budget.h"
#include "costate/mechanism/length_size.h"
#include "costate/problem/scaled_gradient.h"
#include "costate/record/jobs.h"
#include "costate/sensitivity/method.h"

namespace costate {

namespace {

constexpr double kRounding = 1e-15;
// Two that agree to so many digits are enough; below, others are tried.
constexpr double kEnough = 1e-7;
constexpr std::size_t kMostEach = 3;
// Agreement to fewer digits than two proves nothing.
constexpr double kAgrees = 1e-2;
// A cost whose terms cancel is measured by a thousandth of their sum, an output of a small range by a thousandth of the
// largest range in its unit of measurement.
constexpr double kCancelled = 1e-3;
// An output whose range is no more of its size is constant, and measured by its size.
constexpr double kConstant = 1e-6;
// Of the mechanism's length, and of angles.
constexpr double kNoMotion = 1e-10;
// An output whose terms cancel to less than this part of what they amount to is measured by that part: the force of a
// spring and its damper that drive no mass is zero, and each of them right to its tolerance.
constexpr double kCancelledTerms = 1e-6;
// What the reference's own energy may change by, against the kinetic one, where it is said to be kept.
constexpr double kKept = 1e-7;
constexpr std::size_t kFewParameters = 10;

double infinite_unless(double x) { return std::isfinite(x) ? x : std::numeric_limits<double>::infinity(); }

/// What a quantity of a unit amounts to along the motion: ranges of coordinates, the kinetic energy, a force that
/// gives it over such a range. An output that is zero is measured by a part of it.
std::map<std::string, double> sizes(const TradeProbe& probe, const TradeMotion& m, double kinetic) {
  std::map<std::string, double> size;
  const auto& coordinates = probe.problem().mechanism->coordinates();
  for (std::size_t i = 0; i < std::min(coordinates.size(), m.lowest.size()); ++i)
    size[coordinates[i].unit] = std::max(size[coordinates[i].unit], m.highest[i] - m.lowest[i]);
  // Where all that moves is rounding they are what they could be.
  const double length = length_size(*probe.problem().mechanism);
  for (const auto& [unit, could] : {std::pair("m", length), std::pair("rad", 1.0)})
    if (size.contains(unit) && !(size[unit] > kNoMotion * could)) size[unit] = could;
  const double span = probe.problem().solver.t_end - probe.problem().solver.t_start;
  for (const char* unit : {"m", "rad"})
    if (size.contains(unit)) size[std::string(unit) + "/s"] = size[unit] / span;
  size["J"] = size["N m"] = kinetic;
  if (size["m"] > 0) size["N"] = kinetic / size["m"];
  return size;
}

/// A combination at a tight tolerance and at ten times that.
struct Witness {
  Combination what;
  std::string method;
  double rtol = 0;
  TradeValues tight, looser;
};

struct Attempt {
  std::optional<Witness> witness;
  std::string note;            // why there is none
  std::exception_ptr failure;  // of the mechanism itself
};

class WitnessSearch {
 public:
  WitnessSearch(const TradeProbe& probe, const ReferenceSearch& search) : probe_(probe), search_(search) {}

  TradeReference find() {
    const auto ode = candidates("cvodes"), dae = candidates("idas");
    std::vector<Witness> on_cvodes, on_idas;
    TradeReference best;
    bool any = false;
    const auto good = [&] {
      return any && best.proven && (worst(best) <= kEnough || (search_.has_time && !search_.has_time()));
    };
    // Of each integrator the first is needed in any case.
    std::array<Attempt, 2> first;
    for_each_job(2, jobs(), [&](std::size_t k) {
      const auto& from = k == 0 ? ode : dae;
      if (!from.empty()) first[k] = run(from[0]);
    });
    // One on each integrator in turns, each beside those on the other one.
    for (std::size_t i = 0; i < std::max(ode.size(), dae.size()) && !good(); ++i)
      for (const bool ours : {true, false}) {
        const auto& from = ours ? ode : dae;
        auto& side = ours ? on_cvodes : on_idas;
        if (good() || i >= from.size() || side.size() >= kMostEach) continue;
        const Attempt a = i == 0 ? first[ours ? 0 : 1] : run(from[i]);
        const std::optional<Witness>& w = a.witness;
        if (!a.note.empty()) notes_.push_back(a.note);
        if (a.failure) failure_ = a.failure;
        if (!w) continue;
        side.push_back(*w);
        for (const Witness& other : ours ? on_idas : on_cvodes) {
          if (other.what.formulation == w->what.formulation) continue;
          const TradeReference r = ours ? pair(*w, other) : pair(other, *w);
          if (!any || (r.proven && !best.proven) || (r.proven == best.proven && worst(r) < worst(best))) best = r;
          any = true;
        }
      }
    if (!any) best = alone(on_cvodes, on_idas);
    best.notes = notes_;
    return best;
  }

 private:
  /// Exact constraints before soft ones; those that stand in for others first.
  std::vector<Combination> candidates(const std::string& integrator) const {
    std::vector<const Formulation*> list;
    for (const auto& f : formulations()) {
      if (integrator == "cvodes" ? !f.make_ode : !f.make_dae) continue;
      if (search_.redundant && !f.carries_redundancy) continue;
      if (f.exact_constraints()) list.push_back(&f);
    }
    // On CVODES what stands in for others; on IDAS first what holds the constraints in another way than by
    // accelerations.
    const auto rank = [&](const Formulation* f) {
      const int stand_in = f->stand_in > 0 ? f->stand_in : 100;
      return integrator == "cvodes" ? stand_in : (f->constraints == ConstraintForm::acceleration ? 1000 : 0) + stand_in;
    };
    std::stable_sort(list.begin(), list.end(), [&](auto* a, auto* b) { return rank(a) < rank(b); });
    std::vector<Combination> r;
    for (const Formulation* f : list) r.push_back({f->name, integrator, "", false});
    return r;
  }

  std::string method_for(const Combination& c) const {
    const bool forward = probe_.rho().size() <= kFewParameters;
    const auto needs = c.integrator == "idas" ? SensitivityMethod::Needs::dae : SensitivityMethod::Needs::ode;
    for (const auto& m : sensitivity_methods())
      if (m.needs == needs && m.adjoint != forward && !m.perturbs &&
          refusal(m, find_formulation(c.formulation)).empty())
        return m.name;
    return {};
  }

  TradeValues values(const Witness& w, double rtol) const {
    TradeValues v = probe_.run(w.what, rtol, 0, search_.allow());
    if (!w.method.empty()) {
      Combination c = w.what;
      c.method = w.method;
      v.gradient = probe_.run(c, rtol, 0, search_.allow()).gradient;
    }
    return v;
  }

  Attempt run(const Combination& c) const {
    Attempt attempt;
    Witness w;
    w.what = c;
    if (search_.gradient) {
      w.method = method_for(c);
      if (w.method.empty()) return attempt;
    }
    std::string why;
    for (double rtol = search_.tightest; rtol < 1e-8; rtol *= 10) {
      try {
        w.rtol = rtol;
        w.looser = values(w, 10 * rtol);
        w.tight = values(w, rtol);
        take_notices();
        attempt.witness = w;
        return attempt;
      } catch (const CapabilityError& e) {
        why = e.what();
        break;
      } catch (const SolverError& e) {
        why = e.what();
      } catch (const ModelError& e) {
        why = e.what();
        attempt.failure = std::current_exception();
        break;
      } catch (const Cut& e) {
        why = std::string("cut ") + e.what();
        rtol *= 10;
      }
    }
    attempt.note = fmt::format("{} does not serve as a reference: {}", c.name(), why);
    return attempt;
  }

  TradeReference pair(const Witness& a, const Witness& b) const {
    TradeReference r;
    r.first = a.what;
    r.second = b.what;
    r.rtol_first = a.rtol;
    r.rtol_second = b.rtol;
    r.gradient_first = a.method;
    r.gradient_second = b.method;
    r.values = a.tight;
    r.measure(probe_);
    TradeRow apart, change;
    r.judge(b.tight, probe_, apart);
    r.judge(a.looser, probe_, change);
    r.proven = true;
    for (std::size_t m = 0; m < r.floor.size(); ++m) {
      if (!apart.error[m]) continue;
      // Integrators of one order err alike: two that agree may be off together. What the last power of ten of the
      // tolerance changed is an error that falls at least as its square root does, with a margin of two.
      r.floor[m] = std::max({2 * *apart.error[m], *change.error[m], kRounding});
      r.proven = r.proven && r.floor[m] <= kAgrees;
    }
    return r;
  }

  TradeReference alone(const std::vector<Witness>& on_cvodes, const std::vector<Witness>& on_idas) const {
    if (on_cvodes.empty() && on_idas.empty()) {
      if (failure_) std::rethrow_exception(failure_);
      if (!notes_.empty())
        throw SolverError(
            fmt::format("No combination could be followed to a tolerance tight enough for a reference. {}",
                        fmt::join(notes_, " ")));
      throw CapabilityError(
          "No combination with exact constraints can be the reference of this scene; there is nothing to measure "
          "errors against.");
    }
    const Witness& w = on_cvodes.empty() ? on_idas.front() : on_cvodes.front();
    TradeReference r = pair(w, w);
    r.second = {};
    r.gradient_second.clear();
    r.rtol_second = 0;
    r.proven = false;
    return r;
  }

  double worst(const TradeReference& r) const { return *std::max_element(r.floor.begin(), r.floor.end()); }

  const TradeProbe& probe_;
  const ReferenceSearch& search_;
  std::vector<std::string> notes_;
  std::exception_ptr failure_;  // of the mechanism itself
};

}  // namespace

void TradeReference::measure(const TradeProbe& probe) {
  const TradeMotion& m = *values.motion;
  const auto& outputs = probe.outputs();
  const double kinetic = m.kinetic.empty() ? 0 : *std::max_element(m.kinetic.begin(), m.kinetic.end());
  std::map<std::string, double> largest = sizes(probe, m, kinetic);
  std::vector<double> low(outputs.size(), HUGE_VAL), high(outputs.size(), -HUGE_VAL), size(outputs.size(), 0);
  for (const auto& sample : m.outputs)
    for (std::size_t o = 0; o < outputs.size(); ++o) {
      low[o] = std::min(low[o], sample[o]);
      high[o] = std::max(high[o], sample[o]);
      size[o] = std::max(size[o], std::abs(sample[o]));
    }
  for (std::size_t o = 0; o < outputs.size(); ++o)
    largest[outputs[o]->unit()] = std::max(largest[outputs[o]->unit()], high[o] - low[o]);
  // What turns makes points go round, and the other way about: as much in the other unit.
  const double length = length_size(*probe.problem().mechanism);
  const auto turned = [&](const std::string& unit) {
    if (unit.starts_with("rad")) return largest["m" + unit.substr(3)] / length;
    return unit == "m" || unit.starts_with("m/s") ? length * largest["rad" + unit.substr(1)] : 0;
  };
  // Euler parameters and unit vectors are parts of 1.
  std::set<std::string> of_one;
  for (const Coordinate& c : probe.problem().mechanism->coordinates())
    if (c.unit == "1") of_one.insert(c.name);
  output_unit.clear();
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    const double range = high[o] - low[o];
    const double of = std::max(largest[outputs[o]->unit()], of_one.count(outputs[o]->name()) > 0 ? 1.0 : 0.0);
    const double unit = std::max(range > kConstant * size[o] ? range : size[o], kCancelled * of);
    // An energy's zero is anybody's choice.
    const double least = outputs[o]->unit() == "J" ? kinetic : 0;
    const double nothing =
        kCancelledTerms * std::max(o < m.amounts.size() ? m.amounts[o] : 0, turned(outputs[o]->unit()));
    output_unit.push_back(unit > 0 ? std::max({unit, least, nothing}) : 1);
  }
  psi_unit = std::max(std::abs(values.psi), kCancelled * m.cost_amount);
  if (!(psi_unit > 0)) psi_unit = 1;
  gradient_unit = largest_scaled(probe.problem().parameters, values.gradient);
  if (!(gradient_unit > 1e-9 * psi_unit)) gradient_unit = std::max(psi_unit, 1e-300);
  double change = 0;
  for (const double e : m.energy) change = std::max(change, std::abs(e - m.energy.front()));
  energy_unit = kinetic > 0 && change <= kKept * kinetic ? kinetic : 0;
}

void TradeReference::judge(const TradeValues& v, const TradeProbe& probe, TradeRow& row) const {
  const auto put = [&](TradeMeasure m, double error) {
    row.error[static_cast<std::size_t>(m)] = infinite_unless(error);
  };
  row.psi = v.psi;
  const Objective& cost = probe.problem().objective;
  if (!cost.running.empty() || !cost.terminal.empty()) put(TradeMeasure::psi, std::abs(v.psi - values.psi) / psi_unit);
  if (v.motion && !probe.outputs().empty()) {
    double most = -1;
    for (std::size_t s = 0; s < values.motion->outputs.size(); ++s)
      for (std::size_t o = 0; o < probe.outputs().size(); ++o) {
        const double e =
            infinite_unless(std::abs(v.motion->outputs[s][o] - values.motion->outputs[s][o]) / output_unit[o]);
        if (o >= probe.counted()) {
          if (e > row.besides) row.besides = e, row.worst_besides = probe.outputs()[o]->name();
        } else if (e > most) {
          most = e, row.worst = probe.outputs()[o]->name();
        }
      }
    if (probe.counted() > 0) put(TradeMeasure::outputs, most);
  }
  if (v.motion && probe.problem().mechanism->row_count() > 0) {
    row.position_drift = v.motion->position_drift;
    row.velocity_drift = v.motion->velocity_drift;
  }
  if (v.motion && energy_unit > 0) {
    double change = 0;
    for (const double e : v.motion->energy) change = std::max(change, std::abs(e - v.motion->energy.front()));
    row.energy_drift = infinite_unless(change / energy_unit);
  }
  if (!v.gradient.empty() && !values.gradient.empty()) {
    double most = -1;
    const auto& parameters = probe.problem().parameters.parameters;
    for (std::size_t j = 0; j < parameters.size(); ++j) {
      const double e =
          infinite_unless(std::abs(v.gradient[j] - values.gradient[j]) * parameters[j].scale / gradient_unit);
      if (e > most) most = e, row.worst = parameters[j].name;
    }
    put(TradeMeasure::gradient, most);
  }
}

TradeReference find_trade_reference(const TradeProbe& probe, const ReferenceSearch& search) {
  return WitnessSearch(probe, search).find();
}

}  // namespace costate
