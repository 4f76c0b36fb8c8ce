// Second derivatives of what an event does: lib/README.md (13.14), on path duals, one part of which is the variable and
// the other the direction.
#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/event/motion_events.h"
#include "costate/event/spatial_slip.h"

namespace costate {

namespace {
using Eigen::Map;
using Eigen::VectorXd;

VectorXd as_vector(const std::vector<double>& x) {
  return Map<const VectorXd>(x.data(), static_cast<Eigen::Index>(x.size()));
}
}  // namespace

MotionEvents::Gradient MotionEvents::begin_second(int event, const StateView& before, const Side& minus) {
  const GuardOf& g = of(event);
  if (friction_falls(g) && slides_in_space(*contact_of(event)))
    throw CapabilityError(fmt::format(
        "At t = {:.9g} s '{}' begins with a fall of friction in space, from static_coefficient to "
        "friction_coefficient: second derivatives of psi are not carried across. Take differences of gradients, or one "
        "coefficient.",
        before.t, g.name));
  second_event_ = event;
  second_before_ = before;
  if (has_impulse(event)) linearize_impact(event, before, true);
  VectorXd by_multipliers;
  if (friction_falls(g)) {
    by_multipliers = linearize_all(g, before, minus, true);
  } else {
    linearize(g, before, minus, true);
    by_multipliers = by_multipliers_of(g);
  }
  return {as_vector(h_x_), as_vector(h_rho_), h_t_, by_multipliers};
}

bool MotionEvents::changes_alone(int event, const double* z_before, const double* z_after) const {
  for (const ContactOf& c : contacts_)
    for (const int state : {c.closed_state, c.sliding_state})
      if (&c != contact_of(event) && state >= 0 && z_before[state] != z_after[state]) return false;
  return true;
}

MotionEvents::Gradient MotionEvents::transition_gradient(const double* mu) {
  const GuardOf& g = of(second_event_);
  const int n = assembly_.n(), first = 2 * n + g.first_state;
  Gradient sum{Map<const VectorXd>(mu, 2 * n + assembly_.nz()), VectorXd::Zero(assembly_.np())};
  if (has_impulse(second_event_)) sum.t = impact_adjoint(mu + n, sum.x.data(), sum.x.data() + n, sum.rho.data());
  sum.x.segment(first, static_cast<Eigen::Index>(D_x_.size())).setZero();
  for (std::size_t i = 0; i < D_x_.size(); ++i) {
    const double weight = mu[first + static_cast<int>(i)];
    sum.x += weight * as_vector(D_x_[i]);
    sum.rho += weight * as_vector(D_rho_[i]);
    sum.t += weight * D_t_[i];
  }
  return sum;
}

void MotionEvents::add_multipliers_change(const GuardOf& g, double kappa, const Variation& d, Gradient& sum) {
  sum.lambda = VectorXd::Zero(assembly_.m());
  std::vector<int> all = sharing(g, second_before_);
  all.push_back(static_cast<int>(&g - guards_.data()));
  for (const int i : all) {
    const GuardOf& of = guards_[static_cast<std::size_t>(i)];
    load(of, second_before_);
    const auto& numbers = of.force->numbers();
    for (std::size_t k = 0; k < p_.size(); ++k) p_[k].v.c1 = d.numbers[numbers[k]];
    for (std::size_t k = 0; k < lambda_.size(); ++k) lambda_[k].v.c1 = d.lambda[of.first_row + static_cast<int>(k)];
    const auto seeded = [&](PathDual& x) {
      x.d[0] = Taylor2(1.0);
      const double change = kappa * of.guarded->guard(of.k, arguments()).d[0].c1;
      x.d[0] = Taylor2();
      return change;
    };
    for (std::size_t k = 0; k < lambda_.size(); ++k)
      sum.lambda[of.first_row + static_cast<int>(k)] += seeded(lambda_[k]);
    for (PathDual& p : p_) p.v.c1 = 0;  // they count with each other in the caller's
    for (std::size_t k = 0; k < p_.size(); ++k)
      for (const auto& [j, factor] : assembly_.number_columns()[static_cast<std::size_t>(numbers[k])])
        sum.rho[j] += factor * seeded(p_[k]);
  }
}

MotionEvents::Gradient MotionEvents::gradient_change(const double* mu, double kappa, const Variation& d,
                                                     const VectorXd& drho) {
  const GuardOf& g = of(second_event_);
  const int n = assembly_.n(), first = g.first_state;
  Gradient sum{VectorXd::Zero(2 * n + assembly_.nz()), VectorXd::Zero(assembly_.np())};
  if (has_impulse(second_event_))
    sum.t = impact_gradient_change(mu + n, d, drho, sum.x.data(), sum.x.data() + n, sum.rho.data());
  // The straight line along d.
  load(g, second_before_);
  const auto& c = g.force->coordinates();
  const auto& numbers = g.force->numbers();
  for (std::size_t i = 0; i < c.size(); ++i) {
    q_[i].v.c1 = d.q[c[i]];
    v_[i].v.c1 = d.v[c[i]];
  }
  for (std::size_t i = 0; i < z_.size(); ++i) z_[i].v.c1 = d.z[first + static_cast<int>(i)];
  for (std::size_t i = 0; i < p_.size(); ++i) p_[i].v.c1 = d.numbers[numbers[i]];
  t_.v.c1 = d.t;
  const auto seeded = [&](PathDual& x) {
    x.d[0] = Taylor2(1.0);
    double change = kappa * g.guarded->guard(g.k, arguments()).d[0].c1;
    for (auto& o : out_) o = PathDual();
    g.guarded->transition(g.k, arguments(), out_.data());
    x.d[0] = Taylor2();
    for (std::size_t i = 0; i < out_.size(); ++i) change += mu[2 * n + first + static_cast<int>(i)] * out_[i].d[0].c1;
    return change;
  };
  for (std::size_t i = 0; i < c.size(); ++i) {
    sum.x[c[i]] += seeded(q_[i]);
    sum.x[n + c[i]] += seeded(v_[i]);
  }
  for (std::size_t i = 0; i < z_.size(); ++i) sum.x[2 * n + first + static_cast<int>(i)] += seeded(z_[i]);
  sum.t += seeded(t_);
  for (std::size_t k = 0; k < p_.size(); ++k) {
    const auto& parameters = assembly_.number_columns()[static_cast<std::size_t>(numbers[k])];
    if (parameters.empty()) continue;
    const double by = seeded(p_[k]);
    for (const auto& [j, factor] : parameters) sum.rho[j] += factor * by;
  }
  if (friction_falls(g)) add_multipliers_change(g, kappa, d, sum);
  return sum;
}

}  // namespace costate
