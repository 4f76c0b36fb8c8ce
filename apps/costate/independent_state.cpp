#include "independent_state.h"

#include <Eigen/QR>
#include <cmath>

#include "costate/objective/all_outputs.h"

namespace costate::app {

namespace {

/// The blocks at (first_row + row, column), or transposed at (column, first_row + row).
void fill(Eigen::MatrixXd& A, const SparsePattern& pattern, const std::vector<double>& values, int first_row,
          bool transposed) {
  for (int j = 0; j < pattern.cols; ++j) {
    const auto c = static_cast<std::size_t>(j);
    for (auto e = pattern.column_start[c]; e < pattern.column_start[c + 1]; ++e) {
      const auto i = first_row + pattern.row[static_cast<std::size_t>(e)];
      const double x = values[static_cast<std::size_t>(e)];
      if (transposed)
        A(j, i) += x;
      else
        A(i, j) += x;
    }
  }
}

/// Rows that are not there have lambda = 0; those along which contacts slide, lib/README.md (19.6), (19.7),
/// lambda_along + s mu lambda_normal = 0.
void add_switched_rows(Eigen::MatrixXd& A, const Assembly& assembly) {
  const int n = assembly.n();
  for (int i = 0; i < assembly.m(); ++i)
    if (!assembly.is_there(i)) A(n + i, n + i) = 1;
  for (const Assembly::SlidingRow& r : assembly.sliding_rows()) {
    A(n + r.along, n + r.along) = 1;
    A(n + r.along, n + r.normal) = assembly.friction(r);
  }
}

}  // namespace

IndependentState::IndependentState(const Problem& problem, const std::vector<double>& rho)
    : assembly_(problem.mechanism, problem.parameters) {
  assembly_.set_parameters(rho.data());
  for (auto& o : make_all_outputs(*problem.mechanism))
    if (o->name() != "time") outputs_.push_back(std::move(o));
}

std::vector<double> IndependentState::outputs_at(const StateView& s, const Eigen::VectorXd& x) {
  StateView full = s;
  full.a = x.data();
  full.lambda = x.data() + assembly_.n();
  std::vector<double> values;
  for (const auto& o : outputs_) values.push_back(o->value(full, assembly_));
  return values;
}

//  [ M      Phi_q^T ] [   a    ]   [   Q   ]
//  [ Phi_q     0    ] [ lambda ] = [ -bias ],   scaled to S A S (S^-1 x) = S b with rows of S A S near one.
// Contacts that are open or slide stand in the corner, and Phi_q^T holds the rows along which they slide.
std::vector<double> IndependentState::values(const StateView& s, std::vector<char>* determined) {
  const int n = assembly_.n(), m = assembly_.m();
  StateView state = s;
  state.a = state.lambda = nullptr;
  assembly_.calc_dynamics(state);
  Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n + m, n + m);
  fill(A, assembly_.square(), assembly_.M, 0, false);
  fill(A, assembly_.jacobian(), assembly_.phi_q, n, false);
  fill(A, assembly_.jacobian(), assembly_.reaction_jacobian(), n, true);
  if (assembly_.has_switched_rows()) add_switched_rows(A, assembly_);
  Eigen::VectorXd b(n + m), S = Eigen::VectorXd::Ones(n + m);
  for (int i = 0; i < n; ++i) b[i] = assembly_.Q[static_cast<std::size_t>(i)];
  for (int i = 0; i < m; ++i) b[n + i] = -assembly_.bias[static_cast<std::size_t>(i)];
  for (int pass = 0; pass < 5; ++pass) {
    Eigen::VectorXd largest = A.rowwise().lpNorm<Eigen::Infinity>();
    for (int i = 0; i < n + m; ++i) largest[i] = largest[i] > 0 ? 1 / std::sqrt(largest[i]) : 1;
    A = largest.asDiagonal() * A * largest.asDiagonal();
    S = S.cwiseProduct(largest);
  }
  Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> factors(n + m, n + m);
  factors.setThreshold(1e-11);
  factors.compute(A);
  const Eigen::VectorXd scaled = factors.solve(S.cwiseProduct(b)), x = S.cwiseProduct(scaled);
  const std::vector<double> found = outputs_at(state, x);
  if (!determined) return found;
  determined->assign(found.size(), 1);
  if (factors.rank() == n + m) return found;
  // Something of the null space: w - A^+ A w, as large as the solution.
  Eigen::VectorXd w(n + m);
  for (int i = 0; i < n + m; ++i) w[i] = std::cos(2.4 * i + 0.3);
  w -= factors.solve(A * w);
  w *= (scaled.norm() + 1e-300) / (w.norm() + 1e-300);
  const Eigen::VectorXd shift = S.cwiseProduct(w);
  const std::vector<double> other = outputs_at(state, x + shift);
  const double least = 1e-9 * x.lpNorm<Eigen::Infinity>();
  for (std::size_t c = 0; c < found.size(); ++c)
    (*determined)[c] = std::abs(other[c] - found[c]) <= 1e-6 * (std::abs(other[c]) + std::abs(found[c])) + least;
  return found;
}

}  // namespace costate::app
