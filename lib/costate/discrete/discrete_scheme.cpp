#include "costate/discrete/discrete_scheme.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "costate/assembly/packed_state.h"
#include "costate/base/error.h"
#include "costate/level/unknown_names.h"

namespace costate {

namespace {
constexpr double kEps = std::numeric_limits<double>::epsilon();
// Corrections below this part of the coordinates are rounding errors of the constraints' own evaluation (sums of a few
// products, times the condition of a mechanism away from singular positions).
constexpr double kRounding = 32 * kEps;
// Where a fresh matrix brings no progress below this size, rounding is what remains: near singular positions it is
// larger. Above, the step has failed.
constexpr double kNoise = 1e-9;
// An iteration that contracts less asks for a matrix of its own.
constexpr double kSlow = 0.25;
constexpr int kMaxIterations = 40;
constexpr int kMaxRefactorizations = 4;
}  // namespace

DiscreteScheme::DiscreteScheme(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                               Objective objective, const AlphaCoefficients& coefficients)
    : System(std::move(mechanism), std::move(parameters), std::move(objective)),
      alpha_coefficients_(coefficients),
      matrices_(assembly_),
      stage_rows_(assembly_),
      n_(assembly_.n()),
      m_(assembly_.m()),
      nz_(assembly_.nz()) {
  append_differential_unknowns(assembly_.mechanism(), unknowns_);
  lay_out();
  if (events_) events_->use(velocity_jump().balance());
  if (assembly_.has_switched_rows()) stage_rows_.give_as(level());
  const auto n = static_cast<std::size_t>(n_), nz = static_cast<std::size_t>(nz_);
  const auto size = static_cast<std::size_t>(matrices_.size());
  for (auto* x : {&q_g_, &v_g_, &v_star_}) x->assign(n, 0);
  z_g_.assign(nz, 0);
  rhs_.assign(size, 0);
  for (auto& d : differences_) d.assign(size, 0);
  std::vector<std::string> units;
  for (const auto& c : assembly_.mechanism().coordinates()) {
    const auto at = std::find(units.begin(), units.end(), c.unit);
    group_.push_back(static_cast<int>(at - units.begin()));
    if (at == units.end()) units.push_back(c.unit);
  }
  group_scale_.assign(units.size(), 0);
  state_scale_.assign(nz, 0);
  state_reach_.assign(nz, 0);
}

StepRecord DiscreteScheme::parts(double* numbers) const {
  StepRecord r;
  const int sizes[] = {n_, n_, nz_, n_, m_, n_ + nz_ + m_, n_, m_, n_, nz_, nz_, 1, 1};
  double** of[] = {&r.q, &r.v, &r.z, &r.a, &r.lambda, &r.x, &r.u, &r.eta, &r.alpha, &r.y, &r.f, &r.t, &r.h};
  for (std::size_t i = 0; i < std::size(sizes); ++i) {
    *of[i] = numbers;
    numbers += sizes[i];
  }
  return r;
}

void DiscreteScheme::lay_out() {
  const std::size_t total = static_cast<std::size_t>(6 * n_ + 4 * nz_ + 3 * m_ + 2);
  numbers_.assign(total, 0);
  r_ = parts(numbers_.data());
}

StateView DiscreteScheme::view(double t, const double* y) const { return packed_view(t, y, n_); }

AccelerationLevel& DiscreteScheme::level() {
  if (!level_) level_ = std::make_unique<AccelerationLevel>(assembly_, Stabilization{});
  return *level_;
}

MechanismState DiscreteScheme::mechanism_state(double t, const double* y) {
  level().solve(view(t, y));
  return level_->state();
}

StateView DiscreteScheme::state() const { return state_of(r_); }

StateView DiscreteScheme::state_of(const StepRecord& r) const {
  StateView s;
  s.t = *r.t;
  s.q = r.q;
  s.v = r.v;
  s.z = r.z;
  s.a = r.a;
  s.lambda = r.lambda;
  return s;
}

StateView DiscreteScheme::stage() {
  for (int i = 0; i < n_; ++i) v_star_[i] = r_.v[i] - r_.u[i];
  StateView s = state();
  s.v = v_star_.data();
  s.a = r_.x;
  s.lambda = r_.x + n_ + nz_;
  return s;
}

void DiscreteScheme::start(double t, double h, StartDerivative wanted) {
  t_start_ = t;
  length_ = h;
  index_ = 0;
  c_ = StepCoefficients(alpha_coefficients_, h);
  stale_ = false;
  counters_ = {};
  start_ = find_start(assembly_, t, needs_start_columns(assembly_, wanted));
  std::fill(numbers_.begin(), numbers_.end(), 0.0);
  *r_.t = t;
  std::copy(start_.q.data(), start_.q.data() + n_, r_.q);
  std::copy(start_.v.data(), start_.v.data() + n_, r_.v);
  std::copy(start_.z.data(), start_.z.data() + nz_, r_.z);
  assembly_.calc_dynamics(state());
  std::size_t giving = 0;
  for (int i = 0; i < m_; ++i) giving += level_ && level_->gives(i) ? 1 : 0;
  if (constraint_rank(assembly_, t, r_.q).dependent_rows.size() > giving) fail_singular("at the start", -1);
  assembly_.calc_dynamics(state());
  find_rates("at the start");
  factor_stage_here();  // which the first step iterates on
  known_differences_ = 0;
  remember();
  std::fill(state_scale_.begin(), state_scale_.end(), 0.0);
}

/// Rates of all kinds at (t, q, v, z), where the assembly's dynamics are; they are the next step's first guess.
void DiscreteScheme::find_rates(const char* where) {
  slips_here();
  check(factor_projection(), where);
  find_accelerations();
  std::copy(r_.a, r_.a + n_, r_.alpha);
  std::copy(r_.f, r_.f + nz_, r_.y);
  std::copy(r_.a, r_.a + n_, r_.x);
  std::copy(r_.f, r_.f + nz_, r_.x + n_);
  std::copy(r_.lambda, r_.lambda + m_, r_.x + n_ + nz_);
}

/// 3: with P factored and the assembly's dynamics at (t, q, v, z).
void DiscreteScheme::find_accelerations() {
  double* b = rhs_.data();
  for (int i = 0; i < n_; ++i) b[i] = assembly_.Q[i];
  for (int i = 0; i < nz_; ++i) b[n_ + i] = assembly_.zdot[i];
  for (int i = 0; i < m_; ++i) b[n_ + nz_ + i] = -assembly_.bias[i];
  matrices_.solve_projection(b);
  std::copy(b, b + n_, r_.a);
  std::copy(b + n_, b + n_ + nz_, r_.f);
  std::copy(b + n_ + nz_, b + matrices_.size(), r_.lambda);
}

/// Sums the backward differences of x up to the order that was best at the last step.
void DiscreteScheme::predict() {
  std::copy(differences_[0].begin(), differences_[0].end(), r_.x);
  for (int k = 1; k < order_; ++k)
    for (int i = 0; i < matrices_.size(); ++i) r_.x[i] += differences_[k][i];
}

/// Takes x into the backward differences. The k-th of them is the error that extrapolation from k earlier steps would
/// have made at this one.
void DiscreteScheme::remember() {
  const int last = static_cast<int>(differences_.size()) - 1;
  const int size = matrices_.size();
  double best = std::numeric_limits<double>::infinity();
  const int known = std::min(known_differences_, last);
  for (int i = 0; i < size; ++i) {
    double d = r_.x[i];
    for (int k = 0; k <= known; ++k) {
      const double before = differences_[k][i];
      differences_[k][i] = d;
      d -= before;
    }
  }
  order_ = 1;
  for (int k = 1; k <= known; ++k) {
    double error = 0;
    for (int i = 0; i < n_; ++i) error = std::max(error, std::abs(differences_[k][i]));
    if (error < best) {
      best = error;
      order_ = k;
    }
  }
  known_differences_ = known + 1;
}

void DiscreteScheme::set_scales() {
  const auto& coordinates = assembly_.mechanism().coordinates();
  std::fill(group_scale_.begin(), group_scale_.end(), 0.0);
  for (int i = 0; i < n_; ++i) {
    double& scale = group_scale_[group_[i]];
    scale = std::max({scale, std::abs(r_.q[i]) + c_.h * std::abs(r_.v[i]) + c_.h * c_.h * std::abs(r_.a[i]),
                      coordinates[i].unit == "rad" ? 1.0 : 0.0});
  }
  for (int i = 0; i < nz_; ++i)
    state_scale_[i] = std::max(state_scale_[i], std::abs(r_.z[i]) + c_.h * std::abs(r_.f[i]));
}

/// What a step of the coordinates' own size makes of each state: the work of a force at rest is known no better than
/// rounding of the coordinates leaves it, however small it is.
void DiscreteScheme::set_reaches() {
  if (nz_ == 0) return;
  std::fill(state_reach_.begin(), state_reach_.end(), 0.0);
  const SparsePattern& p = assembly_.state_force();
  for (int j = 0; j < p.cols; ++j)
    for (auto e = p.column_start[j]; e < p.column_start[j + 1]; ++e) {
      const auto at = static_cast<std::size_t>(e);
      double& reach = state_reach_[static_cast<std::size_t>(p.row[at])];
      reach = std::max(reach, c_.G_z * (c_.G / c_.B * std::abs(assembly_.f_v[at]) + std::abs(assembly_.f_q[at])) *
                                  group_scale_[group_[j]]);
    }
}

/// The largest of B |da*| and G_z |df*| against the coordinates and states that they change, as they were at the step's
/// beginning or are now: what begins to move from a place at the origin is known no better than to rounding of where
/// the step leads.
double DiscreteScheme::correction_size() {
  double size = 0;
  reached_.assign(group_scale_.begin(), group_scale_.end());
  for (int i = 0; i < n_; ++i) reached_[group_[i]] = std::max(reached_[group_[i]], std::abs(r_.q[i]));
  const auto take = [&](double correction, double scale) {
    const double e = correction == 0 ? 0 : std::abs(correction) / std::max(scale, 1e-300);
    if (!(e <= size)) size = e;
  };
  for (int i = 0; i < n_; ++i) take(c_.B * rhs_[i], reached_[group_[i]]);
  for (int i = 0; i < nz_; ++i)
    take(c_.G_z * rhs_[n_ + i], std::max({state_scale_[i], state_reach_[i], std::abs(r_.z[i])}));
  return size;
}

/// q, v*, z of the present x, the assembly's dynamics there, and minus the residual of 1 in rhs_.
void DiscreteScheme::evaluate_stage() {
  const double *a = r_.x, *f = r_.x + n_, *lambda = r_.x + n_ + nz_;
  for (int i = 0; i < n_; ++i) {
    r_.q[i] = q_g_[i] + c_.B * a[i];
    v_star_[i] = v_g_[i] + c_.G * a[i];
  }
  for (int i = 0; i < nz_; ++i) r_.z[i] = z_g_[i] + c_.G_z * f[i];
  StateView s = state();
  s.v = v_star_.data();
  assembly_.calc_dynamics(s);
  ++counters_.residuals;
  double* b = rhs_.data();
  for (int i = 0; i < n_; ++i) b[i] = assembly_.Q[i];
  add_product(assembly_.square(), assembly_.M.data(), -1, a, b);
  add_transposed_product(assembly_.jacobian(), assembly_.reaction_jacobian().data(), -1, lambda, b);
  for (int i = 0; i < nz_; ++i) b[n_ + i] = assembly_.zdot[i] - f[i];
  s.a = a;
  s.lambda = lambda;
  stage_rows_.subtract(assembly_, c_, s, b + n_ + nz_);
}

/// 1, until corrections are of rounding size. The last correction is applied to x and v*, not to q, so that the
/// assembly's M and phi_q belong to q.
void DiscreteScheme::iterate() {
  double before = std::numeric_limits<double>::infinity();
  int refactorizations = 0;
  bool refactor = std::exchange(stale_, false);
  for (int i = 0;; ++i) {
    evaluate_stage();
    if (refactor || stage_rows_.slips().have_changed()) {
      StateView s = state();
      s.v = v_star_.data();
      s.a = r_.x;
      s.lambda = r_.x + n_ + nz_;
      calc_stage_partials(s);
      check(matrices_.factor_step(assembly_, c_, stage_rows_), "in a step");
      set_reaches();
      ++counters_.extra_factorizations;
      refactor = false;
    }
    matrices_.solve_step(rhs_.data());
    ++counters_.newton_iterations;
    const double size = correction_size();
    if (!std::isfinite(size) || i == kMaxIterations) fail_newton(i, size);
    const bool stands_still = size > kSlow * before;
    const bool done = size <= kRounding || (stands_still && refactorizations > 0 && size <= kNoise);
    for (int k = 0; k < matrices_.size(); ++k) r_.x[k] += rhs_[k];
    if (done) {
      for (int k = 0; k < n_; ++k) v_star_[k] += c_.G * rhs_[k];
      return;
    }
    if (stands_still) {
      if (refactorizations == kMaxRefactorizations) fail_newton(i, size);
      ++refactorizations;
      refactor = true;
    }
    before = size;
  }
}

void DiscreteScheme::set_length(double h) {
  if (h == c_.h) return;
  c_ = h == length_ ? StepCoefficients(alpha_coefficients_, h) : StepCoefficients::trapezoidal(h);
  stale_ = true;
}

void DiscreteScheme::step(double h, double t_end) {
  if (keeps_beginnings_) std::copy(numbers_.begin(), numbers_.end(), begun_numbers_.begin());
  set_length(h);
  ++counters_.steps;
  if (StepSlips& slips = stage_rows_.slips(); slips.possible() && keeps_beginnings_) {
    assembly_.switch_rows(r_.z);
    slips.hold_if_stopping(assembly_, state(), h);
  }
  predict();
  advance(h, t_end);
}

void DiscreteScheme::advance(double h, double t_end) {
  set_scales();
  for (int i = 0; i < n_; ++i) {
    q_g_[i] = r_.q[i] + c_.h * r_.v[i] + (c_.q_alpha * r_.alpha[i] + c_.q_a * r_.a[i]);
    v_g_[i] = r_.v[i] + c_.v_alpha * r_.alpha[i] + c_.v_a * r_.a[i];
    r_.alpha[i] = c_.old_alpha * r_.alpha[i] + c_.old_a * r_.a[i];
  }
  for (int i = 0; i < nz_; ++i) {
    z_g_[i] = r_.z[i] + c_.z_y * r_.y[i] + c_.z_f * r_.f[i];
    r_.y[i] = c_.old_y * r_.y[i] + c_.old_f * r_.f[i];
  }
  ++index_;
  *r_.t = t_end;
  *r_.h = h;
  iterate();
  remember();
  StateView s = state();
  s.v = v_star_.data();
  s.a = r_.x;
  s.lambda = r_.x + n_ + nz_;
  calc_stage_partials(s);
  check(matrices_.factor_step(assembly_, c_, stage_rows_), "in a step");
  set_reaches();
  check(factor_projection(), "in a projection");
  // 2
  double* b = rhs_.data();
  std::fill(b, b + matrices_.size(), 0.0);
  for (int i = 0; i < m_; ++i) b[n_ + nz_ + i] = -assembly_.phi_t[i];
  add_product(assembly_.jacobian(), assembly_.phi_q.data(), -1, v_star_.data(), b + n_ + nz_);
  matrices_.solve_velocities(b);
  for (int i = 0; i < n_; ++i) {
    r_.u[i] = b[i];
    r_.v[i] = v_star_[i] + b[i];
  }
  std::copy(b + n_ + nz_, b + matrices_.size(), r_.eta);
  // 3, 4
  assembly_.calc_dynamics(state());
  find_accelerations();
  for (int i = 0; i < n_; ++i) r_.alpha[i] += c_.new_a * r_.a[i];
  for (int i = 0; i < nz_; ++i) r_.y[i] += c_.new_f * r_.f[i];
}

void DiscreteScheme::load(long index, const double* from) {
  index_ = index;
  std::copy(from, from + numbers_.size(), numbers_.begin());
  if (*r_.h > 0) set_length(*r_.h);
}

void DiscreteScheme::factor_projection_here() {
  assembly_.calc_dynamics(state());
  slips_here();
  check(factor_projection(), "in a projection");
}

void DiscreteScheme::factor_stage_here() {
  const StateView s = stage();
  assembly_.calc_dynamics(s);
  calc_stage_partials(s);
  check(matrices_.factor_step(assembly_, c_, stage_rows_), "in a step");
  set_scales();
  set_reaches();
}

void DiscreteScheme::factor_here() {
  factor_projection_here();
  factor_stage_here();
  stale_ = false;
  known_differences_ = 0;
  remember();
}

}  // namespace costate
