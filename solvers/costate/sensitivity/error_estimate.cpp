#include "costate/sensitivity/error_estimate.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/unsaid.h"
#include "costate/integrator/bent_motion.h"
#include "costate/integrator/run_watch.h"
#include "costate/integrator/sampled_run.h"
#include "costate/integrator/simulate.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/level/penalty_weight.h"
#include "costate/problem/known_error.h"
#include "costate/problem/scaled_gradient.h"
#include "costate/sensitivity/confirmation.h"
#include "costate/sensitivity/method.h"

namespace costate {

namespace {

// A run that takes so many steps more is another one. And the part of the tolerance that an estimate is at least: two
// runs may agree by accident.
constexpr double kOtherSteps = 1.2, kLeastError = 1e-2;
constexpr double kTightestEstimate = 1e-14, kFarthest = 3e-4;
// Of the tolerance, the first run that tells; and of that one's, the others.
constexpr double kFirst = 0.1, kSecond = 0.3, kThird = 0.1;

/// The same problem with a part of the step.
Problem with_a_part_of_the_step(const Problem& problem, const Simulation& result, double part) {
  Problem p = problem;
  p.solver.confirm = false;
  p.solver.step_s = part * (problem.solver.t_end - problem.solver.t_start) / static_cast<double>(result.counters.steps);
  return p;
}

/// A psi of that size that is far below its absolute tolerances has the same errors by all of them: smaller ones tell.
Problem with_tolerance(const Problem& problem, double part, double size) {
  Problem p = problem;
  p.solver.confirm = false;
  const bool small = resolve_small_psi(p, size);
  p.solver.tighten(part, kTightestEstimate, small ? 0 : 1e-16);
  return p;
}

/// By how much two results differ.
ErrorEstimate apart(const Simulation& result, const Simulation& other) {
  ErrorEstimate e;
  e.psi = std::abs(result.psi - other.psi);
  return e;
}

double size_of_psi(const Problem&, const Simulation& result) { return std::abs(result.psi); }

ErrorEstimate apart(const GradientResult& result, const GradientResult& other) {
  ErrorEstimate e = apart(static_cast<const Simulation&>(result), static_cast<const Simulation&>(other));
  for (std::size_t j = 0; j < result.gradient.size(); ++j)
    e.gradient.push_back(std::abs(result.gradient[j] - other.gradient[j]));
  return e;
}

/// What the same run solved better differs by, times `whole`: the part of the error that it takes away.
template <class Result>
void add_apart(const Result& result, const Result& better, double whole, ErrorEstimate& e) {
  const ErrorEstimate other = apart(result, better);
  e.psi = std::max(e.psi, whole * other.psi);
  e.gradient.resize(other.gradient.size(), 0);
  for (std::size_t j = 0; j < other.gradient.size(); ++j)
    e.gradient[j] = std::max(e.gradient[j], whole * other.gradient[j]);
}

/// Where tolerances choose no steps (Maggi's coordinates turn only so far in one) those of half the length tell.
Problem with_shorter_steps(Problem problem, long steps) {
  const double half = 0.5 * (problem.solver.t_end - problem.solver.t_start) / static_cast<double>(std::max(1L, steps));
  double& longest = problem.solver.max_step_s;
  longest = longest > 0 ? std::min(longest, half) : half;
  return problem;
}

/// The farthest of two runs or three that are solved better, each better than the one before: the first may come near
/// the result by chance, with an error of its own as large. `run` makes them of another problem.
template <class Result, class Run>
ErrorEstimate farthest_of_better(const Problem& problem, const Result& result, bool fixed, const Run& run) {
  ErrorEstimate e;
  if (fixed) {  // of order two: half the step takes three quarters of the error away
    for (const double part : {0.5, 0.25})
      add_apart(result, run(with_a_part_of_the_step(problem, result, part)), 1 / (1 - part * part), e);
    return e;
  }
  const auto tightest = [](const Problem& p) { return p.solver.rtol <= kTightestEstimate; };
  for (double part = kFirst;; part *= kFirst) {
    const Problem tighter = with_tolerance(problem, part, size_of_psi(problem, result));
    const Result better = run(tighter);
    const bool another = takes_other_steps(result.counters.steps, better.counters.steps);
    if (!another && part >= kFarthest && !tightest(tighter)) continue;
    add_apart(result, better, 1, e);
    if (!another) try {
        add_apart(result, run(with_shorter_steps(tighter, result.counters.steps)), 1, e);
      } catch (const SolverError&) {
        // Nothing more is known.
      }
    // Where errors fall by fits and starts two may be near the result by chance, too.
    std::vector<double> further = {kSecond};
    if (falls_by_fits(problem, result)) further.push_back(kThird);
    for (const double by : further)
      if (!tightest(tighter)) try {
          add_apart(result, run(with_tolerance(problem, by * part, size_of_psi(problem, result))), 1, e);
        } catch (const SolverError&) {
          // So tight a tolerance cannot be met; the others tell.
        }
    return e;
  }
}

void add_least(const Problem& problem, const Simulation& result, bool fixed, ErrorEstimate& e) {
  if (!fixed) e.psi = std::max(e.psi, kLeastError * problem.solver.rtol * std::abs(result.psi));
}

// What the soft constraints of the penalties add is of first order in 1/alpha: a weight ten times as large takes nine
// tenths of it away.
constexpr double kTakenAway = 0.9;

/// `run` is the same run of another problem.
template <class Result, class Run>
void add_softness(const Problem& problem, const Result& result, ErrorEstimate& e, const Run& run) {
  if (!has_soft_constraints(problem.formulation)) return;
  const ErrorEstimate softness = apart(result, run(with_firmer_constraints(problem)));
  e.psi += softness.psi / kTakenAway;
  for (std::size_t j = 0; j < e.gradient.size(); ++j) e.gradient[j] += softness.gradient[j] / kTakenAway;
}

/// How many times as much as the forces themselves at the start their largest scaled derivative by a parameter is. The
/// rows' errors are reactions over weights: those of a stiff spring that is hardly stretched are small, while their
/// derivatives by its natural length, or by what moves its ends at the start, are not.
double pull_of_parameters(const Problem& problem, const std::vector<double>& rho) {
  Assembly assembly(problem.mechanism, problem.parameters);
  assembly.set_parameters(rho.data());
  const Start start =
      find_start(assembly, problem.solver.t_start, needs_start_columns(assembly, StartDerivative::adjoint));
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(assembly.n() + assembly.m());
  const StateView at{problem.solver.t_start, start.q.data(), start.v.data(), none.data(), none.data(), start.z.data()};
  assembly.calc_dynamics(at);
  Eigen::VectorXd weights(assembly.n());  // by which no pair of opposite forces cancels
  for (Eigen::Index i = 0; i < weights.size(); ++i) weights[i] = 0.5 + std::fmod(0.61803398875 * double(i + 1), 1.0);
  std::vector<double> pull(rho.size(), 0.0);
  Assembly::ParameterWeights w;
  w.force = weights.data();
  assembly.add_parameter_gradient(at, w, 1.0, pull.data());
  assembly.calc_force_partials(at);  // K = -Q_q, without accelerations and multipliers
  const SparsePattern& square = assembly.square();
  Eigen::VectorXd w_q = Eigen::VectorXd::Zero(weights.size());
  for (int j = 0; j < square.cols; ++j)
    for (auto k = square.column_start[j]; k < square.column_start[j + 1]; ++k)
      w_q[j] += weights[square.row[k]] * assembly.K[k];
  const Eigen::VectorXd no_v = Eigen::VectorXd::Zero(weights.size()), no_z = Eigen::VectorXd::Zero(start.z.size());
  add_start_gradient(assembly, problem.solver.t_start, start, w_q.data(), no_v.data(), no_z.data(), pull.data());
  const double forces = Eigen::Map<const Eigen::VectorXd>(assembly.Q.data(), assembly.n()).norm(),
               pulled = largest_scaled(problem.parameters, pull);
  return pulled > 0 ? pulled / std::max(forces, 1e-6 * pulled) : 0;
}

/// Where a tenth of the tolerance changes so much, errors do not fall as it does, and two tighter runs tell as little
/// as one: a chaotic motion's may be near each other by chance.
void tell_if_sensitive(const Problem& problem, const GradientResult& r, const ErrorEstimate& e) {
  const double zero = negligible_cost(problem), rtol = problem.solver.rtol,
               size = r.gradient.empty() ? 0 : gradient_size(problem.parameters, r.psi, r.gradient);
  const double of_psi = e.psi > zero ? e.psi / std::max(std::abs(r.psi), std::numeric_limits<double>::min()) : 0,
               of_gradient = size > 0 ? largest_scaled(problem.parameters, e.gradient) / size : 0;
  // As for runs whose error nobody asks for: 1e4 rtol, a tenth at most.
  if (!(std::max(of_psi, of_gradient) > std::min(0.1, 1e4 * rtol))) return;
  notice(fmt::format(
      "{} makes much of small errors: from rtol {:g} to {:g} or less {} changes by {:.1g} of it. Estimates of "
      "errors that large do not bound them; a smaller rtol, or another method, tells how many digits are right.",
      of_psi >= of_gradient ? "The motion" : what_grows(r), rtol, kFirst * rtol,
      of_psi >= of_gradient ? "psi" : "the gradient", std::max(of_psi, of_gradient)));
}

// Of a row's error, parts of its own length, what psi and a gradient change by at most as a rule, in parts of theirs;
// and what a result whose error is not known is taken to be off by, in tolerances.
constexpr double kOfPsi = 30, kOfGradient = 100, kNotKnown = 30;

/// Whether what soft constraints do to a result is below the error that it is known with anyway.
bool drift_is_stated(const Problem& problem, double drift, const Simulation& result) {
  const double psi = std::abs(result.psi),
               known = result.known_error ? result.known_error->psi : kNotKnown * problem.solver.rtol * psi;
  return kOfPsi * drift * psi <= known;
}
bool drift_is_stated(const Problem& problem, double drift, const GradientResult& result, double size) {
  if (!drift_is_stated(problem, drift, result)) return false;
  const double known = result.known_error ? largest_scaled(problem.parameters, result.known_error->gradient)
                                          : kNotKnown * problem.solver.rtol * size;
  return kOfGradient * drift * size <= known;
}

/// Rows of contacts come and go, and nobody looks along the motion at what they are off by: weights are as many times
/// the masses, and so is what rows bear the accelerations that it leaves.
double drift_of_contacts(const Problem& problem) {
  if (!Assembly(problem.mechanism, ParameterSelection{}).has_switched_rows()) return 0;
  return default_penalty_weight(problem.mechanism) / penalty_weight(problem.mechanism, problem.formulation_options) /
         kPenaltyStiffness;
}

}  // namespace

void widen_by_softness(const Problem& problem, const std::vector<double>& rho, double drift, Simulation& result) {
  if (!has_soft_constraints(problem.formulation) || problem.mechanism->constraints().empty() ||
      drift_is_stated(problem, std::max(drift, drift_of_contacts(problem)), result))
    return;
  try {
    const Unsaid another;
    widen_error(result, (result.psi - simulate(with_firmer_constraints(problem), rho).psi) / kTakenAway);
  } catch (const SolverError&) {
    // Nothing more is known.
  }
}

void watch_penalty(const Problem& problem, const std::vector<double>& rho, GradientResult& result, double drift,
                   const std::function<GradientResult(const Problem&)>& run) {
  if (!has_soft_constraints(problem.formulation) || problem.mechanism->constraints().empty()) return;
  drift = std::max(drift, drift_of_contacts(problem));
  const double usual = default_penalty_weight(problem.mechanism),
               alpha = penalty_weight(problem.mechanism, problem.formulation_options);
  // Rows that are off by d change psi by some d of it, and a gradient by up to a thousand times that, where the motion
  // makes no more of it; a psi that is what is left of next to no motion by d itself; a gradient by what parameters
  // make of d, and by more of itself where it is small against psi. With weights as they are chosen d is some 1e-9.
  constexpr double kDrift = 1e-7, kLarge = 30, kSaid = 1e-4;
  const bool large = alpha > kLarge * usual;
  const double size = gradient_size(problem.parameters, result.psi, result.gradient), of_psi = std::abs(result.psi),
               unsaid = std::min(kDrift * (size < of_psi ? size / of_psi : 1.0), kSaid * of_psi);
  const bool stated = drift_is_stated(problem, drift, result, size);
  if (stated && !large && drift < unsaid && !(drift * pull_of_parameters(problem, rho) >= unsaid)) return;
  Problem other = problem;
  other.formulation_options.set("penalty_alpha", large ? alpha / 10 : alpha * 10);
  constexpr double share = kTakenAway;
  // What two runs differ by includes the errors of both.
  constexpr double kOwnErrors = 3;
  const double allowed = std::max(kSaid, 1e3 * problem.solver.rtol);
  double own_psi = 0, own_gradient = 0;
  if (result.known_error) {
    own_psi = kOwnErrors * result.known_error->psi;
    own_gradient = kOwnErrors * largest_scaled(problem.parameters, result.known_error->gradient);
  }
  ErrorEstimate e;
  double psi = 0, gradient = 0;
  const auto is_more = [&](const GradientResult& own, const GradientResult& changed) {
    e = apart(own, changed);
    psi = e.psi / share / std::max(std::abs(result.psi), problem.solver.absolute());
    gradient = size > 0 ? largest_scaled(problem.parameters, e.gradient) / share / size : 0;
    return (psi > allowed && e.psi > own_psi) ||
           (gradient > allowed && largest_scaled(problem.parameters, e.gradient) > own_gradient);
  };
  const auto widen = [&] {
    for (double& error : e.gradient) error /= share;
    widen_error(result, e.psi / share, e.gradient);
  };
  // Of a result whose own error nothing has told softness is no more than a part, and stated where it is the larger
  // one, of psi and of the gradient.
  const auto tells = [&] {
    return problem.solver.confirm ||
           (e.psi / share > kNotKnown * problem.solver.rtol * of_psi &&
            largest_scaled(problem.parameters, e.gradient) / share > kNotKnown * problem.solver.rtol * size);
  };
  try {
    const Unsaid another;
    // What is no reason for a word is part of the error that is stated.
    if (!is_more(result, run(other))) {
      if (tells()) widen();
      return;
    }
    if (!problem.solver.resolve) {  // two gradients that are not resolved differ by their errors as well
      Problem own = problem;
      own.solver.resolve = other.solver.resolve = true;
      if (!is_more(run(own), run(other))) return;
    }
  } catch (const SolverError&) {
    return;
  }
  widen();
  notice(fmt::format(
      "The penalty's weight alpha = {:.3g} changes psi by some {:.1g} of it, and its gradient by {:.1g} of the largest "
      "scaled derivative: {}. Take {} (--penalty-alpha), or a formulation with exact constraints "
      "(augmented-lagrangian carries redundant ones, too).",
      alpha, psi, gradient,
      large ? "rounding, of rows that depend on each other" : "its constraints are soft, O(1/alpha)",
      large ? "a smaller one" : "a larger one"));
}

bool takes_other_steps(long before, long steps) {
  return static_cast<double>(steps) > kOtherSteps * static_cast<double>(before);
}

std::optional<ErrorEstimate> estimate_or_tell(const std::function<ErrorEstimate()>& estimate) {
  try {
    return estimate();
  } catch (const SolverError& e) {
    notice(
        fmt::format("The error of the result is not known: a run that would tell it, at a smaller tolerance, step or "
                    "softness, fails. {}",
                    e.what()));
  }
  return std::nullopt;
}

bool has_soft_constraints(const std::string& formulation) { return !find_formulation(formulation).exact_constraints(); }

Problem with_firmer_constraints(const Problem& problem) {
  Problem firmer = problem;
  firmer.solver.confirm = false;
  firmer.formulation_options =
      find_formulation(problem.formulation).firmer(problem.mechanism, problem.formulation_options);
  return firmer;
}

ErrorEstimate estimate_error(const Problem& problem, const std::vector<double>& rho, const Simulation& result) {
  const bool fixed = has_fixed_steps(integrator_of(problem));
  const auto run = [&](const Problem& p) { return simulate(p, rho); };
  ErrorEstimate e = farthest_of_better(problem, result, fixed, run);
  if (!fixed) tell_if_sensitive(problem, GradientResult(result), e);
  add_least(problem, result, fixed, e);
  add_softness(problem, result, e, run);
  return e;
}

ErrorEstimate estimate_error(const Problem& problem, const std::string& method, const std::vector<double>& rho,
                             const GradientResult& result) {
  const bool fixed = by_fixed_steps(problem, find_sensitivity_method(method));
  const auto run = [&](const Problem& p) { return gradient(p, method, rho); };
  ErrorEstimate e = farthest_of_better(problem, result, fixed, run);
  if (!fixed) tell_if_sensitive(problem, result, e);
  add_least(problem, result, fixed, e);
  for (std::size_t j = 0; j < e.gradient.size() && !fixed; ++j)
    e.gradient[j] = std::max(e.gradient[j], kLeastError * problem.solver.rtol * std::abs(result.gradient[j]));
  add_softness(problem, result, e, run);
  return e;
}

}  // namespace costate
