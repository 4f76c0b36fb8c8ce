// Second derivatives of an instant that multipliers decide, (19.16) of lib/README.md: with w = h_lambda and KKT^T s =
// [0; w], L = w^T lambda - s^T R has the derivatives of w^T lambda, whatever (a, lambda) do, and they change along d by
//   D(L_x) at fixed s and w, + dw^T lambda_x - ds^T R_x,   KKT^T ds = D(L_(a, lambda)) + [0; dw].
#include "costate/adjoint/hessian_equations.h"
#include "costate/assembly/time_partials.h"
#include "costate/base/error.h"
#include "costate/level/acceleration_rates.h"

namespace costate {

using Eigen::VectorXd;

HessianEquations::Reactions HessianEquations::add_reactions(const VectorXd& f, MotionEvents::Gradient& h) {
  for (const auto& c : assembly_.mechanism().constraints())
    if (c->rheonomic())
      throw CapabilityError(
          "Second derivatives are not carried where friction falls, from static_coefficient to friction_coefficient, "
          "beside a driver. Differences of gradients tell them.");
  Reactions r{std::vector<double>(static_cast<std::size_t>(n_ + m_)), acceleration_rates(assembly_, level_)};
  gradient_.set_zero();
  gradient_.lambda = h.lambda;
  const VectorXd none = VectorXd::Zero(state_size());
  VectorXd xp(state_size()), rho(parameter_count());
  solve_adjoint(gradient_, none.data(), r.s, xp.data(), rho.data());
  h.x -= xp;
  h.rho += rho;
  h.t += h.lambda.dot(r.rates.tail(m_)) + xp.dot(f);
  return r;
}

void HessianEquations::add_reactions_change(const std::vector<double>& s, const Variation& d,
                                            MotionEvents::Gradient& W) {
  const VectorXd none = VectorXd::Zero(state_size());
  change_.set_zero();
  add_equations_change(d, s.data(), none.data(), &W.t);
  change_.lambda += W.lambda;
  VectorXd xp(state_size()), rho(parameter_count());
  solve_adjoint(change_, none.data(), ds_, xp.data(), rho.data());
  W.x -= xp;
  W.rho += rho;
  TimePartials by_time;
  calc_time_partials(assembly_, level_.state(), by_time);
  for (int i = 0; i < n_; ++i) W.t -= ds_[static_cast<std::size_t>(i)] * by_time.force[static_cast<std::size_t>(i)];
}

}  // namespace costate
