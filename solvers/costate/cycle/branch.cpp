#include "costate/cycle/branch.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/stop.h"
#include "costate/cycle/branch_follower.h"
#include "costate/cycle/cycle_rest.h"
#include "costate/cycle/cycle_values.h"
#include "costate/cycle/multipliers.h"
#include "costate/record/interrupt.h"

namespace costate {

namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kCorrections = 12, kFew = 4;
// Steps in u, whose parameter counts by the range that is followed.
constexpr double kFirstStep = 0.02, kLongest = 0.05, kShortest = 1e-7;
// Largest residual that counts as a cycle, in tolerances, as find_cycle's.
constexpr double kAccepted = 1e3;
// A step may turn the tangent by no more than acos of this.
constexpr double kTurn = 0.9;
// Of the range: a point that is as near to its end as that is there.
constexpr double kAtTheEnd = 1e-9;

}  // namespace

BranchFollower::BranchFollower(const Problem& problem, const CycleSettings& settings, const std::vector<double>& rho,
                               const BranchOptions& options)
    : problem_(problem), options_(options), may_rest_(settings.period_s.has_value()), start_(problem, settings, rho) {
  CycleOptions search;
  search.derivatives = false;
  const CycleResult r = find_cycle(problem, settings, rho, search);
  undecided_ = std::max(r.undecided, kBranchRuns * problem.solver.rtol);
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
  node.counted = OutsideCircle::of(node.point, {});
  first_ = std::move(node);
}

Branch BranchFollower::run() {
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

VectorXd BranchFollower::x_of(const VectorXd& u) const {
  VectorXd x = whole_;
  const auto& free = section().free();
  for (Eigen::Index i = 0; i < k_; ++i) x[free[static_cast<std::size_t>(i)]] = u[i] * scale_[i];
  return x;
}

MatrixXd BranchFollower::evaluate(Node& node) {
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

VectorXd BranchFollower::tangent_of(const MatrixXd& A) const {
  if (k_ == 0) return VectorXd::Ones(1);
  const Eigen::JacobiSVD<MatrixXd> svd(A, Eigen::ComputeFullV);
  return svd.matrixV().col(k_);
}

std::optional<BranchFollower::Node> BranchFollower::advance(const Node& from, double step, int* corrections) {
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

bool BranchFollower::is_rest(const Node& node) const {
  const ReturnMap map(without_cycle_cost(problem_), section(), {node.point.parameter});
  return rests(map, start_, node.point.x, node.positions, node.point.period);
}

std::string BranchFollower::walk(int direction, std::vector<Node>& nodes, std::vector<Bifurcation>& found) {
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
        return why_.empty() ? "no cycle was found any further along" : "no cycle was found any further along: " + why_;
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
      if (std::abs(at.point.parameter - bound) <= kAtTheEnd * scale_[k_]) return "the end of the range";
    }
    if (!may_rest_ && is_rest(*next))
      return fmt::format("the motion comes to rest: near {:.6g} the cycles shrink to an equilibrium, which goes on",
                         next->point.parameter);
    next->counted = OutsideCircle::of(next->point, at.counted);
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

Branch follow_cycles(const Problem& problem, const CycleSettings& settings, const std::vector<double>& rho,
                     const BranchOptions& options) {
  if (rho.size() != 1) throw Error("A branch is followed along one parameter.");
  if (!(std::isfinite(options.from) && std::isfinite(options.to)) || options.from == options.to)
    throw Error("A branch is followed between two different finite values of its parameter.");
  return BranchFollower(problem, settings, rho, options).run();
}

}  // namespace costate
