#include "costate/level/maggi_choice.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <memory>
#include <set>

#include "costate/base/stop.h"
#include "costate/level/maggi_chart.h"
#include "costate/level/maggi_ratio.h"

namespace costate {

namespace {

constexpr double kSettled = 1 + 1e-6;  // ties are left as they are
// Of a row of length 1, entries below are what elimination leaves of zero.
constexpr double kNothing = 1e-12;
constexpr int kChosenAtOnce = 64;
// Of very many freedoms each exchange is a factorization: what is nearly the best will do, below the ratio at which
// charts are changed (maggi_names.h).
constexpr double kNearlyBest = 1.2;
constexpr int kMostExchanges = 100;
constexpr std::size_t kStopsEvery = 1024;  // rows

std::vector<int> choose_full(const SparsePattern& jacobian, const double* phi_q, int freedoms,
                             const std::vector<double>& weight) {
  const int n = jacobian.cols, m = jacobian.rows;
  std::vector<int> chosen;
  // Weighted coordinates w_i q_i have the Jacobian Phi_q / w; its rows are brought to length 1.
  Eigen::MatrixXd Jt = Eigen::MatrixXd::Zero(n, m);
  for (int j = 0; j < n; ++j)
    for (auto k = jacobian.column_start[j]; k < jacobian.column_start[j + 1]; ++k)
      Jt(j, jacobian.row[k]) += phi_q[k] / weight[j];
  for (int i = 0; i < m; ++i) {
    const double norm = Jt.col(i).norm();
    if (norm > 0) Jt.col(i) /= norm;
  }
  Eigen::MatrixXd N;
  if (m > 0) {
    const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(Jt);
    N = Eigen::MatrixXd(qr.householderQ()).rightCols(freedoms);
  } else {
    N = Eigen::MatrixXd::Identity(n, n);
  }
  const Eigen::ColPivHouseholderQR<Eigen::MatrixXd> rows(N.transpose());
  Eigen::MatrixXd P(freedoms, freedoms);
  for (int k = 0; k < freedoms; ++k) {
    chosen.push_back(static_cast<int>(rows.colsPermutation().indices()[k]));
    P.row(k) = N.row(chosen.back());
  }
  Eigen::MatrixXd R = P.transpose().fullPivLu().solve(N.transpose()).transpose();
  // N is that of the weighted coordinates already.
  improve_choice(chosen, R.data(), std::vector<double>(static_cast<std::size_t>(n), 1.0));
  std::sort(chosen.begin(), chosen.end());
  return chosen;
}

// The rows are solved for one coordinate each, which is put into the others: always the shortest row, for its largest
// coordinate. Empty where a row has none left.
std::vector<int> eliminate(const SparsePattern& jacobian, const double* phi_q, const std::vector<double>& weight) {
  const auto m = static_cast<std::size_t>(jacobian.rows), n = static_cast<std::size_t>(jacobian.cols);
  std::vector<std::map<int, double>> rows(m);
  std::vector<std::set<int>> columns(n);  // the rows that hold a coordinate and are not solved yet
  for (int j = 0; j < jacobian.cols; ++j)
    for (auto k = jacobian.column_start[j]; k < jacobian.column_start[j + 1]; ++k)
      if (phi_q[k] != 0)
        rows[static_cast<std::size_t>(jacobian.row[k])][j] += phi_q[k] / weight[static_cast<std::size_t>(j)];
  std::set<std::pair<std::size_t, int>> by_length;
  for (std::size_t i = 0; i < m; ++i) {
    double square = 0;
    for (const auto& [j, x] : rows[i]) square += x * x;
    for (auto& [j, x] : rows[i]) {
      x /= std::sqrt(square);
      columns[static_cast<std::size_t>(j)].insert(static_cast<int>(i));
    }
    by_length.insert({rows[i].size(), static_cast<int>(i)});
  }
  std::vector<char> dependent(n, 0);
  while (!by_length.empty()) {
    if (by_length.size() % kStopsEvery == 0) check_stop();
    const int pivot_row = by_length.begin()->second;
    by_length.erase(by_length.begin());
    const auto& pivots = rows[static_cast<std::size_t>(pivot_row)];
    const auto largest = std::max_element(pivots.begin(), pivots.end(), [](const auto& a, const auto& b) {
      return std::abs(a.second) < std::abs(b.second);
    });
    if (largest == pivots.end()) return {};
    const auto [column, pivot] = *largest;
    dependent[static_cast<std::size_t>(column)] = 1;
    for (const auto& [j, x] : pivots) columns[static_cast<std::size_t>(j)].erase(pivot_row);
    const std::vector<int> others(columns[static_cast<std::size_t>(column)].begin(),
                                  columns[static_cast<std::size_t>(column)].end());
    for (const int i : others) {
      auto& row = rows[static_cast<std::size_t>(i)];
      by_length.erase({row.size(), i});
      const double factor = row.at(column) / pivot;
      for (const auto& [j, x] : pivots) {
        double& to = row[j];
        to = j == column ? 0 : to - factor * x;
        if (std::abs(to) > kNothing) {
          columns[static_cast<std::size_t>(j)].insert(i);
        } else {
          row.erase(j);
          columns[static_cast<std::size_t>(j)].erase(i);
        }
      }
      by_length.insert({row.size(), i});
    }
  }
  std::vector<int> chosen;
  for (std::size_t j = 0; j < n; ++j)
    if (!dependent[j]) chosen.push_back(static_cast<int>(j));
  return chosen;
}

// Exchanges the largest |R_ij| that is found, one after the other; false where that leads to a singular choice.
bool improve_by_factors(const SparsePattern& jacobian, const double* phi_q, const std::vector<double>& weight,
                        std::vector<int>& chosen) {
  auto chart = std::make_unique<MaggiChart>(jacobian, chosen);
  for (int exchange = 0;; ++exchange) {
    check_stop();
    if (!chart->factor(phi_q)) return false;
    const LargestRatio largest = find_largest_ratio(*chart, weight);
    if (!std::isfinite(largest.ratio)) return false;
    if (largest.ratio <= kNearlyBest || exchange == kMostExchanges) return true;
    chosen[static_cast<std::size_t>(largest.column)] = largest.row;
    chart = std::make_unique<MaggiChart>(jacobian, chosen);
  }
}

// Improved as far as it is not the best already. Empty where rows depend on each other as far as numbers tell.
std::vector<int> choose_sparse(const SparsePattern& jacobian, const double* phi_q, int freedoms,
                               const std::vector<double>& weight) {
  std::vector<int> chosen = eliminate(jacobian, phi_q, weight);
  if (static_cast<int>(chosen.size()) != freedoms) return {};
  if (freedoms > kMostExactFreedoms) {
    if (!improve_by_factors(jacobian, phi_q, weight, chosen)) return {};
    std::sort(chosen.begin(), chosen.end());
    return chosen;
  }
  MaggiChart chart(jacobian, chosen);
  if (!chart.factor(phi_q)) return {};
  const std::ptrdiff_t n = jacobian.cols, m = jacobian.rows;
  std::vector<double> R;
  const auto solve = [&](int first, int count) {
    R.assign(static_cast<std::size_t>(n * count), 0);
    for (int j = 0; j < count; ++j) R[static_cast<std::size_t>(j * n + m + first + j)] = 1;
    chart.solve(R.data(), count);
    return worst_ratio({chosen.data() + first, static_cast<std::size_t>(count)}, R.data(), weight);
  };
  double ratio = 0;
  for (int j = 0; j < freedoms; j += kChosenAtOnce)
    ratio = std::max(ratio, solve(j, std::min(kChosenAtOnce, freedoms - j)));
  if (!std::isfinite(ratio)) return {};
  if (ratio > kSettled) {
    solve(0, freedoms);
    improve_choice(chosen, R.data(), weight);
    std::sort(chosen.begin(), chosen.end());
  }
  return chosen;
}

}  // namespace

double worst_ratio(std::span<const int> independent, const double* R, const std::vector<double>& weight) {
  const std::size_t n = weight.size();
  double worst = 0;
  for (std::size_t j = 0; j < independent.size(); ++j, R += n) {
    double column = 0;
    for (std::size_t i = 0; i < n; ++i) column = std::max(column, std::abs(R[i]) * weight[i]);
    worst = std::max(worst, column / weight[static_cast<std::size_t>(independent[j])]);
  }
  return worst;
}

void improve_choice(std::vector<int>& independent, double* R, const std::vector<double>& weight) {
  const auto n = static_cast<Eigen::Index>(weight.size()), f = static_cast<Eigen::Index>(independent.size());
  Eigen::Map<Eigen::MatrixXd> T(R, n, f);
  const auto weight_of = [&](Eigen::Index i) { return weight[i]; };
  for (Eigen::Index exchange = 0; exchange < 4 * n * f + 4; ++exchange) {
    check_stop();
    double best = kSettled;
    Eigen::Index in = -1, out = -1;
    for (Eigen::Index j = 0; j < f; ++j)
      for (Eigen::Index i = 0; i < n; ++i) {
        const double ratio = std::abs(T(i, j)) * weight_of(i) / weight_of(independent[j]);
        if (ratio > best) {
          best = ratio;
          in = i;
          out = j;
        }
      }
    if (in < 0) return;
    // T := T P^-1 with P the rows of T at the new choice: column `out` over the pivot, out of row `in` elsewhere.
    const double pivot = T(in, out);
    T.col(out) /= pivot;
    for (Eigen::Index j = 0; j < f; ++j)
      if (j != out) T.col(j) -= T(in, j) * T.col(out);
    independent[out] = static_cast<int>(in);
  }
}

std::vector<int> choose_independent(const SparsePattern& jacobian, const double* phi_q, int freedoms,
                                    const std::vector<double>& weight, int most_full) {
  if (freedoms == 0) return {};
  if (freedoms > most_full && jacobian.rows + freedoms == jacobian.cols)
    if (std::vector<int> chosen = choose_sparse(jacobian, phi_q, freedoms, weight); !chosen.empty()) return chosen;
  return choose_full(jacobian, phi_q, freedoms, weight);
}

}  // namespace costate
