#include "costate/level/maggi_newton.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/linear/dense_factor.h"

namespace costate {

MaggiNewton::MaggiNewton(MaggiLevel& level)
    : level_(level),
      n_(level.assembly().n()),
      m_(level.assembly().m()),
      f_(level.freedoms()),
      nz_(level.assembly().nz()) {
  if (level.sparse()) sparse_ = std::make_unique<MaggiSparseNewton>(level.assembly());
}

void MaggiNewton::form() {
  if (My_.empty()) {
    const auto f = static_cast<std::size_t>(f_), nz = static_cast<std::size_t>(nz_);
    My_.assign(f * f, 0);
    Cy_ = Ky_ = My_;
    RQ_.assign(f * nz, 0);
    Zq_ = Zv_ = RQ_;
    fz_.assign(nz * nz, 0);
    D_.assign(static_cast<std::size_t>(std::max(m_ + f_, n_)), 0);
    A_ = column_ = D_;
    lu_.assign((f + nz) * (f + nz), 0);
    pivots_.assign(f + nz, 0);
    reduced_.assign(f + nz, 0);
  }
  Assembly& assembly = level_.assembly();
  MaggiChart& X = level_.factored_chart();
  const SparsePattern &square = assembly.square(), &rows = assembly.jacobian();
  const double *R = level_.null_space(), *Rr = level_.reaction_null_space(), *My = level_.mass_matrix();
  const auto free = static_cast<int>(level_.independent().size());
  symmetric_ = !level_.slides();
  std::copy(My, My + My_.size(), My_.begin());
  std::fill(Zq_.begin(), Zq_.end(), 0.0);
  std::fill(Zv_.begin(), Zv_.end(), 0.0);
  for (int j = 0; j < f_; ++j) {
    const double* r = R + static_cast<std::ptrdiff_t>(j) * n_;
    if (j >= free) {
      calc_place_column(level_.places()[static_cast<std::size_t>(j - free)]);
      r = place_.data();
    }
    std::fill(D_.begin(), D_.end(), 0.0);
    add_product(rows, assembly.phid_q.data(), -1, r, D_.data());
    X.solve(D_.data());
    std::fill(A_.begin(), A_.end(), 0.0);
    add_product(rows, assembly.phidd_q.data(), -1, r, A_.data());
    add_product(rows, assembly.phid_q.data(), -2, D_.data(), A_.data());
    X.solve(A_.data());
    // Places do not move: of theirs there are no rates.
    std::fill(column_.begin(), column_.end(), 0.0);
    if (j < free) add_product(square, assembly.C.data(), 1, r, column_.data());
    if (j < free) add_product(square, assembly.M.data(), 2, D_.data(), column_.data());
    level_.project(column_.data(), Cy_.data() + static_cast<std::ptrdiff_t>(j) * f_);
    std::fill(column_.begin(), column_.end(), 0.0);
    add_product(square, assembly.K.data(), 1, r, column_.data());
    add_product(square, assembly.C.data(), 1, D_.data(), column_.data());
    add_product(square, assembly.M.data(), 1, A_.data(), column_.data());
    level_.project(column_.data(), Ky_.data() + static_cast<std::ptrdiff_t>(j) * f_);
    if (nz_ == 0) continue;
    double *zq = Zq_.data() + static_cast<std::ptrdiff_t>(j) * nz_,
           *zv = Zv_.data() + static_cast<std::ptrdiff_t>(j) * nz_;
    add_product(assembly.state_force(), assembly.f_q.data(), 1, r, zq);
    add_product(assembly.state_force(), assembly.f_v.data(), 1, D_.data(), zq);
    if (j < free) add_product(assembly.state_force(), assembly.f_v.data(), 1, r, zv);
  }
  if (nz_ == 0) return;
  std::fill(RQ_.begin(), RQ_.end(), 0.0);
  const SparsePattern& q = assembly.force_state();
  for (int k = 0; k < nz_; ++k)
    for (auto e = q.column_start[k]; e < q.column_start[k + 1]; ++e)
      for (int j = 0; j < f_; ++j)
        RQ_[static_cast<std::size_t>(k) * f_ + j] +=
            Rr[static_cast<std::ptrdiff_t>(j) * n_ + q.row[e]] * assembly.Q_z[e];
  std::fill(fz_.begin(), fz_.end(), 0.0);
  const SparsePattern& states = assembly.state_state();
  for (int k = 0; k < nz_; ++k)
    for (auto e = states.column_start[k]; e < states.column_start[k + 1]; ++e)
      fz_[static_cast<std::size_t>(k) * nz_ + states.row[e]] += assembly.f_z[e];
}

void MaggiNewton::calc_place_column(int row) {
  place_.assign(D_.size(), 0);
  if (level_.assembly().holds_position(row)) return;
  place_[static_cast<std::size_t>(row)] = 1;
  level_.factored_chart().solve(place_.data());
}

void MaggiNewton::factor(double gamma) {
  gamma_ = gamma;
  const auto fail = [&] {
    throw StepError(
        fmt::format("The Newton matrix of Maggi's equations is singular at t = {:.9g} s for a step of "
                    "{:.3g} s.",
                    level_.state().t, gamma));
  };
  if (sparse_) {
    if (!sparse_->factor(level_.assembly(), level_.independent(), gamma)) fail();
    return;
  }
  form();
  const int n = size();
  for (int j = 0; j < f_; ++j) {
    double* a = lu_.data() + static_cast<std::ptrdiff_t>(j) * n;
    for (int i = 0; i < f_; ++i) {
      const std::ptrdiff_t k = static_cast<std::ptrdiff_t>(j) * f_ + i;
      a[i] = My_[k] + gamma * (Cy_[k] + gamma * Ky_[k]);
    }
    for (int i = 0; i < nz_; ++i) {
      const std::ptrdiff_t k = static_cast<std::ptrdiff_t>(j) * nz_ + i;
      a[f_ + i] = -gamma * (Zv_[k] + gamma * Zq_[k]);
    }
  }
  for (int j = 0; j < nz_; ++j) {
    double* a = lu_.data() + static_cast<std::ptrdiff_t>(f_ + j) * n;
    for (int i = 0; i < f_; ++i) a[i] = -gamma * RQ_[static_cast<std::ptrdiff_t>(j) * f_ + i];
    for (int i = 0; i < nz_; ++i) a[f_ + i] = (i == j ? 1 : 0) - gamma * fz_[static_cast<std::ptrdiff_t>(j) * nz_ + i];
  }
  if (factor_lu(lu_.data(), n, pivots_.data()) >= 0) fail();
}

void MaggiNewton::solve(double* y, double* yd, const double* w, double* z) {
  if (sparse_) return sparse_->solve(y, yd, w, z);
  double *u = reduced_.data(), *uz = u + f_;
  for (int i = 0; i < f_; ++i) u[i] = w ? gamma_ * w[i] : 0;
  std::copy(z, z + nz_, uz);
  add(My_, f_, 1, yd, u);
  add(Ky_, f_, -gamma_, y, u);
  add(Zq_, nz_, gamma_, y, uz);
  solve_lu(lu_.data(), size(), pivots_.data(), u);
  for (int i = 0; i < f_; ++i) {
    yd[i] = u[i];
    y[i] += gamma_ * u[i];
  }
  std::copy(uz, uz + nz_, z);
}

void MaggiNewton::solve_transposed(double* y, double* yd, double* w, double* z) {
  if (sparse_) return sparse_->solve_transposed(y, yd, w, z);
  double *u = reduced_.data(), *uz = u + f_;
  for (int i = 0; i < f_; ++i) u[i] = yd[i] + gamma_ * y[i];
  std::copy(z, z + nz_, uz);
  solve_lu_transposed(lu_.data(), size(), pivots_.data(), u);
  add_transposed(Ky_, f_, -gamma_, u, y);
  add_transposed(Zq_, nz_, gamma_, uz, y);
  std::fill(yd, yd + f_, 0.0);
  if (symmetric_)
    add(My_, f_, 1, u, yd);
  else
    add_transposed(My_, f_, 1, u, yd);
  for (int i = 0; w && i < f_; ++i) w[i] = gamma_ * u[i];
  std::copy(uz, uz + nz_, z);
}

void MaggiNewton::add(const std::vector<double>& A, int rows, double c, const double* x, double* out) const {
  const double* a = A.data();
  for (int j = 0; j < f_; ++j, a += rows)
    for (int i = 0; i < rows; ++i) out[i] += c * x[j] * a[i];
}

void MaggiNewton::add_transposed(const std::vector<double>& A, int rows, double c, const double* x, double* out) const {
  const double* a = A.data();
  for (int j = 0; j < f_; ++j, a += rows) {
    double sum = 0;
    for (int i = 0; i < rows; ++i) sum += a[i] * x[i];
    out[j] += c * sum;
  }
}

}  // namespace costate
