// The dual-number defaults of every derivative block: exact, slower than by hand, and the oracle of those.
#include <algorithm>
#include <array>
#include <cstring>

#include "costate/base/error.h"
#include "costate/element/element.h"

namespace costate {

namespace {

using Local = std::array<PathDual, kMaxLocal>;

// Numbers can be many (a table's values), so they live in a per-thread buffer that grows once.
PathDual* number_buffer(std::size_t n) {
  thread_local std::vector<PathDual> buffer;
  if (buffer.size() < n) buffer.resize(n);
  return buffer.data();
}

PathDual* load_numbers(const Element& e, const LocalState& s) {
  const std::size_t n = e.numbers().size();
  PathDual* p = number_buffer(n + 1);
  for (std::size_t i = 0; i < n; ++i) p[i] = PathDual(s.p[i]);
  return p;
}

void load(const double* x, int n, Local& out) {
  for (int i = 0; i < n; ++i) out[i] = x ? PathDual(x[i]) : PathDual();
}

/// The motion q(s) = q + v s + a s^2/2 as Taylor coefficients.
void load_path(const LocalState& s, const double* a, int n, Local& q, PathDual& t) {
  for (int i = 0; i < n; ++i) q[i] = PathDual(Taylor2(s.q[i], s.v ? s.v[i] : 0, a ? a[i] : 0));
  t = PathDual(Taylor2(s.t, 1, 0));
}

PathDual seeded(PathDual x) {
  x.d[0] = Taylor2(1.0);
  return x;
}

}  // namespace

void Body::calc_mass(const LocalState& s, LocalMatrix& M) const {
  const int n = static_cast<int>(coordinates().size());
  Local q, v, a, r;
  load(s.q, n, q);
  load(nullptr, n, v);
  const PathDual* p = load_numbers(*this, s);
  for (int j = 0; j < n; ++j) {
    load(nullptr, n, a);
    a[j] = seeded(a[j]);
    r.fill(PathDual());
    residual(q.data(), v.data(), a.data(), p, r.data());
    for (int i = 0; i < n; ++i) M(i, j) = r[i].d[0].c0;
  }
}

void Body::calc_force(const LocalState& s, double* Q) const {
  const int n = static_cast<int>(coordinates().size());
  Local q, v, a, r;
  load(s.q, n, q);
  load(s.v, n, v);
  load(nullptr, n, a);
  r.fill(PathDual());
  residual(q.data(), v.data(), a.data(), load_numbers(*this, s), r.data());
  for (int i = 0; i < n; ++i) Q[i] = -r[i].v.c0;
}

void Body::calc_partials(const LocalState& s, LocalMatrix& r_q, LocalMatrix& r_v) const {
  const int n = static_cast<int>(coordinates().size());
  Local q, v, a, r;
  load(s.q, n, q);
  load(s.v, n, v);
  load(s.a, n, a);
  const PathDual* p = load_numbers(*this, s);
  const auto column = [&](PathDual& x, LocalMatrix& out, int j) {
    const PathDual keep = x;
    x = seeded(x);
    r.fill(PathDual());
    residual(q.data(), v.data(), a.data(), p, r.data());
    for (int i = 0; i < n; ++i) out(i, j) = r[i].d[0].c0;
    x = keep;
  };
  for (int j = 0; j < n; ++j) {
    column(q[j], r_q, j);
    column(v[j], r_v, j);
  }
}

void Body::calc_number_partial(const LocalState& s, int number, double* r_p) const {
  const int n = static_cast<int>(coordinates().size());
  Local q, v, a, r;
  load(s.q, n, q);
  load(s.v, n, v);
  load(s.a, n, a);
  PathDual* p = load_numbers(*this, s);
  p[number] = seeded(p[number]);
  r.fill(PathDual());
  residual(q.data(), v.data(), a.data(), p, r.data());
  for (int i = 0; i < n; ++i) r_p[i] = r[i].d[0].c0;
}

void Constraint::phi_directed(const DirectedPathDual&, const DirectedPathDual*, const DirectedPathDual*,
                              DirectedPathDual*) const {
  throw CapabilityError(path() +
                        " has no second derivatives, which Hessians need: derive its class from ConstraintOf, "
                        "or override phi_directed.");
}

void Constraint::calc_phi(const LocalState& s, double* out) const {
  const int n = static_cast<int>(coordinates().size());
  Local q, f;
  load(s.q, n, q);
  f.fill(PathDual());
  phi(PathDual(s.t), q.data(), load_numbers(*this, s), f.data());
  for (int i = 0; i < rows(); ++i) out[i] = f[i].v.c0;
}

void Constraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  const int n = static_cast<int>(coordinates().size());
  Local q, f;
  load(s.q, n, q);
  const PathDual* p = load_numbers(*this, s);
  for (int j = 0; j < n; ++j) {
    const PathDual keep = q[j];
    q[j] = seeded(q[j]);
    f.fill(PathDual());
    phi(PathDual(s.t), q.data(), p, f.data());
    for (int i = 0; i < rows(); ++i) phi_q(i, j) = f[i].d[0].c0;
    q[j] = keep;
  }
}

void Constraint::calc_phi_t(const LocalState& s, double* phi_t) const {
  const int n = static_cast<int>(coordinates().size());
  Local q, f;
  load(s.q, n, q);
  f.fill(PathDual());
  phi(PathDual(Taylor2(s.t, 1, 0)), q.data(), load_numbers(*this, s), f.data());
  for (int i = 0; i < rows(); ++i) phi_t[i] = f[i].v.c1;
}

void Constraint::calc_bias(const LocalState& s, double* bias) const {
  const int n = static_cast<int>(coordinates().size());
  Local q, f;
  PathDual t;
  load_path(s, nullptr, n, q, t);
  f.fill(PathDual());
  phi(t, q.data(), load_numbers(*this, s), f.data());
  for (int i = 0; i < rows(); ++i) bias[i] = f[i].v.c2;
}

void Constraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  const int n = static_cast<int>(coordinates().size());
  Local q, f;
  const PathDual* p = load_numbers(*this, s);
  // Entry (i, j): Taylor direction e_i, dual direction e_j.
  for (int i = 0; i < n; ++i)
    for (int j = 0; j <= i; ++j) {
      load(s.q, n, q);
      q[i].v.c1 = 1;
      q[j] = seeded(q[j]);
      f.fill(PathDual());
      phi(PathDual(s.t), q.data(), p, f.data());
      double h = 0;
      for (int r = 0; r < rows(); ++r) h += s.lambda[r] * f[r].d[0].c1;
      hessian(i, j) = h;
      hessian(j, i) = h;
    }
}

void Constraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                               LocalMatrix& phidd_q) const {
  Constraint::calc_hessian(s, hessian);
  const int n = static_cast<int>(coordinates().size());
  Local q, f;
  PathDual t;
  load_path(s, s.a, n, q, t);
  const PathDual* p = load_numbers(*this, s);
  for (int j = 0; j < n; ++j) {
    const PathDual keep = q[j];
    q[j] = seeded(q[j]);
    f.fill(PathDual());
    phi(t, q.data(), p, f.data());
    for (int i = 0; i < rows(); ++i) {
      phid_q(i, j) = f[i].d[0].c1;
      phidd_q(i, j) = f[i].d[0].c2;
    }
    q[j] = keep;
  }
}

void Constraint::calc_number_partial(const LocalState& s, int number, double* phi_p, double* phid_p, double* phidd_p,
                                     double* reaction_p) const {
  const int n = static_cast<int>(coordinates().size());
  Local q, f;
  PathDual t;
  load_path(s, s.a, n, q, t);
  PathDual* p = load_numbers(*this, s);
  p[number] = seeded(p[number]);
  f.fill(PathDual());
  phi(t, q.data(), p, f.data());
  for (int i = 0; i < rows(); ++i) {
    phi_p[i] = f[i].d[0].c0;
    phid_p[i] = f[i].d[0].c1;
    phidd_p[i] = f[i].d[0].c2;
  }
  if (!s.lambda) return;
  for (int j = 0; j < n; ++j) {
    load(s.q, n, q);
    q[j].v.c1 = 1;
    f.fill(PathDual());
    phi(PathDual(s.t), q.data(), p, f.data());
    double r = 0;
    for (int i = 0; i < rows(); ++i) r += s.lambda[i] * f[i].d[0].c1;
    reaction_p[j] = r;
  }
}

double Constraint::calc_number_gradient(const LocalState& s, int number, const ConstraintWeights& w) const {
  const int n = static_cast<int>(coordinates().size());
  Local q, f;
  PathDual t;
  load_path(s, s.a, n, q, t);
  PathDual* p = load_numbers(*this, s);
  p[number] = seeded(p[number]);
  f.fill(PathDual());
  phi(t, q.data(), p, f.data());
  double sum = 0;
  for (int i = 0; i < rows(); ++i)
    sum += w.phi[i] * f[i].d[0].c0 + w.phid[i] * f[i].d[0].c1 + w.phidd[i] * f[i].d[0].c2;
  if (!w.reaction || !s.lambda) return sum;
  // w^T (phi_q^T lambda)_p = lambda^T (phi_q w)_p: one derivative along w.
  for (int j = 0; j < n; ++j) q[j] = PathDual(Taylor2(s.q[j], w.reaction[j], 0));
  f.fill(PathDual());
  phi(PathDual(s.t), q.data(), p, f.data());
  for (int i = 0; i < rows(); ++i) sum += s.lambda[i] * f[i].d[0].c1;
  return sum;
}

void Force::calc_force(const LocalState& s, double* Q, double* zdot) const {
  const int n = static_cast<int>(coordinates().size());
  Local q, v, z, f, g;
  load(s.q, n, q);
  load(s.v, n, v);
  load(s.z, states(), z);
  f.fill(PathDual());
  g.fill(PathDual());
  force(PathDual(s.t), q.data(), v.data(), z.data(), load_numbers(*this, s), f.data(), g.data());
  for (int i = 0; i < n; ++i) Q[i] = f[i].v.c0;
  for (int i = 0; i < states(); ++i) zdot[i] = g[i].v.c0;
}

void Force::calc_partials(const LocalState& s, ForcePartials out) const {
  const int n = static_cast<int>(coordinates().size());
  Local q, v, z, f, g;
  load(s.q, n, q);
  load(s.v, n, v);
  load(s.z, states(), z);
  const PathDual* p = load_numbers(*this, s);
  const auto column = [&](PathDual& x, LocalMatrix& Q_x, LocalMatrix& f_x, int j) {
    const PathDual keep = x;
    x = seeded(x);
    f.fill(PathDual());
    g.fill(PathDual());
    force(PathDual(s.t), q.data(), v.data(), z.data(), p, f.data(), g.data());
    for (int i = 0; i < n; ++i) Q_x(i, j) = f[i].d[0].c0;
    for (int i = 0; i < states(); ++i) f_x(i, j) = g[i].d[0].c0;
    x = keep;
  };
  for (int j = 0; j < n; ++j) {
    column(q[j], out.Q_q, out.f_q, j);
    column(v[j], out.Q_v, out.f_v, j);
  }
  for (int j = 0; j < states(); ++j) column(z[j], out.Q_z, out.f_z, j);
}

void Force::add_number_gradient(const LocalState& s, const double* w_Q, const double* w_f, const int* numbers,
                                int count, double* out) const {
  const auto n = coordinates().size();
  double Q_p[kMaxLocal], f_p[kMaxLocal];
  for (int i = 0; i < count; ++i) {
    std::fill(Q_p, Q_p + n, 0.0);
    std::fill(f_p, f_p + states(), 0.0);
    calc_number_partial(s, numbers[i], Q_p, f_p);
    if (w_Q)
      for (std::size_t j = 0; j < n; ++j) out[i] += w_Q[j] * Q_p[j];
    if (w_f)
      for (int j = 0; j < states(); ++j) out[i] += w_f[j] * f_p[j];
  }
}

void Force::calc_number_partial(const LocalState& s, int number, double* Q_p, double* f_p) const {
  const int n = static_cast<int>(coordinates().size());
  Local q, v, z, f, g;
  load(s.q, n, q);
  load(s.v, n, v);
  load(s.z, states(), z);
  PathDual* p = load_numbers(*this, s);
  p[number] = seeded(p[number]);
  f.fill(PathDual());
  g.fill(PathDual());
  force(PathDual(s.t), q.data(), v.data(), z.data(), p, f.data(), g.data());
  for (int i = 0; i < n; ++i) Q_p[i] = f[i].d[0].c0;
  for (int i = 0; i < states(); ++i) f_p[i] = g[i].d[0].c0;
}

}  // namespace costate
