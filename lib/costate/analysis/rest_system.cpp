#include "costate/analysis/rest_system.h"

#include <algorithm>
#include <cmath>

#include "costate/analysis/start.h"

namespace costate {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kNoStiffness = 1e-11;  // of the largest stiffness, in the metric of the masses
constexpr double kSingular = 1e-9;      // of pivots of equilibrated matrices

MatrixXd columns_of(const MatrixXd& A, const std::vector<int>& which) {
  MatrixXd B(A.rows(), static_cast<Eigen::Index>(which.size()));
  for (std::size_t i = 0; i < which.size(); ++i) B.col(static_cast<Eigen::Index>(i)) = A.col(which[i]);
  return B;
}

MatrixXd rows_of(const MatrixXd& A, const std::vector<int>& which) {
  MatrixXd B(static_cast<Eigen::Index>(which.size()), A.cols());
  for (std::size_t i = 0; i < which.size(); ++i) B.row(static_cast<Eigen::Index>(i)) = A.row(which[i]);
  return B;
}

MatrixXd solve_square(const MatrixXd& A, const MatrixXd& b) {
  if (A.rows() == 0) return MatrixXd::Zero(0, b.cols());
  return A.partialPivLu().solve(b);
}

/// Null vectors of A, rows and columns brought to comparable sizes first.
MatrixXd kernel(const MatrixXd& A) {
  const Eigen::Index n = A.rows();
  if (n == 0) return MatrixXd::Zero(0, 0);
  VectorXd size(n);
  for (Eigen::Index i = 0; i < n; ++i) size[i] = std::max(A.row(i).norm(), A.col(i).norm());
  const double largest = size.maxCoeff();
  if (!(largest > 0)) return MatrixXd::Identity(n, n);
  for (Eigen::Index i = 0; i < n; ++i) size[i] = 1 / std::sqrt(size[i] > kNoStiffness * largest ? size[i] : largest);
  Eigen::FullPivLU<MatrixXd> lu(size.asDiagonal() * A * size.asDiagonal());
  lu.setThreshold(kSingular);
  if (lu.dimensionOfKernel() == 0) return MatrixXd::Zero(n, 0);
  return size.asDiagonal() * lu.kernel();
}

}  // namespace

RestSystem::RestSystem(Assembly& assembly, double t, const std::vector<HeldPosition>& held)
    : assembly_(assembly),
      held_(held),
      n_(assembly.n()),
      m_(assembly.m()),
      nz_(assembly.nz()),
      t_(t),
      rest_(static_cast<std::size_t>(assembly.n()), 0.0),
      largest_z_(VectorXd::Zero(assembly.nz())) {}

StateView RestSystem::state() const {
  StateView s;
  s.t = t_;
  s.q = q_.data();
  s.v = s.a = rest_.data();
  s.lambda = multipliers_.data();
  s.z = z_.data();
  return s;
}

MatrixXd RestSystem::calc_rows() const {
  MatrixXd X = MatrixXd::Zero(m_ + static_cast<Eigen::Index>(held_.size()), n_);
  X.topRows(m_) = dense_matrix(assembly_.jacobian(), assembly_.phi_q);
  for (std::size_t h = 0; h < held_.size(); ++h) X(m_ + static_cast<Eigen::Index>(h), held_[h].coordinate) = 1;
  return X;
}

double RestSystem::row_scale() const {
  double r = 1;
  for (const double x : assembly_.phi_q) r = std::max(r, std::abs(x));
  return r;
}

void RestSystem::move_to(const VectorXd& q, const VectorXd& z) {
  q_ = q;
  z_ = z;
  largest_z_ = largest_z_.cwiseMax(z.cwiseAbs());
  multipliers_.setZero(m_ + static_cast<Eigen::Index>(held_.size()));
  assembly_.calc_dynamics(state());
  gap_.resize(multipliers_.size());
  std::copy(assembly_.phi.begin(), assembly_.phi.end(), gap_.data());
  for (std::size_t h = 0; h < held_.size(); ++h)
    gap_[m_ + static_cast<Eigen::Index>(h)] = q_[held_[h].coordinate] - held_[h].value;
  here_.compute(calc_rows());
  const VectorXd Q = Eigen::Map<const VectorXd>(assembly_.Q.data(), n_);
  multipliers_ = here_.solve_transposed(Q);
  unbalanced_ = Q - here_.matrix().transpose() * multipliers_;
  rate_ = Eigen::Map<const VectorXd>(assembly_.zdot.data(), nz_);
}

VectorXd RestSystem::closing_step() const { return here_.solve(-gap_); }

void RestSystem::linearize() {
  assembly_.calc_dynamics(state());
  assembly_.calc_partials(state());
  linear_ = here_;
  N_ = linear_.null_space();
  M_ = dense_matrix(assembly_.square(), assembly_.M);
  K_ = dense_matrix(assembly_.square(), assembly_.K);
  const MatrixXd Q_z = dense_matrix(assembly_.force_state(), assembly_.Q_z), f_q = dense_matrix(assembly_.state_force(), assembly_.f_q),
                 f_z = dense_matrix(assembly_.state_state(), assembly_.f_z);
  // States that neither move nor can be moved at rest (a tyre that does not roll) stay where they are.
  free_states_.clear();
  for (int i = 0; i < nz_; ++i)
    if (!assembly_.mechanism().held_states()[static_cast<std::size_t>(i)] &&
        (rate_[i] != 0 || f_q.row(i).any() || f_z.row(i).any()))
      free_states_.push_back(i);
  Q_z_ = columns_of(Q_z, free_states_);
  f_q_ = rows_of(f_q, free_states_);
  f_z_ = columns_of(rows_of(f_z, free_states_), free_states_);
  Mr_ = N_.transpose() * M_ * N_;
  Kr_ = N_.transpose() * K_ * N_;
  Kz_ = Kr_;
  eliminated_ = kernel(f_z_).cols() == 0;
  if (eliminated_ && !free_states_.empty()) Kz_ += N_.transpose() * Q_z_ * solve_square(f_z_, f_q_ * N_);
  measure_stiffness();
}

void RestSystem::measure_stiffness() {
  lowest_ = highest_ = 0;
  const Eigen::Index f = N_.cols();
  if (f == 0 || !Kz_.allFinite()) return;
  // Directions without mass get a little, so that they have a metric.
  const double largest = Mr_.diagonal().maxCoeff();
  const MatrixXd mass = Mr_ + (largest > 0 ? 1e-14 * largest : 1.0) * MatrixXd::Identity(f, f);
  const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> eigen(0.5 * (Kz_ + Kz_.transpose()), mass,
                                                                 Eigen::EigenvaluesOnly);
  lowest_ = eigen.eigenvalues()[0];
  highest_ = std::max(std::abs(lowest_), std::abs(eigen.eigenvalues()[f - 1]));
  if (std::abs(lowest_) < kNoStiffness * highest_) lowest_ = 0;
}

MatrixXd RestSystem::reduced_matrix(double sigma) const {
  const Eigen::Index f = N_.cols(), nz = f_z_.rows();
  MatrixXd J(f + nz, f + nz);
  J << Kr_ + sigma * Mr_, -N_.transpose() * Q_z_, f_q_ * N_, f_z_;
  return J;
}

RestStep RestSystem::newton(double sigma) const {
  RestStep step;
  const VectorXd closing = linear_.solve(-gap_);
  const Eigen::Index f = N_.cols(), nz = f_z_.rows();
  VectorXd right(f + nz);
  right.head(f) = N_.transpose() * (unbalanced_ - K_ * closing);
  for (Eigen::Index i = 0; i < nz; ++i) right[f + i] = -rate_[free_states_[static_cast<std::size_t>(i)]];
  right.tail(nz) -= f_q_ * closing;
  const VectorXd x = solve_square(reduced_matrix(sigma), right);
  step.q = closing + N_ * x.head(f);
  step.z = VectorXd::Zero(nz_);
  for (Eigen::Index i = 0; i < nz; ++i) step.z[free_states_[static_cast<std::size_t>(i)]] = x[f + i];
  return step;
}

double RestSystem::step_size(const RestStep& step) const {
  double r = n_ > 0 ? step.q.norm() : 0;
  for (int i = 0; i < nz_; ++i)
    if (step.z[i] != 0) r = std::max(r, std::abs(step.z[i]) / std::max(largest_z_[i], std::abs(step.z[i])));
  return r;
}

std::vector<std::string> RestSystem::undetermined() const {
  const Mechanism& m = assembly_.mechanism();
  std::vector<std::string> names;
  const auto add = [&](const VectorXd& q, const VectorXd& z) {
    // The largest entry that is not named yet.
    double largest = -1;
    std::string name;
    for (int i = 0; i < n_; ++i) {
      const std::string& c = m.coordinates()[static_cast<std::size_t>(i)].name;
      if (std::abs(q[i]) > largest && std::find(names.begin(), names.end(), c) == names.end()) {
        largest = std::abs(q[i]);
        name = c;
      }
    }
    const auto states = m.state_names();
    for (std::size_t i = 0; i < free_states_.size(); ++i)
      if (std::abs(z[static_cast<Eigen::Index>(i)]) > 1e6 * largest)
        name = "the force state " + states[static_cast<std::size_t>(free_states_[i])];
    names.push_back(name);
  };
  const Eigen::Index f = N_.cols(), nz = f_z_.rows();
  if (eliminated_) {
    if (f == 0) return names;
    const double largest = Mr_.diagonal().maxCoeff();
    const MatrixXd mass = Mr_ + (largest > 0 ? 1e-14 * largest : 1.0) * MatrixXd::Identity(f, f);
    const Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd> eigen(0.5 * (Kz_ + Kz_.transpose()), mass);
    const MatrixXd V = eigen.eigenvectors(), null = V * kernel(V.transpose() * Kz_ * V);
    for (Eigen::Index k = 0; k < null.cols(); ++k) add(N_ * null.col(k), VectorXd::Zero(nz));
    return names;
  }
  const MatrixXd null = kernel(reduced_matrix(0));
  for (Eigen::Index k = 0; k < null.cols(); ++k) add(N_ * null.col(k).head(f), null.col(k).tail(nz));
  return names;
}

MatrixXd RestSystem::lambda_off_range(const MatrixXd& q_rho) {
  // lambda = X w turns with X where rows are redundant: the part off the range of X is (1 - X X^+) X_rho w.
  const VectorXd w = linear_.solve(multipliers_);
  StateView s = state();
  Assembly::ParameterColumns moved, still;
  assembly_.resize(moved);
  assembly_.resize(still);
  assembly_.calc_parameter_columns(s, still);
  const std::vector<double> phid_q = assembly_.phid_q;
  s.v = w.data();
  assembly_.calc_dynamics(s);
  assembly_.calc_partials(s);
  assembly_.calc_parameter_columns(s, moved);
  MatrixXd d = MatrixXd::Zero(multipliers_.size(), q_rho.cols());
  d.topRows(m_) = moved.phid - still.phid +
                  (dense_matrix(assembly_.jacobian(), assembly_.phid_q) - dense_matrix(assembly_.jacobian(), phid_q)) * q_rho;
  return d - linear_.matrix() * linear_.solve(d);
}

void RestSystem::differentiate(MatrixXd& q_rho, MatrixXd& z_rho, MatrixXd& lambda_rho, MatrixXd& held_rho) {
  linearize();
  const int np = assembly_.np();
  Assembly::ParameterColumns c;
  assembly_.resize(c);
  assembly_.calc_parameter_columns(state(), c);
  const auto& columns = assembly_.number_columns();
  MatrixXd right = MatrixXd::Zero(multipliers_.size(), np);
  right.topRows(m_) = -c.phi;
  for (std::size_t h = 0; h < held_.size(); ++h)
    if (held_[h].number >= 0)
      for (const auto& [column, factor] : columns[static_cast<std::size_t>(held_[h].number)])
        right(m_ + static_cast<Eigen::Index>(h), column) += factor;
  const MatrixXd closing = linear_.solve(right);
  VectorXd z0(nz_);
  calc_initial_states(assembly_, z0, &z_rho);
  // Of held states the initial values; of free ones what follows.
  MatrixXd held_z = z_rho;
  for (const int i : free_states_) held_z.row(i).setZero();
  const MatrixXd F = c.F - dense_matrix(assembly_.force_state(), assembly_.Q_z) * held_z + K_ * closing;
  const MatrixXd rate = rows_of(c.f + dense_matrix(assembly_.state_state(), assembly_.f_z) * held_z, free_states_) + f_q_ * closing;
  const Eigen::Index f = N_.cols(), nz = f_z_.rows();
  MatrixXd b(f + nz, np);
  b << -N_.transpose() * F, -rate;
  const MatrixXd x = solve_square(reduced_matrix(0), b);
  q_rho = closing + N_ * x.topRows(f);
  z_rho = held_z;
  for (Eigen::Index i = 0; i < nz; ++i) z_rho.row(free_states_[static_cast<std::size_t>(i)]) = x.row(f + i);
  const MatrixXd force = c.F + K_ * q_rho - dense_matrix(assembly_.force_state(), assembly_.Q_z) * z_rho;
  MatrixXd multipliers = -linear_.solve_transposed(force);
  if (linear_.rank() < multipliers_.size()) multipliers += lambda_off_range(q_rho);
  lambda_rho = multipliers.topRows(m_);
  held_rho = multipliers.bottomRows(static_cast<Eigen::Index>(held_.size()));
}

void RestSystem::solve_adjoint(const VectorXd& weight_q, const VectorXd& weight_z, VectorXd& s, VectorXd& w,
                               VectorXd& x) const {
  const Eigen::Index f = N_.cols(), nz = f_z_.rows();
  VectorXd b(f + nz);
  b.head(f) = N_.transpose() * weight_q;
  for (Eigen::Index i = 0; i < nz; ++i) b[f + i] = weight_z[free_states_[static_cast<std::size_t>(i)]];
  const VectorXd solved = solve_square(reduced_matrix(0).transpose(), b);
  s = N_ * solved.head(f);
  w = VectorXd::Zero(nz_);
  for (Eigen::Index i = 0; i < nz; ++i) w[free_states_[static_cast<std::size_t>(i)]] = solved[f + i];
  x = VectorXd(linear_.solve_transposed(weight_q - K_.transpose() * s - f_q_.transpose() * solved.tail(nz))).head(m_);
}

}  // namespace costate
