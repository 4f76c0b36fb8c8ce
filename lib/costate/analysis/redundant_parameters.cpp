#include "costate/analysis/redundant_parameters.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "costate/analysis/closing_path.h"
#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/linear/to_dense.h"

namespace costate {

namespace {
// Of what a parameter changes the rows by: what redundant rows may leave of it, for start errors and rounding.
constexpr double kLeft = 1e-6;
// Beyond so many rows a dense factorization takes longer than a run, some of them beyond kManyRows, and some tens
// beyond kFewRows.
constexpr int kMostRows = 1500, kManyRows = 500, kFewRows = 150;
constexpr int kTimes = 16;              // looks between the start and the end
constexpr int kMostIterations = 40;     // of a way to positions
constexpr double kDependentOff = 1e-6;  // rows that depend on each other so nearly are one, off the positions
constexpr double kRankOn = 1e-9;        // on them, as find_start has it
constexpr double kIsClosed = 1e-13, kTooFar = 20, kLooksBeside = 0.2;  // as StepLength measures

/// Whether a parameter sets a number of a constraint: else there is nothing to solve a start for.
bool moves_constraints(const Assembly& assembly) {
  const auto& constraints = assembly.mechanism().constraints();
  return std::any_of(constraints.begin(), constraints.end(), [&](const auto& c) {
    return std::any_of(c->numbers().begin(), c->numbers().end(), [&](int number) {
      return !assembly.number_columns()[static_cast<std::size_t>(number)].empty();
    });
  });
}

/// What was looked at last and found to hold. What parameters move is a matter of their numbers, not of their values,
/// of which an optimization has many.
struct Looked {
  std::weak_ptr<const Mechanism> mechanism;
  std::vector<std::string> names;
  double t = 0, t_end = 0;
  bool is(const Looked& other) const {
    return mechanism.lock() && mechanism.lock() == other.mechanism.lock() && names == other.names && t == other.t &&
           t_end == other.t_end;
  }
};

/// Positions that meet the constraints, and what parameters do to them there.
class Positions {
 public:
  Positions(Assembly& assembly, const Start& start)
      : assembly_(assembly), start_(start), rest_(Eigen::VectorXd::Zero(assembly.n() + assembly.m())) {}

  /// The constraint Jacobian at q, of rows that hold positions, with Phi and the parameters' columns left in the
  /// assembly. A foot sticks where it is, wherever a parameter has it: its rows hold rates alone.
  const Eigen::MatrixXd& jacobian(double t, const Eigen::VectorXd& q) {
    StateView s = start_.state(t);
    s.q = q.data();
    s.v = s.a = rest_.data();
    s.lambda = rest_.data() + assembly_.n();
    assembly_.calc_dynamics(s);
    assembly_.calc_parameter_columns(s, columns_);
    phi_q_ = to_dense(assembly_.jacobian(), assembly_.phi_q.data());
    held_ = 0;
    all_changes_ = columns_.phi;
    for (int i = 0; i < assembly_.m(); ++i) {
      if (assembly_.is_there(i) && assembly_.holds_position(i)) {
        ++held_;
        continue;
      }
      phi_q_.row(i).setZero();
      columns_.phi.row(i).setZero();
      assembly_.phi[static_cast<std::size_t>(i)] = 0;
    }
    return phi_q_;
  }
  /// Leads q to the nearest positions at time t, by Newton steps of least norm. False where there are none near.
  bool close(double t, Eigen::VectorXd& q) {
    const StepLength length(assembly_, q);
    for (int i = 0; i < kMostIterations; ++i) {
      factors_.setThreshold(kDependentOff);
      factors_.compute(jacobian(t, q));
      const Eigen::VectorXd step =
          factors_.solve(Eigen::Map<const Eigen::VectorXd>(assembly_.phi.data(), assembly_.m()));
      if (!step.allFinite()) return false;
      q -= step;
      const double moved = length(step);
      if (moved > kTooFar) return false;
      if (moved < kIsClosed) return true;
    }
    return false;
  }

  /// Throws where redundant rows do not allow what a parameter does at q; returns whether any are redundant there.
  bool require(double t, const Eigen::VectorXd& q) {
    const Eigen::MatrixXd& phi_q = jacobian(t, q);
    factors_.setThreshold(kRankOn);
    factors_.compute(phi_q);
    if (factors_.rank() == held_) return false;
    const Eigen::MatrixXd& change = columns_.phi;
    if (change.isZero(0)) return true;
    const auto [j, row] = torn_parameter(all_changes_, change - phi_q * factors_.solve(change));
    if (j >= 0) refuse_torn_parameter(assembly_, j, row);
    return true;
  }

  /// What the rows leave free of d, where require() has looked last.
  Eigen::VectorXd free_part(const Eigen::VectorXd& d) const { return d - factors_.solve(phi_q_ * d); }

 private:
  Assembly& assembly_;
  const Start& start_;
  Eigen::VectorXd rest_;
  Assembly::ParameterColumns columns_;
  Eigen::MatrixXd phi_q_;        // of the last look
  Eigen::MatrixXd all_changes_;  // of rows that hold rates alone, too
  Eigen::Index held_ = 0;
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> factors_;
};

}  // namespace

std::pair<int, int> torn_parameter(const Eigen::MatrixXd& change, const Eigen::MatrixXd& left) {
  for (Eigen::Index j = 0; j < change.cols(); ++j) {
    Eigen::Index worst = 0;
    if (left.rows() > 0 && left.col(j).cwiseAbs().maxCoeff(&worst) > kLeft * change.col(j).cwiseAbs().maxCoeff())
      return {static_cast<int>(j), static_cast<int>(worst)};
  }
  return {-1, -1};
}

void refuse_torn_parameter(const Assembly& assembly, int j, int row) {
  const auto names = assembly.mechanism().row_names();
  const bool given = row >= static_cast<int>(names.size());  // a position that is held
  throw ModelError(
      "parameter",
      fmt::format("'{}' cannot vary alone: {} and others are redundant, and hold together only at "
                  "its present value. Let one parameter set all numbers that have to change together "
                  "('numbers' in [parameter.NAME]), or take the redundant constraint out.",
                  assembly.parameters().parameters[static_cast<std::size_t>(j)].name,
                  given ? "a given position" : fmt::format("row '{}'", names[static_cast<std::size_t>(row)])));
}

void require_compatible_parameters(Assembly& assembly, double t, double t_end) {
  const Mechanism& m = assembly.mechanism();
  const int n = assembly.n(), rows = assembly.m();
  const bool counted = !m.starts_at_equilibrium();  // then as many positions are given as are free
  if (rows == 0 || rows > kMostRows || !moves_constraints(assembly)) return;
  if (counted && rows + static_cast<int>(m.given_positions().size()) <= n) return;
  const Start start = find_start(assembly, t, false);
  Positions positions(assembly, start);
  if (!positions.require(t, start.q) || rows > kManyRows) return;
  thread_local Looked last;
  const Looked now{assembly.mechanism_ptr(), assembly.parameters().names(), t, t_end};
  if (now.is(last)) return;
  // Beside the start, along what the rows leave free: no place of the mechanism's own.
  const StepLength length(assembly, start.q);
  Eigen::VectorXd d(n);
  for (int i = 0; i < n; ++i) d[i] = std::cos(2.4 * i + 0.3) / std::max(length.weights()[i], 1e-300);
  d = positions.free_part(d);
  const double size = length(d);
  if (size > kIsClosed) {
    Eigen::VectorXd q = start.q + kLooksBeside / size * d;
    if (positions.close(t, q)) positions.require(t, q);
  }
  // Where the drivers lead.
  Eigen::VectorXd q = start.q;
  const int times = rows <= kFewRows ? kTimes : 0;
  for (int k = 1; k <= times; ++k) {
    const double at = t + (t_end - t) * (k - 0.382) / kTimes;
    if (!positions.close(at, q)) break;
    positions.require(at, q);
  }
  last = now;
}

}  // namespace costate
