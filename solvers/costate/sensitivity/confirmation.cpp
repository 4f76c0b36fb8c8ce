#include "costate/sensitivity/confirmation.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/unsaid.h"
#include "costate/integrator/bent_motion.h"
#include "costate/integrator/unknown_sizes.h"
#include "costate/problem/known_error.h"
#include "costate/problem/scaled_gradient.h"

namespace costate {

namespace {

constexpr double kLoosest = 1e-6, kTightest = 1e-13;
// The tolerances of the runs beside it, relative.
constexpr double kLooser = 100, kTighter = 0.1;
// Errors of 60 rtol fall with the tolerance to the power 5/6 or faster: a hundred times it changes 3e3 rtol. Where it
// changes more, either run may be off by that: with 1e4 rtol, by what rtol = 1e-8 must not be off in silence.
constexpr double kExplained = 3e3;
// What is left then is said from here on; it has been five times as much (test/cases/truss_671687.toml).
constexpr double kKnown = 2e3;
// Errors fall by this a decade of the tolerance, at least as they should, and no less than that as is assumed.
constexpr double kFalls = 6.8, kHardlyFalls = 1.05;
// By this they fall in the two decades to the looser run, where that is explained, at least; as a rule by 46. A run
// at a tenth of the tolerance may be near the result by chance, so that one decade says less than three: what is known
// is no less than the result's error by the rule (test/cases/truss_1040123.toml: 3.8e-7 between two that are both off
// by 7e-6).
constexpr double kSurelyLess = 10, kAsARule = kFalls * kFalls - 1;
// Where events move errors fall by fits and starts: of 1,900 gradients over stick, slip, impacts and touches one in 50
// was off by more than three times what the former told.
constexpr double kSurelyOverEvents = 3, kByChanceOverEvents = 0.5;
// Where the looser run was further off than this, errors do not fall as the tolerance does, and two runs may be near
// each other by chance: by 316 = 1000^(5/6) less the better of the two is off by 3e3 rtol, as with kKnown.
constexpr double kErratic = 1e6;
// A psi below this part of the gradient counts as so large: a speed of 1e-5 m/s that is asked of points that could move
// by metres.
constexpr double kSmallPsi = 1e-6;
// A hundred times the tolerance asks a scheme of order 9 for 1.7 times the steps. Where it takes hardly fewer, the
// steps are those of something else, of ramps and places in the scene, and the looser run repeats this one's errors
// (test/cases/late_pulse_703887.toml); what is tighter by these factors then has to take more.
constexpr double kMoreSteps = 1.4;
constexpr double kTightening[] = {kTighter, 1e-2, 1e-3};
// Methods of many steps take as a rule twice the steps for a hundred times the tolerance. Where it is less than this,
// the looser run is bound by the same places, and may be near by chance (test/cases/pulse_2101293.toml).
constexpr double kHardlyMoreSteps = 1.25;
// Where none does, looser ones have to take fewer.
constexpr double kLoosening[] = {1e3, 1e4, 1e5, 1e6}, kLoosestBeside = 1e-3;
// A psi far below what absolute tolerances are made for has their errors, at any rtol: some kAbsolute of them are
// kUnresolved rtol of it. It is computed once more with tolerances of which they would be a tenth of that, but no
// smaller than kFinest of what they were; where a part is asked for, kFinestAsked.
constexpr double kAbsolute = 30, kUnresolved = 1e4, kFinest = 1e-4, kFinestAsked = 1e-6;
// Of psi's integral alone, whose tolerance costs steps only where the cost changes: of what atol makes of it. A narrow
// pulse far below that has no error control at all, and every run the same errors. And how many steps, for one before,
// that is worth.
constexpr double kFinestIntegral = 1e-10;
constexpr long kMostFiner = 30, kStepsOfFew = 1000;

// What a tenth of a loose tolerance may change without a word: a third of 1e4 rtol, a tenth at most.
constexpr double kMuchOfLoose = 3e3, kMuch = 0.1;

struct Apart {
  double relative = 0;
  std::string what;
};

Apart apart(const Problem& problem, const GradientResult& a, const GradientResult& b) {
  const auto& parameters = problem.parameters.parameters;
  const double zero = negligible_cost(problem), psi_size = size_of_psi(problem, b),
               size = gradient_size(problem.parameters, b.psi, b.gradient);
  Apart r;
  const auto look = [&](double change, double of, const std::string& what) {
    if (!(change > zero)) return;
    const double relative = change / std::max(of, std::numeric_limits<double>::min());
    if (!(relative <= r.relative)) r = {relative, what};
  };
  look(std::abs(a.psi - b.psi), psi_size, fmt::format("psi changes by {:.1e}", std::abs(a.psi - b.psi)));
  for (std::size_t j = 0; j < b.gradient.size(); ++j) {
    const double change = std::abs(a.gradient[j] - b.gradient[j]);
    look(change * parameters[j].scale, size,
         fmt::format("its derivative with respect to '{}', {:.6g}, changes by {:.1e}", parameters[j].name,
                     b.gradient[j], change));
  }
  return r;
}

/// By how much errors fall a decade, and the error of the tightest of three runs, at 100, 1 and 0.1 times the
/// tolerance, from the changes between the first two and the last two: of errors that fall by f a decade these are e
/// (f^2 - 1) and e (1 - 1/f), in a ratio of f (f + 1). A discrete method that steps over kinks of forces has errors of
/// the first order of the step, whatever its own.
double decades(double first, double still) {
  double f = kFalls;
  if (std::isfinite(first) && still > 0) f = std::min(f, std::sqrt(0.25 + first / still) - 0.5);
  return std::max(f, kHardlyFalls);
}
double left_over(double first, double still) { return still / (decades(first, still) - 1); }

/// No estimate is below this part of the tolerance.
constexpr double kLeastKnown = 0.01;

/// The result may be off by what it changed by from `other`, over `divisor`. Of a few entries one or the other changes
/// little by chance: none is known better, in parts of itself, than the largest are, nor than a tenth of what those
/// changed by; psi is, as a tenth of the former, but no worse than a thousand times what it changed by.
void know(const Problem& problem, GradientResult& result, const GradientResult& other, double divisor) {
  constexpr double kOfPsi = 0.1, kChance = 1e3;
  const double changed = largest_scaled_change(problem.parameters, result.gradient, other.gradient);
  const double size = largest_scaled(problem.parameters, result.gradient), rounding = kLeastKnown * problem.solver.rtol,
               least = std::max(rounding, size > 0 ? std::min(1.0, changed / divisor / size) : 0);
  std::vector<double> gradient = pooled_changes(problem.parameters, result.gradient, other.gradient);
  for (std::size_t j = 0; j < gradient.size(); ++j)
    gradient[j] = std::max(gradient[j] / divisor, least * std::abs(result.gradient[j]));
  const double of_psi = std::abs(result.psi - other.psi) / divisor;
  widen_error(result,
              std::max({of_psi, rounding * std::abs(result.psi),
                        std::min(kOfPsi * least * std::abs(result.psi), kChance * of_psi)}),
              gradient);
}

/// Whatever else is found of its error is not all of it.
void leave_open(GradientResult& result) {
  widen_error(result, 0, std::vector<double>(result.gradient.size(), 0.0));
  result.known_error->all = false;
}

/// Absolute tolerances such that errors of a psi of that size by them are `aim` of it, where they are more than `least`
/// of it; false where they are less.
bool resolve_psi_of(Problem& problem, double size, double least, double aim, double finest) {
  const double tolerated = problem.solver.absolute() * cost_size(problem);
  if (!(size > 0) || kAbsolute * tolerated <= least * size) return false;
  const double smaller = aim * size / (kAbsolute * tolerated);
  problem.solver.cost_atol = tolerated * std::max(smaller, kFinestIntegral);
  problem.solver.atol = problem.solver.absolute() * std::max(smaller, finest);
  return true;
}

/// At another tolerance; what it has to say is not for this run.
bool attempt(const Problem& problem, double factor, const GradientRun& run, GradientResult& result,
             const std::function<void(Problem&)>& besides = {}) {
  Problem other = problem;
  other.solver.set_rtol(problem.solver.rtol * factor);
  if (besides) besides(other);
  try {
    result = run(other);
  } catch (const SolverError&) {
    return false;
  }
  return result.gradient.size() == problem.parameters.parameters.size() && std::isfinite(result.psi) &&
         std::all_of(result.gradient.begin(), result.gradient.end(), [](double g) { return std::isfinite(g); });
}

bool takes_more_steps(const GradientResult& finer, const GradientResult& coarser, double times = kMoreSteps) {
  return static_cast<double>(finer.counters.steps) >= times * static_cast<double>(coarser.counters.steps);
}

double surely_less(const Problem& problem, const GradientResult& r) {
  return falls_by_fits(problem, r) ? kSurelyOverEvents : kSurelyLess;
}

/// At loose tolerances a looser run tells nothing: a tighter one does, of a result that stays. A motion far below
/// absolute tolerances is damped away by all of them that are loose: the tighter one resolves a psi of that size.
GradientResult beside_a_tighter_one(const Problem& problem, GradientResult result, const GradientRun& run,
                                    bool scheme) {
  const double rtol = problem.solver.rtol;
  GradientResult tight;
  double by = kTighter;
  const auto resolve = [size = size_of_psi(problem, result)](Problem& p) { resolve_any_psi(p, size); };
  const bool known = [&] {
    const Unsaid tighter_ones;
    if (!attempt(problem, by, run, tight, resolve)) return false;
    // Steps that are those of places in the scene, or of a motion smaller than absolute tolerances, repeat their
    // errors.
    for (const double factor : {1e-2, 1e-3}) {
      if (takes_more_steps(tight, result, scheme ? kMoreSteps : kHardlyMoreSteps)) break;
      GradientResult tighter;
      if (!attempt(problem, factor, run, tighter, resolve)) break;
      tight = std::move(tighter);
      by = factor;
    }
    return true;
  }();
  if (!known) {
    notice(fmt::format(
        "At rtol {:g}, which would tell what the result at {:g} is worth, this method has none: how many digits are "
        "right is not known. Compare methods (costate check).",
        rtol * by, rtol));
    leave_open(result);
    return result;
  }
  know(problem, result, tight, falls_by_fits(problem, result) ? kByChanceOverEvents : 1);
  const Apart change = apart(problem, result, tight);
  if (change.relative > std::min(kMuch, kMuchOfLoose * rtol))
    notice(fmt::format("From rtol {:g} to {:g} {}, where psi is {:.6g}: take the smaller one, or a smaller one still.",
                       rtol, rtol * by, change.what, result.psi));
  return result;
}

}  // namespace

const char* what_grows(const GradientResult& r) {
  return r.counters.backward_steps > 0 ? "The motion, or the way back along it," : "The motion";
}

double size_of_psi(const Problem& problem, const GradientResult& r) {
  return std::max(std::abs(r.psi), kSmallPsi * largest_scaled(problem.parameters, r.gradient));
}

bool resolve_any_psi(Problem& problem, double size) {
  return resolve_psi_of(problem, size, kMuch, kMuch, kFinestAsked);
}

bool resolve_small_psi(Problem& problem, double size, double part) {
  if (!(size > negligible_cost(problem))) return false;
  const double least = part > 0 ? part : kUnresolved * problem.solver.rtol;
  return resolve_psi_of(problem, size, least, part > 0 ? part : 0.1 * kUnresolved * problem.solver.rtol,
                        part > 0 ? kFinestAsked : kFinest);
}

bool resolve_small_psi(Problem& problem, GradientResult& result, const GradientRun& run) {
  Problem resolved = problem;
  if (!resolve_small_psi(resolved, size_of_psi(problem, result))) return false;
  const std::vector<std::string> said = take_notices();
  Problem few = resolved;
  few.solver.max_steps = std::min(few.solver.max_steps, kMostFiner * result.counters.steps + kStepsOfFew);
  GradientResult finer;
  if (!attempt(few, 1, run, finer) ||
      !(apart(resolved, result, finer).relative > std::min(kMuch, kKnown * problem.solver.rtol))) {
    take_notices();
    for (const auto& s : said) notice(s);
    return false;
  }
  finer.counters.simulations = std::max(finer.counters.simulations, result.counters.simulations);
  result = std::move(finer);
  problem = std::move(resolved);
  return true;
}

GradientResult confirmed(const Problem& asked, GradientResult result, const GradientRun& run, Looks looks,
                         bool* sensitive) {
  const double rtol = asked.solver.rtol;
  if (rtol * kTighter < kTightest) return result;
  Problem problem = asked;
  resolve_small_psi(problem, result, run);
  std::vector<std::string> said = take_notices();
  const auto say = [](const std::vector<std::string>& sentences) {
    take_notices();
    for (const auto& s : sentences) notice(s);
  };
  if (!(rtol <= kLoosest)) {
    say(said);
    return beside_a_tighter_one(problem, std::move(result), run, looks.scheme);
  }
  GradientResult loose, tight;
  Apart first{std::numeric_limits<double>::infinity(), ""};
  if (attempt(problem, kLooser, run, loose)) first = apart(problem, loose, result);
  const bool explained = first.relative <= kExplained * rtol;
  const bool repeated = looks.scheme && std::isfinite(first.relative) && !takes_more_steps(result, loose);
  const bool bound = !looks.scheme && !takes_more_steps(result, loose, kHardlyMoreSteps);
  if (explained && !looks.erratic && !repeated && !bound) {
    know(asked, result, loose, surely_less(asked, result));
    say(said);
    return result;
  }
  if (sensitive) *sensitive = !explained;
  take_notices();
  double tighter = 0;
  for (const double factor : kTightening) {
    if (tighter > 0 && (!repeated || takes_more_steps(tight, result) || rtol * factor < kTightest)) break;
    GradientResult next;
    if (!attempt(problem, factor, run, next)) break;
    tight = std::move(next);
    tighter = factor;
  }
  if (tighter == 0) {
    const bool known = std::isfinite(first.relative);
    if (known)
      know(asked, result, loose, explained ? surely_less(asked, result) : 1);
    else
      leave_open(result);
    say(said);
    if (!known)
      notice(fmt::format(
          "Neither at rtol {:g} nor at {:g}, which would tell what the result at {:g} is worth, does this method have "
          "one: how many digits are right is not known. Compare methods (costate check).",
          rtol * kLooser, rtol * kTighter, rtol));
    else if (!explained)
      notice(fmt::format(
          "From rtol {:g} to {:g} {}, where psi is {:.6g}, and at {:g}, which would tell what is left, this "
          "method has no result: how many digits are right is not known. Compare methods (costate check).",
          rtol * kLooser, rtol, first.what, result.psi, rtol * kTighter));
    return result;
  }
  // Two near each other may be as far from what is right where errors hardly fall.
  const Apart still = apart(problem, result, tight);
  if (repeated && !takes_more_steps(tight, result)) {
    // No tolerance within reach gives other steps: the difference to one that does, and is worse, bounds the error.
    GradientResult other;
    for (const double factor : kLoosening)
      if (rtol * factor <= kLoosestBeside && attempt(problem, factor, run, other) && takes_more_steps(result, other)) {
        know(asked, result, other, 1);
        say(said);
        return result;
      }
    know(asked, result, tight, 1);
    say(said);
    notice(fmt::format(
        "Tolerances from {:g} to {:g} give the same steps, those of places in the scene or of max_step_s: what "
        "is left of errors is not known. Compare methods (costate check).",
        rtol * tighter, rtol * kLooser));
    return result;
  }
  const double left = left_over(repeated ? HUGE_VAL : first.relative, still.relative);
  if (explained && std::max(left, still.relative) <= kExplained * rtol) {
    know(asked, result, tight, 1);
    if (std::isfinite(first.relative)) know(asked, result, loose, kAsARule);
    say(said);
    return result;
  }
  // What either run had to say stands; where both say the same with other numbers, those of the result do.
  const std::vector<std::string> later = take_notices();
  const auto opening = [](const std::string& s) { return s.substr(0, s.find_first_of("0123456789")); };
  std::erase_if(said, [&](const std::string& s) {
    return std::any_of(later.begin(), later.end(), [&](const std::string& l) { return opening(l) == opening(s); });
  });
  say(said);
  for (const auto& s : later) notice(s);
  tight.counters.simulations = std::max(tight.counters.simulations, result.counters.simulations);
  const bool erratic = std::isfinite(first.relative) && first.relative > kErratic * rtol;
  // The looser of two may be the nearer one by chance: all of the last change may be left.
  know(asked, tight, result, std::min(1.0, decades(repeated ? HUGE_VAL : first.relative, still.relative) - 1));
  if (std::isfinite(first.relative)) know(asked, tight, loose, kAsARule);
  const char* who = what_grows(tight);
  if (left > kKnown * rtol)
    notice(
        fmt::format("{} makes much of small errors: from rtol {:g} to {:g} {}, where psi is {:.6g}. The "
                    "result is that of the latter; a smaller rtol tells how many of its digits are right.",
                    who, rtol, rtol * tighter, still.what, tight.psi));
  else if (erratic)
    notice(
        fmt::format("{} makes much of small errors: from rtol {:g} to {:g} {}, where psi is {:.6g}. The result "
                    "is that of {:g}; a smaller rtol tells how many of its digits are right.",
                    who, rtol * kLooser, rtol, first.what, tight.psi, rtol * tighter));
  return tight;
}

}  // namespace costate
