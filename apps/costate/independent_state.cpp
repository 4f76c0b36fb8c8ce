#include "independent_state.h"

#include <algorithm>
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
IndependentState::Solution IndependentState::solve() const {
  const int n = assembly_.n(), m = assembly_.m();
  Solution r;
  Eigen::MatrixXd& A = r.A;
  A = Eigen::MatrixXd::Zero(n + m, n + m);
  fill(A, assembly_.square(), assembly_.M, 0, false);
  fill(A, assembly_.jacobian(), assembly_.phi_q, n, false);
  fill(A, assembly_.jacobian(), assembly_.reaction_jacobian(), n, true);
  if (assembly_.has_switched_rows()) add_switched_rows(A, assembly_);
  Eigen::VectorXd b(n + m);
  r.S = Eigen::VectorXd::Ones(n + m);
  for (int i = 0; i < n; ++i) b[i] = assembly_.Q[static_cast<std::size_t>(i)];
  for (int i = 0; i < m; ++i) b[n + i] = -assembly_.bias[static_cast<std::size_t>(i)];
  for (int pass = 0; pass < 5; ++pass) {
    Eigen::VectorXd largest = A.rowwise().lpNorm<Eigen::Infinity>();
    for (int i = 0; i < n + m; ++i) largest[i] = largest[i] > 0 ? 1 / std::sqrt(largest[i]) : 1;
    A = largest.asDiagonal() * A * largest.asDiagonal();
    r.S = r.S.cwiseProduct(largest);
  }
  r.factors.setThreshold(1e-11);
  r.factors.compute(A);
  r.scaled = r.factors.solve(r.S.cwiseProduct(b));
  r.x = r.S.cwiseProduct(r.scaled);
  return r;
}

std::vector<double> IndependentState::values(const StateView& s, std::vector<char>* determined) {
  const int n = assembly_.n(), m = assembly_.m();
  StateView state = s;
  state.a = state.lambda = nullptr;
  assembly_.calc_dynamics(state);
  const Solution r = solve();
  const std::vector<double> found = outputs_at(state, r.x);
  if (!determined) return found;
  determined->assign(found.size(), 1);
  if (r.factors.rank() == n + m) return found;
  // Something of the null space: w - A^+ A w, as large as the solution.
  Eigen::VectorXd w(n + m);
  for (int i = 0; i < n + m; ++i) w[i] = std::cos(2.4 * i + 0.3);
  w -= r.factors.solve(r.A * w);
  w *= (r.scaled.norm() + 1e-300) / (w.norm() + 1e-300);
  const Eigen::VectorXd shift = r.S.cwiseProduct(w);
  const std::vector<double> other = outputs_at(state, r.x + shift);
  const double least = 1e-9 * r.x.lpNorm<Eigen::Infinity>();
  for (std::size_t c = 0; c < found.size(); ++c)
    (*determined)[c] = std::abs(other[c] - found[c]) <= 1e-6 * (std::abs(other[c]) + std::abs(found[c])) + least;
  return found;
}

void IndependentState::add_sizes_by_reactions(const StateView& s, const Eigen::VectorXd& lambda, ForceSizes& largest) {
  const int n = assembly_.n(), m = assembly_.m();
  std::vector<const Output*> accelerations;
  for (const auto& o : outputs_)
    if (o->unit() == "m/s^2" || o->unit() == "rad/s^2") accelerations.push_back(o.get());
  Eigen::MatrixXd M = Eigen::MatrixXd::Zero(n, n), of_rows = Eigen::MatrixXd::Zero(n, m);
  fill(M, assembly_.square(), assembly_.M, 0, false);
  fill(of_rows, assembly_.jacobian(), assembly_.reaction_jacobian(), 0, true);
  Eigen::VectorXd scale = M.diagonal();
  for (int j = 0; j < n; ++j) scale[j] = scale[j] > 0 ? 1 / std::sqrt(scale[j]) : 1;
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> factors(scale.asDiagonal() * M * scale.asDiagonal());
  const Eigen::MatrixXd by_rows =
      -(scale.asDiagonal() * factors.solve(scale.asDiagonal() * of_rows) * lambda.asDiagonal()).eval();
  StateView state = s;
  Eigen::VectorXd a = Eigen::VectorXd::Zero(n);
  state.lambda = lambda.data();
  state.a = a.data();
  std::vector<double> without;
  for (const Output* o : accelerations) without.push_back(o->value(state, assembly_));
  for (int i = 0; i < m; ++i) {
    if (lambda[i] == 0) continue;
    a = by_rows.col(i);
    for (std::size_t c = 0; c < accelerations.size(); ++c) {
      double& most = largest.by_reactions[accelerations[c]->name()];
      const double x = std::abs(accelerations[c]->value(state, assembly_) - without[c]);
      if (std::isfinite(x)) most = std::max(most, x);
    }
  }
}

IndependentState::ForceSizes IndependentState::sizes_by_forces(const StateView& s) {
  StateView state = s;
  state.a = state.lambda = nullptr;
  assembly_.calc_dynamics(state);
  const auto diagonal = [&](int j) {
    const SparsePattern& square = assembly_.square();
    double mass = 0;
    for (auto e = square.column_start[static_cast<std::size_t>(j)];
         e < square.column_start[static_cast<std::size_t>(j) + 1]; ++e)
      if (square.row[static_cast<std::size_t>(e)] == j) mass += assembly_.M[static_cast<std::size_t>(e)];
    return mass;
  };
  const SparsePattern& jacobian = assembly_.jacobian();
  std::vector<double> force(static_cast<std::size_t>(assembly_.m()), 0), entry = force;
  ForceSizes largest;
  for (int j = 0; j < assembly_.n(); ++j) {
    const auto c = static_cast<std::size_t>(j);
    const double Q = std::abs(assembly_.Q[c]), mass = diagonal(j);
    double& most = largest.by_unit[assembly_.mechanism().coordinates()[c].unit + "/s^2"];
    if (mass > 0) most = std::max(most, Q / mass);
    for (auto e = jacobian.column_start[c]; e < jacobian.column_start[c + 1]; ++e) {
      const auto i = static_cast<std::size_t>(jacobian.row[static_cast<std::size_t>(e)]);
      const double x = std::abs(assembly_.phi_q[static_cast<std::size_t>(e)]);
      if (x > 0) force[i] = std::max(force[i], Q);
      entry[i] = std::max(entry[i], x);
    }
  }
  std::size_t row = 0;
  for (const auto& o : outputs_) {
    if (o->name().rfind("lambda.", 0) != 0 || row == entry.size()) continue;
    double& most = largest.by_unit[o->unit()];
    if (entry[row] > 0) most = std::max(most, force[row] / entry[row]);
    ++row;
  }
  add_sizes_by_reactions(state, solve().x.tail(assembly_.m()), largest);
  return largest;
}

}  // namespace costate::app
