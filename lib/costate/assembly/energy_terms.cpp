// Energies of the whole mechanism, the kinetic one with its gradient, and Mdot x. A body's residual at rest
// is M a - Q(q, 0), so that derivatives of M x are differences of two residuals' derivatives at rest, with a
// := x and a := 0.
#include <algorithm>

#include "costate/assembly/assembly.h"

namespace costate {

double Assembly::kinetic_energy(const StateView& s) {
  energy_mass_.resize(M.size());
  calc_mass(s, energy_mass_);
  double e = 0;
  for (int j = 0; j < n_; ++j)
    for (auto k = square_.column_start[j]; k < square_.column_start[j + 1]; ++k)
      e += 0.5 * s.v[square_.row[k]] * energy_mass_[k] * s.v[j];
  return e;
}

void Assembly::add_kinetic_energy_gradient(const StateView& s, double factor, double* g_q, double* g_v, double* g_rho) {
  energy_mass_.resize(M.size());
  calc_mass(s, energy_mass_);
  add_product(square_, energy_mass_.data(), factor, s.v, g_v);
  // (M v)_q and (M v)_p are those of the body's residual at a := v less those at a := 0, both at rest.
  const std::vector<double> rest(static_cast<std::size_t>(n_), 0.0);
  StateView moving = s, still = s;
  moving.a = s.v;
  moving.v = still.v = still.a = rest.data();
  double f[kMaxLocal];
  for (std::size_t b = 0; b < bodies_.size(); ++b) {
    const Body& body = *mechanism_->bodies()[b];
    const auto& c = body.coordinates();
    const int k = static_cast<int>(c.size());
    for (const double sign : {1.0, -1.0}) {
      const StateView& x = sign > 0 ? moving : still;
      if (!body.constant_mass()) {
        LocalMatrix r_q(scratch_.data(), k, k), r_v(scratch_.data() + kMaxLocal * kMaxLocal, k, k);
        r_q.setZero();
        r_v.setZero();
        body.calc_partials(gather(bodies_[b], x), r_q, r_v);
        for (int j = 0; j < k; ++j)
          for (int i = 0; i < k; ++i) g_q[c[j]] += 0.5 * sign * factor * s.v[c[i]] * r_q(i, j);
      }
      for (int number : bodies_[b].active) {
        std::fill(f, f + kMaxLocal, 0.0);
        body.calc_number_partial(gather(bodies_[b], x), number, f);
        double sum = 0;
        for (int i = 0; i < k; ++i) sum += 0.5 * sign * factor * s.v[c[i]] * f[i];
        for (const auto& [column, w] : columns_[body.numbers()[number]]) g_rho[column] += w * sum;
      }
    }
  }
}

void Assembly::add_mass_rate_product(const StateView& s, const double* x, double* out) {
  if (varying_mass_.empty()) return;
  // Mdot x = (M x)_q v, with (M x)_q as in the kinetic energy's gradient.
  const std::vector<double> rest(static_cast<std::size_t>(n_), 0.0);
  StateView moving = s, still = s;
  moving.a = x;
  moving.v = still.v = still.a = rest.data();
  for (const std::size_t b : varying_mass_) {
    const Body& body = *mechanism_->bodies()[b];
    const auto& c = body.coordinates();
    const int k = static_cast<int>(c.size());
    for (const double sign : {1.0, -1.0}) {
      LocalMatrix r_q(scratch_.data(), k, k), r_v(scratch_.data() + kMaxLocal * kMaxLocal, k, k);
      r_q.setZero();
      r_v.setZero();
      body.calc_partials(gather(bodies_[b], sign > 0 ? moving : still), r_q, r_v);
      for (int j = 0; j < k; ++j)
        for (int i = 0; i < k; ++i) out[c[i]] += sign * r_q(i, j) * s.v[c[j]];
    }
  }
}

double Assembly::potential_energy(const StateView& s) {
  double e = 0;
  for (std::size_t b = 0; b < bodies_.size(); ++b)
    e += mechanism_->bodies()[b]->potential_energy(gather(bodies_[b], s));
  for (std::size_t f = 0; f < forces_.size(); ++f)
    e += mechanism_->forces()[f]->potential_energy(gather(forces_[f], s));
  return e;
}

}  // namespace costate
