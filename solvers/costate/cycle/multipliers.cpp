#include "costate/cycle/multipliers.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"

namespace costate {

std::vector<std::complex<double>> multipliers_of(const Eigen::MatrixXd& P, int trivial) {
  if (P.rows() == 0) return {};
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(P, false);
  if (solver.info() != Eigen::Success) throw SolverError("The eigenvalue problem of the multipliers did not converge.");
  std::vector<std::complex<double>> m(solver.eigenvalues().begin(), solver.eigenvalues().end());
  std::sort(m.begin(), m.end(), [](const auto& a, const auto& b) {
    const double x = std::abs(a), y = std::abs(b);
    if (std::abs(x - y) > 1e-12 * std::max(x, y)) return x > y;
    return a.imag() > b.imag();
  });
  m.resize(m.size() - std::min(m.size(), static_cast<std::size_t>(trivial)));
  return m;
}

double multiplier_error(const Eigen::MatrixXd& P, const Eigen::MatrixXd& other, std::complex<double> m) {
  if (P.rows() == 0) return 0;
  const Eigen::EigenSolver<Eigen::MatrixXd> right(P), left(P.transpose().eval()), changed(other, false);
  for (const auto* solver : {&right, &left, &changed})
    if (solver->info() != Eigen::Success)
      throw SolverError("The eigenvalue problem of the multipliers did not converge.");
  const auto nearest = [](const Eigen::VectorXcd& of, std::complex<double> to) {
    Eigen::Index k = 0;
    (of.array() - to).abs().minCoeff(&k);
    return k;
  };
  const Eigen::VectorXcd all = right.eigenvalues();
  const Eigen::Index k = nearest(all, m);
  const double change = std::abs(changed.eigenvalues()[nearest(changed.eigenvalues(), all[k])] - all[k]);
  const Eigen::VectorXcd w = right.eigenvectors().col(k),
                         u = left.eigenvectors().col(nearest(left.eigenvalues(), all[k]));
  const double product = std::abs((u.transpose() * w).value()),
               sum = (u.cwiseAbs() * w.cwiseAbs().transpose()).cwiseProduct(other - P).norm();
  double next = std::numeric_limits<double>::infinity();  // the distance to the next one
  for (Eigen::Index i = 0; i < all.size(); ++i)
    if (i != k) next = std::min(next, std::abs(all[i] - all[k]));
  double terms = product > 0 ? sum / product : 0;
  // From where two meet they move apart as the root of what changes.
  if (terms > next) terms = std::sqrt(terms * next);
  return std::max(change, std::sqrt(change * terms));
}

}  // namespace costate
