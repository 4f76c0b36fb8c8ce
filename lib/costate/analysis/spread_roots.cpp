#include "costate/analysis/spread_roots.h"

#include <Eigen/Dense>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "costate/base/error.h"
#include "costate/base/stop.h"

namespace costate {

using Eigen::MatrixXcd;
using Eigen::MatrixXd;
using Eigen::VectorXcd;
using Eigen::VectorXd;

namespace {

using Long = long double;
using Complex = std::complex<double>;
using LongComplex = std::complex<Long>;
using LongMatrix = Eigen::Matrix<Long, Eigen::Dynamic, Eigen::Dynamic>;
using LongComplexMatrix = Eigen::Matrix<LongComplex, Eigen::Dynamic, Eigen::Dynamic>;
using LongComplexVector = Eigen::Matrix<LongComplex, Eigen::Dynamic, 1>;

constexpr double kEps = std::numeric_limits<double>::epsilon();
constexpr double kTerms = 8 * kEps;   // rounding of an entry, of its terms
constexpr double kNull = 200 * kEps;  // of a singular value, of the terms along its vectors
constexpr double kOneVector = 1e-3;   // y^T x of unit vectors, below which two roots may share theirs
constexpr double kAccurate = 1e-9;    // a root of the QR iteration that is good to this is left as it is
// Of the largest entry, what a rounded angle leaves of one that acts square to it, twice: the cosine of pi/2, squared.
constexpr double kSquaredRounding = 100 * kEps * kEps;
constexpr Eigen::Index kLongLimit = 80;  // rows up to which the QR iteration is done in long numbers
constexpr int kMostSweeps = 300;

/// Sets of rows that no entry connects.
std::vector<std::vector<int>> parts_of(const MatrixXd& A) {
  const int n = static_cast<int>(A.rows());
  std::vector<int> root(static_cast<std::size_t>(n));
  std::iota(root.begin(), root.end(), 0);
  const auto find = [&](int i) {
    while (root[static_cast<std::size_t>(i)] != i) i = root[static_cast<std::size_t>(i)];
    return i;
  };
  for (int j = 0; j < n; ++j)
    for (int i = 0; i < n; ++i)
      if (A(i, j) != 0) root[static_cast<std::size_t>(find(i))] = find(j);
  std::vector<std::vector<int>> parts(static_cast<std::size_t>(n));
  for (int i = 0; i < n; ++i) parts[static_cast<std::size_t>(find(i))].push_back(i);
  std::erase_if(parts, [](const auto& p) { return p.empty(); });
  return parts;
}

/// A becomes D^-1 A D with rows and columns of comparable size, D powers of two.
VectorXd balance(MatrixXd& A, MatrixXd& terms) {
  const Eigen::Index n = A.rows();
  VectorXd d = VectorXd::Ones(n);
  bool changed = true;
  for (int sweep = 0; changed && sweep < 100; ++sweep) {
    changed = false;
    for (Eigen::Index i = 0; i < n; ++i) {
      const double self = std::abs(A(i, i)), row = A.row(i).cwiseAbs().sum() - self,
                   column = A.col(i).cwiseAbs().sum() - self;
      if (!(row > 0) || !(column > 0)) continue;
      const double f = std::exp2(std::round(std::log2(row / column) / 2));
      if (!(column * f + row / f < 0.95 * (column + row))) continue;
      d[i] *= f;
      A.col(i) *= f;
      A.row(i) /= f;
      terms.col(i) *= f;
      terms.row(i) /= f;
      changed = true;
    }
  }
  return d;
}

/// Orthonormal vectors that changes of A by rounding can make null vectors, found with rows and columns of size 1.
MatrixXd null_vectors(const MatrixXd& A, const MatrixXd& terms) {
  const Eigen::Index n = A.rows();
  VectorXd row = VectorXd::Ones(n), column = VectorXd::Ones(n);
  const auto scaled = [&](const MatrixXd& X) -> MatrixXd { return row.asDiagonal() * X * column.asDiagonal(); };
  for (int sweep = 0; sweep < 200; ++sweep) {
    const MatrixXd S = scaled(terms).cwiseMax(scaled(A.cwiseAbs()));
    for (Eigen::Index i = 0; i < n; ++i) {
      const double r = S.row(i).maxCoeff(), c = S.col(i).maxCoeff();
      if (r > 0) row[i] /= std::sqrt(r);
      if (c > 0) column[i] /= std::sqrt(c);
    }
  }
  const MatrixXd S = scaled(A), T = scaled(terms).cwiseMax(S.cwiseAbs());
  const Eigen::JacobiSVD<MatrixXd> svd(S, Eigen::ComputeFullU | Eigen::ComputeFullV);
  std::vector<int> null;
  for (Eigen::Index k = 0; k < n; ++k) {
    const double size = svd.matrixU().col(k).cwiseAbs().dot(T * svd.matrixV().col(k).cwiseAbs());
    if (!(svd.singularValues()[k] > kNull * std::max(size, 1e-3))) null.push_back(static_cast<int>(k));
  }
  if (null.empty()) return MatrixXd(n, 0);
  const MatrixXd N = column.asDiagonal() * svd.matrixV()(Eigen::all, null);
  const Eigen::HouseholderQR<MatrixXd> qr(N);
  return qr.householderQ() * MatrixXd::Identity(n, n);  // those of the null space first, then the others
}

/// A in the orthonormal basis V has zeros in its first columns: those of its zero eigenvalues, chains included.
struct Deflated {
  MatrixXd A, terms, V;
  Eigen::Index zeros = 0;
};

Deflated split_zeros(const MatrixXd& A, const MatrixXd& terms) {
  const Eigen::Index n = A.rows();
  Deflated d{A, terms, MatrixXd::Identity(n, n), 0};
  while (d.zeros < n) {
    const Eigen::Index rest = n - d.zeros;
    const MatrixXd block = d.A.bottomRightCorner(rest, rest), block_terms = d.terms.bottomRightCorner(rest, rest);
    const MatrixXd V = null_vectors(block, block_terms);
    if (V.cols() == 0) break;
    // As many as it has null vectors: those that the block takes to nothing.
    Eigen::Index null = 0;
    const MatrixXd image = (block * V).cwiseAbs(), allowed = block_terms * V.cwiseAbs();
    while (null < rest && (image.col(null).array() <= 1e3 * kNull * allowed.col(null).array()).all()) ++null;
    if (null == 0) break;
    MatrixXd full = MatrixXd::Identity(n, n);
    full.bottomRightCorner(rest, rest) = V;
    d.A = full.transpose() * d.A * full;
    d.terms = full.transpose().cwiseAbs() * d.terms * full.cwiseAbs();
    d.V = d.V * full;
    d.A.block(d.zeros, d.zeros, rest, null).setZero();
    d.zeros += null;
  }
  return d;
}

/// Roots of B by the QR iteration with what its rounding may have done to each, and their vectors.
template <class Scalar>
void iterate(const MatrixXd& B, std::vector<LongComplex>& value, VectorXd& spoiled) {
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  using ComplexMatrix = Eigen::Matrix<std::complex<Scalar>, Eigen::Dynamic, Eigen::Dynamic>;
  const Eigen::EigenSolver<Matrix> eigen(B.cast<Scalar>());
  if (eigen.info() != Eigen::Success) throw SolverError("Modes: the eigenvalues did not converge.");
  const ComplexMatrix X = eigen.eigenvectors(), Y = X.fullPivLu().inverse();  // rows: y^T, y^T x = 1
  const Scalar rounding = std::numeric_limits<Scalar>::epsilon() * B.cast<Scalar>().norm();
  spoiled.resize(B.rows());
  for (Eigen::Index k = 0; k < B.rows(); ++k) {
    value.emplace_back(eigen.eigenvalues()[k]);
    const Scalar moved = 10 * rounding * Y.row(k).norm() * X.col(k).norm();
    spoiled[k] = std::isfinite(moved) ? static_cast<double>(moved) : HUGE_VAL;
  }
}

/// Null vectors of B - x from the right and the left, by inverse iteration.
void find_vectors(const MatrixXd& B, LongComplex x, VectorXcd& right, VectorXcd& left) {
  const Eigen::Index n = B.rows();
  LongComplexMatrix S = B.cast<LongComplex>();
  S.diagonal().array() -= x;
  for (const bool transposed : {false, true}) {
    Eigen::FullPivLU<LongComplexMatrix> lu(transposed ? LongComplexMatrix(S.transpose()) : S);
    // A pivot of nothing becomes one of rounding; of a double root with one vector it is the square of what is added.
    const Long size = std::abs(x) > 0 ? std::abs(x) : S.norm();
    for (Long added = std::numeric_limits<Long>::epsilon(); !(std::abs(lu.matrixLU()(n - 1, n - 1)) > 0) && added < 1;
         added *= 100) {
      S.diagonal().array() += added * size;
      lu.compute(transposed ? LongComplexMatrix(S.transpose()) : S);
    }
    lu.setThreshold(0);
    LongComplexVector v = LongComplexVector::Ones(n);
    for (Eigen::Index i = 0; i < n; ++i)
      v[i] += LongComplex(0.1L * static_cast<Long>(i % 7), 0.01L * static_cast<Long>(i));
    for (int k = 0; k < 3; ++k) {
      v = lu.solve(v);
      v /= v.norm();
    }
    (transposed ? left : right) = v.cast<Complex>();
  }
}

/// Those that `open` marks, with all others known.
void refine(const MatrixXd& B, std::vector<LongComplex>& x, std::vector<bool> open, Eigen::Index zeros) {
  const std::size_t n = x.size();
  // Apart from each other and from zero.
  for (std::size_t i = 0; i < n; ++i)
    for (std::size_t j = 0; open[i] && j < n; ++j)
      if (i != j && !(std::abs(x[i] - x[j]) > 1e-10L * std::abs(x[j])))
        x[i] += (std::abs(x[i]) > 0 ? std::abs(x[i]) : static_cast<Long>(B.norm())) *
                std::polar(1e-3L * static_cast<Long>(i + 1), static_cast<Long>(0.7 + static_cast<double>(i)));
  for (int sweep = 0; sweep < kMostSweeps; ++sweep) {
    check_stop();
    bool all = true;
    for (std::size_t i = 0; i < n; ++i) {
      if (!open[i]) continue;
      LongComplexMatrix S = -B.cast<LongComplex>();
      S.diagonal().array() += x[i];
      const Eigen::FullPivLU<LongComplexMatrix> lu(S);
      LongComplex sum = 0;
      const Long smallest = std::abs(lu.matrixLU()(lu.rows() - 1, lu.cols() - 1));
      if (!(smallest > 0)) {
        open[i] = false;  // on the root
        continue;
      }
      Eigen::FullPivLU<LongComplexMatrix> solver = lu;
      solver.setThreshold(0);
      sum = LongComplexMatrix(solver.solve(LongComplexMatrix::Identity(S.rows(), S.cols()))).trace();
      for (std::size_t j = 0; j < n; ++j)
        if (j != i) sum -= LongComplex(1) / (x[i] - x[j]);
      (void)zeros;  // B is without them
      const LongComplex step = LongComplex(1) / sum;
      if (!std::isfinite(std::abs(step))) {
        open[i] = false;
        continue;
      }
      x[i] -= step;
      if (std::abs(step) <= 1e-15L * std::abs(x[i]))
        open[i] = false;
      else
        all = false;
    }
    if (all) return;
  }
}

/// `nothing`: a smaller root is zero.
void add_roots(const MatrixXd& A_part, const MatrixXd& terms_part, const std::vector<int>& rows, Eigen::Index n,
               double nothing, Roots& out) {
  MatrixXd A = A_part, terms = terms_part;
  const VectorXd scale = balance(A, terms);
  const Deflated d = split_zeros(A, terms);
  out.zeros += static_cast<int>(d.zeros);
  const Eigen::Index size = A.rows(), rest = size - d.zeros;
  if (rest == 0) return;
  const MatrixXd B = d.A.bottomRightCorner(rest, rest), B_terms = d.terms.bottomRightCorner(rest, rest);
  std::vector<LongComplex> x;
  VectorXd spoiled;
  if (rest <= kLongLimit)
    iterate<Long>(B, x, spoiled);
  else
    iterate<double>(B, x, spoiled);
  std::vector<bool> open(static_cast<std::size_t>(rest));
  for (std::size_t k = 0; k < open.size(); ++k)
    open[k] = !(spoiled[static_cast<Eigen::Index>(k)] <= kAccurate * static_cast<double>(std::abs(x[k])));
  if (std::find(open.begin(), open.end(), true) != open.end()) refine(B, x, open, d.zeros);
  // The upper triangular block of the zeros: A00 x0 + A01 x1 = w x0, A00 nilpotent.
  const MatrixXcd A00 = d.A.topLeftCorner(d.zeros, d.zeros).cast<Complex>(),
                  A01 = d.A.topRightCorner(d.zeros, rest).cast<Complex>();
  int below = 0, above = 0;
  for (const LongComplex& value : x) {
    VectorXcd right, left;
    find_vectors(B, value, right, left);
    const double size_x = static_cast<double>(std::abs(value)), product = std::abs((left.transpose() * right).value());
    Root root;
    root.value = Complex(value);
    const double moved = kTerms * left.cwiseAbs().dot(B_terms * right.cwiseAbs() + size_x * right.cwiseAbs());
    root.error = moved / product;
    // A root that is one of two, with one vector for both, has y^T x = 0: it moves as the root of what entries do, and
    // the two stay together on the real axis or beside each other.
    const double of_two = std::sqrt(moved * B.norm());
    const bool defective = product < kOneVector && of_two < root.error;
    if (defective) root.error = of_two;
    if (!(root.error < size_x) || size_x <= nothing) {
      ++out.zeros;
      continue;
    }
    // A pair so near to the axis is real.
    if (std::abs(root.value.imag()) <= (defective ? root.error : std::min(root.error, 1e-12 * size_x)))
      root.value = root.value.real();
    if (root.value.imag() < 0) {
      ++below;
      continue;
    }
    if (root.value.imag() > 0) ++above;
    VectorXcd v(size);
    v.tail(rest) = right;
    if (d.zeros > 0)
      v.head(d.zeros) = (root.value * MatrixXcd::Identity(d.zeros, d.zeros) - A00).lu().solve(A01 * right);
    v = (d.V.cast<Complex>() * v).eval();
    v = (scale.cast<Complex>().asDiagonal() * v).eval();
    root.vector = VectorXcd::Zero(n);
    root.vector(rows) = v;
    out.roots.push_back(std::move(root));
  }
  if (below != above) throw SolverError("Modes: the eigenvalues did not converge to conjugate pairs.");
}

}  // namespace

Roots find_roots(MatrixXd A, const MatrixXd& terms) {
  // What rounding alone may have left couples nothing.
  A = (A.cwiseAbs().array() > kTerms * terms.array()).select(A, 0);
  Roots out;
  const double nothing = A.size() > 0 ? kSquaredRounding * A.cwiseAbs().maxCoeff() : 0;
  for (const auto& rows : parts_of(A)) add_roots(A(rows, rows), terms(rows, rows), rows, A.rows(), nothing, out);
  return out;
}

}  // namespace costate
