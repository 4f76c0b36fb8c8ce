// Compliant contact of a point, or of an arc or a sphere about it, with a plane of the ground. The plane has the height
// h above the origin and rises by the angle alpha along x: normal n = (-sin alpha, cos alpha), in space
// (-sin alpha, 0, cos alpha). With the radius R and the centre r
//   gap = n.(r - (0, h)) - R,  d = -gap,  v_t = t.(rdot + omega x (-R n)):
// the velocities are those of material points, so that a wheel that rolls does not slide. Forces: contact_laws.h.
// States: the approach speed where the normal law latches it (0: open), then the bristles of friction.
// Numbers: K, n, e, C, those of friction, h, alpha, R, the initial approach speed, zero (the bristles' start), those of
// the point.
#pragma once

#include <type_traits>

#include "costate/element/force/contact_laws.h"
#include "costate/element/guarded_force.h"
#include "costate/element/point/planar_point.h"
#include "costate/element/point/spatial_point.h"

namespace costate {

template <class Point>
class Contact final : public ForceOf<Contact<Point>>, public GuardedForce {
 public:
  static constexpr int dim = Point::Vector::RowsAtCompileTime;
  static constexpr int tangents = dim - 1;
  static constexpr int kFriction = 4, kHeight = kFriction + kFrictionNumbers, kAngle = kHeight + 1,
                       kRadius = kHeight + 2, kApproach = kHeight + 3, kRest = kHeight + 4, kNumbers = kHeight + 5;

  Contact(std::string name, Point point, NormalLaw law, FrictionModel friction, bool round,
          const std::vector<int>& numbers)
      : ForceOf<Contact<Point>>("contact", std::move(name)),
        point_(std::move(point)),
        law_(law),
        friction_(friction),
        round_(round) {
    this->append_coordinates(point_.coordinates());
    this->append_numbers(numbers);
    this->append_numbers(point_.numbers());
  }

  int states() const override { return (latches(law_) ? 1 : 0) + (has_bristles(friction_) ? tangents : 0); }
  std::string state_name(int i) const override {
    if (latches(law_) && i == 0) return "approach_speed";
    return "bristle" + std::to_string(i - (latches(law_) ? 1 : 0) + 1);
  }
  std::string state_unit(int i) const override { return latches(law_) && i == 0 ? "m/s" : "m"; }
  int initial_state_number(int i) const override { return latches(law_) && i == 0 ? kApproach : kRest; }

  template <class S>
  void physics(const S&, const S* q, const S* v, const S* z, const S* p, S* Q, S* zdot) const {
    Forces<S> f;
    calc(q, v, z, p, f, zdot);
    if (!f.touches) return;
    S force[dim] = {}, n[dim], t[tangents][dim];
    frame(p, n, t);
    for (int i = 0; i < dim; ++i) {
      force[i] = f.normal * n[i];
      for (int k = 0; k < tangents; ++k) force[i] += f.friction[k] * t[k][i];
    }
    point_.add_generalized_force(q, p + kNumbers, force, Q);
    if (!round_) return;
    // The force acts at -R n from the centre.
    if constexpr (dim == 2) {
      Q[2] += p[kRadius] * f.friction[0];
    } else {
      S lever[3], moment[3];
      for (int i = 0; i < 3; ++i) lever[i] = -(p[kRadius] * n[i]);
      cross3(lever, force, moment);
      // Q_e = 2 E^T M
      const S* e = q + 3;
      S exm[3];
      cross3(e + 1, moment, exm);
      Q[3] -= S(2.0) * dot3(e + 1, moment);
      for (int i = 0; i < 3; ++i) Q[4 + i] += S(2.0) * (e[0] * moment[i] - exm[i]);
    }
  }

  // Events: the touch, and the end of the contact where the gap opens again. The force has ended before, or ends there.
  int guard_count() const override { return latches(law_) || has_bristles(friction_) ? 2 : 0; }
  std::string guard_name(int k) const override { return k == 0 ? "touch" : "release"; }
  int guard_direction(int k) const override { return k == 0 ? -1 : 1; }
  bool guard_armed(int k, const double* z) const override {
    if (!latches(law_)) return k == 1;  // nothing is latched at the touch; bristles start anew behind a release
    return (z[0] > 0) == (k == 1);
  }
  std::string past_at_start(int k) const override {
    if (!latches(law_)) return {};
    return k == 0
               ? "a contact that is closed at the start needs 'approach_speed_m_per_s', the speed it was closed with."
               : "a contact that is open at the start has no 'approach_speed_m_per_s'.";
  }
  PathDual guard(int, const MeasureArguments& x) const override { return gap(x.q, x.p); }
  void transition(int k, const MeasureArguments& x, PathDual* z_after) const override {
    for (int i = 0; i < states(); ++i) z_after[i] = PathDual(0.0);
    if (k == 0) z_after[0] = closing_speed(x.q, x.v, x.p);
  }

  std::vector<Measure> measures() const override {
    return {{"gap", "m", false},          {"penetration", "m", false},    {"penetration_rate", "m/s", false},
            {"normal_force", "N", false}, {"friction_force", "N", false}, {"slip_velocity", "m/s", false}};
  }
  PathDual measure(int i, const MeasureArguments& x) const override {
    using std::sqrt;
    if (i == 0) return gap(x.q, x.p);
    if (i == 1) {
      const PathDual g = gap(x.q, x.p);
      return value_of(g) < 0 ? -g : PathDual(0.0);
    }
    if (i == 2) return closing_speed(x.q, x.v, x.p);
    if (i == 5) {
      PathDual slip[tangents];
      slip_velocity(x.q, x.v, x.p, slip);
      return tangents == 1 ? slip[0] : length(slip);
    }
    Forces<PathDual> f;
    PathDual rates[dim] = {};
    calc(x.q, x.v, x.z, x.p, f, rates);
    if (i == 3) return f.normal;
    return tangents == 1 ? f.friction[0] : length(f.friction);
  }
  double potential_energy(const LocalState& s) const override {
    const double d = -gap(s.q, s.p), n = law_ == NormalLaw::linear ? 1 : s.p[1];
    const bool closed = !latches(law_) || s.z[0] > 0;
    return closed && d > 0 ? s.p[0] * std::pow(d, n + 1) / (n + 1) : 0;
  }

 private:
  template <class S>
  struct Forces {
    S normal{}, friction[tangents] = {};
    bool touches = false;
  };

  /// Of a vector along the plane, smooth at zero.
  static PathDual length(const PathDual* x) {
    using std::sqrt;
    PathDual square(1e-24);
    for (int k = 0; k < tangents; ++k) square += x[k] * x[k];
    return sqrt(square);
  }

  template <class S>
  static void frame(const S* p, S* n, S (*t)[dim]) {
    using std::cos;
    using std::sin;
    const S c = cos(p[kAngle]), s = sin(p[kAngle]);
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
  S gap(const S* q, const S* p) const {
    S r[dim] = {}, n[dim], t[tangents][dim];
    if constexpr (dim == 2)
      point_.position(q, p + kNumbers, r[0], r[1]);
    else
      point_.position(q, p + kNumbers, r);
    frame(p, n, t);
    r[dim - 1] -= p[kHeight];
    S g = -p[kRadius];
    for (int i = 0; i < dim; ++i) g += n[i] * r[i];
    return g;
  }

  template <class S>
  void velocity(const S* q, const S* v, const S* p, S* u) const {
    if constexpr (dim == 2)
      point_.velocity(q, v, p + kNumbers, u[0], u[1]);
    else
      point_.velocity(q, v, p + kNumbers, u);
  }

  template <class S>
  S closing_speed(const S* q, const S* v, const S* p) const {
    S u[dim] = {}, n[dim], t[tangents][dim], rate(0.0);
    velocity(q, v, p, u);
    frame(p, n, t);
    for (int i = 0; i < dim; ++i) rate -= n[i] * u[i];
    return rate;
  }

  template <class S>
  void slip_velocity(const S* q, const S* v, const S* p, S* slip) const {
    S u[dim] = {}, n[dim], t[tangents][dim];
    velocity(q, v, p, u);
    frame(p, n, t);
    if (round_) {
      if constexpr (dim == 2) {
        for (int i = 0; i < 2; ++i) u[i] += v[2] * p[kRadius] * t[0][i];
      } else {
        // omega = 2 E edot, at the lever -R n
        const S *e = q + 3, *ed = v + 3;
        S omega[3], cross[3], lever[3];
        cross3(e + 1, ed + 1, cross);
        for (int i = 0; i < 3; ++i) {
          omega[i] = S(2.0) * (e[0] * ed[1 + i] - ed[0] * e[1 + i] + cross[i]);
          lever[i] = -(p[kRadius] * n[i]);
        }
        cross3(omega, lever, cross);
        for (int i = 0; i < 3; ++i) u[i] += cross[i];
      }
    }
    for (int k = 0; k < tangents; ++k) {
      slip[k] = S(0.0);
      for (int i = 0; i < dim; ++i) slip[k] += t[k][i] * u[i];
    }
  }

  template <class S>
  void calc(const S* q, const S* v, const S* z, const S* p, Forces<S>& f, S* zdot) const {
    const S depth = -gap(q, p);
    const bool closed = latches(law_) ? value_of(z[0]) > 0 : value_of(depth) > 0;
    if (!closed) return;
    // Within a step that ends at the release the gap is open already: the law goes on, and is zero there.
    f.touches = true;
    f.normal = normal_force(law_, p, depth, closing_speed(q, v, p), latches(law_) ? z[0] : depth);
    if (friction_ == FrictionModel::none) return;
    S slip[tangents];
    slip_velocity(q, v, p, slip);
    const int first = latches(law_) ? 1 : 0;
    friction_force(friction_, tangents, p + kFriction, f.normal, slip, z + first, f.friction, zdot + first);
  }

  Point point_;
  NormalLaw law_;
  FrictionModel friction_;
  bool round_;
};

}  // namespace costate
