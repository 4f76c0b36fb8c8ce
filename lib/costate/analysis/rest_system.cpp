#include "costate/analysis/rest_system.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/analysis/picks.h"
#include "costate/mechanism/coordinate_parts.h"

namespace costate {

using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kNoStiffness = 1e-11;  // of the largest stiffness, in the metric of the masses
constexpr double kSingular = 1e-9;      // of pivots of equilibrated matrices

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

// What directions without mass get of the largest mass, so that they have one: for the search hardly anything, to tell
// what nothing holds enough for the stiffness there not to hide that of the others.
constexpr double kAnyMass = 1e-14, kSomeMass = 1e-8;

/// The metric of the masses.
MatrixXd metric(const MatrixXd& M, double least) {
  const double largest = M.size() > 0 ? M.diagonal().maxCoeff() : 0;
  return M + (largest > 0 ? least * largest : 1.0) * MatrixXd::Identity(M.rows(), M.cols());
}

MatrixXd symmetric(const MatrixXd& A) { return 0.5 * (A + A.transpose()); }

using Symmetric = Eigen::GeneralizedSelfAdjointEigenSolver<MatrixXd>;

}  // namespace

RestSystem::RestSystem(Assembly& assembly, double t, const std::vector<HeldPosition>& held)
    : assembly_(assembly),
      held_(held),
      n_(assembly.n()),
      m_(assembly.m()),
      nz_(assembly.nz()),
      t_(t),
      rest_(static_cast<std::size_t>(assembly.n()), 0.0),
      largest_z_(VectorXd::Zero(assembly.nz())) {
  find_parts();
}

void RestSystem::find_parts() {
  const Mechanism& m = assembly_.mechanism();
  const std::vector<int> root = coordinate_parts(m);
  std::vector<int> part(static_cast<std::size_t>(n_), -1);
  const auto part_of_coordinate = [&](int i) -> Part& {
    int& k = part[static_cast<std::size_t>(root[static_cast<std::size_t>(i)])];
    if (k < 0) {
      k = static_cast<int>(parts_.size());
      parts_.emplace_back();
    }
    return parts_[static_cast<std::size_t>(k)];
  };
  const auto enter = [](std::vector<int>& list, std::vector<int>& local, int number) {
    local[static_cast<std::size_t>(number)] = static_cast<int>(list.size());
    list.push_back(number);
  };
  local_q_.resize(static_cast<std::size_t>(n_));
  local_row_.resize(static_cast<std::size_t>(m_));
  local_state_.resize(static_cast<std::size_t>(nz_));
  for (int i = 0; i < n_; ++i) enter(part_of_coordinate(i).q, local_q_, i);
  for (std::size_t k = 0; k < m.constraints().size(); ++k)
    for (int i = 0; i < m.constraints()[k]->rows(); ++i)
      enter(part_of_coordinate(m.constraints()[k]->coordinates().front()).rows, local_row_, m.row_offsets()[k] + i);
  for (std::size_t k = 0; k < m.forces().size(); ++k) {
    const auto& q = m.forces()[k]->coordinates();
    if (m.forces()[k]->states() == 0) continue;
    if (q.empty()) parts_.emplace_back();
    Part& p = q.empty() ? parts_.back() : part_of_coordinate(q.front());
    for (int i = 0; i < m.forces()[k]->states(); ++i) enter(p.states, local_state_, m.state_offsets()[k] + i);
  }
  for (std::size_t h = 0; h < held_.size(); ++h)
    part_of_coordinate(held_[h].coordinate).held.push_back(static_cast<int>(h));
}

StateView RestSystem::state() const {
  StateView s;
  s.t = t_;
  s.q = q_.data();
  s.v = s.a = rest_.data();
  s.lambda = multipliers_.data();
  s.z = z_.data();
  return s;
}

MatrixXd RestSystem::part_of(const SparsePattern& pattern, const std::vector<double>& values,
                             const std::vector<int>& columns, const std::vector<int>& local_row,
                             std::size_t row_count) const {
  MatrixXd A = MatrixXd::Zero(static_cast<Eigen::Index>(row_count), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t c = 0; c < columns.size(); ++c) {
    const auto j = static_cast<std::size_t>(columns[c]);
    for (auto k = pattern.column_start[j]; k < pattern.column_start[j + 1]; ++k)
      A(local_row[static_cast<std::size_t>(pattern.row[static_cast<std::size_t>(k)])], static_cast<Eigen::Index>(c)) +=
          values[static_cast<std::size_t>(k)];
  }
  return A;
}

std::vector<int> RestSystem::row_numbers(const Part& p) const {
  std::vector<int> r = p.rows;
  for (const int h : p.held) r.push_back(m_ + h);
  return r;
}

MatrixXd RestSystem::calc_rows(const Part& p) const {
  const auto rows = static_cast<Eigen::Index>(p.rows.size());
  MatrixXd X = MatrixXd::Zero(rows + static_cast<Eigen::Index>(p.held.size()), static_cast<Eigen::Index>(p.q.size()));
  X.topRows(rows) = part_of(assembly_.jacobian(), assembly_.phi_q, p.q, local_row_, p.rows.size());
  for (std::size_t h = 0; h < p.held.size(); ++h)
    X(rows + static_cast<Eigen::Index>(h),
      local_q_[static_cast<std::size_t>(held_[static_cast<std::size_t>(p.held[h])].coordinate)]) = 1;
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
  const VectorXd Q = Eigen::Map<const VectorXd>(assembly_.Q.data(), n_);
  unbalanced_.resize(n_);
  for (Part& p : parts_) {
    p.here.compute(calc_rows(p));
    const VectorXd force = pick(Q, p.q), lambda = p.here.solve_transposed(force);
    put(lambda, row_numbers(p), multipliers_);
    put(force - p.here.matrix().transpose() * lambda, p.q, unbalanced_);
  }
  rate_ = Eigen::Map<const VectorXd>(assembly_.zdot.data(), nz_);
}

VectorXd RestSystem::closing_step() const {
  VectorXd step(n_);
  for (const Part& p : parts_) put(p.here.solve(-pick(gap_, row_numbers(p))), p.q, step);
  return step;
}

void RestSystem::linearize() {
  assembly_.calc_dynamics(state());
  assembly_.calc_partials(state());
  freedom_ = 0;
  lowest_ = std::numeric_limits<double>::infinity();
  highest_ = 0;
  for (Part& p : parts_) {
    linearize(p);
    freedom_ += static_cast<int>(p.N.cols());
    measure_stiffness(p);
  }
  if (freedom_ == 0) lowest_ = 0;
}

void RestSystem::linearize(Part& p) {
  p.linear = p.here;
  p.N = p.linear.null_space();
  p.M = part_of(assembly_.square(), assembly_.M, p.q, local_q_, p.q.size());
  p.K = part_of(assembly_.square(), assembly_.K, p.q, local_q_, p.q.size());
  p.Q_z = part_of(assembly_.force_state(), assembly_.Q_z, p.states, local_q_, p.q.size());
  const MatrixXd f_q = part_of(assembly_.state_force(), assembly_.f_q, p.q, local_state_, p.states.size()),
                 f_z = part_of(assembly_.state_state(), assembly_.f_z, p.states, local_state_, p.states.size());
  // States that neither move nor can be moved at rest (a tyre that does not roll) stay where they are.
  p.free.clear();
  for (std::size_t i = 0; i < p.states.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(i);
    if (!assembly_.mechanism().held_states()[static_cast<std::size_t>(p.states[i])] &&
        (rate_[p.states[i]] != 0 || (f_q.row(row).array() != 0).any() || (f_z.row(row).array() != 0).any()))
      p.free.push_back(static_cast<int>(i));
  }
  p.f_q = pick_rows(f_q, p.free);
  p.f_z = pick_rows(f_z, p.free);
  p.f_zz = pick_columns(p.f_z, p.free);
  p.NQ_z = p.N.transpose() * pick_columns(p.Q_z, p.free);
  p.f_qN = p.f_q * p.N;
  p.Mr = p.N.transpose() * p.M * p.N;
  p.Kr = p.N.transpose() * p.K * p.N;
  p.Kz = p.Kr;
  p.eliminated = kernel(p.f_zz).cols() == 0;
  if (p.eliminated && !p.free.empty()) p.Kz += p.NQ_z * solve_square(p.f_zz, p.f_qN);
}

void RestSystem::measure_stiffness(const Part& p) {
  const Eigen::Index f = p.N.cols();
  if (f == 0 || !p.Kz.allFinite()) return;
  constexpr double kSymmetric = 1e-9;
  double low, high;
  if ((p.Kz - p.Kz.transpose()).norm() > kSymmetric * p.Kz.norm()) {
    // Forces that follow the motion: what grows by itself is a negative root, not a form that is not definite.
    const MatrixXd by_mass = metric(p.Mr, kAnyMass).ldlt().solve(p.Kz);
    const VectorXd roots = Eigen::EigenSolver<MatrixXd>(by_mass, false).eigenvalues().real();
    low = roots.minCoeff();
    high = roots.cwiseAbs().maxCoeff();
  } else {
    const Symmetric eigen(symmetric(p.Kz), metric(p.Mr, kAnyMass), Eigen::EigenvaluesOnly);
    low = eigen.eigenvalues()[0];
    high = std::max(std::abs(low), std::abs(eigen.eigenvalues()[f - 1]));
  }
  lowest_ = std::min(lowest_, std::abs(low) < kNoStiffness * high ? 0 : low);
  highest_ = std::max(highest_, high);
}

MatrixXd RestSystem::Part::reduced(double sigma) const {
  const Eigen::Index f = N.cols(), nz = f_zz.rows();
  MatrixXd J(f + nz, f + nz);
  J << Kr + sigma * Mr, -NQ_z, f_qN, f_zz;
  return J;
}

RestStep RestSystem::newton(double sigma) const {
  RestStep step{VectorXd::Zero(n_), VectorXd::Zero(nz_)};
  for (const Part& p : parts_) {
    const VectorXd closing = p.linear.solve(-pick(gap_, row_numbers(p)));
    const Eigen::Index f = p.N.cols(), nz = p.f_zz.rows();
    const std::vector<int> states = chosen(p.states, p.free);
    VectorXd right(f + nz);
    right << p.N.transpose() * (pick(unbalanced_, p.q) - p.K * closing), -pick(rate_, states) - p.f_q * closing;
    const VectorXd x = solve_square(p.reduced(sigma), right);
    put(closing + p.N * x.head(f), p.q, step.q);
    put(x.tail(nz), states, step.z);
  }
  return step;
}

double RestSystem::step_size(const RestStep& step) const {
  double r = step.q.norm();
  for (int i = 0; i < nz_; ++i)
    if (step.z[i] != 0) r = std::max(r, std::abs(step.z[i]) / std::max(largest_z_[i], std::abs(step.z[i])));
  return r;
}

std::vector<int> RestSystem::held_twice() const {
  std::vector<int> twice;
  for (const Part& p : parts_) {
    const auto rows = static_cast<Eigen::Index>(p.rows.size()), held = static_cast<Eigen::Index>(p.held.size());
    if (held == 0) continue;
    RowSpace space;
    const auto rank = [&](Eigen::Index count) {
      space.compute(p.linear.matrix().topRows(count));
      return space.rank();
    };
    int before = rank(rows);
    if (p.linear.rank() == before + static_cast<int>(held)) continue;
    for (Eigen::Index h = 0; h < held; ++h) {
      const int with = rank(rows + h + 1);
      if (with == before) twice.push_back(p.held[static_cast<std::size_t>(h)]);
      before = with;
    }
  }
  return twice;
}

std::vector<std::string> RestSystem::undetermined() const {
  const Mechanism& m = assembly_.mechanism();
  std::vector<std::string> names;
  const auto add = [&](const Part& p, const VectorXd& q, const VectorXd& z) {
    // The largest entry that is not named yet.
    double largest = -1;
    std::string name;
    for (std::size_t i = 0; i < p.q.size(); ++i) {
      const std::string& c = m.coordinates()[static_cast<std::size_t>(p.q[i])].name;
      const double x = std::abs(q[static_cast<Eigen::Index>(i)]);
      if (!(x > largest) || std::find(names.begin(), names.end(), c) != names.end()) continue;
      largest = x;
      name = c;
    }
    const auto states = m.state_names();
    for (std::size_t i = 0; i < p.free.size(); ++i)
      if (std::abs(z[static_cast<Eigen::Index>(i)]) > 1e6 * largest)
        name = "the force state " + states[static_cast<std::size_t>(p.states[static_cast<std::size_t>(p.free[i])])];
    names.push_back(name);
  };
  for (const Part& p : parts_) {
    const Eigen::Index f = p.N.cols(), nz = p.f_zz.rows();
    if (f + nz == 0) continue;
    if (!p.eliminated) {
      const MatrixXd null = kernel(p.reduced(0));
      for (Eigen::Index k = 0; k < null.cols(); ++k) add(p, p.N * null.col(k).head(f), null.col(k).tail(nz));
    } else if (f > 0) {
      const Symmetric eigen(symmetric(p.Kz), metric(p.Mr, kSomeMass));
      const MatrixXd V = eigen.eigenvectors(), null = V * kernel(V.transpose() * p.Kz * V);
      for (Eigen::Index k = 0; k < null.cols(); ++k) add(p, p.N * null.col(k), VectorXd::Zero(nz));
    }
  }
  return names;
}

}  // namespace costate
