// Steps of the discrete scheme that do not end where the next one of the same length begins: at events, at kinks.
#include <algorithm>

#include "costate/discrete/discrete_scheme.h"

namespace costate {

void DiscreteScheme::keep_beginnings() {
  keeps_beginnings_ = true;
  begun_numbers_ = numbers_;
  begun_ = parts(begun_numbers_.data());
}

void DiscreteScheme::repeat(double h, double t_end) {
  // The last solution is the first guess of this one; what the step began with counts for everything else.
  stage_rows_.slips().release();
  const std::vector<double> guess(r_.x, r_.x + matrices_.size());
  std::copy(begun_numbers_.begin(), begun_numbers_.end(), numbers_.begin());
  std::copy(guess.begin(), guess.end(), r_.x);
  --index_;
  set_length(h);
  advance(h, t_end);
}

ImpulseJump& DiscreteScheme::velocity_jump() {
  if (!velocity_jump_) velocity_jump_ = std::make_unique<VelocityJump>(assembly_, level());
  return *velocity_jump_;
}

/// As at the start, but that the next step iterates on a matrix of its own.
void DiscreteScheme::begin_anew(double t) {
  *r_.t = t;
  *r_.h = 0;
  std::fill(r_.u, r_.u + n_, 0.0);
  std::fill(r_.eta, r_.eta + m_, 0.0);
  assembly_.calc_dynamics(state());
  find_rates("behind a jump");
  stale_ = true;
  known_differences_ = 0;
  remember();
}

void DiscreteScheme::cross_event() {
  const std::vector<double> before = numbers_;
  events_->cross(pending_event_, state_of(before.data()), r_.v, r_.z);
  begin_anew(time());
}

void DiscreteScheme::cross_kink(double kink, double t_after) {
  Jump jump;
  jump.t = time();
  jump.y.assign(r_.q, r_.q + 2 * n_ + nz_);  // which a record begins with
  const double* v = velocity_jump().calc(state(), t_after);
  std::copy(v, v + n_, r_.v);
  begin_anew(t_after);
  require_contacts_follow(jump, kink, r_.q);
}

void DiscreteScheme::move_on(double dt, double t) {
  for (int i = 0; i < n_; ++i) {
    r_.q[i] += dt * r_.v[i];
    r_.v[i] += dt * r_.a[i];
  }
  for (int i = 0; i < nz_; ++i) r_.z[i] += dt * r_.f[i];
  *r_.t = t;
  *r_.h = dt;
}

// Which are only read.
StateView DiscreteScheme::state_of(const double* record) const { return state_of(parts(const_cast<double*>(record))); }
const double* DiscreteScheme::rates_of(const double* record) const { return parts(const_cast<double*>(record)).f; }

}  // namespace costate
