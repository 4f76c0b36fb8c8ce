// What multipliers do within a step along a branch of cycles.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/cycle/branch_follower.h"
#include "costate/cycle/multipliers.h"

namespace costate {

namespace {

using Eigen::MatrixXd;

constexpr int kBisections = 60;
// Where a multiplier crosses is located to this part of the step that it was seen in.
constexpr double kLocated = 1e-9;
// Where no cycle is found in the middle (at a branch point Newton's matrix is singular) these parts are tried.
constexpr double kAside[] = {0.5, 0.4, 0.6, 0.25, 0.75, 0.1, 0.9};
// How fast a multiplier crosses is told by one this part of the step further on, and how well it is known by runs at
// these parts of the tolerance, the first with which there are any. Errors at least halve in a decade, so that what is
// left is no more than this many times what changes.
constexpr double kFurther = 0.01, kOtherTolerances[] = {0.1, 10}, kOfChange = 2;

/// With the multiplier that is the nearest to where it crosses.
template <class Critical>
Bifurcation bifurcation_at(const BranchPoint& point, BifurcationKind kind, const Critical& critical) {
  Bifurcation f;
  f.kind = kind;
  f.at = point;
  double nearest = std::numeric_limits<double>::infinity();
  for (const auto& m : point.multipliers)
    if (critical(m) < nearest) nearest = critical(m), f.multiplier = m;
  return f;
}

}  // namespace

OutsideCircle OutsideCircle::of(const std::vector<std::complex<double>>& multipliers, double radius) {
  OutsideCircle o;
  for (const auto& m : multipliers) {
    if (m.imag() == 0) {
      o.above += m.real() > radius;
      o.below += m.real() < -radius;
    } else if (m.imag() > 0) {
      o.pairs += std::abs(m) > radius;
    }
  }
  return o;
}

OutsideCircle OutsideCircle::of(const BranchPoint& point, const OutsideCircle& before) {
  const OutsideCircle certain = of(point.multipliers, 1 + point.undecided),
                      perhaps = of(point.multipliers, 1 - point.undecided);
  const auto settled = [](int was, int from, int to) { return std::clamp(was, from, std::max(from, to)); };
  return {settled(before.above, certain.above, perhaps.above), settled(before.below, certain.below, perhaps.below),
          settled(before.pairs, certain.pairs, perhaps.pairs)};
}

std::pair<BranchFollower::Node, BranchFollower::Node> BranchFollower::locate(const Node& from, const Node& to,
                                                                             double step, const Beyond& beyond) {
  double near_by = 0, far_by = step;
  Node near_node = from, far_node = to;
  for (int i = 0; i < kBisections && far_by - near_by > kLocated * step; ++i) {
    double by = 0;
    std::optional<Node> n;
    for (const double part : kAside) {
      by = near_by + part * (far_by - near_by);
      int corrections = 0;
      n = advance(from, by, &corrections);
      if (n) break;
    }
    if (!n) break;
    const bool there = beyond(*n);
    (there ? far_by : near_by) = by;
    (there ? far_node : near_node) = std::move(*n);
  }
  return {std::move(near_node), std::move(far_node)};
}

std::optional<BranchFollower::Node> BranchFollower::solved_anew(const Node& node, double part, MatrixXd& A) {
  const SolverOptions own = problem_.solver;
  problem_.solver.set_rtol(part * own.rtol);
  int corrections = 0;
  std::optional<Node> other = advance(node, 0, &corrections);
  if (other) A = evaluate(*other);
  problem_.solver = own;
  return other;
}

/// How far from where it was found to cross, within a step, the multiplier m may do so. With m known to dm, and
/// dm/ds along the branch, it crosses within ds = dm/(dm/ds), and the parameter is p' ds from there; p itself, which
/// at a fold does not change along the branch, has errors of its own.
double BranchFollower::error_of_crossing(const Node& found, const std::complex<double>& m, double step,
                                         const Critical& critical) {
  double dm = undecided_, dp = 0;
  Node same = found;
  MatrixXd A, other_A;
  for (const double part : kOtherTolerances) try {
      A = evaluate(same);
      const std::optional<Node> other = solved_anew(found, part, other_A);
      if (!other) continue;
      const MatrixXd one = MatrixXd::Identity(k_, k_);
      dm = kOfChange * multiplier_error(one - A.leftCols(k_), one - other_A.leftCols(k_), m);
      dp = kOfChange * std::abs(other->point.parameter - found.point.parameter);
      break;
    } catch (const SolverError&) {
    }
  int corrections = 0;
  double ds = step, turn = 0;
  const double further = kFurther * step;
  if (const std::optional<Node> beyond = advance(found, further, &corrections)) {
    double moved = std::numeric_limits<double>::infinity();
    for (const auto& next : beyond->point.multipliers) moved = std::min(moved, critical(next));
    // Where bisection ended early (at a branch point), what was found has not crossed exactly, either.
    const double off = critical(m);
    if (moved > off) ds = std::min(step, (dm + off) * further / (moved - off));
    turn = std::abs(beyond->tangent[k_] - found.tangent[k_]) / further;
  }
  return dp + scale_[k_] * (std::abs(found.tangent[k_]) + turn * ds) * ds;
}

void BranchFollower::look_for_turn(const Node& a, const Node& b, double step, std::vector<Bifurcation>& found) {
  const auto [near_node, far_node] =
      locate(a, b, step, [&](const Node& at) { return at.tangent[k_] * b.tangent[k_] > 0; });
  Bifurcation f =
      bifurcation_at(far_node.point, BifurcationKind::branch_point, [](const auto& m) { return std::abs(m - 1.0); });
  // The parameter itself has no slope there.
  f.parameter_error = std::max(std::abs(far_node.point.parameter - near_node.point.parameter),
                               kBranchRuns * problem_.solver.rtol * std::abs(f.at.parameter));
  MatrixXd A;
  for (const double part : kOtherTolerances) try {
      const std::optional<Node> other = solved_anew(far_node, part, A);
      if (!other) continue;
      f.parameter_error = std::max(f.parameter_error, kOfChange * std::abs(other->point.parameter - f.at.parameter));
      break;
    } catch (const SolverError&) {
    }
  found.push_back(std::move(f));
}

void BranchFollower::look_for_bifurcations(const Node& a, const Node& b, double step, std::vector<Bifurcation>& found) {
  const OutsideCircle &x = a.counted, &y = b.counted;
  const auto add = [&](BifurcationKind kind, const auto& count, const auto& critical) {
    const int before = count(x);
    const auto strictly = [&](const Node& at) { return count(OutsideCircle::of(at.point.multipliers, 1)); };
    const bool in_step = strictly(a) == before && strictly(b) == count(y);
    const auto crossed = [&](const Node& at) {
      return (in_step ? strictly(at) : count(OutsideCircle::of(at.point, x))) != before;
    };
    const auto [near_node, far_node] = locate(a, b, step, crossed);
    Bifurcation f = bifurcation_at(far_node.point, kind, critical);
    // Besides, runs are known to some tolerances.
    f.parameter_error = std::max({0.5 * std::abs(far_node.point.parameter - near_node.point.parameter),
                                  kBranchRuns * problem_.solver.rtol * std::abs(f.at.parameter),
                                  error_of_crossing(far_node, f.multiplier, step, critical)});
    if (kind == BifurcationKind::fold && a.tangent[k_] * b.tangent[k_] > 0) f.kind = BifurcationKind::branch_point;
    found.push_back(std::move(f));
  };
  if (x.above != y.above)
    add(
        BifurcationKind::fold, [](const OutsideCircle& o) { return o.above; },
        [](const std::complex<double>& m) { return std::abs(m - 1.0); });
  else if (a.tangent[k_] * b.tangent[k_] < 0)
    look_for_turn(a, b, step, found);
  if (x.below != y.below)
    add(
        BifurcationKind::flip, [](const OutsideCircle& o) { return o.below; },
        [](const std::complex<double>& m) { return std::abs(m + 1.0); });
  // A pair that becomes two real numbers outside the circle has crossed nothing.
  if (x.pairs != y.pairs && x.above == y.above && x.below == y.below)
    add(
        BifurcationKind::neimark_sacker, [](const OutsideCircle& o) { return o.pairs; },
        [](const std::complex<double>& m) { return m.imag() > 0 ? std::abs(std::abs(m) - 1) : HUGE_VAL; });
}

}  // namespace costate
