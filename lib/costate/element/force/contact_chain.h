// Derivatives of a contact in the plane with a plane at rest, by the chain rule. Laws see few numbers, the depth d, the
// closing speed c, the slip s, the angular velocity w and the point's own states; they alone are evaluated on duals.
// With the point's r_q = J and (r_q v)_q = J', R that of what is round (else 0) and e the direction of its angle
//   d_q = -n.J,  c_q = -n.J',  s_q = t.J',  c_v = -n.J,  s_v = t.J + R e,  w_v = e,
//   Q = J^T (N n + F t) + (R F + M) e,
// and with the ground's angle alpha, n_alpha = -t, t_alpha = n, the height h and R themselves
//   d_alpha = t.(r - (0, h)),  c_alpha = t.rdot,  s_alpha = -c,  d_h = n_y,  d_R = 1,  s_R = w.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "costate/element/force/contact_points.h"

namespace costate {

template <class Point, class Ground>
class ContactChain : public ContactPoints<Point, Ground> {
  using Points = ContactPoints<Point, Ground>;

 public:
  using Points::kGround, Points::kNumbers;
  /// Whether the ground is one that this holds for.
  static constexpr bool by_chain = Points::dim == 2 && !Points::on_road;

 protected:
  using Points::Points, Points::count, Points::own_states, Points::size, Points::surface, Points::point_numbers,
      Points::along, Points::motion, Points::apply_laws, Points::arguments, Points::surfaces_, Points::options_;
  template <class S>
  using Forces = typename Points::template Forces<S>;

  /// Whether derivatives by this number are among these: not those of points.
  bool is_chained(int number) const { return number < surfaces_.front().numbers; }

  /// The numbers as constants, in a buffer of the thread.
  template <class S>
  static S* constants(const double* p, std::size_t n) {
    thread_local std::vector<S> buffer;
    if (buffer.size() < n) buffer.resize(n);
    for (std::size_t i = 0; i < n; ++i) buffer[i] = S(p[i]);
    return buffer.data();
  }

  /// Of point i, which touches: all derivative blocks.
  void add_chained_partials(int i, const LocalState& s, const ForcePartials& out) const {
    constexpr int inputs = 4, states = 2;  // own ones: latched speed and bristle
    using D = Dual<inputs + states>;
    const int n = size(), own = own_states(), first = i * own, end = count() * own,
              rows = own + (options_.energy ? 1 : 0);
    Placed at(*this, i, s);
    Forces<D> f;
    f.motion.gap = -D::variable(-at.m.gap, 0);
    f.motion.closing = D::variable(at.m.closing, 1);
    f.motion.slip[0] = D::variable(at.m.slip[0], 2);
    f.motion.omega[0] = D::variable(at.m.omega[0], 3);
    D z[states], rate[states + 1];
    for (int k = 0; k < own; ++k) z[k] = D::variable(s.z[first + k], inputs + k);
    apply_laws(i, constants<D>(s.p, chained_numbers()), z, f, rate);
    rate[own] = f.lost;
    const int angle = at.round ? 2 : -1;
    const D turning = D(at.radius) * f.friction[0] + f.moment[0];
    const auto row = [&](int k) { return k < own ? first + k : end; };
    for (int j = 0; j < n; ++j) {
      const auto by_q = [&](const D& y) { return -y.d[0] * at.nJ[j] - y.d[1] * at.nJd[j] + y.d[2] * at.tJd[j]; };
      const auto by_v = [&](const D& y) {
        const double x = -y.d[1] * at.nJ[j] + y.d[2] * at.tJ[j];
        return j == angle ? x + at.radius * y.d[2] + y.d[3] : x;
      };
      const double Nq = by_q(f.normal), Fq = by_q(f.friction[0]), Nv = by_v(f.normal), Fv = by_v(f.friction[0]);
      for (int r = 0; r < n; ++r) {
        out.Q_q(r, j) += at.nJ[r] * Nq + at.tJ[r] * Fq;
        out.Q_v(r, j) += at.nJ[r] * Nv + at.tJ[r] * Fv;
      }
      if (angle >= 0) {
        out.Q_q(angle, j) += by_q(turning);
        out.Q_v(angle, j) += by_v(turning);
      }
      for (int k = 0; k < rows; ++k) {
        out.f_q(row(k), j) += by_q(rate[k]);
        out.f_v(row(k), j) += by_v(rate[k]);
      }
    }
    if (surface(i).point().kind() == Point::Kind::on_body) {
      const typename Point::Vector force(f.normal.v * at.m.n[0] + f.friction[0].v * at.m.t[0][0],
                                         f.normal.v * at.m.n[1] + f.friction[0].v * at.m.t[0][1]);
      out.Q_q(Point::curvature_index, Point::curvature_index) +=
          surface(i).point().curvature(s.q, point_numbers(i, s.p), force);
    }
    for (int l = 0; l < own; ++l) {
      const auto d = static_cast<std::size_t>(inputs + l);
      for (int r = 0; r < n; ++r) out.Q_z(r, first + l) += at.nJ[r] * f.normal.d[d] + at.tJ[r] * f.friction[0].d[d];
      if (angle >= 0) out.Q_z(angle, first + l) += turning.d[d];
      for (int k = 0; k < rows; ++k) out.f_z(row(k), first + l) += rate[k].d[d];
    }
  }

  /// Of point i, which touches: out[where[j]] += Q_p.w_Q + f_p.w_f by n <= width of its chained numbers.
  template <int width>
  void add_chained_gradient(int i, const LocalState& s, const double* w_Q, const double* w_f, const int* numbers,
                            const int* where, int n, double* out) const {
    using D = Dual<width>;
    const int own = own_states(), first = i * own, end = count() * own;
    Placed at(*this, i, s);
    D* p = constants<D>(s.p, chained_numbers());
    Forces<D> f;
    f.motion.gap = D(at.m.gap);
    f.motion.closing = D(at.m.closing);
    f.motion.slip[0] = D(at.m.slip[0]);
    f.motion.omega[0] = D(at.m.omega[0]);
    double by_n = 0, by_t = 0;
    for (int r = 0; w_Q && r < size(); ++r) {
      by_n += w_Q[r] * at.nJ[r];
      by_t += w_Q[r] * at.tJ[r];
    }
    const double by_turn = w_Q && at.round ? w_Q[2] : 0;
    for (int j = 0; j < n; ++j) {
      const auto d = static_cast<std::size_t>(j);
      p[numbers[j]].d[d] = 1;
      const int k = numbers[j] - kGround;
      if (k == Ground::kHeight) f.motion.gap.d[d] = -at.m.n[1];
      if (k == Ground::kPlace) f.motion.gap.d[d] = -at.m.n[0];
      if (k == Ground::kRadius) {
        f.motion.gap.d[d] = -1;
        f.motion.slip[0].d[d] = at.m.omega[0];
      }
      if (k == Ground::kAngle) {
        f.motion.gap.d[d] = -along(i, s.q, s.p);
        f.motion.closing.d[d] = at.m.slip[0] - at.radius * at.m.omega[0];
        f.motion.slip[0].d[d] = -at.m.closing;
      }
    }
    D z[2], rate[2];
    for (int k = 0; k < own; ++k) z[k] = D(s.z[first + k]);
    apply_laws(i, p, z, f, rate);
    for (int j = 0; j < n; ++j) {
      const auto d = static_cast<std::size_t>(j);
      const int k = numbers[j] - kGround;
      double sum = by_n * f.normal.d[d] + by_t * f.friction[0].d[d] +
                   by_turn * (at.radius * f.friction[0].d[d] + f.moment[0].d[d]);
      if (k == Ground::kAngle) sum += by_n * f.friction[0].v - by_t * f.normal.v;
      if (k == Ground::kRadius) sum += by_turn * f.friction[0].v;
      for (int l = 0; w_f && l < own; ++l) sum += w_f[first + l] * rate[l].d[d];
      if (w_f && options_.energy) sum += w_f[end] * f.lost.d[d];
      out[where[j]] += sum;
    }
  }

 private:
  std::size_t chained_numbers() const { return static_cast<std::size_t>(surfaces_.front().numbers); }

  /// Of point i: its motion, and what its derivatives are along n and t.
  struct Placed {
    static constexpr int most = Point::kMaxCoordinates;
    Placed(const ContactChain& of, int i, const LocalState& s)
        : m(of.motion(i, of.arguments(s))), round(of.surface(i).round()) {
      const auto& point = of.surface(i).point();
      const double* p = of.point_numbers(i, s.p);
      typename Point::Jacobian J(2, point.size()), Jd(2, point.size());
      point.jacobian(s.q, p, J);
      point.jacobian_dot(s.q, s.v, p, Jd);
      for (int j = 0; j < point.size(); ++j) {
        nJ[j] = m.n[0] * J(0, j) + m.n[1] * J(1, j);
        tJ[j] = m.t[0][0] * J(0, j) + m.t[0][1] * J(1, j);
        nJd[j] = m.n[0] * Jd(0, j) + m.n[1] * Jd(1, j);
        tJd[j] = m.t[0][0] * Jd(0, j) + m.t[0][1] * Jd(1, j);
      }
      if (round) radius = s.p[kGround + Ground::kRadius];
    }
    typename Ground::template Motion<double> m;
    bool round;
    double radius = 0, nJ[most], tJ[most], nJd[most], tJd[most];
  };
};

}  // namespace costate
