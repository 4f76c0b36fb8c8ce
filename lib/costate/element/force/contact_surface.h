// What touches the ground: a point, or an arc or a sphere about it, against a plane. The plane goes through
// (x0, h) and rises by the angle alpha along x: normal n = (-sin alpha, cos alpha), in space (-sin alpha, 0, cos
// alpha). With the radius R and the centre r
//   gap = n.(r - (x0, h)) - R,  v_t = t.(rdot + omega x (-R n)):
// the velocities are those of material points, so that a wheel that rolls does not slide.
// Numbers `g` of the plane and the surface: h, alpha, R, x0; `p` those of the point.
#pragma once

#include <cmath>

#include "costate/element/gap_element.h"
#include "costate/element/point/planar_point.h"
#include "costate/element/point/point_speed.h"
#include "costate/element/point/spatial_point.h"

namespace costate {

template <class Point>
class ContactSurface {
 public:
  static constexpr int dim = Point::Vector::RowsAtCompileTime;
  static constexpr int tangents = dim - 1;
  static constexpr int kHeight = 0, kAngle = 1, kRadius = 2, kPlace = 3, kNumbers = 4;
  /// Angular velocities and moments: about z in the plane.
  static constexpr int turns = dim == 2 ? 1 : 3;

  ContactSurface(Point point, bool round) : point_(std::move(point)), round_(round) {}
  const Point& point() const { return point_; }
  bool round() const { return round_; }

  template <class S>
  static void frame(const S* g, S* n, S (*t)[dim]) {
    using std::cos;
    using std::sin;
    const S c = cos(g[kAngle]), s = sin(g[kAngle]);
    for (int k = 0; k < tangents; ++k)
      for (int i = 0; i < dim; ++i) t[k][i] = S(0.0);
    for (int i = 0; i < dim; ++i) n[i] = S(0.0);
    n[0] = -s;
    n[dim - 1] = c;
    t[0][0] = c;
    t[0][dim - 1] = s;
    if constexpr (dim == 3) t[1][1] = S(1.0);
  }

  template <class S>
  void position(const S* q, const S* p, S* r) const {
    if constexpr (dim == 2)
      point_.position(q, p, r[0], r[1]);
    else
      point_.position(q, p, r);
  }

  template <class S>
  void velocity(const S* q, const S* v, const S* p, S* u) const {
    if constexpr (dim == 2)
      point_.velocity(q, v, p, u[0], u[1]);
    else
      point_.velocity(q, v, p, u);
  }

  /// Of a place r: n.(r - (x0, h)) - R.
  template <class S>
  static S gap_of(const S* r, const S* n, const S* g) {
    S gap = -g[kRadius] - n[dim - 1] * g[kHeight] - n[0] * g[kPlace];
    for (int i = 0; i < dim; ++i) gap += n[i] * r[i];
    return gap;
  }

  template <class S>
  S gap(const S* q, const S* g, const S* p) const {
    S r[dim] = {}, n[dim], t[tangents][dim];
    position(q, p, r);
    frame(g, n, t);
    return gap_of(r, n, g);
  }

  GapMotion gap_motion(const double* q, const double* v, const double* g, const double* p) const {
    double r[dim] = {}, u[dim] = {}, n[dim], t[tangents][dim];
    position(q, p, r);
    velocity(q, v, p, u);
    frame(g, n, t);
    GapMotion m;
    m.gap = gap_of(r, n, g);
    for (int i = 0; i < dim; ++i) m.rate += n[i] * u[i];
    // Along n alone; of a body from its origin, which its coordinates begin with.
    const PointSpeed speed = point_speed(point_, q, v, p);
    m.clear = m.gap;
    m.travel = std::abs(m.rate);
    if (speed.lever > 0) {
      double rate = 0;
      for (int i = 0; i < dim; ++i) rate += n[i] * v[i];
      m.clear = gap_of(q, n, g) - speed.lever;
      m.travel = std::abs(rate);
    }
    m.speed = m.travel + speed.lever * speed.turn;
    m.turn = speed.turn;
    return m;
  }

  /// The gap changes by no more than sum_j slopes[j] |q'_j - q_j|; the gap, or, as slopes of rotations are large or not
  /// known, what it is at least however its body is turned.
  double reach(const double* q, const double* g, const double* p, double* slopes) const {
    double n[dim], t[tangents][dim];
    frame(g, n, t);
    if (point_.kind() != Point::Kind::on_body) {  // linear in q
      typename Point::Jacobian J(dim, point_.size());
      point_jacobian(q, p, J);
      for (int j = 0; j < point_.size(); ++j) {
        double along = 0;
        for (int i = 0; i < dim; ++i) along += n[i] * J(i, j);
        slopes[j] = std::abs(along);
      }
      return gap(q, g, p);
    }
    double square = 0;
    for (int i = 0; i < dim; ++i) {
      slopes[i] = std::abs(n[i]);
      square += p[i] * p[i];
    }
    const double lever = std::sqrt(square), clear = gap_of(q, n, g) - kStretch * lever;
    if (dim == 3 || clear > 0) return clear;
    slopes[2] = lever;
    return gap(q, g, p);
  }

  /// Where it is along the k-th direction of the plane, from (x0, h).
  template <class S>
  S along(int k, const S* q, const S* g, const S* p) const {
    S r[dim] = {}, n[dim], t[tangents][dim], s(0.0);
    position(q, p, r);
    frame(g, n, t);
    r[0] -= g[kPlace];
    r[dim - 1] -= g[kHeight];
    for (int i = 0; i < dim; ++i) s += t[k][i] * r[i];
    return s;
  }

  /// The gap, closing speed against n, slip velocity (tangents), angular velocity (turns; of round ones); the plane's
  /// directions.
  template <class S>
  struct Motion {
    S gap{0.0}, closing{0.0}, slip[tangents] = {}, omega[turns] = {};
    S n[dim] = {}, t[tangents][dim] = {};
  };
  template <class S>
  void motion(const S* q, const S* v, const S* g, const S* p, Motion<S>& m) const {
    S r[dim] = {}, u[dim] = {};
    position(q, p, r);
    velocity(q, v, p, u);
    frame(g, m.n, m.t);
    m.gap = gap_of(r, m.n, g);
    m.closing = S(0.0);
    for (int i = 0; i < dim; ++i) m.closing -= m.n[i] * u[i];
    if (round_) turn(q, v, g[kRadius], m.n, m.t, m.omega, u);
    for (int k = 0; k < tangents; ++k) {
      m.slip[k] = S(0.0);
      for (int i = 0; i < dim; ++i) m.slip[k] += m.t[k][i] * u[i];
    }
  }

  /// The angular velocity of what is round; u gains omega x (-R n), which takes it from the centre to where it touches.
  template <class S>
  static void turn(const S* q, const S* v, const S& radius, const S* n, const S (*t)[dim], S* omega, S* u) {
    if constexpr (dim == 2) {
      omega[0] = v[2];
      for (int i = 0; i < 2; ++i) u[i] += v[2] * radius * t[0][i];
    } else {
      // omega = 2 E edot
      const S *e = q + 3, *ed = v + 3;
      S cross[3], lever[3];
      cross3(e + 1, ed + 1, cross);
      for (int i = 0; i < 3; ++i) {
        omega[i] = S(2.0) * (e[0] * ed[1 + i] - ed[0] * e[1 + i] + cross[i]);
        lever[i] = -(radius * n[i]);
      }
      cross3(omega, lever, cross);
      for (int i = 0; i < 3; ++i) u[i] += cross[i];
    }
  }

  /// Adds the generalized forces of N along n and F along the plane at the point that touches, and of a moment (turns;
  /// of round ones).
  template <class S>
  void add_force(const Motion<S>& m, const S* q, const S* g, const S* p, const S& N, const S* F, const S* moment,
                 S* Q) const {
    add_force(q, g, p, m.n, m.t, N, F, moment, Q);
  }
  /// The same with the directions n and t.
  template <class S>
  void add_force(const S* q, const S* g, const S* p, const S* n, const S (*t)[dim], const S& N, const S* F,
                 const S* moment, S* Q) const {
    S force[dim] = {};
    for (int i = 0; i < dim; ++i) {
      force[i] = N * n[i];
      for (int k = 0; k < tangents; ++k) force[i] += F[k] * t[k][i];
    }
    point_.add_generalized_force(q, p, force, Q);
    if (!round_) return;
    // The force acts at -R n from the centre.
    if constexpr (dim == 2) {
      Q[2] += g[kRadius] * F[0] + moment[0];
    } else {
      S lever[3], M[3];
      for (int i = 0; i < 3; ++i) lever[i] = -(g[kRadius] * n[i]);
      cross3(lever, force, M);
      for (int i = 0; i < 3; ++i) M[i] += moment[i];
      // Q_e = 2 E^T M
      const S* e = q + 3;
      S exm[3];
      cross3(e + 1, M, exm);
      Q[3] -= S(2.0) * dot3(e + 1, M);
      for (int i = 0; i < 3; ++i) Q[4 + i] += S(2.0) * (e[0] * M[i] - exm[i]);
    }
  }

 private:
  /// By how much a body in space is longer than it is where an integrator leaves |e| = 1, at most.
  static constexpr double kStretch = dim == 3 ? 1.1 : 1;

  void point_jacobian(const double* q, const double* p, typename Point::Jacobian& J) const {
    if constexpr (dim == 2)
      point_.jacobian(q, p, J);
    else
      J = point_.jacobian(q, p);
  }

  Point point_;
  bool round_;
};

}  // namespace costate
