#include "costate/discrete/step_matrices.h"

#include <utility>

namespace costate {

namespace {
BlockMatrix placed(const Assembly& a, int& square, int& force_state, int& transposed, int& state_force,
                   int& state_state, int& identity, int& jacobian, int& corner, const SparsePattern& corner_pattern) {
  const int n = a.n(), m = a.m(), nz = a.nz();
  BlockMatrix x(n + nz + m);
  square = x.place(a.square(), 0, 0);
  force_state = x.place(a.force_state(), 0, n);
  transposed = x.place(a.jacobian(), 0, n + nz, true);
  state_force = x.place(a.state_force(), n, 0);
  state_state = x.place(a.state_state(), n, n);
  identity = x.place(SparsePattern::identity(nz), n, n);
  jacobian = x.place(a.jacobian(), n + nz, 0);
  if (a.has_switched_rows()) corner = x.place(corner_pattern, n + nz, n + nz);
  x.finalize();
  return x;
}

SparsePattern pattern_of_corner(const Assembly& a) {
  std::vector<std::pair<int, int>> entries = a.slidable_rows();
  for (int i = 0; i < a.m(); ++i) entries.emplace_back(i, i);
  return SparsePattern::from_entries(a.m(), a.m(), std::move(entries));
}
}  // namespace

StepMatrices::StepMatrices(const Assembly& a)
    : corner_pattern_(pattern_of_corner(a)),
      matrix_(placed(a, square_, force_state_, transposed_, state_force_, state_state_, identity_, jacobian_, corner_,
                     corner_pattern_)),
      size_(a.n() + a.nz() + a.m()),
      states_(a.nz() > 0),
      symmetric_(a.slidable_rows().empty()),
      step_(matrix_.pattern()),
      projection_(matrix_.pattern()) {}

int StepMatrices::factor_step(const Assembly& a, const StepCoefficients& c, const StageRows& rows) {
  matrix_.set_zero();
  matrix_.add(square_, a.M.data());
  matrix_.add(square_, a.C.data(), c.G);
  matrix_.add(square_, a.K.data(), c.B);
  matrix_.add(transposed_, a.reaction_jacobian().data());
  if (rows.keep_rates()) {
    matrix_.add(jacobian_, rows.by_q().data(), c.B);
    matrix_.add(jacobian_, rows.by_v().data(), c.G);
  } else {
    matrix_.add(jacobian_, a.phi_q.data());
  }
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
  matrix_.add(transposed_, a.reaction_jacobian().data());
  matrix_.add(jacobian_, a.phi_q.data());
  if (states_) matrix_.add_constant(identity_, 1);
  add_corner(a);
  return projection_.factor(matrix_.values().data());
}

void StepMatrices::add_corner(const Assembly& a) {
  if (corner_ < 0) return;
  corner_values_.assign(corner_pattern_.row.size(), 0);
  const auto at = [&](int i, int j) -> double& {
    return corner_values_[static_cast<std::size_t>(corner_pattern_.find(i, j))];
  };
  for (int i = 0; i < a.m(); ++i)
    if (!a.is_there(i)) at(i, i) = -1;
  for (const Assembly::SlidingRow& r : a.sliding_rows()) at(r.along, r.normal) = -a.friction(r);
  matrix_.add(corner_, corner_values_.data());
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
