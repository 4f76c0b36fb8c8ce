// Of mechanisms that begin with redundant rows: whether a formulation carries them, and whether the constraints lose
// rank where a single row comes to depend on the others. Among redundant rows that may be the choice of those that
// count.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "costate/analysis/motion_watch.h"
#include "costate/base/error.h"
#include "costate/linear/to_dense.h"

namespace costate {

namespace {
// Of the row scaled to 1: as `check` and the start have it; and below which it is redundant in the watch.
constexpr double kWatchedRankTolerance = 1e-9, kRedundant = 1e-6;
// Singular values that count: positions between steps, and drift, leave a redundant row up to this.
constexpr double kCounts = 1e-4;
// Beyond so many rows singular values take longer than they are worth.
constexpr int kMostForRank = 600;
// Of the rank's smallest singular value beside a place, what is left of it there where nothing is lost.
constexpr double kLeftOfRank = 0.5;
}  // namespace

void MotionWatch::refuse_dependent_rows(double t) {
  if (settings_.carries_redundancy) return;
  // The same rows, at full accuracy: each against all before it.
  const Eigen::MatrixXd A = to_dense(assembly_.jacobian(), scaled_.data()).transpose();
  std::vector<std::string> names;
  double nearest = 1;
  for (Eigen::Index i = 0; i < A.cols(); ++i) {
    if (!redundant_[static_cast<std::size_t>(i)]) continue;
    Eigen::MatrixXd others(A.rows(), A.cols() - 1);
    for (Eigen::Index k = 0, at = 0; k < A.cols(); ++k)
      if (k != i) others.col(at++) = A.col(k);
    Eigen::VectorXd rest = A.col(i);
    if (others.cols() > 0) rest -= others * others.completeOrthogonalDecomposition().solve(A.col(i));
    names.push_back(rows_[static_cast<std::size_t>(i)]);
    nearest = std::min(nearest, rest.norm());
  }
  if (nearest < std::max(kWatchedRankTolerance, settings_.rtol))
    throw SolverError(fmt::format(
        "At t = {:.9g} s {} of {} constraint rows depend on the others, to within {:.1e} of 1 ({}), so that "
        "formulation '{}' "
        "does not determine the accelerations. Remove what is redundant, or take a formulation that carries it: "
        "augmented-lagrangian, penalty or maggi.",
        t, names.size(), rows_.size(), nearest, fmt::join(names, ", "), settings_.formulation));
  if (nearest > kRedundant) return;
  near_dependent_.push_back(
      fmt::format("At t = {:.9g} s constraint rows depend on the others to within {:.1e} of 1 ({}): accelerations and "
                  "reactions are "
                  "known to as many digits less.",
                  t, nearest, fmt::join(names, ", ")));
}

Eigen::VectorXd MotionWatch::singular_values() const {
  return Eigen::BDCSVD<Eigen::MatrixXd>(to_dense(assembly_.jacobian(), scaled_.data())).singularValues();
}

int MotionWatch::rank_of(const Eigen::VectorXd& singular) {
  return static_cast<int>((singular.array() > kCounts).count());
}

int MotionWatch::first_rank() {
  if (first_rank_ >= 0) return first_rank_;
  const std::vector<double> at_rest(first_.q.size(), 0.0);
  StateView s;
  s.t = first_.t;
  s.q = first_.q.data();
  s.v = at_rest.data();
  assembly_.calc_constraints(s);
  calc_distances(distances_);
  return first_rank_ = rank_of(singular_values());
}

bool MotionWatch::rank_has_risen(double t) {
  if (assembly_.m() > kMostForRank) return true;
  const int first = first_rank();
  calc_distances_at(t);
  return rank_of(singular_values()) > first;
}

bool MotionWatch::rank_falls(double from, double at, double to) {
  if (!began_redundant_ || assembly_.m() > kMostForRank) return true;
  const auto values = [&](double t) {
    calc_distances_at(t);
    return singular_values();
  };
  const Eigen::VectorXd before = values(from), here = values(at), behind = values(to);
  const int rank = std::max({rank_of(before), rank_of(behind), first_rank()});
  if (rank == 0) return true;
  return here[rank - 1] < std::max(rank_limit_, kLeftOfRank * std::min(before[rank - 1], behind[rank - 1]));
}

}  // namespace costate
