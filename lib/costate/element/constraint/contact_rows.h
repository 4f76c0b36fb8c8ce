// The rows of a rigid contact with a plane of the ground while it is closed: the gap, and where it sticks the place
// along the ground, for an arc less what it has rolled; in space two places, of a point. The multiplier of a row is
// minus the force of the ground.
// Numbers: h, alpha, R, where it sticks at the start, in both directions in space; those of the point.
#pragma once

#include <string>
#include <vector>

#include "costate/element/force/contact_surface.h"
#include "costate/element/switched_rows.h"

namespace costate {

template <class Point>
class ContactRows final : public ConstraintOf<ContactRows<Point>>, public SwitchedRows {
 public:
  using Surface = ContactSurface<Point>;
  static constexpr int kAlong = Surface::kNumbers, kNumbers = kAlong + Surface::tangents;

  /// `friction`: its coefficient among all numbers; states: of the force's own.
  ContactRows(std::string name, const Point& point, bool round, bool sticks, int friction, const Force& force,
              int state, int sliding_state, const std::vector<int>& numbers)
      : ConstraintOf<ContactRows<Point>>("contact", std::move(name)),
        surface_(point, round),
        sticks_(sticks),
        friction_(friction),
        force_(force),
        state_(state),
        sliding_state_(sliding_state) {
    this->append_coordinates(point.coordinates());
    this->append_numbers(numbers);
    this->append_numbers(point.numbers());
  }

  int rows() const override { return sticks_ ? 1 + Surface::tangents : 1; }
  std::string row_name(int i) const override { return i == 0 ? "normal" : i == 1 ? "along" : "across"; }
  const Force& switched_by() const override { return force_; }
  int switching_state() const override { return state_; }
  bool holds_position(int i) const override { return i == 0; }
  int sliding_state() const override { return sliding_state_; }
  int friction_number() const override { return friction_; }

  template <class S>
  static S place(const Surface& surface, int k, const S* q, const S* ground, const S* point) {
    S s = surface.along(k, q, ground, point);
    if constexpr (Surface::dim == 2)
      if (surface.round()) s += ground[Surface::kRadius] * q[2];
    return s;
  }
  template <class S>
  void physics(const S&, const S* q, const S* p, S* phi) const {
    phi[0] = surface_.gap(q, p, p + kNumbers);
    if (!sticks_) return;
    for (int k = 0; k < Surface::tangents; ++k) phi[1 + k] = place(surface_, k, q, p, p + kNumbers) - p[kAlong + k];
  }

  std::vector<Measure> measures() const override {
    std::vector<Measure> m{{"normal_force", "N", true}};
    if (sticks_) m.push_back({"friction_force", "N", true});
    return m;
  }
  PathDual measure(int i, const MeasureArguments& x) const override {
    if (i == 0 || Surface::tangents == 1) return -x.lambda[i];
    return sqrt(x.lambda[1] * x.lambda[1] + x.lambda[2] * x.lambda[2] + PathDual(1e-24));
  }

 private:
  Surface surface_;
  bool sticks_;
  int friction_;
  const Force& force_;
  int state_, sliding_state_;
};

}  // namespace costate
