#include "costate/cycle/branch.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/stop.h"
#include "costate/cycle/cycle_rest.h"
#include "costate/cycle/cycle_start.h"
#include "costate/cycle/cycle_values.h"
#include "costate/cycle/multipliers.h"
#include "costate/record/interrupt.h"

namespace costate {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kCorrections = 12, kFew = 4, kBisections = 60;
// Steps in u, whose parameter counts by the range that is followed.
constexpr double kFirstStep = 0.02, kLongest = 0.05, kShortest = 1e-7;
// Largest residual that counts as a cycle, in tolerances, as find_cycle's.
constexpr double kAccepted = 1e3;
// A step may turn the tangent by no more than acos of this.
constexpr double kTurn = 0.9;
// Where a multiplier crosses is located to this part of the step that it was seen in.
constexpr double kLocated = 1e-9;
// How fast a multiplier crosses is told by one this part of the step further on, and how well it is known by runs at
// these parts of the tolerance, the first with which there are any. Errors at least halve in a decade, so that what is
// left is no more than this many times what changes.
constexpr double kFurther = 0.01, kOtherTolerances[] = {0.1, 10}, kOfChange = 2;
// What errors of runs at rtol make of a multiplier, and of the parameter where it crosses, at least: of a branch that
// conserves, moduli were off by 0.2 to 15 rtol.
constexpr double kRuns = 100;

/// How many multipliers of a kind are outside a circle about the unit circle.
struct Outside {
  int above = 0, below = 0, pairs = 0;
};

Outside outside(const std::vector<std::complex<double>>& multipliers, double radius) {
  Outside o;
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

/// Those outside, of which what is undecided stays where it was.
Outside outside(const BranchPoint& point, const Outside& before) {
  const Outside certain = outside(point.multipliers, 1 + point.undecided),
                perhaps = outside(point.multipliers, 1 - point.undecided);
  const auto settled = [](int was, int from, int to) { return std::clamp(was, from, std::max(from, to)); };
  return {settled(before.above, certain.above, perhaps.above), settled(before.below, certain.below, perhaps.below),
          settled(before.pairs, certain.pairs, perhaps.pairs)};
}

/// A cycle and the branch's direction there.
struct Node {
  BranchPoint point;
  VectorXd u, tangent;
  std::vector<double> positions;
  Outside counted;
};

class Follower {
 public:
  Follower(const Problem& problem, const CycleSettings& settings, const std::vector<double>& rho,
           const BranchOptions& options)
      : problem_(problem), options_(options), may_rest_(settings.period_s.has_value()), start_(problem, settings, rho) {
    CycleOptions search;
    search.derivatives = false;
    const CycleResult r = find_cycle(problem, settings, rho, search);
    undecided_ = std::max(r.undecided, kRuns * problem.solver.rtol);
    branch_.counters += r.counters;
    branch_.names = r.names;
    branch_.units = r.units;
    const auto& free = section().free();
    k_ = static_cast<Eigen::Index>(free.size());
    scale_.resize(k_ + 1);
    const double largest = k_ > 0 ? r.x(free).cwiseAbs().maxCoeff() : 1;
    for (Eigen::Index i = 0; i < k_; ++i)
      scale_[i] = std::max(std::abs(r.x[free[static_cast<std::size_t>(i)]]), 0.1 * std::max(largest, 1e-9));
    scale_[k_] = std::abs(options.to - options.from);
    whole_ = r.x;
    Node node;
    node.u.resize(k_ + 1);
    for (Eigen::Index i = 0; i < k_; ++i) node.u[i] = r.x[free[static_cast<std::size_t>(i)]] / scale_[i];
    node.u[k_] = rho[0] / scale_[k_];
    node.positions = r.positions;
    const MatrixXd A = evaluate(node);
    node.tangent = tangent_of(A);
    node.counted = outside(node.point, {});
    first_ = std::move(node);
  }

  Branch run() {
    std::vector<Node> up, down;
    std::vector<Bifurcation> above, below;
    branch_.ended_first = "it was not followed";
    try {
      branch_.ended_last = "it was interrupted";
      branch_.ended_last = walk(1, up, above);
      branch_.ended_first = "it was interrupted";
      branch_.ended_first = walk(-1, down, below);
    } catch (const Interrupted& e) {
      branch_.interrupted = e.signal_number();
    }
    for (auto n = down.rbegin(); n != down.rend(); ++n) branch_.points.push_back(n->point);
    branch_.first = branch_.points.size();
    branch_.points.push_back(first_.point);
    for (const auto& n : up) branch_.points.push_back(n.point);
    branch_.bifurcations.assign(below.rbegin(), below.rend());
    branch_.bifurcations.insert(branch_.bifurcations.end(), above.begin(), above.end());
    return std::move(branch_);
  }

 private:
  const Section& section() const { return start_.section(); }

  VectorXd x_of(const VectorXd& u) const {
    VectorXd x = whole_;
    const auto& free = section().free();
    for (Eigen::Index i = 0; i < k_; ++i) x[free[static_cast<std::size_t>(i)]] = u[i] * scale_[i];
    return x;
  }

  /// The return from u: fills the node's point and what the residual is, and gives d(x - P)/du, scaled.
  MatrixXd evaluate(Node& node) {
    check_stop();
    const double p = node.u[k_] * scale_[k_];
    ReturnMap map(without_cycle_cost(problem_), section(), {p});
    VectorXd x = x_of(node.u);
    map.onto_section(x, node.positions);
    const auto& free = section().free();
    for (Eigen::Index i = 0; i < k_; ++i) node.u[i] = x[free[static_cast<std::size_t>(i)]] / scale_[i];
    const MapValue v = map.evaluate(x, node.positions, MapDerivatives::all);
    branch_.counters += v.counters;
    BranchPoint& b = node.point;
    b.parameter = p;
    b.x = x;
    b.period = v.time;
    b.travel = v.travel;
    b.psi = has_cycle_values(problem_) ? std::nan("") : v.psi;
    const MatrixXd P = v.next_x(free, free);
    b.multipliers = multipliers_of(P, section().trivial_multipliers());
    b.undecided = undecided_;
    b.residual = 0;
    residual_.resize(k_);
    const SolverOptions& s = problem_.solver;
    for (Eigen::Index i = 0; i < k_; ++i) {
      const int j = free[static_cast<std::size_t>(i)];
      residual_[i] = (x[j] - v.next[j]) / scale_[i];
      b.residual = std::max(b.residual, std::abs(x[j] - v.next[j]) / (s.rtol * std::abs(x[j]) + s.absolute()));
    }
    node.positions = v.positions;
    MatrixXd A(k_, k_ + 1);
    A.leftCols(k_) = MatrixXd::Identity(k_, k_) - P;
    A.col(k_) = -v.next_rho(free, 0);
    for (Eigen::Index j = 0; j <= k_; ++j) A.col(j) *= scale_[j];
    for (Eigen::Index i = 0; i < k_; ++i) A.row(i) /= scale_[i];
    return A;
  }

  VectorXd tangent_of(const MatrixXd& A) const {
    if (k_ == 0) return VectorXd::Ones(1);
    const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeFullV);
    return svd.matrixV().col(k_);
  }

  /// From a node along its tangent by `step`; none where no cycle is found there.
  std::optional<Node> advance(const Node& from, double step, int* corrections) {
    Node node;
    node.positions = from.positions;
    node.u = from.u + step * from.tangent;
    const VectorXd predicted = node.u;
    double before = std::numeric_limits<double>::infinity();
    try {
      for (int i = 0; i < kCorrections; ++i) {
        const MatrixXd A = evaluate(node);
        *corrections = i;
        if (!std::isfinite(node.point.residual)) return {};
        const bool stands = node.point.residual <= 1 || (i > 0 && node.point.residual > 0.3 * before);
        if (stands && node.point.residual <= kAccepted) {
          node.tangent = tangent_of(A);
          const double turn = node.tangent.dot(from.tangent);
          if (turn < 0) node.tangent = -node.tangent;
          if (std::abs(turn) < kTurn && std::abs(step) > 10 * kShortest) return {};
          return node;
        }
        if (stands && i > 2) return {};
        before = node.point.residual;
        MatrixXd J(k_ + 1, k_ + 1);
        J.topRows(k_) = A;
        J.row(k_) = from.tangent.transpose();
        VectorXd r(k_ + 1);
        r.head(k_) = residual_;
        r[k_] = from.tangent.dot(node.u - predicted);
        node.u -= J.partialPivLu().solve(r);
      }
    } catch (const SolverError& e) {
      why_ = e.what();
    } catch (const ModelError& e) {
      why_ = e.bare_message();
    }
    return {};
  }

  /// Whether the branch has come to an equilibrium, which a section is met by as well.
  bool is_rest(const Node& node) const {
    const ReturnMap map(without_cycle_cost(problem_), section(), {node.point.parameter});
    return rests(map, start_, node.point.x, node.positions, node.point.period);
  }

  /// Until the parameter leaves its range; returns why it ended.
  std::string walk(int direction, std::vector<Node>& nodes, std::vector<Bifurcation>& found) {
    const double low = std::min(options_.from, options_.to), high = std::max(options_.from, options_.to);
    Node at = first_;
    if (at.tangent[k_] * direction < 0) at.tangent = -at.tangent;
    double step = kFirstStep;
    for (int count = 0; count < options_.max_points;) {
      int corrections = 0;
      why_.clear();
      std::optional<Node> next = advance(at, step, &corrections);
      if (!next) {
        step /= 2;
        if (step < kShortest)
          return why_.empty() ? "no cycle was found any further along"
                              : "no cycle was found any further along: " + why_;
        continue;
      }
      const bool out = next->point.parameter > high || next->point.parameter < low;
      if (out) {
        const double bound = next->point.parameter > high ? high : low;
        const auto beyond = [&](const Node& n) {
          return bound == high ? n.point.parameter > high : n.point.parameter < low;
        };
        next = locate(at, *next, at.tangent.dot(next->u - at.u), beyond).first;
        next->point.parameter = bound;
        if (std::abs(at.point.parameter - bound) <= kLocated * scale_[k_]) return "the end of the range";
      }
      if (!may_rest_ && is_rest(*next))
        return fmt::format("the motion comes to rest: near {:.6g} the cycles shrink to an equilibrium, which goes on",
                           next->point.parameter);
      next->counted = outside(next->point, at.counted);
      look_for_bifurcations(at, *next, at.tangent.dot(next->u - at.u), found);
      if (options_.progress) options_.progress(next->point);
      nodes.push_back(*next);
      at = std::move(*next);
      ++count;
      if (out) return "the end of the range";
      // Entries of x may have grown since they were scaled.
      if (corrections <= kFew) step = std::min(1.5 * step, kLongest * std::max(1.0, at.u.head(k_).norm()));
    }
    return fmt::format("the limit of {} points", options_.max_points);
  }

  /// The two ends of the shortest part of a step within which `beyond` becomes true, by bisection.
  template <class Beyond>
  std::pair<Node, Node> locate(const Node& from, const Node& to, double step, const Beyond& beyond) {
    double near_by = 0, far_by = step;
    Node near_node = from, far_node = to;
    for (int i = 0; i < kBisections && far_by - near_by > kLocated * step; ++i) {
      const double by = 0.5 * (near_by + far_by);
      int corrections = 0;
      std::optional<Node> n = advance(from, by, &corrections);
      if (!n) break;  // at a branch point Newton's matrix is singular
      const bool there = beyond(*n);
      (there ? far_by : near_by) = by;
      (there ? far_node : near_node) = std::move(*n);
    }
    return {std::move(near_node), std::move(far_node)};
  }

  /// The node at another tolerance, and A there.
  std::optional<Node> solved_anew(const Node& node, double part, MatrixXd& A) {
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
  template <class Critical>
  double error_of_crossing(const Node& found, const std::complex<double>& m, double step, const Critical& critical) {
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

  void look_for_bifurcations(const Node& a, const Node& b, double step, std::vector<Bifurcation>& found) {
    const Outside &x = a.counted, &y = b.counted;
    const auto add = [&](BifurcationKind kind, const auto& count, const auto& critical) {
      const int before = count(x);
      const auto strictly = [&](const Node& at) { return count(outside(at.point.multipliers, 1)); };
      const bool in_step = strictly(a) == before && strictly(b) == count(y);
      const auto crossed = [&](const Node& at) {
        return (in_step ? strictly(at) : count(outside(at.point, x))) != before;
      };
      const auto [near_node, far_node] = locate(a, b, step, crossed);
      Bifurcation f;
      f.kind = kind;
      f.at = far_node.point;
      double nearest = std::numeric_limits<double>::infinity();
      for (const auto& m : f.at.multipliers)
        if (critical(m) < nearest) nearest = critical(m), f.multiplier = m;
      // Besides, runs are known to some tolerances.
      f.parameter_error = std::max({0.5 * std::abs(far_node.point.parameter - near_node.point.parameter),
                                    kRuns * problem_.solver.rtol * std::abs(f.at.parameter),
                                    error_of_crossing(far_node, f.multiplier, step, critical)});
      if (kind == BifurcationKind::fold && a.tangent[k_] * b.tangent[k_] > 0) f.kind = BifurcationKind::branch_point;
      found.push_back(std::move(f));
    };
    if (x.above != y.above)
      add(
          BifurcationKind::fold, [](const Outside& o) { return o.above; },
          [](const std::complex<double>& m) { return std::abs(m - 1.0); });
    if (x.below != y.below)
      add(
          BifurcationKind::flip, [](const Outside& o) { return o.below; },
          [](const std::complex<double>& m) { return std::abs(m + 1.0); });
    // A pair that becomes two real numbers outside the circle has crossed nothing.
    if (x.pairs != y.pairs && x.above == y.above && x.below == y.below)
      add(
          BifurcationKind::neimark_sacker, [](const Outside& o) { return o.pairs; },
          [](const std::complex<double>& m) { return m.imag() > 0 ? std::abs(std::abs(m) - 1) : HUGE_VAL; });
  }

  Problem problem_;
  const BranchOptions& options_;
  bool may_rest_;  // over a period given an equilibrium repeats itself as well
  CycleStart start_;
  Branch branch_;
  Eigen::Index k_ = 0;
  double undecided_ = 0;
  VectorXd scale_, whole_, residual_;
  Node first_;
  std::string why_;
};

}  // namespace

Branch follow_cycles(const Problem& problem, const CycleSettings& settings, const std::vector<double>& rho,
                     const BranchOptions& options) {
  if (rho.size() != 1) throw Error("A branch is followed along one parameter.");
  if (!(std::isfinite(options.from) && std::isfinite(options.to)) || options.from == options.to)
    throw Error("A branch is followed between two different finite values of its parameter.");
  return Follower(problem, settings, rho, options).run();
}

}  // namespace costate
