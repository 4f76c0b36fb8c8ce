#include "costate/analysis/given_system.h"

#include <Eigen/SparseQR>
#include <algorithm>

#include "costate/analysis/start.h"
#include "costate/assembly/rolling_rows.h"
#include "costate/base/stop.h"
#include "costate/linear/inverse_norm.h"
#include "costate/linear/least_squares.h"
#include "costate/linear/matrix_parts.h"

namespace costate {

namespace {

// Coordinates; above, uncoupled parts one by one, larger ones by sparse factors, of which the time of full ones would
// be a multiple (of 480 coordinates 0.1 s for 0.01).
constexpr int kDenseLimit = 200;
constexpr int kNamedLimit = 500;  // of what a message names, found by full factors
constexpr double kRankTolerance = 1e-9;
// A large matrix with an inverse below this is regular beyond the tolerance, and its LU factors serve. What is not so
// surely regular is left to a sparse QR, whose cost grows much faster than linearly.
constexpr double kSurelyRegular = 0.01 / kRankTolerance;

using Dense = Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>;
using Sparse = Eigen::SparseQR<Eigen::SparseMatrix<double>, Eigen::COLAMDOrdering<int>>;

}  // namespace

namespace {

/// Columns that are dependent come last. Long, and not to be interrupted from within.
std::shared_ptr<Sparse> orthogonal_factors(const Eigen::SparseMatrix<double>& matrix) {
  auto qr = std::make_shared<Sparse>();
  qr->setPivotThreshold(kRankTolerance);
  const auto own = std::make_shared<Eigen::SparseMatrix<double>>(matrix);
  run_stoppably([qr, own] { qr->compute(*own); });
  return qr;
}

}  // namespace

/// A part with its factors; none where it has no rows or no columns.
struct GivenSystem::FactoredPart {
  explicit FactoredPart(MatrixPart p) : part(std::move(p)) {
    if (part.rows.empty() || part.columns.empty()) return;
    if (part.columns.size() <= kDenseLimit) {
      dense.emplace(part.matrix.rows(), part.matrix.cols());
      dense->setThreshold(kRankTolerance);
      dense->compute(Eigen::MatrixXd(part.matrix));
    } else {
      if (part.rows.size() == part.columns.size()) square = std::make_unique<SparseSquare>(part.matrix);
      if (square && square->regular(kSurelyRegular)) return;
      square.reset();
      least = std::make_unique<LeastSquares>(part.matrix);
      if (least->full_rank()) return;
      least.reset();
      sparse = orthogonal_factors(part.matrix);
    }
  }
  int rank() const {
    return static_cast<int>(dense ? dense->rank() : square || least ? part.matrix.cols() : sparse ? sparse->rank() : 0);
  }
  Eigen::MatrixXd solve(const Eigen::MatrixXd& b) const {
    if (square) return square->solve(b);
    if (least) return least->solve(b);
    return dense ? Eigen::MatrixXd(dense->solve(b)) : Eigen::MatrixXd(sparse->solve(b));
  }
  Eigen::VectorXd solve_transposed(const Eigen::VectorXd& w) const {
    if (square) return square->solve_transposed(w);
    if (least) return least->solve_transposed(w);
    if (dense) return dense->transpose().solve(w);
    // A P = Q [R; 0] with all columns independent: the adjoint of P R^-1 Q^T.
    Eigen::VectorXd y = Eigen::VectorXd::Zero(part.matrix.rows());
    const Eigen::SparseMatrix<double> R = sparse->matrixR().topLeftCorner(w.size(), w.size());
    y.head(w.size()) =
        R.triangularView<Eigen::Upper>().transpose().solve(Eigen::VectorXd(sparse->colsPermutation().transpose() * w));
    return sparse->matrixQ() * y;
  }

  MatrixPart part;
  std::optional<Dense> dense;
  std::unique_ptr<SparseSquare> square;  // the LU factors of what is surely regular
  std::unique_ptr<LeastSquares> least;   // those of more rows than columns, which are surely independent
  std::shared_ptr<Sparse> sparse;        // or the orthogonal ones
};

GivenSystem::GivenSystem(const Assembly& assembly, const std::vector<GivenStart>& given, Of of)
    : assembly_(assembly), given_(given), of_(of), rows_(assembly.m() + static_cast<int>(given.size())) {}

GivenSystem::~GivenSystem() = default;

void GivenSystem::factor(const double* q) {
  const auto& J = assembly_.jacobian();
  std::vector<Eigen::Triplet<double>> entries;
  const std::vector<int> left_out = of_ == Of::positions ? rows_without_place(assembly_) : std::vector<int>();
  for (int j = 0; j < J.cols; ++j)
    for (auto k = J.column_start[j]; k < J.column_start[j + 1]; ++k)
      if (const int row = static_cast<int>(J.row[k]); !std::binary_search(left_out.begin(), left_out.end(), row))
        entries.emplace_back(row, j, assembly_.phi_q[k]);
  for (std::size_t g = 0; g < given_.size(); ++g)
    if (given_[g].coordinate >= 0)
      entries.emplace_back(assembly_.m() + static_cast<int>(g), given_[g].coordinate, 1.0);
    else
      for (const auto& [i, j, c] : given_[g].terms)
        entries.emplace_back(assembly_.m() + static_cast<int>(g), j, c * q[i]);
  matrix_.resize(rows_, assembly_.n());
  matrix_.setFromTriplets(entries.begin(), entries.end());
  matrix_.makeCompressed();
  scale(q);
  if (assembly_.n() <= kDenseLimit) {
    dense_.emplace(rows_, assembly_.n());
    dense_->setThreshold(kRankTolerance);
    dense_->compute(Eigen::MatrixXd(matrix_));
  } else {
    parts_.clear();
    for (MatrixPart& p : matrix_parts(matrix_)) {
      check_stop();
      parts_.emplace_back(std::move(p));
    }
  }
}

// Ranks are judged by entries of size 1. Rows of squared lengths, and columns of angles, are far from that where a
// mechanism is of nanometres or of kilometres; what is rounding of zero is left.
void GivenSystem::scale(const double* q) {
  constexpr double kUsual = 1e4, kOfZero = 1e-13;
  double size = 0;
  for (int i = 0; i < assembly_.n(); ++i) size = std::max(size, std::abs(q[i]));
  const auto factors = [&](const Eigen::VectorXd& largest, double zero) {
    Eigen::VectorXd f = Eigen::VectorXd::Ones(largest.size());
    for (Eigen::Index i = 0; i < f.size(); ++i)
      if (largest[i] > zero && !(1 / kUsual < largest[i] && largest[i] < kUsual))
        f[i] = std::ldexp(1.0, -std::ilogb(largest[i]));
    return f;
  };
  const auto largest = [&](bool of_rows) {
    Eigen::VectorXd l = Eigen::VectorXd::Zero(of_rows ? rows_ : assembly_.n());
    for (int j = 0; j < matrix_.outerSize(); ++j)
      for (Eigen::SparseMatrix<double>::InnerIterator e(matrix_, j); e; ++e) {
        double& of = l[of_rows ? e.row() : e.col()];
        of = std::max(of, std::abs(e.value()));
      }
    return l;
  };
  row_ = factors(largest(true), kOfZero * std::max(size, 1.0));
  matrix_ = row_.asDiagonal() * matrix_;
  column_ = factors(largest(false), kOfZero);
  matrix_ = matrix_ * column_.asDiagonal();
}

int GivenSystem::rank() const {
  if (dense_) return static_cast<int>(dense_->rank());
  int sum = 0;
  for (const FactoredPart& p : parts_) sum += p.rank();
  return sum;
}

Eigen::MatrixXd GivenSystem::solve(const Eigen::MatrixXd& right) const {
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(assembly_.n(), right.cols());
  if (right.cols() == 0) return x;
  const Eigen::MatrixXd b = row_.asDiagonal() * right;
  if (dense_) return column_.asDiagonal() * dense_->solve(b);
  for (const FactoredPart& p : parts_)
    if (!p.part.rows.empty() && !p.part.columns.empty())
      x(p.part.columns, Eigen::all) = p.solve(b(p.part.rows, Eigen::all));
  return column_.asDiagonal() * x;
}

Eigen::VectorXd GivenSystem::solve_transposed(const Eigen::VectorXd& weights) const {
  const Eigen::VectorXd w = column_.cwiseProduct(weights);
  if (dense_) return row_.cwiseProduct(Eigen::VectorXd(dense_->transpose().solve(w)));
  Eigen::VectorXd y = Eigen::VectorXd::Zero(rows_);
  for (const FactoredPart& p : parts_)
    if (!p.part.rows.empty() && !p.part.columns.empty()) y(p.part.rows) = p.solve_transposed(w(p.part.columns));
  return row_.cwiseProduct(y);
}

int GivenSystem::undetermined() const {
  if (assembly_.n() > kNamedLimit) return -1;
  const Eigen::MatrixXd A(matrix_);
  Eigen::FullPivLU<Eigen::MatrixXd> lu(A);
  lu.setThreshold(kRankTolerance);
  if (lu.dimensionOfKernel() == 0) return -1;
  Eigen::Index at;
  lu.kernel().col(0).cwiseAbs().maxCoeff(&at);
  return static_cast<int>(at);
}

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
  const auto add = [&](const auto& qr, const std::vector<int>* rows) {
    const int rank = static_cast<int>(qr.rank());
    const Eigen::VectorXi order = qr.colsPermutation().indices();
    result.rank += rank;
    for (Eigen::Index i = rank; i < order.size(); ++i) {
      const int row = rows ? (*rows)[order[i]] : order[i];
      if (assembly.is_there(row)) result.dependent_rows.push_back(row);
    }
  };
  const auto add_dense = [&](const Eigen::SparseMatrix<double>& B, const std::vector<int>* rows) {
    Eigen::ColPivHouseholderQR<Eigen::MatrixXd> qr(B.rows(), B.cols());
    qr.setThreshold(kRankTolerance);
    qr.compute(Eigen::MatrixXd(B));
    add(qr, rows);
  };
  if (assembly.n() <= kDenseLimit) {
    add_dense(A, nullptr);
    return result;
  }
  for (const MatrixPart& p : matrix_parts(A)) {
    if (p.columns.empty()) continue;
    if (p.rows.empty()) {  // a row of zeros
      for (const int row : p.columns)
        if (assembly.is_there(row)) result.dependent_rows.push_back(row);
    } else if (p.rows.size() <= kDenseLimit) {
      add_dense(p.matrix, &p.columns);
    } else if (LeastSquares(p.matrix).full_rank()) {
      result.rank += static_cast<int>(p.columns.size());
    } else if (const auto dependent = dependent_columns(p.matrix)) {
      result.rank += static_cast<int>(p.columns.size() - dependent->size());
      for (const int j : *dependent)
        if (const int row = p.columns[static_cast<std::size_t>(j)]; assembly.is_there(row))
          result.dependent_rows.push_back(row);
    } else {
      add(*orthogonal_factors(p.matrix), &p.columns);
    }
  }
  return result;
}

}  // namespace costate
