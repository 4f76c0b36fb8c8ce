// Whether what acts on a mechanism repeats itself with the period that a cycle is said to have, and after whole turns
// of what goes round.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <string>

#include "costate/assembly/slip_directions.h"
#include "costate/base/error.h"
#include "costate/cycle/return_map.h"
#include "costate/element/gap_element.h"
#include "costate/element/switched_rows.h"
#include "costate/event/gap_trace.h"
#include "costate/formulation/step_plan.h"

namespace costate {

namespace {
constexpr int kManyTurns = 97;
/// What acts at one time: forces and constraints, their derivatives by the state, and by the parameters.
struct Terms {
  std::vector<double> values, slopes, gaps;
  Eigen::MatrixXd columns;
};

/// Of what may touch, whether it does or not at this state: a post that moves under a ball in the air is no force.
std::vector<double> gaps_at(const StateView& s, const Assembly& assembly) {
  std::vector<double> values;
  for (const auto& f : assembly.mechanism().forces())
    if (const auto* gaps = dynamic_cast<const GapElement*>(f.get()))
      for (int i = 0; i < gaps->gap_count(); ++i) values.push_back(GapTrace(*f, *gaps, i).look(s, assembly).m.gap);
  return values;
}

/// Positions a period later: angles that a driver of their own has turned by whole turns meanwhile stand that far on.
std::vector<double> turned_by_drivers(const std::vector<double>& q, const std::vector<double>& phi_now,
                                      const std::vector<double>& phi_then, const Mechanism& mechanism) {
  constexpr double kTurn = 2 * std::numbers::pi, kWhole = 1e-9;
  std::vector<double> turned = q;
  for (std::size_t c = 0; c < mechanism.constraints().size(); ++c) {
    const Constraint& driver = *mechanism.constraints()[c];
    if (!driver.rheonomic() || driver.rows() != 1 || driver.coordinates().size() != 1) continue;
    const int i = driver.coordinates().front();
    const auto row = static_cast<std::size_t>(mechanism.row_offsets()[c]);
    const double by = phi_now[row] - phi_then[row], turns = std::round(by / kTurn);
    if (mechanism.coordinates()[static_cast<std::size_t>(i)].unit == "rad" && turns != 0 &&
        std::abs(by - turns * kTurn) < kWhole * std::abs(by))
      turned[static_cast<std::size_t>(i)] += by;
  }
  return turned;
}

/// The middles of what lies between the times at which laws of time begin, end or become others: a pulse may be all
/// that depends on time.
void add_middles(const StepPlan& plan, double from, double to, std::vector<double>& times) {
  constexpr int kMost = 2000;
  for (int k = 0; k < kMost && from < to; ++k) {
    const double next = std::min(plan.next_time(from), to);
    times.push_back(0.5 * (from + next));
    from = next;
  }
}
}  // namespace

void ReturnMap::require_periodic(const Eigen::VectorXd& x, const std::vector<double>& positions) const {
  std::vector<double> values;
  const Problem p = problem_at(x, positions, false, parameters(), values);
  Assembly assembly(p.mechanism, p.parameters);
  assembly.set_parameters(values.data());
  const State state = this->state(x, positions);
  const auto period = section_.settings().period_s;
  const double span = period ? *period : p.solver.t_end - p.solver.t_start;
  const std::vector<double> zero(static_cast<std::size_t>(assembly.n() + assembly.m()), 0.0);
  const int np = static_cast<int>(rho_.size());
  const auto view = [&](double t, const std::vector<double>& q) {
    StateView s;
    s.t = t;
    s.q = q.data();
    s.v = state.v.data();
    s.z = state.z.data();
    s.a = s.lambda = zero.data();
    return s;
  };
  const std::vector<double> here(state.q.begin(), state.q.end());
  std::vector<double> later = here;
  if (period) {
    assembly.calc_dynamics(view(p.solver.t_start, here));
    const std::vector<double> phi(assembly.phi.begin(), assembly.phi.end());
    assembly.calc_dynamics(view(p.solver.t_start + span, here));
    later = turned_by_drivers(here, phi, {assembly.phi.begin(), assembly.phi.end()}, assembly.mechanism());
  }
  const auto terms = [&](double t, const std::vector<double>& q, bool derivatives) {
    const StateView s = view(t, q);
    assembly.calc_dynamics(s);
    Terms r;
    r.gaps = gaps_at(s, assembly);
    for (const auto* part : {&assembly.Q, &assembly.phi, &assembly.phi_t, &assembly.bias, &assembly.zdot})
      r.values.insert(r.values.end(), part->begin(), part->end());
    if (!derivatives) return r;
    assembly.calc_partials(s);
    Assembly::ParameterColumns c;
    assembly.resize(c);
    assembly.calc_parameter_columns(s, c);
    for (const auto* part : {&assembly.K, &assembly.C, &assembly.Q_z, &assembly.f_q, &assembly.f_v, &assembly.f_z})
      r.slopes.insert(r.slopes.end(), part->begin(), part->end());
    r.columns.resize(c.F.rows() + 3 * c.phi.rows() + c.f.rows(), np);
    if (np > 0)
      r.columns << c.F.leftCols(np), c.phi.leftCols(np), c.phid.leftCols(np), c.phidd.leftCols(np), c.f.leftCols(np);
    return r;
  };
  constexpr double kSame = 1e-7;
  std::vector<double> times;
  for (const double part : {0.0, 0.1379, 0.3417, 0.5731, 0.8123}) times.push_back(p.solver.t_start + part * span);
  const std::size_t with_derivatives = times.size();
  const double t_end = p.solver.t_start + span;
  add_middles(StepPlan(assembly, p.objective, p.solver.t_start, t_end, view(p.solver.t_start, here)), p.solver.t_start,
              t_end, times);
  std::vector<Terms> now, then;
  double size = 0, slope_size = 0, gap_size = 0;
  Eigen::VectorXd column_size = Eigen::VectorXd::Zero(np);
  for (const double t : times) {
    const bool derivatives = now.size() < with_derivatives;
    now.push_back(terms(t, here, derivatives));
    then.push_back(terms(t + (period ? span : 0.4391 * span), later, derivatives));
    for (const auto* side : {&now.back(), &then.back()}) {
      for (const double f : side->values) size = std::max(size, std::abs(f));
      for (const double g : side->gaps) gap_size = std::max(gap_size, std::abs(g));
      for (const double f : side->slopes) slope_size = std::max(slope_size, std::abs(f));
      for (int j = 0; j < np; ++j)
        if (side->columns.rows() > 0)
          column_size[j] = std::max(column_size[j], side->columns.col(j).cwiseAbs().maxCoeff());
    }
  }
  // What parameters do to open gaps is in no column: whether they still repeat themselves where one is another.
  const auto moves_gaps_apart = [&](int j, double t) {
    if (gap_size == 0) return false;
    std::vector<double> moved = values;
    moved[static_cast<std::size_t>(j)] += 1e-3 * p.parameters.parameters[static_cast<std::size_t>(j)].scale;
    assembly.set_parameters(moved.data());
    const std::vector<double> a = gaps_at(view(t, here), assembly), b = gaps_at(view(t + span, later), assembly);
    assembly.set_parameters(values.data());
    for (std::size_t i = 0; i < a.size(); ++i)
      if (std::abs(a[i] - b[i]) > kSame * gap_size) return true;
    return false;
  };
  bool depends = false;
  for (std::size_t k = 0; k < times.size(); ++k) {
    double most = 0;  // of what they are
    const auto compare = [&](const std::vector<double>& a, const std::vector<double>& b, const std::vector<double>& c,
                             double of) {
      for (std::size_t i = 0; i < a.size() && of > 0; ++i) {
        most = std::max(most, std::abs(a[i] - b[i]) / of);
        depends = depends || std::abs(a[i] - c[i]) > kSame * of;
      }
    };
    compare(now[k].values, then[k].values, now[0].values, size);
    // A stiffness that changes in time is no force where the start is at rest in it.
    if (k < with_derivatives) compare(now[k].slopes, then[k].slopes, now[0].slopes, slope_size);
    compare(now[k].gaps, then[k].gaps, now[0].gaps, gap_size);
    if (most > kSame)
      throw ModelError(period ? "cycle.period_s" : "cycle.section",
                       period ? fmt::format("Forces or constraints at t = {:g} s and {:g} s later differ by {:.2g} of "
                                            "what they are: this is no period of theirs.",
                                            times[k], span, most)
                              : "Forces or constraints depend on time, so that a state at the section does not say how "
                                "the motion goes on. Give 'period_s' in the place of 'section'.");
    for (int j = 0; period && k < with_derivatives && j < np; ++j)
      if ((column_size[j] > 0 &&
           (now[k].columns.col(j) - then[k].columns.col(j)).cwiseAbs().maxCoeff() > kSame * column_size[j]) ||
          moves_gaps_apart(j, times[k]))
        throw ModelError("cycle.period_s",
                         fmt::format("Parameter '{}' changes the period of the forces, while 'period_s' is a fixed "
                                     "number: the cycle has no derivative by it. Leave it out of the parameters.",
                                     problem_.parameters.parameters[static_cast<std::size_t>(j)].name));
  }
  if (period && !depends)
    throw ModelError("cycle.period_s",
                     "Nothing here depends on time: the period of a free motion is its own. Give 'section' in the "
                     "place of 'period_s'.");
}

void ReturnMap::require_same_modes(const MapValue& value) const {
  for (std::size_t i = 0; i < value.modes.size(); ++i) {
    const SectionMode& mode = section_.modes()[i];
    if (std::abs(value.modes[i] - mode.starts) < 0.5) continue;
    const auto text = [&](double x) {
      return mode.closed ? x > 0.5 ? "closed" : "open" : std::abs(x) < 0.5 ? "at rest along the ground" : "sliding";
    };
    throw SolverError(
        fmt::format("The motion comes back to its coordinates, but {} is {} at the end of a cycle and {} where it "
                    "begins ('{}' is {:g} and {:g}): such a motion does not repeat itself. Let the scene start as it "
                    "ends, or take another section.",
                    mode.contact, text(value.modes[i]), text(mode.starts), mode.name, value.modes[i], mode.starts));
  }
}

std::string ReturnMap::sticks_at_place(const State& state) const {
  const Mechanism& m = *problem_.mechanism;
  for (const auto& c : m.constraints()) {
    const auto* rows = dynamic_cast<const SwitchedRows*>(c.get());
    const int sliding = rows ? sliding_state(m, *c) : -1;
    if (sliding >= 0 && rows->has_place(1) && state.z[static_cast<std::size_t>(sliding - 1)] > 0.5 &&
        state.z[static_cast<std::size_t>(sliding)] == 0)
      return rows->switched_by().path();
  }
  return {};
}

void ReturnMap::require_same_place(const Eigen::VectorXd& x, const std::vector<double>& positions,
                                   const MapValue& value) const {
  const State begin = state(x, positions);
  const std::string contact = sticks_at_place(begin);
  if (contact.empty()) return;
  const auto refused = [&](const std::string& what) {
    return ModelError(
        contact + ".along_m",
        fmt::format("{}: {} sticks at the section, and where it does is a number of the scene, which the search does "
                    "not vary. Leave this key out and let [start] give that coordinate in 'given', so that the place "
                    "is looked for{}.",
                    what, contact,
                    section_.settings().travel.empty() ? "; of a motion that goes on from there say 'travel'" : ""));
  };
  const auto& coordinates = problem_.mechanism->coordinates();
  double largest = 0;
  for (std::size_t i = 0; i < begin.q.size(); ++i)
    if (coordinates[i].unit == "m") largest = std::max(largest, std::abs(begin.q[i]));
  const double same =
      std::sqrt(problem_.solver.rtol) * std::max(largest, std::abs(value.travel)) + 100 * problem_.solver.absolute();
  std::vector<double> moved(begin.q.size(), 0.0);
  std::size_t elsewhere = moved.size();
  for (std::size_t i = 0; i < begin.q.size(); ++i) {
    if (coordinates[i].unit == "m") moved[i] = value.positions[i] - begin.q[i];
    if (elsewhere == moved.size() && !(std::abs(moved[i]) <= same)) elsewhere = i;
  }
  // Where all that acts is the same further on, the place plays no part.
  if (elsewhere < moved.size() && !acts_alike(x, positions, begin, moved))
    throw refused(fmt::format("The motion comes back with '{}' at {:.9g} m, and begins with {:.9g} m",
                              coordinates[elsewhere].name, value.positions[elsewhere], begin.q[elsewhere]));
  // What comes back by chance, as parameters have it, comes back elsewhere as they change.
  if (elsewhere < moved.size() || section_.carried().coordinate >= 0) return;
  for (std::size_t i = 0; i < moved.size(); ++i) moved[i] = section_.along(i) == 1 ? 1 : 0;
  for (const RunEvent& e : value.events)
    if (e.name.rfind(contact + ":", 0) == 0 && !acts_alike(x, positions, begin, moved))
      throw refused(fmt::format("The cycle has '{}' in it", e.name));
}

bool ReturnMap::acts_alike(const Eigen::VectorXd& x, const std::vector<double>& positions, const State& begin,
                           const std::vector<double>& moved) const {
  std::vector<double> values;
  const Problem p = problem_at(x, positions, false, parameters(), values);
  Assembly assembly(p.mechanism, p.parameters);
  assembly.set_parameters(values.data());
  const std::vector<double> zero(static_cast<std::size_t>(assembly.n() + assembly.m()), 0.0);
  std::vector<bool> place(static_cast<std::size_t>(assembly.m()), false);  // rows that say where something sticks
  for (std::size_t c = 0; c < p.mechanism->constraints().size(); ++c)
    if (const auto* rows = dynamic_cast<const SwitchedRows*>(p.mechanism->constraints()[c].get()))
      for (int i = 1; i < p.mechanism->constraints()[c]->rows(); ++i)
        place[static_cast<std::size_t>(p.mechanism->row_offsets()[c] + i)] = rows->has_place(i);
  const auto terms = [&](double part) {
    std::vector<double> q = begin.q;
    for (std::size_t i = 0; i < q.size(); ++i) q[i] += part * moved[i];
    StateView s;
    s.t = p.solver.t_start;
    s.q = q.data();
    s.v = begin.v.data();
    s.z = begin.z.data();
    s.a = s.lambda = zero.data();
    assembly.calc_dynamics(s);
    std::array<std::vector<double>, 3> r{{{assembly.Q.begin(), assembly.Q.end()},
                                          {assembly.zdot.begin(), assembly.zdot.end()},
                                          {assembly.phi.begin(), assembly.phi.end()}}};
    for (std::size_t i = 0; i < place.size(); ++i)
      if (place[i]) r[2][i] = 0;
    return r;
  };
  constexpr double kSame = 1e-7;
  const auto here = terms(0);
  for (const double part : {0.3819, 1.0}) {
    const auto there = terms(part);
    for (std::size_t k = 0; k < here.size(); ++k) {
      double size = 0, off = 0;
      if (k == 2)  // a row that is met has the size of what was moved
        for (const double by : moved) size = std::max(size, std::abs(by));
      for (std::size_t i = 0; i < here[k].size(); ++i) {
        size = std::max({size, std::abs(here[k][i]), std::abs(there[k][i])});
        off = std::max(off, std::abs(here[k][i] - there[k][i]));
      }
      if (off > kSame * size) return false;
    }
  }
  return true;
}

std::string ReturnMap::otherwise(const Eigen::VectorXd& x, const std::vector<double>& positions, const MapValue& value,
                                 const Eigen::VectorXd& further) const {
  // Runs that begin elsewhere have other errors: up to some 1e4 tolerances where what goes round nearly stops on its
  // way.
  constexpr double kNothing = 100;  // absolute tolerances
  const double same = std::sqrt(problem_.solver.rtol),
               small = std::max(0.1 * x.lpNorm<Eigen::Infinity>(), kNothing * problem_.solver.absolute() / same);
  std::string found;
  try {
    const MapValue next = evaluate(x + further, positions, MapDerivatives::none);
    double most = same;
    const auto compare = [&](double a, double b, const std::string& name, const std::string& unit) {
      if (const double off = std::abs(a - b) / std::max(std::abs(a), small); !(off <= most)) {
        most = off;
        found = fmt::format("{} is {:.9g} {} there for {:.9g} {} here", name, b, unit, a, unit);
      }
    };
    if (std::abs(value.time - next.time) > same * value.time)
      found = fmt::format("the time to the next section is {:.9g} s there for {:.9g} s here", next.time, value.time);
    for (const int i : section_.free())
      compare(value.next[i], next.next[i] - further[i],
              fmt::format("'{}' on return", section_.coordinates()[static_cast<std::size_t>(i)].name),
              section_.coordinates()[static_cast<std::size_t>(i)].unit);
  } catch (const SolverError& e) {
    found = e.what();
    if (!found.empty() && found.back() == '.') found.pop_back();
  }
  return found;
}

void ReturnMap::require_same_later(const Eigen::VectorXd& x, const std::vector<double>& positions,
                                   const MapValue& value) const {
  // Forces may depend on time at the places alone to which the motion comes.
  const auto period = section_.settings().period_s;
  const double by = period ? *period : 0.4391 * value.time;
  ReturnMap later = *this;
  later.problem_.solver.t_start += by;
  later.problem_.solver.t_end += by;
  // Angles that a driver has turned stand further on after a period.
  const auto from = [&](const MapValue& here) {
    return later.otherwise(x, period ? value.positions : positions, here, Eigen::VectorXd::Zero(x.size()));
  };
  std::string found = from(value);
  // The search's runs have the steps of their derivatives, too.
  if (!found.empty()) found = from(evaluate(x, positions, MapDerivatives::none));
  if (found.empty()) return;
  throw ModelError(
      period ? "cycle.period_s" : "cycle.section",
      period
          ? fmt::format("The motion that was found does not repeat itself: from where it begins, but {:g} s later, {}. "
                        "Forces or constraints on its way do not return after {:g} s: this is no period of theirs.",
                        by, found, by)
          : fmt::format("The motion that was found depends on when it begins: {:.6g} s later, {}. Forces or "
                        "constraints on its way depend on time, so that a state at the section does not say how the "
                        "motion goes on. Give 'period_s' in the place of 'section'.",
                        by, found));
}

void ReturnMap::require_whole_turns(const Eigen::VectorXd& x, const std::vector<double>& positions,
                                    const MapValue& value) const {
  if (value.turned.isZero()) return;
  std::string turning;
  for (int i = 0; i < section_.size(); ++i)
    if (value.turned[i] != 0)
      turning += fmt::format("{}'{}' by {:.6g} rad", turning.empty() ? "" : ", ",
                             section_.coordinates()[static_cast<std::size_t>(i)].name, value.turned[i]);
  // Where forces are those of a turn before, so is the motion; a state at which they are alike by chance (a dead
  // centre) does not show that they are. Nor does the next turn, of what acts from some turn on.
  for (const int turns : {1, kManyTurns})
    if (const std::string found = otherwise(x, positions, value, turns * value.turned); !found.empty())
      throw ModelError(
          "cycle.turns",
          fmt::format("What turns ({}) does not bring the motion back to where it began: {}{}. Something acts by the "
                      "angle itself, not by where it points. Take a section that is met once in all of its turns (an "
                      "output sin(angle/2) for two of them), or count = 2.",
                      turning, turns > 1 ? fmt::format("{} such turns on, ", turns) : "", found));
}

}  // namespace costate
