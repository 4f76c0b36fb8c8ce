// Rigid contact with a plane of the ground: of a point, of an arc or a sphere about it (contact_surface.h). It holds no
// force of its own: where the gap closes velocities jump (event/impact.h).
// Numbers: e, mu, the approach speed below which it closes, h, alpha, R, whether it is closed at the start; those of
// the points.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "costate/element/force/contact_surface.h"
#include "costate/element/unilateral_force.h"

namespace costate {

template <class Point>
class RigidContact final : public Force, public UnilateralForce {
 public:
  using Surface = ContactSurface<Point>;
  static constexpr int kRestitution = 0, kFriction = 1, kClosing = 2, kGround = 3,
                       kClosed = kGround + Surface::kNumbers, kNumbers = kClosed + 1;

  /// `ahead_of`: it closes only where it is ahead of that point along the plane's first direction.
  RigidContact(std::string name, const Point& point, const Point* ahead_of, bool round, const std::vector<int>& numbers)
      : Force("contact", std::move(name)), surface_(point, round) {
    append_coordinates(point.coordinates());
    append_numbers(numbers);
    append_numbers(point.numbers());
    if (!ahead_of) return;
    ahead_of_.emplace_back(*ahead_of, false);
    append_coordinates(ahead_of->coordinates());
    append_numbers(ahead_of->numbers());
  }

  void force(const PathDual&, const PathDual*, const PathDual*, const PathDual*, const PathDual*, PathDual*,
             PathDual*) const override {}
  void calc_force(const LocalState&, double*, double*) const override {}
  void calc_partials(const LocalState&, ForcePartials) const override {}
  void calc_number_partial(const LocalState&, int, double*, double*) const override {}
  void add_number_gradient(const LocalState&, const double*, const double*, const int*, int, double*) const override {}

  int guard_count() const override { return 1; }
  std::string guard_name(int) const override { return "touch"; }
  std::string mode_behind(int) const override { return "bounces"; }
  int guard_direction(int) const override { return -1; }
  bool guard_armed(int, const double*) const override { return true; }
  std::string past_at_start(int) const override { return "a rigid contact is above the ground where it starts."; }
  PathDual guard(int, const MeasureArguments& x) const override {
    return is_ahead(x.q, x.p) ? gap(x.q, x.p) : PathDual(std::nan(""));
  }
  double guard_value(int, const LocalState& s) const override {
    return is_ahead(s.q, s.p) ? gap(s.q, s.p) : std::nan("");
  }
  void transition(int, const MeasureArguments&, PathDual*) const override {}

  bool is_impact(int k) const override { return k == 0; }
  int row_count() const override { return 1; }
  PathDual row(int, const MeasureArguments& x) const override { return gap(x.q, x.p); }
  int restitution_number() const override { return kRestitution; }
  int friction_number() const override { return -1; }
  int closing_speed_number() const override { return kClosing; }
  int closed_state() const override { return -1; }

  // Those of a compliant contact; a rigid one that is open gives no force and does not penetrate.
  std::vector<Measure> measures() const override {
    return {{"gap", "m", false},          {"penetration", "m", false},    {"penetration_rate", "m/s", false},
            {"normal_force", "N", false}, {"friction_force", "N", false}, {"slip_velocity", "m/s", false}};
  }
  PathDual measure(int i, const MeasureArguments& x) const override {
    if (i == 0) return gap(x.q, x.p);
    if (i == 1 || i == 3 || i == 4) return PathDual(0.0);
    typename Surface::template Motion<PathDual> m;
    surface_.motion(x.q, x.v, x.p + kGround, x.p + kNumbers, m);
    if (i == 2) return m.closing;
    if constexpr (Surface::tangents == 1) return m.slip[0];
    return sqrt(m.slip[0] * m.slip[0] + m.slip[1] * m.slip[1] + PathDual(1e-24));
  }

 private:
  template <class S>
  S gap(const S* q, const S* p) const {
    return surface_.gap(q, p + kGround, p + kNumbers);
  }
  template <class S>
  bool is_ahead(const S* q, const S* p) const {
    if (ahead_of_.empty()) return true;
    const S *own = q + surface_.point().size(), *numbers = p + kNumbers + surface_.point().numbers().size();
    return value_of(surface_.along(0, q, p + kGround, p + kNumbers)) >
           value_of(ahead_of_.front().along(0, own, p + kGround, numbers));
  }

  Surface surface_;
  std::vector<Surface> ahead_of_;
};

}  // namespace costate
