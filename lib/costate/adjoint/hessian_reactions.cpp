// Second derivatives of an instant that multipliers decide, (19.16) of lib/README.md: with w = h_lambda and KKT^T s =
// [0; w], L = w^T lambda - s^T R has the derivatives of w^T lambda, whatever (a, lambda) do, and they change along d by
//   D(L_x) at fixed s and w, + dw^T lambda_x - ds^T R_x,   KKT^T ds = D(L_(a, lambda)) + [0; dw].
#include <algorithm>
#include <array>

#include "costate/adjoint/hessian_equations.h"
#include "costate/base/error.h"
#include "costate/event/crossing_rate.h"
#include "costate/level/acceleration_rates.h"

namespace costate {

namespace {
using Eigen::Map;
using Eigen::VectorXd;

/// s^T Q_t of all forces, and its change along d.
Taylor2 by_time(const Assembly& assembly, const StateView& s, const Variation& d, const double* weights) {
  std::array<PathDual, kMaxLocal> q, v, z, Q, f;
  std::vector<PathDual> p;
  Taylor2 sum;
  const Mechanism& mechanism = assembly.mechanism();
  for (std::size_t k = 0; k < mechanism.forces().size(); ++k) {
    const Force& e = *mechanism.forces()[k];
    const int first = mechanism.state_offsets()[k];
    const auto along = [](double x, double dx) { return PathDual(Taylor2(x, dx, 0)); };
    for (std::size_t i = 0; i < e.coordinates().size(); ++i) {
      const int c = e.coordinates()[i];
      q[i] = along(s.q[c], d.q[c]);
      v[i] = along(s.v[c], d.v[c]);
    }
    for (int i = 0; i < e.states(); ++i) z[static_cast<std::size_t>(i)] = along(s.z[first + i], d.z[first + i]);
    p.clear();
    for (const int number : e.numbers())
      p.push_back(along(assembly.numbers()[static_cast<std::size_t>(number)], d.numbers[number]));
    Q.fill(PathDual());
    f.fill(PathDual());
    PathDual t = along(s.t, d.t);
    t.d[0] = Taylor2(1.0);
    e.force(t, q.data(), v.data(), z.data(), p.data(), Q.data(), f.data());
    for (std::size_t i = 0; i < e.coordinates().size(); ++i) sum += weights[e.coordinates()[i]] * Q[i].d[0];
  }
  return sum;
}
}  // namespace

HessianEquations::Reactions HessianEquations::reactions_of(const VectorXd& weights) {
  for (const auto& c : assembly_.mechanism().constraints())
    if (c->rheonomic())
      throw CapabilityError(
          "Second derivatives are not carried where friction falls, from static_coefficient to friction_coefficient, "
          "beside a driver. Differences of gradients tell them.");
  Reactions r;
  r.s.assign(static_cast<std::size_t>(n_ + m_), 0);
  std::copy(weights.data(), weights.data() + m_, r.s.begin() + n_);
  level_.solve_kkt_transposed(r.s.data());
  r.rates = acceleration_rates(assembly_, level_);
  return r;
}

void HessianEquations::add_reactions(const Reactions& of, const VectorXd& f, MotionEvents::Gradient& h) {
  gradient_.set_zero();
  gradient_.lambda = h.lambda;
  const VectorXd none = VectorXd::Zero(state_size());
  VectorXd xp(state_size()), rho(parameter_count());
  std::vector<double> s(of.s.size());
  solve_adjoint(gradient_, none.data(), s, xp.data(), rho.data());
  const VectorXd rates = of.rates.tail(m_);
  const double rate = h.lambda.dot(rates);
  h.x -= xp;
  h.rho += rho;
  h.t += rate + xp.dot(f);
}

void HessianEquations::add_reactions_change(const Reactions& of, double kappa, const Variation& d,
                                            MotionEvents::Gradient& W) {
  const VectorXd none = VectorXd::Zero(state_size());
  change_.set_zero();
  add_equations_change(d, of.s.data(), none.data());
  for (VectorXd* x : {&change_.q, &change_.v, &change_.a, &change_.lambda, &change_.z, &change_.rho}) *x *= kappa;
  change_.lambda += W.lambda;
  VectorXd xp(state_size()), rho(parameter_count());
  solve_adjoint(change_, none.data(), ds_, xp.data(), rho.data());
  W.x -= xp;
  W.rho += rho;
  W.t += kappa * by_time(assembly_, level_.state(), d, of.s.data()).c1 +
         by_time(assembly_, level_.state(), d, ds_.data()).c0;
}

}  // namespace costate
