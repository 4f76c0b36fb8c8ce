// Changes of independent coordinates, and kinks of drivers, forward, along tangents and back: lib/README.md (6).
#include "costate/formulation/maggi_branch.h"
#include "costate/formulation/maggi_dae.h"
#include "costate/formulation/maggi_event.h"
#include "costate/level/maggi_names.h"

namespace costate {

void MaggiDae::use_mode(int mode) {
  if (mode == level_.chart()) return;
  level_.use_chart(mode);
  rename();
}

void MaggiDae::rename() {
  name_maggi_unknowns(assembly_.mechanism(), level_.independent(), level_.places(), unknowns_);
}

bool MaggiDae::keeps_branch(double from, double t, const double* y) {
  solve_point(t, y);
  return costate::keeps_branch(level_, from);
}

bool MaggiDae::wants_other_coordinates(double t, const double*) { return wants_other_chart(level_, t); }

void MaggiDae::cross_event(int event, double t, double* y, double* yp) { cross_event(event, t, y, yp, -1); }

void MaggiDae::cross_event(int event, double t, double* y, double* yp, int chart) {
  level_.solve(t, y, y + f_, y + 2 * f_);
  costate::cross_event(level_, *events_, event, y, chart);
  rename();
  level_.solve(t, y, y + f_, y + 2 * f_);
  level_.solve_accelerations();
  load_state(level_.state(), y, yp);
}

void MaggiDae::cross_event_tangent(const Jump& jump, double* const* s, double* const* sp, int count) {
  std::vector<double> after = jump.y, rates = jump.yp;
  use_mode(jump.before);
  cross_event(jump.event, jump.t, after.data(), rates.data(), jump.after);
  const auto plus = event_side(jump.t, after.data());
  use_mode(jump.before);
  const auto minus = event_side(jump.t, jump.y.data());
  linearize_motion(jump.t, jump.y.data());
  jump_cost_tangent_.assign(static_cast<std::size_t>(count), 0);
  costate::cross_event_tangent(level_, *events_, jump.event, minus, plus, jump.after, after.data() + 2 * f_, s, count,
                               jump_cost_tangent_.data());
  rename();
  linearize_motion(jump.t, after.data());
  complete_columns(s, sp, count);
}

void MaggiDae::cross_event_adjoint(const Jump& jump, double* mu, double* mup, double* gradient) {
  std::vector<double> after = jump.y, rates = jump.yp;
  cross_event(jump.event, jump.t, after.data(), rates.data(), jump.after);
  const auto plus = event_side(jump.t, after.data());
  use_mode(jump.before);
  const auto minus = event_side(jump.t, jump.y.data());
  level_.solve(jump.t, jump.y.data(), jump.y.data() + f_, jump.y.data() + 2 * f_);
  ScalarGradient weights;
  weights.resize(assembly_);
  costate::cross_event_adjoint(level_, *events_, jump.event, minus, plus, jump.after, after.data() + 2 * f_, mu,
                               weights, gradient);
  pull_weights(jump.t, jump.y.data(), weights, mu, mup, gradient);
}

void MaggiDae::adjoint_at(double t, const double* y, const double* w, double* mu, double* mup, double* gradient) {
  pull_weights(t, y, weights_of(assembly_, w), mu, mup, gradient);
}

void MaggiDae::pull_weights(double t, const double* y, const ScalarGradient& weights, double* mu, double* mup,
                            double* gradient) {
  linearize_motion(t, y);
  level_.pull(weights, false);
  level_.finish_pull(nullptr);
  copy_pulled(1, mu);
  level_.add_pulled_parameters(1, gradient);
  complete_adjoint(mu, mup);
}

void MaggiDae::cross_kink(double t, double t_after, double* y, double* yp) {
  level_.solve(t, y, y + f_, y + 2 * f_);
  kink_.cross(t_after, y + f_);
  level_.solve(t_after, y, y + f_, y + 2 * f_);
  level_.solve_accelerations();
  load_state(level_.state(), y, yp);
}

void MaggiDae::cross_kink_tangent(const Jump& before, double t_after, double* const* s, double* const* sp, int count) {
  const auto moving = moving_time(before, [&](double* y, double* yp) { cross_kink(before.t, t_after, y, yp); });
  set_cost_tangent(moving);
  linearize_motion(before.t, before.y.data());
  kink_.tangent(t_after, s, count, moving ? &*moving : nullptr);
  std::vector<double> y = before.y, yp = before.yp;
  cross_kink(before.t, t_after, y.data(), yp.data());
  linearize_motion(t_after, y.data());
  complete_columns(s, sp, count);
}

void MaggiDae::cross_kink_adjoint(const Jump& before, double t_after, double* mu, double* mup, double* gradient) {
  const auto moving = moving_time(before, [&](double* y, double* yp) { cross_kink(before.t, t_after, y, yp); });
  level_.solve(before.t, before.y.data(), before.y.data() + f_, before.y.data() + 2 * f_);
  const ScalarGradient& weights = kink_.adjoint(t_after, mu, gradient, moving ? &*moving : nullptr);
  linearize_motion(before.t, before.y.data());
  level_.pull(weights, false);
  level_.finish_pull(nullptr);
  keep_places(level_, mu, [&] { copy_pulled(1, mu); });
  level_.add_pulled_parameters(1, gradient);
  complete_adjoint(mu, mup);
}

void MaggiDae::change_coordinates(double t, double* y, double* yp) {
  level_.solve(t, y, y + f_, y + 2 * f_);
  level_.solve_accelerations();
  const StateView s = level_.state();
  level_.change_chart();
  load_state(s, y, yp);
  rename();
}

// dy after = (B2 dq, B2 dv, dz, B2 da), with dw before the jump from the equations of motion.
void MaggiDae::change_coordinates_tangent(const Jump& jump, double* const* s, double* const* sp, int count) {
  use_mode(jump.after);
  const std::vector<int> independent = level_.independent();
  use_mode(jump.before);
  linearize_motion(jump.t, jump.y.data());
  level_.push(s, count, false, true);
  Eigen::VectorXd da;
  const int w = 2 * f_ + nz_;
  for (int j = 0; j < count; ++j) {
    solve_pushed_accelerations(j, da);
    for (int i = 0; i < f_; ++i) {
      sp[j][w + i] = 0;
      if (static_cast<std::size_t>(i) >= independent.size()) {
        s[j][f_ + i] = sp[j][i] = s[j][w + i] = sp[j][f_ + i] = 0;
        continue;
      }
      const int k = independent[i];
      s[j][i] = level_.dq(j)[k];
      s[j][f_ + i] = sp[j][i] = level_.dv(j)[k];
      s[j][w + i] = sp[j][f_ + i] = da[k];
    }
    std::copy_n(level_.state_rate(j), nz_, sp[j] + 2 * f_);
  }
  use_mode(jump.after);
}

void MaggiDae::change_coordinates_adjoint(const Jump& jump, double* mu, double* mup, double* gradient) {
  use_mode(jump.after);
  cost_gradient_.set_zero();
  const auto& independent = level_.independent();
  for (std::size_t i = 0; i < independent.size(); ++i) {
    cost_gradient_.q[independent[i]] = mu[i];
    cost_gradient_.v[independent[i]] = mu[static_cast<std::size_t>(f_) + i];
  }
  for (int i = 0; i < nz_; ++i) cost_gradient_.z[i] = mu[2 * f_ + i];
  use_mode(jump.before);
  linearize_motion(jump.t, jump.y.data());
  level_.pull(cost_gradient_, false);
  level_.finish_pull(nullptr);
  keep_places(level_, mu, [&] { copy_pulled(1, mu); });
  level_.add_pulled_parameters(1, gradient);
  complete_adjoint(mu, mup);
}

}  // namespace costate
