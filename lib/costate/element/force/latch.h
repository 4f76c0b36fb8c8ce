// A latch between two angles, or of one: a knee that catches where the leg has come straight and holds it, by a torsion
// spring and damper, until it is let go. Events: it catches where x = angle_j - angle_i comes to x0 from one side, and
// is let go where a point comes down to a plane of the ground (where that is ahead of another one).
//   T = k (x - x0) + c x'  while it holds, Q_j = -T, Q_i = T.
// State: the mode, 1 where it holds. Numbers: k, c, x0, the mode at the start; h, alpha, R, x of the plane and of an
// arc about the point (contact_surface.h); those of the points.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "costate/element/conditional_guard.h"
#include "costate/element/force/contact_surface.h"
#include "costate/element/guarded_force.h"

namespace costate {

class Latch final : public ForceOf<Latch>, public GuardedForce, public ConditionalGuard {
 public:
  static constexpr int kStiffness = 0, kDamping = 1, kAngle = 2, kHolds = 3, kGround = 4,
                       kNumbers = kGround + ContactSurface<PlanarPoint>::kNumbers;

  /// angles: {angle_j} against the ground, or {angle_i, angle_j}. from_above: whether it catches x that falls to x0.
  /// release, ahead_of: null where nothing lets go, or wherever the point is.
  Latch(std::string name, const std::vector<int>& angles, bool from_above, const PlanarPoint* release,
        const PlanarPoint* ahead_of, const std::vector<int>& numbers)
      : ForceOf<Latch>("latch", std::move(name)), angles_(static_cast<int>(angles.size())), from_above_(from_above) {
    append_coordinates(angles);
    append_numbers(numbers);
    int coordinate = angles_, number = kNumbers;
    for (const PlanarPoint* point : {release, ahead_of}) {
      if (!point) break;
      points_.push_back({ContactSurface<PlanarPoint>(*point, false), coordinate, number});
      append_coordinates(point->coordinates());
      append_numbers(point->numbers());
      coordinate += point->size();
      number += static_cast<int>(point->numbers().size());
    }
  }

  int states() const override { return 1; }
  std::string state_name(int) const override { return "holds"; }
  int initial_state_number(int) const override { return kHolds; }

  template <class S>
  void physics(const S&, const S* q, const S* v, const S* z, const S* p, S* Q, S*) const {
    if (!(value_of(z[0]) > 0)) return;
    const S torque = p[kStiffness] * (difference(q) - p[kAngle]) + p[kDamping] * difference(v);
    Q[angles_ - 1] = -torque;
    if (angles_ == 2) Q[0] = torque;
  }
  void calc_partials(const LocalState& s, ForcePartials out) const override {
    for (LocalMatrix* m : {&out.Q_q, &out.Q_v, &out.Q_z, &out.f_q, &out.f_v, &out.f_z}) m->setZero();
    if (!(s.z[0] > 0)) return;
    for (int i = 0; i < angles_; ++i)
      for (int j = 0; j < angles_; ++j) {
        const double sign = i == j ? -1 : 1;
        out.Q_q(i, j) = sign * s.p[kStiffness];
        out.Q_v(i, j) = sign * s.p[kDamping];
      }
  }
  double potential_energy(const LocalState& s) const override {
    const double x = difference(s.q) - s.p[kAngle];
    return s.z[0] > 0 ? 0.5 * s.p[kStiffness] * x * x : 0;
  }

  int guard_count() const override { return points_.empty() ? 1 : 2; }
  std::string guard_name(int k) const override { return k == 0 ? "catch" : "release"; }
  std::string mode_behind(int k) const override { return k == 0 ? "holds" : "free"; }
  int guard_direction(int k) const override { return k == 1 || from_above_ ? -1 : 1; }
  bool guard_armed(int k, const double* z) const override { return (z[0] > 0) == (k == 1); }
  bool force_jumps(int k) const override { return k == 0; }  // by its damper
  std::string past_at_start(int) const override { return {}; }
  PathDual guard(int k, const MeasureArguments& x) const override { return guard_of(k, x.q, x.p); }
  double guard_value(int k, const LocalState& s) const override { return guard_of(k, s.q, s.p); }
  Other other(int k, const LocalState& s) const override {
    if (k != 1 || points_.size() != 2) return {std::nan(""), std::nan("")};
    return {ahead(s.q, s.p), gap(points_[1], s.q, s.p)};
  }
  void transition(int k, const MeasureArguments&, PathDual* z_after) const override {
    z_after[0] = PathDual(k == 0 ? 1.0 : 0.0);
  }

  std::vector<Measure> measures() const override { return {{"torque", "N m", false}, {"holds", "1", false}}; }
  PathDual measure(int i, const MeasureArguments& x) const override {
    if (i == 1 || !(value_of(x.z[0]) > 0)) return i == 1 ? x.z[0] : PathDual(0.0);
    return x.p[kStiffness] * (difference(x.q) - x.p[kAngle]) + x.p[kDamping] * difference(x.v);
  }

 private:
  struct At {
    ContactSurface<PlanarPoint> surface;
    int coordinates, numbers;  // where those of its point begin
  };
  template <class S>
  S difference(const S* q) const {
    return angles_ == 2 ? q[1] - q[0] : q[0];
  }
  template <class S>
  S guard_of(int k, const S* q, const S* p) const {
    if (k == 0) return difference(q) - p[kAngle];
    if (points_.size() == 2 && !(ahead(q, p) > 0)) return S(std::nan(""));
    return gap(points_[0], q, p);
  }
  template <class S>
  double ahead(const S* q, const S* p) const {
    const auto along = [&](const At& at) {
      return value_of(at.surface.along(0, q + at.coordinates, p + kGround, p + at.numbers));
    };
    return along(points_[0]) - along(points_[1]);
  }
  template <class S>
  static S gap(const At& at, const S* q, const S* p) {
    return at.surface.gap(q + at.coordinates, p + kGround, p + at.numbers);
  }

  int angles_;
  bool from_above_;
  std::vector<At> points_;
};

}  // namespace costate
