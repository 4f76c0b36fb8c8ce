// A branch of limit cycles along one parameter, by pseudo-arclength: with u = (x, p), scaled, a step predicts along the
// branch's tangent t and corrects by Newton's method on
//   x - P(x, p) = 0,   t^T (u - u_predicted) = 0,
// which is regular where the branch turns back. Along it multipliers cross the unit circle at +1 (a fold where the
// parameter turns, otherwise a branch point), at -1 (a flip: cycles of twice the period), or as a pair (Neimark-Sacker:
// motions with two frequencies); where they do is found by bisection of the step. What is as near to the circle as runs
// may be off by, as all multipliers of motions that conserve, has not crossed it.
// Source: R. Seydel, Practical Bifurcation and Stability Analysis, 3rd ed., Springer 2010, chapters 4 and 7.
#pragma once

#include <Eigen/Core>
#include <complex>
#include <optional>
#include <string>
#include <vector>

#include "costate/cycle/cycle.h"

namespace costate {

struct BranchPoint {
  double parameter = 0;
  Eigen::VectorXd x;                              // of the section's coordinates
  double period = 0, travel = 0, psi = 0;         // s, m, cost
  std::vector<std::complex<double>> multipliers;  // largest modulus first
  double residual = 0;                            // |P(x) - x|, the largest entry in tolerances
  double undecided = 0;                           // as near to 1 as this a multiplier tells nothing of stability

  double speed() const { return travel / period; }
  /// None where the largest multiplier is as near to 1 as it may be off by, as that of the cycle where the branch was
  /// begun.
  std::optional<bool> stable() const;
};

enum class BifurcationKind { fold, branch_point, flip, neimark_sacker };
const char* name_of(BifurcationKind kind);

struct Bifurcation {
  BifurcationKind kind = BifurcationKind::fold;
  BranchPoint at;
  std::complex<double> multiplier;  // the one that crosses
  double parameter_error = 0;       // of the parameter: where it crosses, to what runs tell of the multiplier
};

struct BranchOptions {
  double from = 0, to = 0;  // of the parameter
  int max_points = 300;     // in either direction
  std::function<void(const BranchPoint& point)> progress;
};

struct Branch {
  std::vector<std::string> names, units;  // of the section's coordinates
  std::vector<BranchPoint> points;        // along the branch, through the cycle that it was begun with
  std::vector<Bifurcation> bifurcations;  // along the branch
  std::string ended_first, ended_last;    // why it goes no further at its two ends
  std::size_t first = 0;                  // the point that it was begun with
  int interrupted = 0;                    // by this signal, which ended it where it was then
  Counters counters;
};

/// The problem's only parameter is the one that is followed; `rho` is where a cycle is looked for first, within
/// from .. to. Throws as find_cycle does where there is none.
Branch follow_cycles(const Problem& problem, const CycleSettings& settings, const std::vector<double>& rho,
                     const BranchOptions& options);

}  // namespace costate
