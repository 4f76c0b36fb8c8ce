#include "costate/discrete/step_matrices.h"

#include <utility>

#include "costate/assembly/slip_directions.h"

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
  for (std::size_t k = 1; k < a.slidable_rows().size(); ++k) {  // two rows of one contact in space
    const auto &one = a.slidable_rows()[k - 1], &other = a.slidable_rows()[k];
    if (one.second != other.second) continue;
    entries.emplace_back(one.first, other.first);
    entries.emplace_back(other.first, one.first);
  }
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
      projection_(matrix_.pattern()),
      velocities_(may_slide_in_space(a) ? std::make_unique<KluSolver>(matrix_.pattern()) : nullptr) {}

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
  add_corner(a, rows, Of::step);
  return step_.factor(matrix_.values().data());
}

int StepMatrices::factor_projection(const Assembly& a, const StageRows& rows) {
  matrix_.set_zero();
  matrix_.add(square_, a.M.data());
  matrix_.add(transposed_, a.reaction_jacobian().data());
  matrix_.add(jacobian_, a.phi_q.data());
  if (states_) matrix_.add_constant(identity_, 1);
  add_corner(a, rows, Of::projection);
  const int bad = projection_.factor(matrix_.values().data());
  keeps_slips_ = velocities_ && rows.slips().keeps_any();
  if (bad >= 0 || !keeps_slips_) return bad;
  std::vector<double> J = a.phi_q;
  for (std::size_t k = 0; k < J.size(); ++k)
    if (rows.slips().keeps(static_cast<int>(a.jacobian().row[k]))) J[k] = a.reaction_jacobian()[k];
  matrix_.set_zero();
  matrix_.add(square_, a.M.data());
  matrix_.add(transposed_, a.reaction_jacobian().data());
  matrix_.add(jacobian_, J.data());
  if (states_) matrix_.add_constant(identity_, 1);
  add_corner(a, rows, Of::velocities);
  return velocities_->factor(matrix_.values().data());
}

void StepMatrices::add_corner(const Assembly& a, const StageRows& rows, Of of) {
  if (corner_ < 0) return;
  corner_values_.assign(corner_pattern_.row.size(), 0);
  const auto at = [&](int i, int j) -> double& {
    return corner_values_[static_cast<std::size_t>(corner_pattern_.find(i, j))];
  };
  for (int i = 0; i < a.m(); ++i) at(i, i) = -rows.inverse_alpha(a, i);
  const std::vector<double>& directions = rows.slips().directions();
  for (std::size_t i = 0; i < a.sliding_rows().size(); ++i) {
    const Assembly::SlidingRow& r = a.sliding_rows()[i];
    const double direction = rows.slips().any() ? directions[i] : r.direction;
    at(r.along, r.normal) = -direction * a.numbers()[static_cast<std::size_t>(r.number)];
  }
  if (of != Of::projection)
    rows.slips().for_each_multiplier([&](int row, int multiplier, double by) {
      if (of == Of::step || rows.slips().keeps(row)) at(row, multiplier) = of == Of::step ? by : 0;
    });
  matrix_.add(corner_, corner_values_.data());
}

StepMatrices::Saved StepMatrices::save(double* to) const {
  step_.save(to);
  projection_.save(to + step_.saved_size());
  return {step_.pivot_order(), projection_.pivot_order()};
}

bool StepMatrices::restore(const Saved& saved, const double* from) {
  return !velocities_ && step_.restore(saved.step_order, from) &&
         projection_.restore(saved.projection_order, from + step_.saved_size());
}

}  // namespace costate
