#include "costate/level/maggi_sparse_newton.h"

#include <algorithm>

namespace costate {

MaggiSparseNewton::MaggiSparseNewton(const Assembly& assembly)
    : n_(assembly.n()), m_(assembly.m()), nz_(assembly.nz()) {}

void MaggiSparseNewton::place(const Assembly& assembly, const std::vector<int>& independent) {
  if (matrix_ && independent == independent_) return;
  independent_ = independent;
  f_ = static_cast<int>(independent.size());
  std::vector<std::pair<int, int>> entries;
  for (int k = 0; k < f_; ++k) entries.emplace_back(k, independent[static_cast<std::size_t>(k)]);
  const SparsePattern B = SparsePattern::from_entries(f_, n_, std::move(entries));
  const SparsePattern &rows = assembly.jacobian(), &square = assembly.square();
  // Columns of dq, dv, da, dl, dz; rows as above.
  const int v = n_, a = 2 * n_, l = 3 * n_, z = 3 * n_ + m_;
  const int y = m_, velocity = y + f_, yd = velocity + m_, acceleration = yd + f_, force = acceleration + m_;
  matrix_ = std::make_unique<BlockMatrix>(3 * n_ + m_ + nz_);
  BlockMatrix& X = *matrix_;
  at_.phi_q = X.place(rows, 0, 0);
  at_.y_q = X.place(B, y, 0);
  at_.y_v = X.place(B, y, v);
  at_.phid_q = X.place(rows, velocity, 0);
  at_.phi_v = X.place(rows, velocity, v);
  at_.yd_v = X.place(B, yd, v);
  at_.yd_a = X.place(B, yd, a);
  at_.phidd_q = X.place(rows, acceleration, 0);
  at_.phid_v = X.place(rows, acceleration, v);
  at_.phi_a = X.place(rows, acceleration, a);
  at_.K = X.place(square, force, 0);
  at_.C = X.place(square, force, v);
  at_.M = X.place(square, force, a);
  at_.reaction = X.place(rows, force, l, true);
  at_.Q_z = X.place(assembly.force_state(), force, z);
  at_.f_q = X.place(assembly.state_force(), z, 0);
  at_.f_v = X.place(assembly.state_force(), z, v);
  at_.f_z = X.place(assembly.state_state(), z, z);
  at_.z = X.place(SparsePattern::identity(nz_), z, z);
  X.finalize();
  solver_ = std::make_unique<KluSolver>(X.pattern());
  x_.assign(static_cast<std::size_t>(3 * n_ + m_ + nz_), 0);
}

bool MaggiSparseNewton::factor(const Assembly& assembly, const std::vector<int>& independent, double gamma) {
  place(assembly, independent);
  BlockMatrix& X = *matrix_;
  X.set_zero();
  for (const int block : {at_.phi_q, at_.phi_v, at_.phi_a, at_.reaction}) X.add(block, assembly.phi_q.data());
  for (const int block : {at_.y_q, at_.yd_v, at_.z}) X.add_constant(block, 1);
  for (const int block : {at_.y_v, at_.yd_a}) X.add_constant(block, -gamma);
  X.add(at_.phid_q, assembly.phid_q.data());
  X.add(at_.phid_v, assembly.phid_q.data(), 2);
  X.add(at_.phidd_q, assembly.phidd_q.data());
  X.add(at_.K, assembly.K.data());
  X.add(at_.C, assembly.C.data());
  X.add(at_.M, assembly.M.data());
  X.add(at_.Q_z, assembly.Q_z.data(), -1);
  X.add(at_.f_q, assembly.f_q.data(), -gamma);
  X.add(at_.f_v, assembly.f_v.data(), -gamma);
  X.add(at_.f_z, assembly.f_z.data(), -gamma);
  return solver_->factor(X.values().data()) < 0;
}

void MaggiSparseNewton::solve(double* y, double* yd, const double* w, double* z) {
  const int of_y = m_, of_yd = of_y + f_ + m_, force = of_yd + f_ + m_;
  std::fill(x_.begin(), x_.end(), 0.0);
  std::copy(y, y + f_, x_.begin() + of_y);
  std::copy(yd, yd + f_, x_.begin() + of_yd);
  if (w)
    for (int i = 0; i < f_; ++i) x_[static_cast<std::size_t>(force + independent_[static_cast<std::size_t>(i)])] = w[i];
  std::copy(z, z + nz_, x_.end() - nz_);
  solver_->solve(x_.data());
  for (int i = 0; i < f_; ++i) {
    const auto at = static_cast<std::size_t>(independent_[static_cast<std::size_t>(i)]);
    y[i] = x_[at];
    yd[i] = x_[static_cast<std::size_t>(n_) + at];
  }
  std::copy(x_.end() - nz_, x_.end(), z);
}

void MaggiSparseNewton::solve_transposed(double* y, double* yd, double* w, double* z) {
  const int of_y = m_, of_yd = of_y + f_ + m_, force = of_yd + f_ + m_;
  std::fill(x_.begin(), x_.end(), 0.0);
  for (int i = 0; i < f_; ++i) {
    const auto at = static_cast<std::size_t>(independent_[static_cast<std::size_t>(i)]);
    x_[at] = y[i];
    x_[static_cast<std::size_t>(n_) + at] = yd[i];
  }
  std::copy(z, z + nz_, x_.end() - nz_);
  solver_->solve_transposed(x_.data());
  std::copy_n(x_.begin() + of_y, f_, y);
  std::copy_n(x_.begin() + of_yd, f_, yd);
  if (w)
    for (int i = 0; i < f_; ++i) w[i] = x_[static_cast<std::size_t>(force + independent_[static_cast<std::size_t>(i)])];
  std::copy(x_.end() - nz_, x_.end(), z);
}

}  // namespace costate
