#include "costate/cycle/cycle.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/cycle/cycle_derivatives.h"
#include "costate/cycle/cycle_errors.h"
#include "costate/cycle/cycle_rest.h"
#include "costate/cycle/cycle_search.h"
#include "costate/cycle/cycle_start.h"
#include "costate/cycle/multiplier_derivative.h"
#include "costate/problem/scaled_gradient.h"

namespace costate {

namespace {

// Searches at these parts of the tolerance tell errors, at kTightest at the least; no estimate is below this part of
// it.
constexpr double kTighter[] = {0.1, 0.03}, kTightest = 1e-13, kLeast = 0.01;
// How far a multiplier is from 1 is known to its change between two tolerances, which is small by chance, too: in 48
// runs of motions that conserve it was up to 5.6 times too small.
constexpr double kChance = 10;
void add_state(const Problem& problem, const ReturnMap& map, const CycleSearch& search, CycleResult& r) {
  const ReturnMap::State s = map.state(search.x, search.positions);
  const Mechanism& m = *problem.mechanism;
  const auto names = m.coordinate_names(), states = m.state_names();
  for (std::size_t i = 0; i < names.size(); ++i) {
    r.state_names.push_back(names[i]);
    r.state.push_back(s.q[i]);
  }
  for (std::size_t i = 0; i < names.size(); ++i) {
    r.state_names.push_back(names[i] + "_dot");
    r.state.push_back(s.v[i]);
  }
  for (std::size_t i = 0; i < states.size(); ++i) {
    r.state_names.push_back("z." + states[i]);
    r.state.push_back(s.z[i]);
  }
}

/// At a looser tolerance.
struct Looser : CycleResult {
  Eigen::MatrixXd P;
};

/// r's derivatives, by r.map, but for what psi changes by as the largest multiplier does.
void differentiate(const ReturnMap& map, CycleResult& r) {
  CycleDerivatives d = cycle_derivatives(map, r.map, r.psi_values, r.values());
  r.x_rho = std::move(d.x);
  r.period_rho = std::move(d.period);
  r.travel_rho = std::move(d.travel);
  r.psi_rho = std::move(d.psi);
}

/// Widens r's errors of derivatives by those of a search at a looser tolerance.
void estimate_derivatives(const Looser& loose, const ParameterSelection& parameters, CycleResult& r) {
  const auto widen = [&](auto& error, const auto& other) {
    error = error.size() == 0 ? other : other.cwiseMax(error).eval();
  };
  widen(r.x_rho_error, derivative_errors(r.units, r.period.value, r.x_rho, loose.x_rho, parameters));
  widen(r.period_rho_error, derivative_errors(r.period_rho, loose.period_rho, parameters));
  widen(r.travel_rho_error, derivative_errors(r.travel_rho, loose.travel_rho, parameters));
  widen(r.speed_rho_error, derivative_errors(r.speed_rho(), loose.speed_rho(), parameters));
  widen(r.psi_rho_error, derivative_errors(r.psi_rho, loose.psi_rho, parameters));
}

void differentiate_multiplier(const CycleSearch& search, const ReturnMap& map, const CycleOptions& options,
                              CycleResult& r) {
  const double by_multiplier = r.psi_values[kCycleMultiplier];
  if (!options.multiplier && by_multiplier == 0) return;
  try {
    const MultiplierDerivative m =
        multiplier_derivative(map, search.x, search.positions, static_cast<int>(r.x_rho.cols()));
    r.counters += m.counters;
    r.multiplier_rho = m.by_rho;
    r.multiplier_rho_error = m.error;
    if (r.x_rho_error.size() > 0) {
      // Its own estimate is of runs from one fixed point.
      const auto& parameters = map.problem().parameters;
      const double known = relative_error(r.units, r.period.value, r.x_rho, r.x_rho_error, parameters);
      const Eigen::VectorXd scale = scales(parameters).head(m.error.size());
      r.multiplier_rho_error =
          m.error.cwiseMax(kByChance * known * scaled_size(m.by_rho, parameters) * scale.cwiseInverse());
    }
    r.multiplier_method = multiplier_method(m);
    if (by_multiplier == 0) return;
    r.psi_rho += by_multiplier * m.by_rho;
    if (r.psi_rho_error.size() > 0) r.psi_rho_error += std::abs(by_multiplier) * r.multiplier_rho_error;
  } catch (const Error& e) {
    if (by_multiplier != 0) throw;
    r.multiplier_method = e.what();
  }
}

/// Widens r's errors by what a search at a looser tolerance has found. Searches from one point that none can leave tell
/// nothing, but what Newton's last step would still change.
void estimate(const Looser& loose, double rtol, const CycleSearch& search, CycleResult& r) {
  const auto widen = [&](Estimated& e, double other, const Eigen::RowVectorXd& by_x) {
    e.error = std::max(
        {e.error, std::abs(e.value - other), std::abs(by_x.dot(search.left)), kLeast * rtol * std::abs(e.value)});
  };
  Eigen::VectorXd error =
      (r.x - loose.x).cwiseAbs().cwiseMax(search.left.cwiseAbs()).cwiseMax(kLeast * rtol * r.x.cwiseAbs());
  pool_errors(r.units, search.value.time, r.x, error);
  r.x_error = r.x_error.cwiseMax(error);
  widen(r.period, loose.period.value, search.value.time_x);
  widen(r.travel, loose.travel.value, search.value.travel_x);
  widen(r.psi, loose.psi.value, search.value.psi_x);
  const double changed = std::abs(r.largest() - loose.largest());
  r.undecided = std::max(r.undecided, kChance * changed);
  r.multiplier_error = std::max(r.multiplier_error, changed);
  if (!r.multipliers.empty())
    r.multiplier_error =
        std::max(r.multiplier_error, multiplier_error(search.monodromy(), loose.P, r.multipliers.front()));
}

/// An equilibrium repeats itself after any time; a motion that a section is to be met by does not come to it.
void tell_rest(const CycleSettings& settings, double rtol, double time) {
  if (!settings.period_s)
    throw SolverError(
        fmt::format("No cycle was found: the motion comes to rest. What the search ends at moves by no more than its "
                    "tolerances in the {:.6g} s to the next section: an equilibrium, of which 'costate equilibrium' "
                    "and 'costate modes' tell. A cycle needs something that feeds it: begin nearer to one, or look "
                    "whether there is one at these parameters.",
                    time));
  notice(
      fmt::format("This cycle is rest, to what rtol {:g} tells: nothing moves by more than its tolerance in a period, "
                  "and the multipliers are those of an equilibrium. A smaller rtol tells more.",
                  rtol));
}

/// The problem whose cost knows the values of the cycle that was found, at the tolerance of its search.
class Whole {
 public:
  Whole(const Problem& problem, const ReturnMap& map, const CycleSearch& search)
      : search_(search), valued_(has_cycle_values(problem)), own_(map) {
    if (!valued_) return;
    const auto multipliers = multipliers_of(search.monodromy(), map.section().trivial_multipliers());
    const MapValue& v = search.value;
    const CycleValues values = {v.time, v.travel, v.travel / v.time,
                                multipliers.empty() ? 0 : std::abs(multipliers.front())};
    ValuedProblem with = with_cycle_values(problem, map.rho(), values);
    with.problem.solver = map.problem().solver;
    with.problem.check_values(with.rho);
    with_.emplace(with.problem, map.section(), with.rho, kCycleValues);
  }

  const ReturnMap& map() const { return with_ ? *with_ : own_; }
  /// P, psi and what else a cycle gives at the search's x.
  MapValue value(bool derivatives) const {
    if (!valued_ && !derivatives) return search_.value;
    return map().evaluate(search_.x, search_.positions, derivatives ? MapDerivatives::all : MapDerivatives::last);
  }
  CycleValues by_values(const MapValue& v) const {
    return valued_ ? CycleValues(v.psi_rho.tail<kCycleValues>().transpose()) : CycleValues(CycleValues::Zero());
  }

 private:
  const CycleSearch& search_;
  bool valued_;
  const ReturnMap& own_;
  std::optional<ReturnMap> with_;
};

}  // namespace

std::optional<bool> CycleResult::stable() const {
  if (std::abs(largest() - 1) <= undecided) return {};
  return largest() < 1;
}

CycleResult find_cycle(const Problem& problem, const CycleSettings& settings, const std::vector<double>& rho,
                       const CycleOptions& options) {
  const CycleStart start(problem, settings, rho);
  const Section& section = start.section();
  ReturnMap map(without_cycle_cost(problem), section, rho);  // the values are known once the cycle is
  CycleSearch search(map, options);
  search.x = start.x();
  search.positions = start.positions();
  map.require_periodic(search.x, search.positions);
  settle(map, settings.settle, search.x, search.positions);
  map.onto_section(search.x, search.positions);
  search.begin();
  search.solve();
  map.require_same_modes(search.value);
  map.require_same_place(search.x, search.positions, search.value);
  if (rests(map, start, search.x, search.positions, search.value.time))
    tell_rest(settings, problem.solver.rtol, search.value.time);
  map.require_same_later(search.x, search.positions, search.value);
  map.require_whole_turns(search.x, search.positions, search.value);
  CycleResult r;
  for (const auto& c : section.coordinates()) {
    r.names.push_back(c.name);
    r.units.push_back(c.unit);
  }
  const bool derivatives = options.derivatives && !rho.empty();
  const auto take = [&](const MapValue& v) {
    search.counters += v.counters;
    r.x = search.x;
    r.period.value = v.time;
    r.travel.value = v.travel;
    r.psi.value = v.psi;
    r.multipliers = multipliers_of(search.monodromy(), section.trivial_multipliers());
  };
  std::vector<Looser> looser;  // of searches at looser tolerances, where errors are estimated
  if (options.estimate) {
    const SolverOptions& solver = problem.solver;
    double last = solver.rtol;
    for (const double tighter : kTighter) {
      const double part = std::max(tighter, kTightest / solver.rtol);
      if (!(part * solver.rtol < last)) break;
      last = part * solver.rtol;
      const Whole at_this(problem, map, search);
      take(at_this.value(false));
      Looser& loose = looser.emplace_back(Looser{r, search.monodromy()});
      if (derivatives) {
        loose.map = at_this.value(true);
        search.counters += loose.map.counters;
        loose.psi_values = at_this.by_values(loose.map);
        differentiate(at_this.map(), loose);
      }
      map.set_tolerance(last, part * solver.absolute());
      search.begin();
      search.solve();
    }
    take(Whole(problem, map, search).value(false));
  }
  r.x_error.setZero(search.x.size());
  for (const Looser& loose : looser) estimate(loose, problem.solver.rtol, search, r);
  const Whole whole(problem, map, search);
  r.map = whole.value(derivatives);
  if (looser.empty()) take(r.map);
  r.undecided = std::max({r.undecided, r.multiplier_error, problem.solver.rtol});
  r.psi_values = whole.by_values(r.map);
  if (derivatives) {
    differentiate(whole.map(), r);
    for (const Looser& loose : looser) estimate_derivatives(loose, problem.parameters, r);
    differentiate_multiplier(search, whole.map(), options, r);
  }
  add_state(problem, map, search, r);
  r.residual = search.residual;
  r.worst = search.worst;
  r.iterations = search.iterations;
  r.events = search.value.events;
  r.positions = search.positions;
  r.counters += search.counters;
  r.integrator = search.value.integrator;
  return r;
}

}  // namespace costate
