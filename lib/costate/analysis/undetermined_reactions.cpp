#include "costate/analysis/undetermined_reactions.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/SparseQR>
#include <cmath>
#include <memory>
#include <utility>

#include "costate/analysis/start.h"
#include "costate/base/stop.h"
#include "costate/linear/least_squares.h"

namespace costate {

namespace {
// Of entries of N, which are of the size 1: positions are closed to some 1e-10, and rows depend on each other to that.
constexpr double kOpen = 1e-6;
constexpr std::size_t kNamed = 5;
}  // namespace

UndeterminedReactions::UndeterminedReactions(Assembly& assembly, double t, const Eigen::VectorXd& q,
                                             const Eigen::VectorXd& z)
    : assembly_(assembly), t_(t), q_(q), z_(z) {
  const auto m = static_cast<Eigen::Index>(assembly.m());
  N_.resize(m, 0);
  if (m == 0) return;
  const std::vector<int> dependent = constraint_rank(assembly, t, q.data()).dependent_rows;  // leaves phi_q there
  if (dependent.empty()) return;
  const SparsePattern& J = assembly.jacobian();
  row_size_ = Eigen::VectorXd::Zero(m);
  for (int j = 0; j < J.cols; ++j)
    for (auto k = J.column_start[j]; k < J.column_start[j + 1]; ++k)
      row_size_[J.row[k]] += assembly.phi_q[k] * assembly.phi_q[k];
  row_size_ = row_size_.cwiseSqrt();
  std::vector<Eigen::Index> column(static_cast<std::size_t>(m), 0), rows;
  for (const int d : dependent) column[static_cast<std::size_t>(d)] = -1;
  for (Eigen::Index i = 0; i < m; ++i)
    if (column[static_cast<std::size_t>(i)] == 0 && row_size_[i] > 0) {
      column[static_cast<std::size_t>(i)] = static_cast<Eigen::Index>(rows.size());
      rows.push_back(i);
    } else {
      column[static_cast<std::size_t>(i)] = -1;
    }
  Eigen::SparseMatrix<double> independent(assembly.n(), static_cast<Eigen::Index>(rows.size()));
  std::vector<Eigen::Triplet<double>> entries;
  std::vector<Eigen::VectorXd> right(static_cast<std::size_t>(m));
  for (const int d : dependent) right[static_cast<std::size_t>(d)] = Eigen::VectorXd::Zero(assembly.n());
  for (int j = 0; j < J.cols; ++j)
    for (auto k = J.column_start[j]; k < J.column_start[j + 1]; ++k) {
      const auto i = static_cast<std::size_t>(J.row[k]);
      if (!(row_size_[J.row[k]] > 0)) continue;
      const double x = assembly.phi_q[k] / row_size_[J.row[k]];
      if (right[i].size() > 0)
        right[i][j] = x;
      else if (column[i] >= 0)
        entries.emplace_back(j, static_cast<int>(column[i]), x);
    }
  independent.setFromTriplets(entries.begin(), entries.end());
  independent.makeCompressed();
  // A dependent row is a combination of the independent ones: a column of N.
  // Sparse orthogonal factors where LU factors leave a doubt: long, and not to be interrupted from within.
  LeastSquares least(independent);
  const bool surely = !rows.empty() && least.full_rank();
  using Factors = Eigen::SparseQR<Eigen::SparseMatrix<double>, Eigen::COLAMDOrdering<int>>;
  const auto qr = std::make_shared<Factors>();
  if (!surely) {
    const auto own = std::make_shared<Eigen::SparseMatrix<double>>(std::move(independent));
    run_stoppably([qr, own] { qr->compute(*own); });
  }
  N_.setZero(m, static_cast<Eigen::Index>(dependent.size()));
  for (std::size_t c = 0; c < dependent.size(); ++c) {
    check_stop();
    const int d = dependent[c];
    const Eigen::VectorXd& b = right[static_cast<std::size_t>(d)];
    const auto to = static_cast<Eigen::Index>(c);
    N_(d, to) = -1;
    if (rows.empty() || b.isZero(0)) continue;
    const Eigen::VectorXd x = surely ? Eigen::VectorXd(least.solve(b)) : Eigen::VectorXd(qr->solve(b));
    for (std::size_t i = 0; i < rows.size(); ++i) N_(rows[i], to) = x[static_cast<Eigen::Index>(i)];
  }
}

std::vector<std::string> UndeterminedReactions::rows() const {
  std::vector<std::string> names;
  const std::vector<std::string> all = assembly_.mechanism().row_names();
  for (Eigen::Index i = 0; i < N_.rows(); ++i)
    if (N_.cols() > 0 && N_.row(i).cwiseAbs().maxCoeff() > kOpen) names.push_back(all[static_cast<std::size_t>(i)]);
  return names;
}

template <class Add>
bool UndeterminedReactions::leaves_open_of(const Add& add) {
  if (none()) return false;
  // Numbers that no square, target or magnitude makes something special of.
  const auto some = [](int count, double from) {
    Eigen::VectorXd x(count);
    for (int i = 0; i < count; ++i) x[i] = from + std::fmod(0.61803398875 * (i + 1), 1.0);
    return x;
  };
  const Eigen::VectorXd v = some(assembly_.n(), 0.1), a = some(assembly_.n(), 0.3), lambda = some(assembly_.m(), 0.7);
  const StateView s{t_, q_.data(), v.data(), a.data(), lambda.data(), z_.data()};
  ScalarGradient g;
  g.resize(assembly_);
  add(s, g);
  const Eigen::VectorXd scaled = (row_size_.array() > 0).select(g.lambda.array() / row_size_.array(), g.lambda.array());
  return (N_.transpose() * scaled).cwiseAbs().maxCoeff() > kOpen * scaled.cwiseAbs().maxCoeff();
}

bool UndeterminedReactions::leaves_open(const Output& output) {
  return output.needs_accelerations() &&
         leaves_open_of([&](const StateView& s, ScalarGradient& g) { output.add_gradient(s, assembly_, 1, g); });
}

bool UndeterminedReactions::leaves_open(const CostTerm& term) {
  return term.needs_accelerations() &&
         leaves_open_of([&](const StateView& s, ScalarGradient& g) { term.add_gradient(s, assembly_, 1, g); });
}

std::vector<char> rows_there(const Assembly& assembly) {
  std::vector<char> there;
  for (int i = 0; i < assembly.m(); ++i) there.push_back(assembly.is_there(i) ? 1 : 0);
  return there;
}

std::string first_names(const std::vector<std::string>& names) {
  if (names.size() <= kNamed + 1) return fmt::format("{}", fmt::join(names, ", "));
  return fmt::format("{} and {} more", fmt::join(names.begin(), names.begin() + kNamed, ", "), names.size() - kNamed);
}

}  // namespace costate
