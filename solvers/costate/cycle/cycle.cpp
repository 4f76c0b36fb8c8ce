#include "costate/cycle/cycle.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/stop.h"
#include "costate/cycle/cycle_errors.h"
#include "costate/cycle/cycle_rest.h"
#include "costate/cycle/cycle_start.h"
#include "costate/cycle/multiplier_derivative.h"

namespace costate {

namespace {

constexpr int kHalvings = 8;
// A search ends where its next step would be this part of the tolerances, or their errors let it come no nearer.
constexpr double kNear = 1e-3;
// How far a multiplier is from 1 is known to its change between two tolerances, which is small by chance, too: in 48
// runs of motions that conserve it was up to 5.6 times too small.
constexpr double kChance = 10;
// I - P_x is singular where its smallest singular value is below this part of the largest, or of 1 as P_x itself is all
// but 1 at a resonance, or what runs at the tolerance make of zero: their errors are usually 1 to 200 rtol.
constexpr double kSingular = 1e-9, kSingularRuns = 200;

/// Scales s by which P becomes s_i^-1 P_ij s_j with rows and columns of like sizes (Osborne): metres beside radians per
/// second, or a speed that a small angle makes, are no sign that P - 1 is singular.
Eigen::VectorXd balancing(const Eigen::MatrixXd& P) {
  constexpr int kSweeps = 10;
  constexpr double kMost = 1e6;
  Eigen::VectorXd s = Eigen::VectorXd::Ones(P.rows());
  for (int sweep = 0; sweep < kSweeps; ++sweep)
    for (Eigen::Index i = 0; i < s.size(); ++i) {
      double row = 0, column = 0;
      for (Eigen::Index j = 0; j < s.size(); ++j) {
        if (j == i) continue;
        row = std::max(row, std::abs(P(i, j)) * s[j] / s[i]);
        column = std::max(column, std::abs(P(j, i)) * s[i] / s[j]);
      }
      if (row > 0 && column > 0) s[i] = std::clamp(s[i] * std::sqrt(row / column), 1 / kMost, kMost);
    }
  return s;
}

/// The search at one tolerance.
class Search {
 public:
  Search(ReturnMap& map, const CycleOptions& options) : map_(map), options_(options) {}

  Eigen::VectorXd x;
  std::vector<double> positions;
  MapValue value;        // at x
  Eigen::VectorXd left;  // what Newton's last step would still change, where the runs' errors let it come no nearer
  double residual = 0;
  int iterations = 0;
  std::string worst;
  Counters counters;

  void begin() { look(x, positions); }
  /// Newton's steps until the residual does not fall any more.
  void solve();
  Eigen::MatrixXd monodromy() const { return reduced(value.next_x); }
  Eigen::MatrixXd reduced(const Eigen::MatrixXd& full) const {
    const auto& free = map_.section().free();
    return full(free, free);
  }

 private:
  double tolerance(double at) const {
    const SolverOptions& s = map_.problem().solver;
    return s.rtol * std::abs(at) + s.absolute();
  }
  double weigh(const MapValue& v, const Eigen::VectorXd& at, std::string* name) const {
    double most = 0;
    for (const int i : map_.section().free()) {
      const double r = std::abs(v.next[i] - at[i]) / tolerance(at[i]);
      if (r > most || !std::isfinite(r)) {
        most = std::isfinite(r) ? r : std::numeric_limits<double>::infinity();
        if (name) *name = map_.section().coordinates()[static_cast<std::size_t>(i)].name;
      }
    }
    return most;
  }
  void look(const Eigen::VectorXd& at, const std::vector<double>& from) {
    value = map_.evaluate(at, from, MapDerivatives::state);
    counters += value.counters;
    residual = weigh(value, at, &worst);
  }
  Eigen::VectorXd newton_step() const;
  /// A step's entries in tolerances: what returns within them may be far from the cycle, by 1/(1 - mu).
  Eigen::VectorXd in_tolerances(const Eigen::VectorXd& dx) const {
    return dx.cwiseAbs().cwiseQuotient(x(map_.section().free()).unaryExpr([&](double at) { return tolerance(at); }));
  }
  [[noreturn]] void fail(const std::string& why) const;
  double entry(const Eigen::VectorXd& of) const {
    for (int i = 0; i < map_.section().size(); ++i)
      if (map_.section().coordinates()[static_cast<std::size_t>(i)].name == worst) return of[i];
    return 0;
  }

  ReturnMap& map_;
  const CycleOptions& options_;
};

Eigen::VectorXd Search::newton_step() const {
  const auto& free = map_.section().free();
  const auto k = static_cast<Eigen::Index>(free.size());
  if (k == 0) return {};
  const Eigen::MatrixXd P = monodromy();
  const Eigen::VectorXd s = balancing(P);
  const Eigen::MatrixXd A = Eigen::MatrixXd::Identity(k, k) - s.cwiseInverse().asDiagonal() * P * s.asDiagonal();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(A, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const double least = std::max(kSingular, kSingularRuns * map_.problem().solver.rtol);
  if (svd.singularValues()[k - 1] < least * std::max(1.0, svd.singularValues()[0])) {
    Eigen::Index most = 0;
    svd.matrixV().col(k - 1).cwiseProduct(s).cwiseAbs().maxCoeff(&most);
    const SectionCoordinate& c =
        map_.section().coordinates()[static_cast<std::size_t>(free[static_cast<std::size_t>(most)])];
    const double rtol = map_.problem().solver.rtol;
    throw SolverError(fmt::format(
        "A cycle is not determined: a change of '{}' stays as it is from one section to the next (a multiplier is "
        "1{}). Where the mechanism moves on along its way, name that coordinate as 'travel' in [cycle]; where energy "
        "is kept, cycles come in families, and none of them is the limit of anything; at a resonance nothing ends "
        "their "
        "growth.",
        c.name, least > kSingular ? fmt::format(", to what rtol {:g} tells; a smaller one tells more", rtol) : ""));
  }
  const Eigen::VectorXd back = (value.next - x)(free);
  return s.cwiseProduct(svd.solve(back.cwiseQuotient(s)));
}

void Search::fail(const std::string& why) const {
  throw SolverError(
      fmt::format("No cycle was found: {} After {} iteration{} the return is off by {:.3g} tolerances (rtol {:g}), "
                  "most of all '{}': "
                  "{:.9g} where it began, {:.9g} on return. Begin nearer to the cycle (a start in the gait, 'settle' "
                  "in [cycle] goes "
                  "through some cycles first), or look whether there is one at these parameters.",
                  why, iterations, iterations == 1 ? "" : "s", residual, map_.problem().solver.rtol, worst, entry(x),
                  entry(value.next)));
}

void Search::solve() {
  const auto& free = map_.section().free();
  std::string refused;
  left.setZero(x.size());
  const auto leave = [&](const Eigen::VectorXd& dx) {
    const Eigen::VectorXd parts = in_tolerances(dx);
    for (std::size_t i = 0; i < free.size(); ++i)
      if (const auto k = static_cast<Eigen::Index>(i); parts[k] > kNear) left[free[i]] = dx[k];
  };
  for (int step = 0; step < options_.max_iterations; ++step) {
    if (options_.progress) options_.progress(iterations, residual);
    check_stop();
    // Also of what closes at once, as all that keeps its energy does.
    const Eigen::VectorXd dx = newton_step();
    if (residual <= 1 && (dx.size() == 0 || in_tolerances(dx).maxCoeff() <= kNear)) return;
    const Eigen::VectorXd from = x;
    const std::vector<double> from_positions = positions;
    const MapValue before = value;
    const double before_residual = residual;
    const std::string before_worst = worst;
    bool better = false;
    double part = 1;
    for (int k = 0; k < kHalvings && !better; ++k, part /= 2) {
      x = from;
      for (std::size_t i = 0; i < free.size(); ++i) x[free[i]] += part * dx[static_cast<Eigen::Index>(i)];
      try {
        // First guesses of what x leaves open: where the last cycle ended, which is nearest to the new start.
        positions = before.positions;
        map_.onto_section(x, positions);
        look(x, positions);
        better = residual < before_residual;
      } catch (const SolverError& e) {
        refused = e.what();
      } catch (const ModelError& e) {
        refused = e.bare_message();
      }
      // Where only the errors of the runs are left, halving does not help.
      if (!better && before_residual <= options_.accepted) break;
    }
    ++iterations;
    if (better && residual > 0.5 * before_residual && residual <= options_.accepted) return leave(newton_step());
    if (better) continue;
    x = from;
    positions = from_positions;
    value = before;
    residual = before_residual;
    worst = before_worst;
    if (residual <= options_.accepted) return leave(dx);
    fail(refused.empty() ? "Newton's steps no longer bring the return nearer." : refused);
  }
  if (residual > options_.accepted) fail(fmt::format("{} iterations were not enough.", options_.max_iterations));
}

void add_state(const Problem& problem, const ReturnMap& map, const Search& search, CycleResult& r) {
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

/// r's derivatives, by r.map, but for what psi changes by as the largest multiplier does.
void differentiate(const ReturnMap& map, CycleResult& r) {
  CycleDerivatives d = cycle_derivatives(map, r.map, r.psi_values, r.values());
  r.x_rho = std::move(d.x);
  r.period_rho = std::move(d.period);
  r.travel_rho = std::move(d.travel);
  r.psi_rho = std::move(d.psi);
}

void estimate_derivatives(const CycleResult& loose, const Problem& problem, const Section& section, CycleResult& r) {
  const auto& parameters = problem.parameters.parameters;
  r.x_rho_error = derivative_errors(section.coordinates(), r.period.value, r.x_rho, loose.x_rho, parameters);
  r.period_rho_error = derivative_errors(r.period_rho, loose.period_rho, parameters);
  r.travel_rho_error = derivative_errors(r.travel_rho, loose.travel_rho, parameters);
  r.speed_rho_error = derivative_errors(r.speed_rho(), loose.speed_rho(), parameters);
  r.psi_rho_error = derivative_errors(r.psi_rho, loose.psi_rho, parameters);
}

void differentiate_multiplier(const Search& search, const ReturnMap& map, const CycleOptions& options, CycleResult& r) {
  const double by_multiplier = r.psi_values[kCycleMultiplier];
  if (!options.multiplier && by_multiplier == 0) return;
  try {
    const MultiplierDerivative m =
        multiplier_derivative(map, search.x, search.positions, static_cast<int>(r.x_rho.cols()));
    r.counters += m.counters;
    r.multiplier_rho = m.by_rho;
    r.multiplier_rho_error = m.error;
    r.multiplier_method = multiplier_method(m);
    if (by_multiplier == 0) return;
    r.psi_rho += by_multiplier * m.by_rho;
    if (r.psi_rho_error.size() > 0) r.psi_rho_error += std::abs(by_multiplier) * m.error;
  } catch (const Error& e) {
    if (by_multiplier != 0) throw;
    r.multiplier_method = e.what();
  }
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
  Whole(const Problem& problem, const ReturnMap& map, const Search& search)
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
  const Search& search_;
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
  Search search(map, options);
  search.x = start.x();
  search.positions = start.positions();
  map.require_periodic(search.x, search.positions);
  settle(map, settings.settle, search.x, search.positions);
  map.onto_section(search.x, search.positions);
  search.begin();
  search.solve();
  map.require_same_modes(search.value);
  map.require_whole_turns(search.x, search.positions, search.value);
  if (rests(map, start, search.x, search.positions, search.value.time))
    tell_rest(settings, problem.solver.rtol, search.value.time);
  CycleResult r;
  CycleResult loose;  // of the search at the problem's own tolerance, where errors are estimated
  const bool derivatives = options.derivatives && !rho.empty();
  const auto take = [&](const MapValue& v) {
    search.counters += v.counters;
    r.x = search.x;
    r.period.value = v.time;
    r.travel.value = v.travel;
    r.psi.value = v.psi;
    r.multipliers = multipliers_of(search.monodromy(), section.trivial_multipliers());
  };
  if (options.estimate) {
    const Whole at_own_tolerance(problem, map, search);
    take(at_own_tolerance.value(false));
    loose = r;
    if (derivatives) {
      loose.map = at_own_tolerance.value(true);
      search.counters += loose.map.counters;
      loose.psi_values = at_own_tolerance.by_values(loose.map);
      differentiate(at_own_tolerance.map(), loose);
    }
    const Eigen::MatrixXd loose_P = search.monodromy();
    const SolverOptions& solver = problem.solver;
    map.set_tolerance(0.1 * solver.rtol, 0.1 * solver.absolute());
    search.begin();
    search.solve();
    take(Whole(problem, map, search).value(false));
    // Two searches from one point that neither can leave tell nothing.
    const auto error = [&](double change, const Eigen::RowVectorXd& by_x) {
      return std::max(std::abs(change), std::abs(by_x.dot(search.left)));
    };
    const MapValue& map_value = search.value;
    r.x_error = (r.x - loose.x).cwiseAbs().cwiseMax(search.left.cwiseAbs());
    pool_errors(section.coordinates(), map_value.time, r.x, r.x_error);
    r.period.error = error(r.period.value - loose.period.value, map_value.time_x);
    r.travel.error = error(r.travel.value - loose.travel.value, map_value.travel_x);
    r.psi.error = error(r.psi.value - loose.psi.value, map_value.psi_x);
    const double changed = std::abs(r.largest() - loose.largest());
    r.undecided = kChance * changed;
    r.multiplier_error = changed;
    if (!r.multipliers.empty())
      r.multiplier_error = std::max(changed, multiplier_error(search.monodromy(), loose_P, r.multipliers.front()));
  } else {
    r.x_error.setZero(search.x.size());
  }
  const Whole whole(problem, map, search);
  r.map = whole.value(derivatives);
  if (!options.estimate) take(r.map);
  r.undecided = std::max({r.undecided, r.multiplier_error, problem.solver.rtol});
  r.psi_values = whole.by_values(r.map);
  if (derivatives) {
    differentiate(whole.map(), r);
    if (options.estimate) estimate_derivatives(loose, problem, section, r);
    differentiate_multiplier(search, whole.map(), options, r);
  }
  for (const auto& c : section.coordinates()) {
    r.names.push_back(c.name);
    r.units.push_back(c.unit);
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
