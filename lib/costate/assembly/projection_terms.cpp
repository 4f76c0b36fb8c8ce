// Derivatives of M u + Phi_q^T eta with u and eta fixed. A body's residual at rest is M a - Q(q, 0), so that M u is the
// difference of two residuals at rest, with a := u and with a := 0, and so are its derivatives.
#include <algorithm>

#include "costate/assembly/assembly.h"

namespace costate {

void Assembly::calc_projection_hessian(const StateView& s, const double* u, const double* eta,
                                       std::vector<double>& out) {
  calc_hessian(s, eta, out);
  if (varying_mass_.empty()) return;
  rest_.resize(static_cast<std::size_t>(n_), 0.0);
  StateView moving = s, still = s;
  moving.a = u;
  moving.v = still.v = still.a = rest_.data();
  for (const std::size_t b : varying_mass_) {
    const Body& body = *mechanism_->bodies()[b];
    const int k = static_cast<int>(body.coordinates().size());
    for (const double sign : {1.0, -1.0}) {
      LocalMatrix r_q(scratch_.data(), k, k), r_v(scratch_.data() + kMaxLocal * kMaxLocal, k, k);
      r_q.setZero();
      r_v.setZero();
      body.calc_partials(gather(bodies_[b], sign > 0 ? moving : still), r_q, r_v);
      scatter_square(bodies_[b], scratch_.data(), sign, out);
    }
  }
}

/// Visits the varied numbers k of bodies with (M u)_k in local coordinates.
template <class Visit>
void Assembly::for_each_momentum_partial(const StateView& s, const double* u, bool constant_bodies,
                                         const Visit& visit) {
  rest_.resize(static_cast<std::size_t>(n_), 0.0);
  StateView x = s;
  x.v = rest_.data();
  double f[kMaxLocal], still[kMaxLocal];
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    for (const int k : bodies_[i].active) {
      const Body& e = *mechanism_->bodies()[i];
      if (!constant_bodies && e.constant_mass() && e.constant_force()) break;
      const std::size_t n = e.coordinates().size();
      std::fill(f, f + n, 0.0);
      std::fill(still, still + n, 0.0);
      x.a = u;
      e.calc_number_partial(gather(bodies_[i], x), k, f);
      x.a = rest_.data();
      e.calc_number_partial(gather(bodies_[i], x), k, still);
      for (std::size_t j = 0; j < n; ++j) f[j] -= still[j];
      visit(e, e.numbers()[k], f);
    }
}

void Assembly::calc_projection_columns(const StateView& s, const double* u, const double* eta, Eigen::MatrixXd& F) {
  read_switches(s);
  F.setZero();
  const auto deliver = [&](const Element& e, int number, const double* f) {
    for (const auto& [column, c] : columns_[number])
      for (std::size_t j = 0; j < e.coordinates().size(); ++j) F(e.coordinates()[j], column) += c * f[j];
  };
  for_each_momentum_partial(s, u, true, deliver);
  StateView x = s;
  x.lambda = eta;
  double f[kMaxLocal], g0[kMaxLocal], g1[kMaxLocal], g2[kMaxLocal];
  for (std::size_t i = 0; i < constraints_.size(); ++i)
    for (const int k : constraints_[i].active) {
      if (!constraints_[i].there) break;
      const Constraint& e = *mechanism_->constraints()[i];
      for (double* y : {f, g0, g1, g2}) std::fill(y, y + kMaxLocal, 0.0);
      e.calc_number_partial(gather(constraints_[i], x), k, g0, g1, g2, f);
      deliver(e, e.numbers()[k], f);
    }
}

void Assembly::add_projection_gradient(const StateView& s, const double* u, const double* eta, const double* s1,
                                       double factor, double* gradient, bool constant_bodies) {
  read_switches(s);
  for_each_momentum_partial(s, u, constant_bodies, [&](const Element& e, int number, const double* f) {
    double x = 0;
    for (std::size_t j = 0; j < e.coordinates().size(); ++j) x += s1[e.coordinates()[j]] * f[j];
    for (const auto& [column, c] : columns_[number]) gradient[column] += factor * c * x;
  });
  StateView x = s;  // only q and lambda count
  rest_.resize(static_cast<std::size_t>(n_), 0.0);
  x.v = x.a = rest_.data();
  x.lambda = eta;
  const double none[kMaxLocal] = {};
  double local[kMaxLocal];
  const ConstraintWeights weights{none, none, none, local};
  for (std::size_t i = 0; i < constraints_.size(); ++i) {
    if (constraints_[i].active.empty() || !constraints_[i].there) continue;
    const Constraint& e = *mechanism_->constraints()[i];
    const LocalState l = gather(constraints_[i], x);
    for (std::size_t j = 0; j < e.coordinates().size(); ++j) local[j] = s1[e.coordinates()[j]];
    for (const int k : constraints_[i].active) {
      const double sum = e.calc_number_gradient(l, k, weights);
      for (const auto& [column, c] : columns_[e.numbers()[k]]) gradient[column] += factor * c * sum;
    }
  }
}

void Assembly::add_constant_body_gradient(const double* outer, const double* sum, double factor, double* gradient) {
  rest_.resize(static_cast<std::size_t>(n_), 0.0);
  StateView s;
  s.q = s.v = s.a = rest_.data();
  double unit[kMaxLocal] = {}, f[kMaxLocal], at_rest[kMaxLocal];
  for (std::size_t i = 0; i < bodies_.size(); ++i)
    for (const int k : bodies_[i].active) {
      const Body& e = *mechanism_->bodies()[i];
      if (!e.constant_mass() || !e.constant_force()) break;
      const std::size_t n = e.coordinates().size();
      LocalState l = gather(bodies_[i], s);
      std::fill(at_rest, at_rest + n, 0.0);
      e.calc_number_partial(l, k, at_rest);  // -Q_k
      double x = 0;
      for (std::size_t r = 0; r < n; ++r) x += at_rest[r] * sum[e.coordinates()[r]];
      l.a = unit;
      for (std::size_t c = 0; c < n; ++c) {
        unit[c] = 1;
        std::fill(f, f + n, 0.0);
        e.calc_number_partial(l, k, f);
        for (std::size_t r = 0; r < n; ++r) x += (f[r] - at_rest[r]) * outer[bodies_[i].square[c * n + r]];
        unit[c] = 0;
      }
      for (const auto& [column, weight] : columns_[e.numbers()[k]]) gradient[column] += factor * weight * x;
    }
}

void Assembly::calc_hessian(const StateView& s, const double* gamma, std::vector<double>& hessian) {
  read_switches(s);
  hessian.assign(square_.row.size(), 0.0);
  StateView x = s;
  x.lambda = gamma;
  add_hessians(x, hessian);
}

}  // namespace costate
