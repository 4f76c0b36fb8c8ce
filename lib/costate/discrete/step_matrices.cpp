#include "costate/discrete/step_matrices.h"

namespace costate {

namespace {
BlockMatrix placed(const Assembly& a, int& square, int& force_state, int& transposed, int& state_force,
                   int& state_state, int& identity, int& jacobian, int& corner) {
  const int n = a.n(), m = a.m(), nz = a.nz();
  BlockMatrix x(n + nz + m);
  square = x.place(a.square(), 0, 0);
  force_state = x.place(a.force_state(), 0, n);
  transposed = x.place(a.jacobian(), 0, n + nz, true);
  state_force = x.place(a.state_force(), n, 0);
  state_state = x.place(a.state_state(), n, n);
  identity = x.place(SparsePattern::identity(nz), n, n);
  jacobian = x.place(a.jacobian(), n + nz, 0);
  if (a.has_switched_rows()) corner = x.place(SparsePattern::identity(m), n + nz, n + nz);
  x.finalize();
  return x;
}
}  // namespace

StepMatrices::StepMatrices(const Assembly& a)
    : matrix_(placed(a, square_, force_state_, transposed_, state_force_, state_state_, identity_, jacobian_, corner_)),
      size_(a.n() + a.nz() + a.m()),
      states_(a.nz() > 0),
      step_(matrix_.pattern()),
      projection_(matrix_.pattern()) {}

int StepMatrices::factor_step(const Assembly& a, const StepCoefficients& c) {
  matrix_.set_zero();
  matrix_.add(square_, a.M.data());
  matrix_.add(square_, a.C.data(), c.G);
  matrix_.add(square_, a.K.data(), c.B);
  matrix_.add(transposed_, a.phi_q.data());
  matrix_.add(jacobian_, a.phi_q.data());
  if (states_) {
    matrix_.add(force_state_, a.Q_z.data(), -c.G_z);
    matrix_.add(state_force_, a.f_v.data(), -c.G);
    matrix_.add(state_force_, a.f_q.data(), -c.B);
    matrix_.add(state_state_, a.f_z.data(), -c.G_z);
    matrix_.add_constant(identity_, 1);
  }
  add_corner(a);
  return step_.factor(matrix_.values().data());
}

int StepMatrices::factor_projection(const Assembly& a) {
  matrix_.set_zero();
  matrix_.add(square_, a.M.data());
  matrix_.add(transposed_, a.phi_q.data());
  matrix_.add(jacobian_, a.phi_q.data());
  if (states_) matrix_.add_constant(identity_, 1);
  add_corner(a);
  return projection_.factor(matrix_.values().data());
}

void StepMatrices::add_corner(const Assembly& a) {
  if (corner_ < 0) return;
  absent_.resize(static_cast<std::size_t>(a.m()));
  for (int i = 0; i < a.m(); ++i) absent_[static_cast<std::size_t>(i)] = a.is_there(i) ? 0 : 1;
  matrix_.add(corner_, absent_.data(), -1);
}

StepMatrices::Saved StepMatrices::save(double* to) const {
  step_.save(to);
  projection_.save(to + step_.saved_size());
  return {step_.pivot_order(), projection_.pivot_order()};
}

bool StepMatrices::restore(const Saved& saved, const double* from) {
  return step_.restore(saved.step_order, from) &&
         projection_.restore(saved.projection_order, from + step_.saved_size());
}

}  // namespace costate
