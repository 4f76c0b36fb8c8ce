#include "costate/analysis/start.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Dense>
#include <Eigen/SparseCore>
#include <Eigen/SparseQR>
#include <algorithm>
#include <optional>

#include "costate/base/error.h"

namespace costate {

namespace {

constexpr int kDenseLimit = 500;  // coordinates; above, a sparse QR takes over
constexpr double kRankTolerance = 1e-9;
constexpr int kMaxIterations = 60;

/// Least-squares solver of [Phi_q; B] x = b with full column rank, dense or sparse.
class GivenSystem {
 public:
  GivenSystem(const Assembly& assembly, const std::vector<GivenStart>& given)
      : assembly_(assembly), given_(given), rows_(assembly.m() + static_cast<int>(given.size())) {}

  int rows() const { return rows_; }

  /// Rates among the given velocities depend on the positions q.
  void factor(const double* q) {
    const auto& J = assembly_.jacobian();
    std::vector<Eigen::Triplet<double>> entries;
    for (int j = 0; j < J.cols; ++j)
      for (auto k = J.column_start[j]; k < J.column_start[j + 1]; ++k)
        entries.emplace_back(static_cast<int>(J.row[k]), j, assembly_.phi_q[k]);
    for (std::size_t g = 0; g < given_.size(); ++g)
      if (given_[g].coordinate >= 0)
        entries.emplace_back(assembly_.m() + static_cast<int>(g), given_[g].coordinate, 1.0);
      else
        for (const auto& [i, j, c] : given_[g].terms)
          entries.emplace_back(assembly_.m() + static_cast<int>(g), j, c * q[i]);
    matrix_.resize(rows_, assembly_.n());
    matrix_.setFromTriplets(entries.begin(), entries.end());
    matrix_.makeCompressed();
    if (assembly_.n() <= kDenseLimit) {
      dense_.emplace(rows_, assembly_.n());
      dense_->setThreshold(kRankTolerance);
      dense_->compute(Eigen::MatrixXd(matrix_));
    } else {
      sparse_.setPivotThreshold(kRankTolerance);
      sparse_.compute(matrix_);
    }
  }
  /// Square and regular: then the constraint rows are independent and the number of given values is right.
  bool determines() const { return rows_ == assembly_.n() && rank() == rows_; }
  int rank() const { return dense_ ? static_cast<int>(dense_->rank()) : static_cast<int>(sparse_.rank()); }
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const {
    return dense_ ? Eigen::MatrixXd(dense_->solve(b)) : Eigen::MatrixXd(sparse_.solve(b));
  }
  /// A coordinate that the given ones leave undetermined (largest entry of a null vector), for messages.
  int undetermined() const {
    if (!dense_) return -1;
    const Eigen::MatrixXd A(matrix_);
    Eigen::FullPivLU<Eigen::MatrixXd> lu(A);
    lu.setThreshold(kRankTolerance);
    if (lu.dimensionOfKernel() == 0) return -1;
    Eigen::Index at;
    lu.kernel().col(0).cwiseAbs().maxCoeff(&at);
    return static_cast<int>(at);
  }

 private:
  const Assembly& assembly_;
  const std::vector<GivenStart>& given_;
  int rows_;
  Eigen::SparseMatrix<double> matrix_;
  std::optional<Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>> dense_;
  Eigen::SparseQR<Eigen::SparseMatrix<double>, Eigen::COLAMDOrdering<int>> sparse_;
};

bool same_coordinates(const std::vector<GivenStart>& a, const std::vector<GivenStart>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(),
                    [](const GivenStart& x, const GivenStart& y) {
                      return x.coordinate == y.coordinate && x.coordinate >= 0;
                    });
}

std::vector<std::string> names_of(const Mechanism& m, const std::vector<GivenStart>& given) {
  std::vector<std::string> r;
  for (const auto& g : given) r.push_back(g.coordinate >= 0 ? m.coordinates()[g.coordinate].name : g.name);
  return r;
}

void require_count(Assembly& assembly, double t, const double* q, const std::vector<GivenStart>& given,
                   const char* what) {
  const Mechanism& m = assembly.mechanism();
  const int rank = constraint_rank(assembly, t, q).rank;
  const int free = assembly.n() - rank;
  const int found = static_cast<int>(given.size());
  if (found == free) return;
  throw ModelError(
      "start", fmt::format("Too {} given {}: {} coordinates less {} independent constraint rows leave {} degree{} of "
                           "freedom, so {} must be given, found {} ({}). {}",
                           found < free ? "few" : "many", what, assembly.n(), rank, free, free == 1 ? "" : "s", free,
                           found, fmt::join(names_of(m, given), ", "),
                           found < free ? "Add to the list that [start] gives, or constrain the mechanism further."
                                        : "Remove some; the constraints determine the rest."));
}

[[noreturn]] void unreachable(Assembly& assembly, const Eigen::VectorXd& residual, const std::vector<GivenStart>& given) {
  const Mechanism& m = assembly.mechanism();
  std::vector<std::pair<double, std::string>> worst;
  const auto rows = m.row_names();
  for (int i = 0; i < assembly.m(); ++i) worst.emplace_back(std::abs(residual[i]), rows[i]);
  for (std::size_t g = 0; g < given.size(); ++g)
    worst.emplace_back(std::abs(residual[assembly.m() + static_cast<int>(g)]),
                       "given " + m.coordinates()[given[g].coordinate].name);
  std::sort(worst.rbegin(), worst.rend());
  std::vector<std::string> text;
  for (std::size_t i = 0; i < std::min<std::size_t>(3, worst.size()); ++i)
    text.push_back(fmt::format("{} by {:.3g}", worst[i].second, worst[i].first));
  throw ModelError("start", fmt::format("The start cannot be reached: Newton's iteration from the first guesses does "
                                        "not close the mechanism. Violated most: {}. Check lengths and given "
                                        "coordinates, or bring the first guesses nearer.",
                                        fmt::join(text, ", ")));
}

}  // namespace

ConstraintRank constraint_rank(Assembly& assembly, double t, const double* q) {
  StateView s;
  s.t = t;
  s.q = q;
  assembly.calc_constraints(s);
  const auto& J = assembly.jacobian();
  ConstraintRank result;
  if (assembly.m() == 0) return result;
  // Columns of Phi_q^T are the rows of Phi_q; column pivoting leaves the dependent ones last.
  std::vector<Eigen::Triplet<double>> entries;
  Eigen::VectorXd norm = Eigen::VectorXd::Zero(assembly.m());
  for (int j = 0; j < J.cols; ++j)
    for (auto k = J.column_start[j]; k < J.column_start[j + 1]; ++k)
      norm[J.row[k]] += assembly.phi_q[k] * assembly.phi_q[k];
  for (int j = 0; j < J.cols; ++j)
    for (auto k = J.column_start[j]; k < J.column_start[j + 1]; ++k)
      if (norm[J.row[k]] > 0)
        entries.emplace_back(j, static_cast<int>(J.row[k]), assembly.phi_q[k] / std::sqrt(norm[J.row[k]]));
  Eigen::SparseMatrix<double> A(assembly.n(), assembly.m());
  A.setFromTriplets(entries.begin(), entries.end());
  A.makeCompressed();
  Eigen::VectorXi order;
  if (assembly.n() <= kDenseLimit) {
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(assembly.n(), assembly.m());
    qr.setThreshold(kRankTolerance);
    qr.compute(Eigen::MatrixXd(A));
    result.rank = static_cast<int>(qr.rank());
    order = qr.colsPermutation().indices();
  } else {
    Eigen::SparseQR<Eigen::SparseMatrix<double>, Eigen::COLAMDOrdering<int>> qr;
    qr.setPivotThreshold(kRankTolerance);
    qr.compute(A);
    result.rank = static_cast<int>(qr.rank());
    order = qr.colsPermutation().indices();
  }
  for (int i = result.rank; i < assembly.m(); ++i) result.dependent_rows.push_back(order[i]);
  return result;
}

Start find_start(Assembly& assembly, double t, bool with_derivatives) {
  const Mechanism& m = assembly.mechanism();
  const auto& numbers = assembly.numbers();
  const int n = assembly.n(), rows = assembly.m(), np = assembly.np();
  Start start;
  start.q.resize(n);
  for (int i = 0; i < n; ++i) start.q[i] = numbers[m.coordinates()[i].position_number];
  start.v.setZero(n);
  start.z.setZero(assembly.nz());
  StateView s;
  s.t = t;
  s.q = start.q.data();
  s.v = start.v.data();
  s.z = start.z.data();

  for (std::size_t k = 0; k < m.forces().size(); ++k)
    for (int i = 0; i < m.forces()[k]->states(); ++i) {
      const int number = m.forces()[k]->initial_state_number(i);
      if (number >= 0) start.z[m.state_offsets()[k] + i] = numbers[m.forces()[k]->numbers()[number]];
    }

  // Positions: damped Gauss-Newton on [Phi; B q - z0].
  GivenSystem position(assembly, m.given_positions());
  const auto residual = [&] {
    assembly.calc_constraints(s);
    Eigen::VectorXd r(position.rows());
    for (int i = 0; i < rows; ++i) r[i] = assembly.phi[i];
    for (std::size_t g = 0; g < m.given_positions().size(); ++g)
      r[rows + static_cast<int>(g)] =
          start.q[m.given_positions()[g].coordinate] - numbers[m.given_positions()[g].number];
    return r;
  };
  Eigen::VectorXd r = residual();
  const double scale = std::max(1e-300, start.q.cwiseAbs().maxCoeff());
  bool converged = false;
  int settled = 0;
  for (start.iterations = 0; start.iterations < kMaxIterations && !converged; ++start.iterations) {
    position.factor(start.q.data());
    const Eigen::VectorXd step = position.solve(-r);
    const Eigen::VectorXd before = start.q;
    const double norm = r.norm();
    double fraction = 1;
    for (int halving = 0; halving < 12; ++halving, fraction /= 2) {
      start.q = before + fraction * step;
      r = residual();
      if (r.norm() <= norm || step.norm() < 1e-12 * scale) break;
    }
    // Quadratic convergence: one step after the size of rounding is enough.
    if (step.norm() < 1e-9 * scale) ++settled;
    converged = settled >= 2 || (step.norm() < 1e-15 * scale);
    if (!r.allFinite()) break;
  }
  // A row's residual of rounding size is some eps times its terms, of size |phi_q||q|.
  double row_scale = 0;
  for (double x : assembly.phi_q) row_scale = std::max(row_scale, std::abs(x));
  if (!converged || !(r.cwiseAbs().maxCoeff() < 1e-10 * scale * std::max(1.0, row_scale))) {
    std::vector<double> guess(static_cast<std::size_t>(n));
    for (int i = 0; i < n; ++i) guess[i] = numbers[m.coordinates()[i].position_number];
    require_count(assembly, t, guess.data(), m.given_positions(), "positions");
    unreachable(assembly, r, m.given_positions());
  }
  position.factor(start.q.data());
  if (!position.determines()) require_count(assembly, t, start.q.data(), m.given_positions(), "positions");
  if (position.rank() < n) {
    const int at = position.undetermined();
    throw ModelError("start", fmt::format("The given positions ({}) do not determine the configuration{}: with the "
                                          "constraints they depend on each other here. Give other coordinates.",
                                          fmt::join(names_of(m, m.given_positions()), ", "),
                                          at < 0 ? "" : fmt::format(" ('{}' stays free)", m.coordinates()[at].name)));
  }

  // Velocities.
  assembly.calc_dynamics(s);
  std::optional<GivenSystem> other;
  if (!same_coordinates(m.given_positions(), m.given_velocities())) other.emplace(assembly, m.given_velocities());
  if (other) other->factor(start.q.data());
  const GivenSystem& velocity = other ? *other : position;
  if (!velocity.determines()) require_count(assembly, t, start.q.data(), m.given_velocities(), "velocities");
  if (velocity.rank() < n)
    throw ModelError("start", fmt::format("The given velocities ({}) do not determine the motion: with the constraints "
                                          "they depend on each other here. Give other coordinates.",
                                          fmt::join(names_of(m, m.given_velocities()), ", ")));
  Eigen::VectorXd b(velocity.rows());
  for (int i = 0; i < rows; ++i) b[i] = -assembly.phi_t[i];
  for (std::size_t g = 0; g < m.given_velocities().size(); ++g)
    b[rows + static_cast<int>(g)] = numbers[m.given_velocities()[g].number];
  start.v = velocity.solve(b);
  if (!with_derivatives) return start;

  // Derivatives with respect to rho.
  const auto& columns = assembly.number_columns();
  Assembly::ParameterColumns c;
  assembly.resize(c);
  const std::vector<double> zero_a(static_cast<std::size_t>(n), 0.0), zero_lambda(static_cast<std::size_t>(rows), 0.0);
  s.q = start.q.data();
  s.v = start.v.data();
  s.a = zero_a.data();
  s.lambda = zero_lambda.data();
  assembly.calc_dynamics(s);
  assembly.calc_partials(s);
  assembly.calc_parameter_columns(s, c);
  Eigen::MatrixXd right = Eigen::MatrixXd::Zero(position.rows(), np);
  right.topRows(rows) = -c.phi;
  for (std::size_t g = 0; g < m.given_positions().size(); ++g)
    for (const auto& [column, f] : columns[m.given_positions()[g].number])
      right(rows + static_cast<int>(g), column) += f;
  start.q_rho = position.solve(right);
  right = Eigen::MatrixXd::Zero(velocity.rows(), np);
  right.topRows(rows) = -c.phid;
  for (int j = 0; j < np; ++j)
    add_product(assembly.jacobian(), assembly.phid_q.data(), -1, start.q_rho.col(j).data(), right.col(j).data());
  for (std::size_t g = 0; g < m.given_velocities().size(); ++g)
    for (const auto& [column, f] : columns[m.given_velocities()[g].number])
      right(rows + static_cast<int>(g), column) += f;
  for (std::size_t g = 0; g < m.given_velocities().size(); ++g)
    for (const auto& [i, j, factor] : m.given_velocities()[g].terms)
      right.row(rows + static_cast<int>(g)) -= factor * start.v[j] * start.q_rho.row(i);
  start.v_rho = velocity.solve(right);
  start.z_rho = Eigen::MatrixXd::Zero(assembly.nz(), np);
  for (std::size_t k = 0; k < m.forces().size(); ++k)
    for (int i = 0; i < m.forces()[k]->states(); ++i) {
      const int number = m.forces()[k]->initial_state_number(i);
      if (number < 0) continue;
      for (const auto& [column, f] : columns[m.forces()[k]->numbers()[number]])
        start.z_rho(m.state_offsets()[k] + i, column) += f;
    }
  return start;
}

}  // namespace costate
