// Compliant contact of two round bodies: circles in the plane, spheres in space, each about a point; or of one with a
// point (radius 0) or a round part of the ground. With centres r_a and r_b, d = r_a - r_b and n = d/|d|
//   gap = |d| - R_a - R_b,   u = rdot_a + omega_a x (-R_a n) - rdot_b - omega_b x (R_b n),
// u that of material points, so that gears of friction do not slip; forces by contact_laws.h, N along n on a and
// friction against the part of u across n, equal and opposite on b, at the point where they touch. In the plane
// friction may have bristles; in space their frame would have to be carried along with n, and they are refused. States:
// the approach speed where the touch is an event (0: open), then the bristle, then the energy lost, where it is asked
// for: E' = (N - K d^n) ddot - F.u. Numbers: K, n, e, C, those of friction, R_a, R_b, the initial approach speed, zero,
// Young's moduli and Poisson's ratios, which in the place of K give Hertz's, 4/3 E* sqrt(R), 1/R = 1/R_a + 1/R_b; those
// of the points.
#pragma once

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "costate/element/force/contact_laws.h"
#include "costate/element/gap_element.h"
#include "costate/element/guarded_force.h"
#include "costate/element/point/planar_point.h"
#include "costate/element/point/point_speed.h"
#include "costate/element/point/spatial_point.h"
#include "costate/element/power_touch.h"

namespace costate {

template <class Point>
class ContactPair final : public ForceOf<ContactPair<Point>>,
                          public GuardedForce,
                          public GapElement,
                          public PowerTouch {
 public:
  static constexpr int dim = Point::Vector::RowsAtCompileTime;
  static constexpr int kFriction = 4, kRadii = kFriction + kFrictionNumbers, kApproach = kRadii + 2,
                       kRest = kApproach + 1, kMaterial = kRest + 1, kNumbers = kMaterial + 4;

  struct Options {
    NormalLaw law = NormalLaw::hertz;
    FrictionModel friction = FrictionModel::none;  // in space none with bristles
    bool material = false, both = false;           // whether K is Hertz's, and whether the other side gives as well
    bool energy = false;
  };

  /// Points of two bodies, or of one and the ground; with friction those that turn are on rigid bodies.
  ContactPair(std::string name, const Point& a, const Point& b, const Options& options, const std::vector<int>& numbers)
      : ForceOf<ContactPair<Point>>("contact_pair", std::move(name)), a_(a), b_(b), options_(options) {
    this->append_coordinates(a.coordinates());
    this->append_coordinates(b.coordinates());
    this->append_numbers(numbers);
    this->append_numbers(a.numbers());
    this->append_numbers(b.numbers());
  }

  int states() const override { return own_states() + (options_.energy ? 1 : 0); }
  std::string state_name(int i) const override {
    if (i == own_states()) return "energy_lost";
    return latched() && i == 0 ? "approach_speed" : "bristle";
  }
  std::string state_unit(int i) const override {
    if (i == own_states()) return "J";
    return latched() && i == 0 ? "m/s" : "m";
  }
  int initial_state_number(int i) const override { return latched() && i == 0 ? kApproach : kRest; }

  template <class S>
  void physics(const S&, const S* q, const S* v, const S* z, const S* p, S* Q, S* zdot) const {
    Forces<S> f;
    for (int i = 0; i < states(); ++i) zdot[i] = S(0.0);
    calc(q, v, z, p, f, zdot);
    if (!f.touches) return;
    const Motion<S>& m = f.motion;
    S force[dim], back[dim];
    for (int i = 0; i < dim; ++i) {
      force[i] = f.normal * m.n[i] + across(f.friction, m, i);
      back[i] = -force[i];
    }
    const int na = a_.size();
    a_.add_generalized_force(q, point_numbers(0, p), force, Q);
    b_.add_generalized_force(q + na, point_numbers(1, p), back, Q + na);
    if (options_.friction == FrictionModel::none) return;
    turn(a_, p[kRadii], q, m, f.friction, Q);
    turn(b_, p[kRadii + 1], q + na, m, f.friction, Q + na);
  }

  // Events: the touch, and the end of the contact where the gap opens again, as those with the ground.
  int guard_count() const override { return latched() || has_bristles(options_.friction) ? 2 : 0; }
  std::string guard_name(int k) const override { return k == 0 ? "touch" : "release"; }
  std::string mode_behind(int k) const override { return k == 0 ? "closed" : "open"; }
  int guard_direction(int k) const override { return k == 0 ? -1 : 1; }
  bool guard_armed(int k, const double* z) const override { return latched() ? (z[0] > 0) == (k == 1) : k == 1; }
  bool force_jumps(int k) const override { return k == 0 && options_.law == NormalLaw::kelvin_voigt; }
  bool latches_speed(int k) const override { return k == 0 && latched() && uses_latched_speed(options_.law); }
  std::string past_at_start(int k) const override {
    if (!latched()) return {};
    return k == 0 ? "a contact that is closed at the start needs an 'approach_speed_m_per_s' above 0, the speed it was "
                    "closed with."
                  : "a contact that is open at the start has no 'approach_speed_m_per_s'.";
  }
  PathDual guard(int, const MeasureArguments& x) const override { return gap(x.q, x.p); }
  double guard_value(int, const LocalState& s) const override { return gap(s.q, s.p); }
  int gap_count() const override { return 1; }
  GapMotion gap_motion(int, const LocalState& s) const override {
    const PointSpeed of_a = point_speed(a_, s.q, s.v, point_numbers(0, s.p)),
                     of_b = point_speed(b_, s.q + a_.size(), s.v + a_.size(), point_numbers(1, s.p));
    const Motion<double> m = motion(s.q, s.v, s.p);
    GapMotion of;
    of.gap = of.clear = m.gap;
    of.rate = -m.closing;
    of.speed = of.travel = of_a.most() + of_b.most();
    of.turn = std::max(of_a.turn, of_b.turn);
    return of;
  }
  bool gap_presses(int, const double* z) const override { return !latched() || z[0] > 0; }
  double gap_force(int, const LocalState& s) const override {
    const double law[4] = {stiffness(s.p), s.p[1], s.p[2], s.p[3]};
    const Motion<double> m = motion(s.q, s.v, s.p);
    return uncut_force(options_.law, law, -m.gap, m.closing, latched() ? s.z[0] : -m.gap);
  }
  int gap_of_guard(int) const override { return 0; }
  double touch_exponent(const double* p) const override { return p[1]; }
  bool tells_bends() const override { return true; }
  /// As those with the ground.
  void add_bends(const LocalState& s, std::vector<double>& beyond) const override {
    const double law[4] = {stiffness(s.p), s.p[1], s.p[2], s.p[3]};
    const Motion<double> m = motion(s.q, s.v, s.p);
    if (!latched())
      beyond.push_back(-m.gap);
    else
      beyond.push_back(s.z[0] > 0 ? uncut_force(options_.law, law, -m.gap, m.closing, s.z[0]) : 0);
  }
  void transition(int k, const MeasureArguments& x, PathDual* z_after) const override {
    for (int i = 0; i < states(); ++i) z_after[i] = i < own_states() ? PathDual(0.0) : x.z[i];
    if (k == 0) z_after[0] = motion(x.q, x.v, x.p).closing;
  }

  std::vector<Measure> measures() const override {
    std::vector<Measure> m{
        {"gap", "m", false},          {"penetration", "m", false},    {"penetration_rate", "m/s", false},
        {"normal_force", "N", false}, {"friction_force", "N", false}, {"slip_velocity", "m/s", false}};
    if (options_.energy) m.push_back({"energy_lost", "J", false});
    return m;
  }
  PathDual measure(int i, const MeasureArguments& x) const override {
    if (i == 6) return x.z[own_states()];
    if (i < 2) {
      const PathDual g = gap(x.q, x.p);
      if (i == 0) return g;
      return value_of(g) < 0 ? -g : PathDual(0.0);
    }
    if (i == 2 || i == 5) {
      const auto m = motion(x.q, x.v, x.p);
      return i == 2 ? m.closing : length(m.slip);
    }
    Forces<PathDual> f;
    std::vector<PathDual> rates(static_cast<std::size_t>(states()) + 1);
    calc(x.q, x.v, x.z, x.p, f, rates.data());
    if (!f.touches) return PathDual(0.0);
    return i == 3 ? f.normal : length(f.friction);
  }
  double potential_energy(const LocalState& s) const override {
    const double d = -gap(s.q, s.p), n = options_.law == NormalLaw::linear ? 1 : s.p[1];
    return d > 0 && touches(s.q, s.z, s.p) ? stiffness(s.p) * std::pow(d, n + 1) / (n + 1) : 0;
  }

 private:
  /// Components of friction: along t = (-n_y, n_x), in space along x, y, z.
  static constexpr int slips = dim == 2 ? 1 : 3;
  template <class S>
  struct Motion {
    S n[dim] = {}, gap{0.0}, closing{0.0}, slip[slips] = {};
  };
  template <class S>
  struct Forces {
    S normal{0.0}, friction[slips] = {};
    Motion<S> motion;
    bool touches = false;
  };

  bool latched() const { return touch_is_event(options_.law, options_.friction); }
  int own_states() const { return (latched() ? 1 : 0) + (has_bristles(options_.friction) ? 1 : 0); }
  template <class S>
  const S* point_numbers(int i, const S* p) const {
    return p + kNumbers + (i == 0 ? 0 : static_cast<int>(a_.numbers().size()));
  }

  template <class S>
  void centres(const S* q, const S* p, S* d) const {
    S r[2][dim] = {};
    const Point* points[2] = {&a_, &b_};
    for (int k = 0; k < 2; ++k) {
      const S* own = q + (k == 0 ? 0 : a_.size());
      if constexpr (dim == 2)
        points[k]->position(own, point_numbers(k, p), r[k][0], r[k][1]);
      else
        points[k]->position(own, point_numbers(k, p), r[k]);
    }
    for (int i = 0; i < dim; ++i) d[i] = r[0][i] - r[1][i];
  }
  template <class S>
  S gap(const S* q, const S* p) const {
    S d[dim];
    centres(q, p, d);
    return norm(d) - p[kRadii] - p[kRadii + 1];
  }
  template <class S>
  static S norm(const S* d) {
    using std::sqrt;
    S square(0.0);
    for (int i = 0; i < dim; ++i) square += d[i] * d[i];
    return sqrt(square);
  }

  template <class S>
  Motion<S> motion(const S* q, const S* v, const S* p) const {
    Motion<S> m;
    S d[dim], u[2][dim] = {};
    centres(q, p, d);
    const S distance = norm(d);
    m.gap = distance - p[kRadii] - p[kRadii + 1];
    for (int i = 0; i < dim; ++i) m.n[i] = d[i] / distance;
    const Point* points[2] = {&a_, &b_};
    for (int k = 0; k < 2; ++k) {
      const S *own = q + (k == 0 ? 0 : a_.size()), *rate = v + (k == 0 ? 0 : a_.size());
      if constexpr (dim == 2)
        points[k]->velocity(own, rate, point_numbers(k, p), u[k][0], u[k][1]);
      else
        points[k]->velocity(own, rate, point_numbers(k, p), u[k]);
      if (points[k]->kind() != Point::Kind::on_body) continue;
      // omega x lever, the lever -l_a n, or l_b n
      const S arm = p[kRadii + k] + S(0.5) * m.gap, lever = k == 0 ? -arm : arm;
      if constexpr (dim == 2) {
        u[k][0] -= rate[2] * lever * m.n[1];
        u[k][1] += rate[2] * lever * m.n[0];
      } else {
        const S *e = own + 3, *ed = rate + 3;
        S cross[3], omega[3];
        cross3(e + 1, ed + 1, cross);
        for (int i = 0; i < 3; ++i) omega[i] = S(2.0) * (e[0] * ed[1 + i] - ed[0] * e[1 + i] + cross[i]);
        cross3(omega, m.n, cross);
        for (int i = 0; i < 3; ++i) u[k][i] += lever * cross[i];
      }
    }
    S normal(0.0);
    for (int i = 0; i < dim; ++i) normal += m.n[i] * (u[0][i] - u[1][i]);
    m.closing = -normal;
    if constexpr (dim == 2)
      m.slip[0] = m.n[0] * (u[0][1] - u[1][1]) - m.n[1] * (u[0][0] - u[1][0]);
    else
      for (int i = 0; i < 3; ++i) m.slip[i] = u[0][i] - u[1][i] - normal * m.n[i];
    return m;
  }

  template <class S>
  static S across(const S* friction, const Motion<S>& m, int i) {
    if constexpr (dim == 2)
      return i == 0 ? -(friction[0] * m.n[1]) : friction[0] * m.n[0];
    else
      return friction[i];
  }
  /// The moment -l n x F, of the same sign on both.
  template <class S>
  static void turn(const Point& point, const S& radius, const S* q, const Motion<S>& m, const S* friction, S* Q) {
    if (point.kind() != Point::Kind::on_body) return;
    const S arm = radius + S(0.5) * m.gap;
    if constexpr (dim == 2) {
      Q[2] -= arm * friction[0];
    } else {
      S M[3], exm[3];
      cross3(m.n, friction, M);
      for (int i = 0; i < 3; ++i) M[i] = -(arm * M[i]);
      // Q_e = 2 E^T M
      const S* e = q + 3;
      cross3(e + 1, M, exm);
      Q[3] -= S(2.0) * dot3(e + 1, M);
      for (int i = 0; i < 3; ++i) Q[4 + i] += S(2.0) * (e[0] * M[i] - exm[i]);
    }
  }

  template <class S>
  S stiffness(const S* p) const {
    using std::sqrt;
    if (!options_.material) return p[0];
    const S *e = p + kMaterial, one(1.0), &ra = p[kRadii], &rb = p[kRadii + 1];
    S compliance = (one - e[1] * e[1]) / e[0];
    if (options_.both) compliance += (one - e[3] * e[3]) / e[2];
    return S(4.0 / 3.0) * sqrt(ra * rb / (ra + rb)) / compliance;
  }
  template <class S>
  bool touches(const S* q, const S* z, const S* p) const {
    return latched() ? value_of(z[0]) > 0 : value_of(gap(q, p)) < 0;
  }
  template <class S>
  void calc(const S* q, const S* v, const S* z, const S* p, Forces<S>& f, S* zdot) const {
    f.touches = touches(q, z, p);
    if (!f.touches) return;
    f.motion = motion(q, v, p);
    const Motion<S>& m = f.motion;
    const S depth = -m.gap, law[4] = {stiffness(p), p[1], p[2], p[3]};
    f.normal = normal_force(options_.law, law, depth, m.closing, latched() ? z[0] : depth);
    const int bristle = latched() ? 1 : 0;
    if (options_.friction != FrictionModel::none)
      friction_force(options_.friction, slips, p + kFriction, f.normal, m.slip, z + bristle, f.friction,
                     zdot + bristle);
    if (!options_.energy) return;
    S& lost = zdot[own_states()];
    lost = (f.normal - elastic_force(options_.law, law, depth)) * m.closing;
    for (int i = 0; i < slips; ++i) lost -= f.friction[i] * m.slip[i];
  }

  /// In the plane with its sign, in space a length that is smooth at zero.
  static PathDual length(const PathDual* x) {
    using std::sqrt;
    if constexpr (slips == 1) return x[0];
    PathDual square(1e-24);
    for (int i = 0; i < slips; ++i) square += x[i] * x[i];
    return sqrt(square);
  }

  Point a_, b_;
  Options options_;
};

}  // namespace costate
