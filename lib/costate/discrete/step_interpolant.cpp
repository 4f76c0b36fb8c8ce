#include "costate/discrete/step_interpolant.h"

#include <utility>

namespace costate {

StepInterpolant::StepInterpolant(DiscreteScheme& scheme) : scheme_(scheme) {
  y_.assign(static_cast<std::size_t>(scheme.size()), 0.0);
}

void StepInterpolant::copy(const StepRecord& r, End& end) const {
  const auto n = static_cast<std::size_t>(scheme_.assembly().n()),
             nz = static_cast<std::size_t>(scheme_.assembly().nz());
  end.t = *r.t;
  end.q.assign(r.q, r.q + n);
  end.v.assign(r.v, r.v + n);
  end.a.assign(r.a, r.a + n);
  end.z.assign(r.z, r.z + nz);
  end.f.assign(r.f, r.f + nz);
}

void StepInterpolant::advance() {
  std::swap(before_, now_);
  copy(now_);
  if (scheme_.index() == 0) before_ = now_;
}

void StepInterpolant::take_step() {
  copy(scheme_.beginning(), before_);
  copy(now_);
}

MechanismState StepInterpolant::at(double t) {
  const double h = now_.t - before_.t;
  if (!(h > 0) || (t - before_.t) / h >= 1 - 1e-12) return scheme_.state();
  return scheme_.mechanism_state(t, motion(t));
}

const double* StepInterpolant::motion(double t) {
  const int n = scheme_.assembly().n(), nz = scheme_.assembly().nz();
  const double h = now_.t - before_.t;
  if (t >= now_.t) {
    const double dt = t - now_.t;
    for (int i = 0; i < n; ++i) {
      y_[i] = now_.q[i] + dt * (now_.v[i] + dt / 2 * now_.a[i]);
      y_[n + i] = now_.v[i] + dt * now_.a[i];
    }
    for (int i = 0; i < nz; ++i) y_[2 * n + i] = now_.z[i] + dt * now_.f[i];
    return y_.data();
  }
  const double s = (t - before_.t) / h, r = 1 - s;
  for (int i = 0; i < n; ++i) {
    // q0 + h v0 s + h^2 a0 s^2 / 2, then what the far end asks for: c s^3 + d s^4 + e s^5.
    const double v0 = h * before_.v[i], v1 = h * now_.v[i], a0 = h * h * before_.a[i], a1 = h * h * now_.a[i];
    const double p = now_.q[i] - (before_.q[i] + v0 + a0 / 2), w = v1 - (v0 + a0), b = a1 - a0;
    const double c = 10 * p - 4 * w + b / 2, d = -15 * p + 7 * w - b, e = 6 * p - 3 * w + b / 2;
    y_[i] = before_.q[i] + s * (v0 + s * (a0 / 2 + s * (c + s * (d + s * e))));
    y_[n + i] = (v0 + s * (a0 + s * (3 * c + s * (4 * d + s * 5 * e)))) / h;
  }
  for (int i = 0; i < nz; ++i) {
    const double f0 = h * before_.f[i], f1 = h * now_.f[i];
    y_[2 * n + i] =
        r * r * (1 + 2 * s) * before_.z[i] + s * s * (1 + 2 * r) * now_.z[i] + s * r * r * f0 - s * s * r * f1;
  }
  return y_.data();
}

}  // namespace costate
