// Method "differences": central differences of psi extrapolated to zero step (Ridders' tableau). An oracle: it perturbs
// the scene's numbers and reruns the whole simulation, so that it shares no derivative block with the gradients that it
// judges (Jacobians steer the integrator's Newton iteration only, not what it converges to).
// Source of the scheme: C. J. F. Ridders, Accurate computation of F'(x) and F'(x) F''(x), Adv. Eng. Software 4 (1982).
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/unsaid.h"
#include "costate/integrator/simulate.h"
#include "costate/record/jobs.h"
#include "costate/sensitivity/cycle_gradient.h"
#include "costate/sensitivity/method.h"

namespace costate {
namespace {

constexpr double kTightestDifferences = 1e-13;  // rtol of the runs; their noise is amplified by 1/step
constexpr double kFirstStep = 0.05;             // relative to the parameter
constexpr int kLevels = 11;   // steps h, h/2, ... h/1024 at most: a strongly bent psi needs the last ones
constexpr double kNoise = 3;  // of psi, in tolerances of its runs: what steps that change from run to run leave
// More where the motion makes much of small errors: of what ten times the tolerance changes in psi.
constexpr double kLooserRun = 10, kNoiseOfLooser = 0.1;
// Of what a slope changes by at ten times the tolerance: errors fall by 6.8 a decade, or less.
constexpr double kOfLooserSlope = 0.25;
constexpr double kAboveNoise = 30, kStays = 0.9, kTold = 1e-3;  // of slopes that differ on both sides
// Where no run goes so far to both sides (a distance that may not vanish, a start that must not touch): how often the
// first step is shortened, and to what.
constexpr int kShortenings = 6;
constexpr double kShortened = 0.25;
constexpr double kConverged = 1e-6;  // relative; from here on growing changes are noise, not yet bends of psi

struct Slope {
  double value = 0, error = 0;
  double below = 0, above = 0;  // where f has another slope on either side of x, else equal
  double step = 0, plain = 0;   // the least step that it is made of, and the slope over that alone
};

/// f on both sides of x, at the first step that has values: h, or one that is shorter.
template <class Function>
std::array<double, 2> first_values(Function&& f, double x, double& h) {
  for (int shortened = 0;; ++shortened, h *= kShortened) try {
      return {f(x + h), f(x - h)};
    } catch (const Error&) {
      if (shortened == kShortenings) throw;
    }
}

/// Derivative and error estimate of f at x: the entry of the extrapolation tableau that changed least, so that neither
/// truncation (first columns) nor noise (last rows) spoils it. Of many entries the best one changed least by chance (it
/// was off by more than twice that in two of five, smooth or not): of the rows behind its own the best one's change
/// counts, too, and how far it is from it (of 6,000: off by twice that in one of forty). Nor is it known better than
/// what values off by `noise` make of it.
template <class Function>
Slope extrapolated_slope(Function&& f, double f_at_x, double x, double h, double noise_of_f) {
  std::array<std::array<double, kLevels>, kLevels> a{};
  const std::array<double, 2> first = first_values(f, x, h);
  constexpr double none = std::numeric_limits<double>::infinity();
  double best = 0, error = none, least = 0, step = h, plain = 0, error_behind = none, behind = 0;
  // By how much the slopes towards both sides differ: halved with the step where f is smooth. Of the level before the
  // last that noise does not spoil, and of that.
  double apart = 0, apart_before = 0;
  for (int i = 0; i < kLevels; ++i, h /= 2) {
    const double above = x + h, below = x - h;
    const double f_above = i == 0 ? first[0] : f(above), f_below = i == 0 ? first[1] : f(below);
    a[0][i] = (f_above - f_below) / (above - below);
    const double sides = (f_above - f_at_x) / (above - x) - (f_at_x - f_below) / (x - below);
    if (std::abs(sides) > kAboveNoise * noise_of_f / h) {
      apart_before = apart;
      apart = sides;
    } else {
      apart = apart_before = 0;  // smooth, as far as can be told
    }
    double power = 4, error_of_row = none, of_row = 0;
    bool better = false;
    for (int j = 1; j <= i; ++j, power *= 4) {
      a[j][i] = (a[j - 1][i] * power - a[j - 1][i - 1]) / (power - 1);
      const double e = std::max(std::abs(a[j][i] - a[j - 1][i]), std::abs(a[j][i] - a[j - 1][i - 1]));
      if (e < error_of_row) {
        error_of_row = e;
        of_row = a[j][i];
      }
      if (e <= error) {
        better = true;
        error = e;
        best = a[j][i];
        step = h;
        plain = a[0][i];
        least = noise_of_f / h;
      }
    }
    if (better) error_behind = none;
    if (!better && error_of_row < error_behind) {
      error_behind = error_of_row;
      behind = of_row;
    }
    const bool noise = i > 1 && std::abs(a[i][i] - a[i - 1][i - 1]) > 4 * error;
    if (noise && !better && error <= kConverged * std::abs(best)) break;
  }
  if (error_behind < none) error = std::max({error, error_behind, std::abs(behind - best)});
  Slope slope{best, std::max(error, least), best, best, step, plain};
  if (std::abs(apart) > kStays * std::abs(apart_before) && std::abs(apart) < std::abs(apart_before) / kStays &&
      std::abs(apart) > kTold * std::abs(best)) {
    slope.below -= 0.5 * apart;
    slope.above += 0.5 * apart;
    slope.error = std::max(slope.error, 0.5 * std::abs(apart));
  }
  return slope;
}

/// psi of the run, or over the cycle.
Simulation run_once(const Problem& problem, const std::vector<double>& rho) {
  return problem.cycle ? cycle_run(problem, rho) : simulate(problem, rho);
}

Problem of_tolerance(const Problem& problem, double rtol) {
  Problem p = problem;
  p.solver.set_rtol(rtol);
  return p;
}

/// Of psi's digits, what other steps would change.
double noise_of(const Problem& problem, const std::vector<double>& rho, double psi) {
  double changes = 0;
  try {
    const Unsaid another;
    changes = std::abs(psi - run_once(of_tolerance(problem, kLooserRun * problem.solver.rtol), rho).psi);
  } catch (const SolverError&) {
    // Nothing is known but the tolerance.
  }
  return std::max(kNoise * problem.solver.rtol * std::abs(psi), kNoiseOfLooser * changes);
}

/// What the slope over its least step changes by at the tolerance of `loose`; 0 where that has no result.
double change_by_tolerance(const Problem& loose, std::vector<double> rho, std::size_t j, const Slope& slope) {
  const double above = rho[j] + slope.step, below = rho[j] - slope.step;
  const auto psi = [&](double value) {
    rho[j] = value;
    return run_once(loose, rho).psi;
  };
  try {
    const Unsaid another;
    const double psi_above = psi(above), psi_below = psi(below);
    return std::abs((psi_above - psi_below) / (above - below) - slope.plain);
  } catch (const SolverError&) {
    return 0;
  }
}

GradientResult run_at(double rtol, const Problem& problem, const std::vector<double>& rho) {
  Problem tight = of_tolerance(problem, rtol);
  // Where there is a choice, CVODES: its psi is the smoother function of the parameters (index 1 on the five-bar: the
  // difference of the gradient 7e-10 instead of 1.2e-8, in a quarter of the time).
  if (tight.solver.integrator.empty() && find_formulation(tight.formulation).make_ode)
    tight.solver.integrator = "cvodes";
  GradientResult r(run_once(tight, rho));
  r.gradient.resize(rho.size());
  r.gradient_error.resize(rho.size());
  const double noise = rho.empty() ? 0 : noise_of(tight, rho, r.psi);
  const Problem loose = of_tolerance(tight, kLooserRun * rtol);
  std::vector<Counters> spent(rho.size());
  std::vector<Slope> slopes(rho.size());
  for_each_job(rho.size(), jobs(), [&](std::size_t j) {
    const auto psi = [&](double value) {
      std::vector<double> x = rho;
      x[j] = value;
      const Simulation at = run_once(tight, x);
      spent[j] += at.counters;
      return at.psi;
    };
    const double scale = rho[j] != 0 ? std::abs(rho[j]) : problem.parameters.parameters[j].scale;
    slopes[j] = extrapolated_slope(psi, r.psi, rho[j], kFirstStep * scale, noise);
    r.gradient[j] = slopes[j].value;
    r.gradient_error[j] = std::max(slopes[j].error, kOfLooserSlope * change_by_tolerance(loose, rho, j, slopes[j]));
  });
  for (std::size_t j = 0; j < rho.size(); ++j)
    if (slopes[j].below != slopes[j].above)
      notice(
          fmt::format("psi has another slope on either side of parameter '{}': {:.6g} below, {:.6g} above. What is "
                      "given is their mean.",
                      problem.parameters.parameters[j].name, slopes[j].below, slopes[j].above));
  for (const Counters& c : spent) r.counters += c;
  return r;
}

GradientResult run_differences(const Problem& problem, const std::vector<double>& rho) {
  // A formulation whose rounding errors are above such a tolerance is asked for less, ten times at a time; the estimate
  // of the error shows what that costs.
  for (double rtol = std::max(kTightestDifferences, std::min(1e-12, problem.solver.rtol * 1e-3));; rtol *= 10) try {
      return run_at(rtol, problem, rho);
    } catch (const SolverError&) {
      if (rtol * 10 > problem.solver.rtol) throw;
    }
}

const RegisterSensitivityMethod differences_registered({
    .name = "differences",
    .summary = "Richardson-extrapolated central differences of whole runs (an oracle)",
    .needs = SensitivityMethod::Needs::either,
    .gradient = run_differences,
    .perturbs = true,
});

}  // namespace
}  // namespace costate
