// Partial derivatives of the assembled terms by the numbers that are parameters.
#include "costate/assembly/assembly.h"

namespace costate {

void Assembly::resize(ParameterColumns& c) const {
  c.F.resize(n_, np());
  c.phi.resize(m_, np());
  c.phid.resize(m_, np());
  c.phidd.resize(m_, np());
  c.f.resize(nz_, np());
}

void Assembly::calc_parameter_columns(const StateView& s, ParameterColumns& out) {
  ++counters_.parameters;
  read_switches(s);
  out.F.setZero(n_, np());
  out.phi.setZero(m_, np());
  out.phid.setZero(m_, np());
  out.phidd.setZero(m_, np());
  out.f.setZero(nz_, np());
  double f[kMaxLocal], g0[kMaxLocal], g1[kMaxLocal], g2[kMaxLocal];
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    for (int k : bodies_[i].active) {
      const Body& e = *mechanism_->bodies()[i];
      std::fill(f, f + kMaxLocal, 0.0);
      e.calc_number_partial(gather(bodies_[i], s), k, f);
      for (const auto& [column, c] : columns_[e.numbers()[k]])
        for (std::size_t j = 0; j < e.coordinates().size(); ++j) out.F(e.coordinates()[j], column) += c * f[j];
    }
  for (std::size_t i = 0; i < forces_.size(); ++i)
    for (int k : forces_[i].active) {
      const Force& e = *mechanism_->forces()[i];
      std::fill(f, f + kMaxLocal, 0.0);
      std::fill(g0, g0 + kMaxLocal, 0.0);
      e.calc_number_partial(gather(forces_[i], s), k, f, g0);
      for (const auto& [column, c] : columns_[e.numbers()[k]]) {
        for (std::size_t j = 0; j < e.coordinates().size(); ++j) out.F(e.coordinates()[j], column) -= c * f[j];
        for (int j = 0; j < e.states(); ++j) out.f(forces_[i].row_offset + j, column) += c * g0[j];
      }
    }
  for (std::size_t i = 0; i < constraints_.size(); ++i)
    for (int k : constraints_[i].active) {
      if (!constraints_[i].there) break;
      const Constraint& e = *mechanism_->constraints()[i];
      for (double* x : {f, g0, g1, g2}) std::fill(x, x + kMaxLocal, 0.0);
      e.calc_number_partial(gather(constraints_[i], s), k, g0, g1, g2, f);
      const int r0 = constraints_[i].row_offset;
      for (const auto& [column, c] : columns_[e.numbers()[k]]) {
        for (std::size_t j = 0; j < e.coordinates().size(); ++j) out.F(e.coordinates()[j], column) += c * f[j];
        for (int j = 0; j < e.rows(); ++j) {
          out.phi(r0 + j, column) += c * g0[j];
          out.phid(r0 + j, column) += c * g1[j];
          out.phidd(r0 + j, column) += c * g2[j];
        }
      }
    }
  const Eigen::MatrixXd turns = slip_columns(*this, s, out.phid);
  for (const SlidingRow& r : sliding_) {
    out.phi.row(r.along).setZero();
    out.phid.row(r.along).setZero();
    out.phidd.row(r.along).setZero();
    if (!s.lambda) continue;
    for (const auto& [column, c] : columns_[static_cast<std::size_t>(r.number)])
      out.phidd(r.along, column) = -c * r.direction * s.lambda[r.normal];
    if (turns.size() > 0) out.phidd.row(r.along) += turns.row(r.along);
  }
}

void Assembly::add_parameter_gradient(const StateView& s, const ParameterWeights& w, double factor, double* gradient) {
  ++counters_.parameters;
  read_switches(s);
  double f[kMaxLocal], local[kMaxLocal], rows[3][kMaxLocal];
  const auto deliver = [&](int number, double x) {
    for (const auto& [column, c] : columns_[number]) gradient[column] += factor * c * x;
  };
  // The weights of an element's own coordinates.
  const auto gather_weights = [&](const Element& e) {
    if (!w.force) return;
    const auto& c = e.coordinates();
    for (std::size_t j = 0; j < c.size(); ++j) local[j] = w.force[c[j]];
  };
  const auto dot = [](std::size_t n, const double* a, const double* b) {
    double sum = 0;
    for (std::size_t j = 0; j < n; ++j) sum += a[j] * b[j];
    return sum;
  };
  if (w.force)
    for (std::size_t i = 0; i < bodies_.size(); ++i) {
      const Body& e = *mechanism_->bodies()[i];
      if (bodies_[i].active.empty() || (!w.constant_bodies && e.constant_mass() && e.constant_force())) continue;
      const LocalState l = gather(bodies_[i], s);
      const std::size_t n = e.coordinates().size();
      gather_weights(e);
      for (const int k : bodies_[i].active) {
        std::fill(f, f + n, 0.0);
        e.calc_number_partial(l, k, f);
        deliver(e.numbers()[k], dot(n, local, f));
      }
    }
  for (std::size_t i = 0; i < forces_.size(); ++i) {
    if (forces_[i].active.empty() || rests(forces_[i], s)) continue;
    const Force& e = *mechanism_->forces()[i];
    const LocalState l = gather(forces_[i], s);
    gather_weights(e);
    const std::vector<int>& active = forces_[i].active;
    constexpr std::size_t most = 32;
    for (std::size_t first = 0; first < active.size(); first += most) {
      const std::size_t count = std::min(most, active.size() - first);
      double sums[most] = {};
      e.add_number_gradient(l, w.force ? local : nullptr, w.state ? w.state + forces_[i].row_offset : nullptr,
                            active.data() + first, static_cast<int>(count), sums);
      for (std::size_t k = 0; k < count; ++k) deliver(e.numbers()[active[first + k]], -sums[k]);
    }
  }
  StateView all = s;  // of what has no weight, v and a may be missing
  rest_.resize(static_cast<std::size_t>(n_), 0.0);
  if (!s.v) all.v = rest_.data();
  if (!s.a) all.a = rest_.data();
  for (std::size_t i = 0; i < constraints_.size(); ++i) {
    if (constraints_[i].active.empty() || !constraints_[i].there) continue;
    const Constraint& e = *mechanism_->constraints()[i];
    const LocalState l = gather(constraints_[i], all);
    gather_weights(e);
    for (int j = 0; j < e.rows(); ++j) {
      const int row = constraints_[i].row_offset + j;
      const double x = w.row ? w.row[row] : 0;
      rows[0][j] = (holds_position(row) ? w.c0 : 0) * x + (w.row_phi ? w.row_phi[row] : 0);
      rows[1][j] = w.c1 * x + (w.row_phid ? w.row_phid[row] : 0);
      rows[2][j] = w.c2 * x;
      if (j >= 1 && constraints_[i].slides != 0) rows[0][j] = rows[1][j] = rows[2][j] = 0;
    }
    if (e.rows() == 3 && constraints_[i].slides != 0 && w.row && s.lambda)
      slip_weights(*this, s, constraints_[i].row_offset, w.c2, w.row, rows[1]);
    const ConstraintWeights weights{rows[0], rows[1], rows[2], w.force && s.lambda ? local : nullptr};
    for (const int k : constraints_[i].active) deliver(e.numbers()[k], e.calc_number_gradient(l, k, weights));
  }
  if (!w.row || !s.lambda) return;
  for (const SlidingRow& r : sliding_) deliver(r.number, -w.c2 * w.row[r.along] * r.direction * s.lambda[r.normal]);
}

}  // namespace costate
