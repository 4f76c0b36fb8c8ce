// What touches a ground that is no plane at rest: a road's profile, a post that moves, or either carried by a body of
// the plane. In the frame of the plane (contact_surface.h), which the body carries, s is along it and d above it; the
// ground is d = f(s) there, or d = f(t). The foot u of a centre at (s, d) is where it is nearest:
//   (s - u) + f'(u) (d - f(u)) = 0,   n = (-f', 1)/H,  t = (1, f')/H,  H = sqrt(1 + f'^2),   gap = n.(s - u, d - f) -
//   R.
// The derivatives of u are those of this equation: Newton's iteration with its derivative at the root gains one order
// each time. Velocities are relative to the ground's material points at c = r - R n, which forces act on in return.
// Numbers `g` of the plane and the surface: h, alpha, R, x0; `p` those of the point, `road` those of the road.
#pragma once

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <type_traits>
#include <vector>

#include "costate/base/error.h"
#include "costate/element/force/contact.h"
#include "costate/element/force/road.h"
#include "costate/element/law/from_derivatives.h"
#include "costate/element/law/motion_law.h"

namespace costate {

template <class Point>
class RoadSurface {
 public:
  using Plane = ContactSurface<Point>;
  static constexpr int dim = Plane::dim, tangents = Plane::tangents, turns = Plane::turns;
  static constexpr int kHeight = Plane::kHeight, kAngle = Plane::kAngle, kRadius = Plane::kRadius,
                       kPlace = Plane::kPlace, kNumbers = Plane::kNumbers;

  /// road may be null: a plane that a body carries. carried: by a body of the plane, whose coordinates are behind those
  /// of the point.
  RoadSurface(Point point, bool round, std::shared_ptr<const Road> road, bool carried)
      : plane_(std::move(point), round), road_(std::move(road)), carried_(carried) {}
  const Point& point() const { return plane_.point(); }
  int carrier_size() const { return carried_ ? 3 : 0; }
  const Road* road() const { return road_.get(); }

  /// Of the motion of what touches against the ground.
  template <class S>
  struct Motion {
    S gap{0.0}, closing{0.0}, slip[tangents] = {}, omega[turns] = {};
    S n[dim] = {}, t[tangents][dim] = {}, c[dim] = {};  // c from the carrier's origin
    double flatness = 1;  // 1 - f''(d - f)/H^2, at the foot or below the centre: 0 where feet part
  };

  template <class S>
  S gap(const S& t, const S* q, const S* g, const S* p, const S* road) const {
    Motion<S> m;
    S r[dim], up[dim], rate;
    place(t, q, g, p, road, m, r, up, rate);
    return m.gap;
  }
  /// Along the plane's k-th direction, from the foot of its origin.
  template <class S>
  S along(int k, const S* q, const S* g, const S* p) const {
    S n[dim], t[tangents][dim], r[dim];
    frame(q, g, n, t);
    from_plane(q, g, p, r);
    S s(0.0);
    for (int i = 0; i < dim; ++i) s += t[k][i] * r[i];
    return s;
  }
  /// How fast along() of the profile's direction grows.
  double along_rate(const double* q, const double* v, const double* g, const double* p) const {
    using Path = Dual<1>;
    constexpr int most = 8;  // numbers of a point
    Path moved[Point::kMaxCoordinates + 3], numbers[most + kNumbers];
    const int n = point().size() + carrier_size(), own = static_cast<int>(point().numbers().size());
    for (int i = 0; i < n; ++i) {
      moved[i] = Path(q[i]);
      moved[i].d[0] = v[i];
    }
    for (int i = 0; i < kNumbers; ++i) numbers[i] = Path(g[i]);
    for (int i = 0; i < own; ++i) numbers[kNumbers + i] = Path(p[i]);
    return along(0, moved, numbers, numbers + kNumbers).d[0];
  }

  template <class S>
  void motion(const S& time, const S* q, const S* v, const S* g, const S* p, const S* road, Motion<S>& m) const {
    S r[dim], up[dim], rate(0.0), u[dim] = {};
    place(time, q, g, p, road, m, r, up, rate);
    if constexpr (dim == 2)
      point().velocity(q, v, p, u[0], u[1]);
    else
      point().velocity(q, v, p, u);
    const S& R = g[kRadius];
    if (plane_.round()) plane_.turn(q, v, R, m.n, m.t, m.omega, u);
    for (int i = 0; i < dim; ++i) {
      m.c[i] = r[i] - R * m.n[i];
      u[i] -= rate * up[i];
    }
    if constexpr (dim == 2)
      if (carried_) {
        const S* w = v + point().size();
        u[0] -= w[0] - w[2] * m.c[1];
        u[1] -= w[1] + w[2] * m.c[0];
        if (plane_.round()) m.omega[0] -= w[2];
      }
    m.closing = S(0.0);
    for (int i = 0; i < dim; ++i) m.closing -= m.n[i] * u[i];
    for (int k = 0; k < tangents; ++k) {
      m.slip[k] = S(0.0);
      for (int i = 0; i < dim; ++i) m.slip[k] += m.t[k][i] * u[i];
    }
  }

  /// The distance from a profile changes by as much as the centre moves against it, at most.
  GapMotion gap_motion(double time, const double* q, const double* v, const double* g, const double* p,
                       const double* road) const {
    Motion<double> m;
    double r[dim], up[dim], rate;
    place(time, q, g, p, road, m, r, up, rate);
    GapMotion of;
    of.gap = m.gap;
    const PointSpeed speed = point_speed(point(), q, v, p);
    of.speed = speed.most() + std::abs(rate);
    of.turn = speed.turn;
    motion(time, q, v, g, p, road, m);
    of.rate = -m.closing;
    if (carried_) {
      const double* w = v + point().size();
      double square = 0;
      for (int i = 0; i < dim; ++i) square += r[i] * r[i];
      of.speed += std::sqrt(w[0] * w[0] + w[1] * w[1]) + std::sqrt(square) * std::abs(w[2]);
      of.turn = std::max(of.turn, std::abs(w[2]));
    }
    of.clear = of.gap;
    of.travel = of.speed;
    return of;
  }

  /// Of a centre where it touches. Throws StepError where the ground is bent more than what touches it: another place
  /// touches as well, and which is the nearest may change at once.
  void require_one_foot(const Motion<double>& m, double t) const {
    constexpr double least = 0.02;
    if (m.flatness > least) return;
    throw StepError(fmt::format(
        "At t = {:.6g} s '{}' is in a dip of the profile that bends more than what touches it, its "
        "radius and how deep it is together: it would touch at two places. Take a smaller radius, a stiffer "
        "ground, or a profile that bends less.",
        t, point().name()));
  }

  /// Adds the generalized forces of N along n and F along the ground at the point that touches, and of a moment (turns;
  /// of round ones), and on the carrier the opposite ones.
  template <class S>
  void add_force(const Motion<S>& m, const S* q, const S* g, const S* p, const S& N, const S* F, const S* moment,
                 S* Q) const {
    plane_.add_force(q, g, p, m.n, m.t, N, F, moment, Q);
    if constexpr (dim == 2)
      if (carried_) {
        S* base = Q + point().size();
        S f[2];
        for (int i = 0; i < 2; ++i) {
          f[i] = N * m.n[i] + F[0] * m.t[0][i];
          base[i] -= f[i];
        }
        base[2] -= m.c[0] * f[1] - m.c[1] * f[0];
        if (plane_.round()) base[2] -= moment[0];
      }
  }

 private:
  /// The plane's directions, turned with the carrier.
  template <class S>
  void frame(const S* q, const S* g, S* n, S (*t)[dim]) const {
    if (!carried_) return Plane::frame(g, n, t);
    const S turned[kNumbers] = {g[kHeight], g[kAngle] + q[point().size() + 2], g[kRadius], g[kPlace]};
    Plane::frame(turned, n, t);
  }
  /// The centre from the plane's origin, (x0, h) from that of the carrier.
  template <class S>
  void from_plane(const S* q, const S* g, const S* p, S* r) const {
    using std::cos;
    using std::sin;
    for (int i = 0; i < dim; ++i) r[i] = S(0.0);
    plane_.position(q, p, r);
    if (!carried_) {
      r[0] -= g[kPlace];
      r[dim - 1] -= g[kHeight];
      return;
    }
    const S* base = q + point().size();
    r[0] -= base[0] + g[kPlace] * cos(base[2]) - g[kHeight] * sin(base[2]);
    r[1] -= base[1] + g[kPlace] * sin(base[2]) + g[kHeight] * cos(base[2]);
  }

  /// Of m: gap, n, t. r: the centre from the carrier's origin; up: the direction in which the ground moves, at `rate`.
  template <class S>
  void place(const S& time, const S* q, const S* g, const S* p, const S* road, Motion<S>& m, S* r, S* up,
             S& rate) const {
    using std::sqrt;
    frame(q, g, up, m.t);
    from_plane(q, g, p, r);
    S s(0.0), d(0.0);
    for (int i = 0; i < dim; ++i) {
      s += m.t[0][i] * r[i];
      d += up[i] * r[i];
      m.n[i] = up[i];
    }
    m.gap = d - g[kRadius];
    rate = S(0.0);
    if (road_) {
      S u = s;
      const RoadPoint<S> at = foot(time, s, d, road, u, m.flatness);
      rate = at.rate;
      if (road_->level()) {
        m.gap -= at.z;
      } else {
        const S turn = S(1.0) / sqrt(S(1.0) + at.slope * at.slope);
        for (int i = 0; i < dim; ++i) {
          const S t0 = m.t[0][i];
          m.n[i] = turn * (up[i] - at.slope * t0);
          m.t[0][i] = turn * (t0 + at.slope * up[i]);
        }
        m.gap = turn * ((d - at.z) - at.slope * (s - u)) - g[kRadius];
      }
    }
    if constexpr (dim == 2)
      if (carried_) {  // from its origin, for levers
        using std::cos;
        using std::sin;
        const S* base = q + point().size();
        r[0] += g[kPlace] * cos(base[2]) - g[kHeight] * sin(base[2]);
        r[1] += g[kPlace] * sin(base[2]) + g[kHeight] * cos(base[2]);
      }
  }

  static const double* values(const double* p, int) { return p; }
  template <class S>
  static const double* values(const S* p, int n) {
    thread_local std::vector<double> buffer;
    buffer.resize(static_cast<std::size_t>(n) + 1);
    for (int i = 0; i < n; ++i) buffer[static_cast<std::size_t>(i)] = value_of(p[i]);
    return buffer.data();
  }
  /// The road's height and slope with all derivatives that S carries; by the road's numbers where S is a PathDual.
  template <class S>
  RoadPoint<S> height(const S& time, const S& u, const S* numbers, const double* constants) const {
    if constexpr (std::is_same_v<S, PathDual>)
      return road_->at(time, u, PathDual(1.0), PathDual(0.0), numbers);
    else
      return road_->at(time, u, 1.0, 0.0, constants);
  }

  template <class S>
  RoadPoint<S> foot(const S& time, const S& s, const S& d, const S* numbers, S& u, double& flatness) const {
    const double* constants = values(numbers, static_cast<int>(road_->numbers().size()));
    if (!road_->level()) {
      double curve;
      u = S(nearest(value_of(time), value_of(s), value_of(d), constants, curve, flatness));
      for (int order = 0; order < DerivativeOrder<S>::value; ++order) {
        const RoadPoint<S> at = height(time, u, numbers, constants);
        u += ((s - u) + at.slope * (d - at.z)) / S(curve);
      }
    }
    return height(time, u, numbers, constants);
  }

  /// Downhill from u = s to the least distance by Newton's method, damped; curve: half the second derivative of its
  /// square.
  double nearest(double time, double s, double d, const double* numbers, double& curve, double& flatness) const {
    struct Look {
      double half_square, slope, curve, steepness;
    };
    const auto look = [&](double u) {
      const RoadPoint<Dual<1>> at = road_->at(Dual<1>(time), Dual<1>::variable(u, 0), 1.0, 0.0, numbers);
      const double off = s - u, above = d - at.z.v, f = at.slope.v;
      return Look{0.5 * (off * off + above * above), -off - f * above, 1 + f * f - at.slope.d[0] * above, 1 + f * f};
    };
    constexpr double rounding = 1e-15;
    double u = s;
    Look here = look(u);
    flatness = here.curve / here.steepness;
    for (int k = 0; k < 100 && here.slope != 0; ++k) {
      double step = -here.slope / std::max(here.curve, 0.1 * here.steepness);
      Look there = look(u + step);
      while (there.half_square > here.half_square * (1 + 1e-12) && std::abs(step) > rounding * std::abs(u)) {
        step *= 0.5;
        there = look(u + step);
      }
      const bool settled = std::abs(step) <= rounding * (std::abs(s) + std::abs(d));
      // Near the foot rounding decides: no nearer is near enough.
      if (settled && std::abs(there.slope) >= std::abs(here.slope)) break;
      u += step;
      here = there;
      if (settled) break;
    }
    flatness = std::min(flatness, here.curve / here.steepness);
    curve = std::max(here.curve, 1e-3 * here.steepness);
    return u;
  }

  Plane plane_;
  std::shared_ptr<const Road> road_;
  bool carried_;
};

/// Contact with such a ground: its profile's features are places that the motion travels, a post's are times.
template <class Point>
class RoadContact final : public Contact<Point, RoadSurface<Point>>, public CourseElement, public MotionLawElement {
  using Base = Contact<Point, RoadSurface<Point>>;
  using Base::kGround, Base::surface, Base::point_numbers, Base::road_;

 public:
  using Base::Base;

  void add_course(const double* p, Course& course) const override {
    if (is(Road::Kind::post)) road()->add_course(0, p + road_, course);
  }
  int tracks() const override { return is(Road::Kind::profile) ? Base::count() : 0; }
  void add_track(int, const double* p, Course& course) const override { road()->add_course(0, p + road_, course); }
  CourseElement::Place track_place(int i, const LocalState& s) const override {
    const double* own = point_numbers(i, s.p);
    return {surface(i).along(0, s.q, s.p + kGround, own), surface(i).along_rate(s.q, s.v, s.p + kGround, own)};
  }
  void add_motion_laws(std::vector<MotionLaw>& laws) const override {
    if (road()) road()->add_motion_laws(road_, laws);
  }
  void add_force_jumps(const double* p, std::vector<double>& times) const override {
    if (road()) road()->add_post_jumps(0, p + road_, times);
  }
  void add_time_slopes(double t, const double* p, double* by) const override {
    double by_shift = 0;
    if (road()) road()->add_post_slopes(t, 0, p + road_, by_shift, by + road_);
  }

 private:
  const Road* road() const { return surface(0).road(); }
  bool is(Road::Kind kind) const { return road() && road()->kind() == kind; }
};

}  // namespace costate
