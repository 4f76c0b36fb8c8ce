// Events at the ends of steps that are differentiated themselves: the guard's derivatives and those of the transition
// alone, without the rates of the motion on either side.
#include <algorithm>

#include "costate/assembly/slip_on_line.h"
#include "costate/element/force/rigid_contact.h"
#include "costate/event/motion_events.h"

namespace costate {

double MotionEvents::guard(int event, const StateView& s) { return guard(of(event), s); }

double MotionEvents::guard_from(int event, const StateView& begin, const StateView& s) {
  const GuardOf& g = of(event);
  const double value = guard(g, s);
  if (!stops_in_space(g)) return value;
  const auto slip = [&](const StateView& x) {
    Variation still;
    still.q = still.v = x.v;
    return SlipOnLine(assembly_, x, still, g.first_row).w;
  };
  return slip(begin).dot(slip(s)) < 0 ? -value - kSlidingOffset : value;
}

double MotionEvents::guard_gradient(int event, const StateView& before, const Side& minus, const Side& plus,
                                    ScalarGradient& out) {
  refuse_slip_from_rest(event, before);
  // For what it refuses: the steps on either side have an end and a beginning there also where nothing jumps.
  goes_on_smoothly(event, before, minus, plus);
  const GuardOf& g = of(event);
  const Eigen::VectorXd by_multipliers = linearize_all(g, before, minus, true);
  const int n = assembly_.n(), nz = assembly_.nz();
  const Eigen::Map<const Eigen::VectorXd> x(h_x_.data(), 2 * n + nz);
  out.set_zero();
  out.q = x.head(n);
  out.v = x.segment(n, n);
  out.z = x.tail(nz);
  out.rho = Eigen::Map<const Eigen::VectorXd>(h_rho_.data(), assembly_.np());
  if (!lambda_.empty()) out.lambda = by_multipliers;
  return h_t_;
}

void MotionEvents::transition_tangent(int event, const StateView& before, double* const* columns, const double* dt,
                                      int count) {
  const int n = assembly_.n(), first = of(event).first_state;
  const bool impact = has_impulse(event);
  if (impact) linearize_impact(event, before, true);
  std::vector<double> own(D_x_.size()), u(static_cast<std::size_t>(n));
  for (int j = 0; j < count; ++j) {
    double* x = columns[j];
    for (std::size_t i = 0; i < own.size(); ++i) {
      own[i] = D_rho_[i][static_cast<std::size_t>(j)] + D_t_[i] * dt[j];
      for (std::size_t k = 0; k < D_x_[i].size(); ++k) own[i] += D_x_[i][k] * x[k];
    }
    if (impact) {
      std::fill(u.begin(), u.end(), 0.0);
      impact_tangent(x, x + n, Eigen::VectorXd::Unit(assembly_.np(), j), dt[j], u.data());
      for (int i = 0; i < n; ++i) x[n + i] += u[static_cast<std::size_t>(i)];
    }
    for (std::size_t i = 0; i < own.size(); ++i) x[2 * n + first + static_cast<int>(i)] = own[i];
  }
}

double MotionEvents::transition_adjoint(int event, const StateView& before, double* mu, double* gradient) {
  const int n = assembly_.n(), first = of(event).first_state;
  double by_time = 0;
  if (has_impulse(event)) {
    linearize_impact(event, before, false);
    std::vector<double> w(static_cast<std::size_t>(2 * n), 0);
    by_time = impact_adjoint(mu + n, w.data(), w.data() + n, gradient);
    for (int i = 0; i < 2 * n; ++i) mu[i] += w[static_cast<std::size_t>(i)];
  }
  std::vector<double> weights(D_x_.size());
  for (std::size_t i = 0; i < weights.size(); ++i) {
    double& own = mu[2 * n + first + static_cast<int>(i)];
    weights[i] = own;
    by_time += own * D_t_[i];
    own = 0;
  }
  for (std::size_t i = 0; i < weights.size(); ++i) {
    for (std::size_t k = 0; k < D_x_[i].size(); ++k) mu[k] += weights[i] * D_x_[i][k];
    for (std::size_t j = 0; j < D_rho_[i].size(); ++j) gradient[j] += weights[i] * D_rho_[i][j];
  }
  return by_time;
}

}  // namespace costate
