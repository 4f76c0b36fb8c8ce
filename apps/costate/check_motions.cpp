#include "check_motions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <tuple>

#include "costate/base/error.h"
#include "costate/cycle/cycle_values.h"
#include "costate/integrator/integrators.h"
#include "costate/integrator/run_budget.h"
#include "costate/integrator/simulate.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/sensitivity/error_estimate.h"

namespace costate::app {

namespace {

// The rule of apps/README.md. A motion's error is a modest multiple of rtol, of what the quantity's range is, of what
// the states' tolerances do to it there, and of what the reference's formulation is off by itself at this tolerance.
constexpr double kRange = 1000, kState = 300, kOwn = 100, kOfReactions = 100;
constexpr int kSamples = 40;
// Of what turns, in the straight quantities where none is other than zero, and the other way round.
constexpr double kOtherKind = 1e-3;

}  // namespace

MotionCheck::MotionCheck(const Problem& problem, const std::vector<double>& rho, std::function<void()> allow)
    : problem_(problem), rho_(rho), allow_(std::move(allow)), state_(problem, rho) {
  // Not at round times, where laws have their corners and what jumps there has two values.
  const double t0 = problem.solver.t_start, t1 = problem.solver.t_end;
  for (int i = 0; i < kSamples; ++i) times_.push_back(t0 + (t1 - t0) * (i + 0.381966) / kSamples);
}

MotionCheck::Motion MotionCheck::record(const Problem& p) {
  allow_();
  Motion motion;
  const Simulation run = simulate(without_cycle_cost(p), rho_, times_, [&](const MechanismState& s, System& system) {
    Assembly& a = system.assembly();
    Sample x;
    x.t = s.t;
    x.q.assign(s.q, s.q + a.n());
    x.v.assign(s.v, s.v + a.n());
    if (a.nz() > 0) x.z.assign(s.z, s.z + a.nz());
    for (const auto& o : state_.outputs()) x.values.push_back(o->value(s, a));
    if (state_.affordable()) {
      StateView own;
      own.t = s.t;
      own.q = x.q.data();
      own.v = x.v.data();
      own.z = x.z.data();
      x.independent = state_.values(own, &x.determined);
    } else {
      x.independent = x.values;
      x.determined.assign(x.values.size(), 1);
    }
    motion.push_back(std::move(x));
  });
  steps_ = run.counters.steps;
  return motion;
}

/// All outputs where the state is off by its tolerances, rtol |y| + atol, some up and some down.
std::vector<double> MotionCheck::displaced(const Sample& s, double phase) {
  std::vector<double> q = s.q, v = s.v;
  const double rtol = problem_.solver.rtol, atol = problem_.solver.absolute(),
               length = length_size(*problem_.mechanism);
  for (std::size_t i = 0; i < q.size(); ++i) {
    const double sign = std::cos(2.4 * static_cast<double>(i) + phase) > 0 ? 1 : -1;
    const double least = atol * (problem_.mechanism->coordinates()[i].unit == "m" ? length : 1);
    q[i] += sign * (rtol * std::abs(q[i]) + least);
    v[i] -= sign * (rtol * std::abs(v[i]) + least);
  }
  StateView moved;
  moved.t = s.t;
  moved.q = q.data();
  moved.v = v.data();
  moved.z = s.z.data();
  return state_.values(moved);
}

void MotionCheck::find_reference(const std::string& formulation, double rtol) {
  Problem p = problem_;
  p.formulation = formulation;
  p.solver.integrator.clear();
  const Motion base = record(p);
  p.solver.set_rtol(rtol);
  reference_ = record(p);
  const std::size_t columns = quantities();
  const double own_rtol = problem_.solver.rtol;
  range_.assign(columns, 0.0);
  for (const Sample& s : reference_)
    for (std::size_t c = 0; c < columns; ++c) range_[c] = std::max(range_[c], std::abs(s.independent[c]));
  unit_ = range_;
  allowed_.assign(reference_.size(), std::vector<double>(columns, 0.0));
  std::vector<double> so_far(columns, 0.0);
  for (std::size_t i = 0; i < reference_.size(); ++i) {
    const Sample& s = reference_[i];
    std::vector<std::vector<double>> moved;
    if (state_.affordable())
      for (const double phase : {0.3, 1.7, 4.0}) moved.push_back(displaced(s, phase));
    for (std::size_t c = 0; c < columns; ++c) {
      double by_state = 0;
      for (const auto& m : moved) by_state = std::max(by_state, std::abs(m[c] - s.independent[c]));
      // Errors grow along a motion; that they are small at one sample may be chance.
      so_far[c] = std::max(so_far[c], std::abs(base[i].independent[c] - s.independent[c]));
      allowed_[i][c] = (kRange * own_rtol + 1e-9) * range_[c] + kState * by_state + kOwn * so_far[c];
      // Nothing is relative to a range of nothing.
      unit_[c] = std::max(unit_[c], kState * by_state / (kRange * own_rtol));
    }
  }
  // Nor to one that is small beside others of its kind: a thousandth of the largest range in this unit of measurement.
  std::map<std::string, double> largest, left_of;
  for (std::size_t c = 0; c < columns; ++c)
    largest[state_.outputs()[c]->unit()] = std::max(largest[state_.outputs()[c]->unit()], range_[c]);
  // Accelerations beside those that the forces would give without the constraints, which may hold everything at rest;
  // multipliers beside those that hold the forces.
  for (const Sample& s : reference_) {
    StateView own;
    own.t = s.t;
    own.q = s.q.data();
    own.v = s.v.data();
    own.z = s.z.data();
    const IndependentState::ForceSizes sizes = state_.sizes_by_forces(own);
    for (const auto& [unit, size] : sizes.by_unit) largest[unit] = std::max(largest[unit], size);
    for (const auto& [name, size] : sizes.by_reactions) left_of[name] = std::max(left_of[name], size);
  }
  // And all of a kind may be zero, of a wheel's centre, say: turns move lengths, torques are forces at these.
  const double length = length_size(*problem_.mechanism);
  for (const auto& [turning, straight, factor] :
       {std::tuple("rad", "m", length), std::tuple("rad/s", "m/s", length), std::tuple("rad/s^2", "m/s^2", length),
        std::tuple("N m", "N", 1 / length)}) {
    const double a = largest[turning], b = largest[straight];
    largest[straight] = std::max(b, kOtherKind * factor * a);
    largest[turning] = std::max(a, kOtherKind * b / factor);
  }
  for (std::size_t c = 0; c < columns; ++c) {
    const double of_its_kind = 1e-3 * largest[state_.outputs()[c]->unit()];
    unit_[c] = std::max(unit_[c], of_its_kind);
    if (!(unit_[c] > 0)) unit_[c] = 1;
    // What rests beside something that moves is known to the tolerance of that, and no output to more than rounding.
    // What is left of reactions is known to some tolerances of these.
    const double least = std::max({of_its_kind * kRange * own_rtol, 1e-15 * unit_[c],
                                   kOfReactions * left_of[state_.outputs()[c]->name()] * own_rtol});
    for (auto& sample : allowed_) sample[c] = std::max(sample[c], least);
  }
}

double MotionCheck::error(const Motion& m, std::size_t i, std::size_t c, bool by_equations) const {
  if (!m[i].determined[c] || !reference_[i].determined[c]) return 0;
  const double e = std::abs(m[i].values[c] - (by_equations ? m[i].independent[c] : reference_[i].independent[c]));
  return std::isfinite(e) ? e : std::numeric_limits<double>::infinity();
}

MotionCheck::Worst MotionCheck::worst(const Motion& m, const Allowed& allowed) const {
  Worst w;
  for (std::size_t i = 0; i < m.size(); ++i)
    for (std::size_t c = 0; c < quantities(); ++c)
      for (const bool by_equations : {false, true}) {
        const double e = error(m, i, c, by_equations), beyond = e == 0 ? 0 : e / allowed[i][c];
        if (beyond > w.beyond) w = {beyond, e, i, c, by_equations};
      }
  return w;
}

void MotionCheck::judge(MotionRow& row, const Problem& p) {
  const Motion motion = record(p);
  const long steps = steps_;
  const bool fixed = has_fixed_steps(row.integrator);
  Allowed allowed = allowed_;
  // Fixed steps are chosen for an error of 0.1 sqrt(rtol).
  if (fixed)
    for (auto& sample : allowed)
      for (std::size_t c = 0; c < sample.size(); ++c) sample[c] += 10 * std::sqrt(p.solver.rtol) * unit_[c];
  for (std::size_t i = 0; i < motion.size(); ++i)
    for (std::size_t c = 0; c < quantities(); ++c)
      row.independent_error = std::max(row.independent_error, error(motion, i, c, true) / unit_[c]);
  const auto show = [&](const Worst& w) {
    const Output& o = *state_.outputs()[w.column];
    row.quantity = o.name();
    row.unit = o.unit();
    row.time = motion[w.sample].t;
    row.found = motion[w.sample].values[w.column];
    row.by_equations = w.by_equations;
    row.expected = w.by_equations ? motion[w.sample].independent[w.column] : reference_[w.sample].independent[w.column];
    row.error = w.error / unit_[w.column];
  };
  const Worst first = worst(motion, allowed);
  show(first);
  if (first.beyond <= 1) return;
  const auto forgive = [&](double without_warning, const std::string& remark) {
    row.verdict = row.error <= without_warning ? Verdict::ok
                  : row.error <= kTolerable    ? Verdict::inaccurate
                                               : Verdict::disagreement;
    row.remark = remark;
  };
  if (has_soft_constraints(p.formulation)) {
    const Motion firm = record(with_firmer_constraints(p));
    const auto vanishes = [&](std::size_t c) { return range_[c] < 1e-2 * unit_[c]; };
    double soft = 0, most = 0, by_equations = 0;
    for (std::size_t i = 0; i < motion.size(); ++i)
      for (std::size_t c = 0; c < quantities(); ++c) {
        const double x = std::abs(motion[i].values[c] - firm[i].values[c]) / 0.9;
        const double left = std::max(error(firm, i, c, false), error(firm, i, c, true)),
                     here = std::max(error(motion, i, c, false), error(motion, i, c, true));
        if (!vanishes(c)) most = std::max(most, here / unit_[c]);
        if (!vanishes(c)) by_equations = std::max(by_equations, error(motion, i, c, true) / unit_[c]);
        // Beyond a hundredth the expansion in 1/alpha says nothing (what rigid constraints keep at zero has no
        // hundredth); and the error must fall as it says.
        if (!(vanishes(c) || x <= kTolerable * unit_[c]) || !(left <= std::max(allowed[i][c], 0.3 * here))) continue;
        allowed[i][c] += 1.5 * x;
        if (!vanishes(c)) soft = std::max(soft, x / unit_[c]);
      }
    if (worst(motion, allowed).beyond <= 1) {
      if (vanishes(first.column)) row.error = most;
      row.independent_error = by_equations;
      return forgive(kSoft, fmt::format("the penalty's own O(1/alpha) is {:.1e}", soft));
    }
  }
  const Worst w = worst(motion, allowed);
  show(w);
  for (const double factor : fixed ? std::vector<double>{0.5, 0.25} : std::vector<double>{1e-2, 1e-4}) {
    Problem better = p;
    std::string at;
    if (fixed) {
      better.solver.step_s = factor * (p.solver.t_end - p.solver.t_start) / static_cast<double>(steps);
      at = fmt::format("{:g} of the step", factor);
    } else {
      better.solver.tighten(factor, 1e-13, 1e-15);
      at = fmt::format("rtol {:g}", better.solver.rtol);
    }
    Motion again;
    try {
      again = record(better);
    } catch (const SolverError& e) {
      row.remark = fmt::format("at {} it fails: {}", at, e.what());
      continue;
    }
    const double left = error(again, w.sample, w.column, w.by_equations);
    row.remark = fmt::format("{:.1e} at {}", left / unit_[w.column], at);
    const bool falls = left <= w.error / (fixed ? 2.5 : 2);
    if (falls && (fixed || worst(again, allowed).beyond <= 1))
      return forgive(fixed ? 10 * kTolerable : kForgiven * p.solver.rtol,
                     fmt::format("limited by the {}: {:.2g} times what is expected, and {}",
                                 fixed ? "step" : "tolerance", w.beyond, row.remark));
  }
  row.verdict = Verdict::disagreement;
}

MotionRow MotionCheck::run(const std::string& formulation, const std::string& integrator) {
  MotionRow row;
  row.formulation = formulation;
  row.integrator = integrator;
  Problem p = problem_;
  p.formulation = formulation;
  p.solver.integrator = integrator;
  const auto end = [&](Verdict v, const std::string& why) {
    row.verdict = v;
    row.why = why;
  };
  try {
    judge(row, p);
  } catch (const Cut& e) {
    end(Verdict::cut, e.what());
  } catch (const TooMuchWork& e) {
    end(Verdict::cut, fmt::format("for its steps: {}", e.what()));
  } catch (const CapabilityError& e) {
    end(Verdict::refused, e.what());
  } catch (const SolverError& e) {
    end(Verdict::failed, e.what());
  } catch (const ModelError& e) {
    end(Verdict::failed, e.what());
  }
  return row;
}

std::string MotionCheck::note() const {
  if (state_.affordable()) return {};
  return fmt::format(
      "Motions are not compared with the equations of motion at their own states: more than {} unknowns.",
      IndependentState::kMostUnknowns);
}

std::string MotionRow::heading() {
  return fmt::format("  {:<22} {:<16} {:>9} {:>9}  {}\n", "motion", "integrator", "error", "equations", "farthest");
}

std::string MotionRow::text() const {
  const std::string begin = fmt::format("  {:<22} {:<16} ", formulation, integrator);
  switch (verdict) {
    case Verdict::refused:
      return begin + "-- " + why + "\n";
    case Verdict::failed:
      return begin + "FAILED: " + why + "\n";
    case Verdict::cut:
      return begin + "cut: " + why + "\n";
    default:
      break;
  }
  return begin + fmt::format("{:>9.1e} {:>9.1e}  {} at {:.6g} s{}{}\n", error, independent_error, quantity, time,
                             verdict == Verdict::disagreement ? "  DISAGREES"
                             : verdict == Verdict::inaccurate ? "  INACCURATE"
                                                              : "",
                             remark.empty() ? "" : "  (" + remark + ")");
}

std::string MotionRow::sentence() const {
  const std::string name = fmt::format("the motion of {} on {}", formulation, integrator);
  if (verdict == Verdict::failed) return fmt::format("{}: {}", name, why);
  if (verdict == Verdict::cut) return fmt::format("{} was cut {}", name, why);
  return fmt::format("{}: {} at t = {:.6g} s is {:.9g} {}, {:.9g} {}{}", name, quantity, time, found, unit, expected,
                     by_equations ? "by the equations of motion at this state" : "by the reference",
                     remark.empty() ? "" : " (" + remark + ")");
}

Json MotionRow::json() const {
  Json j;
  const bool ended = verdict != Verdict::refused && verdict != Verdict::failed && verdict != Verdict::cut;
  const auto if_ended = [&](const auto& x) { return ended ? Json(x) : Json(nullptr); };
  j["formulation"] = formulation;
  j["integrator"] = integrator;
  j["status"] = name_of(verdict);
  j["error"] = if_ended(error);
  j["equations_error"] = if_ended(independent_error);
  j["quantity"] = if_ended(quantity);
  j["unit"] = if_ended(unit);
  j["t_s"] = if_ended(time);
  j["value"] = if_ended(found);
  j["expected"] = if_ended(expected);
  j["expected_by"] = if_ended(by_equations ? "equations" : "reference");
  if (!why.empty()) j[name_of(verdict)] = why;
  if (!remark.empty()) j["remark"] = remark;
  return j;
}

}  // namespace costate::app
