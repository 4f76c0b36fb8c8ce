// Outputs of points: their places, velocities and accelerations, component by component.
#pragma once

#include <string>
#include <type_traits>
#include <utility>

#include "costate/element/point/planar_point.h"
#include "costate/element/point/spatial_point.h"
#include "costate/objective/local_output.h"

namespace costate {

/// A component of a point of the plane or of space, its rate or its second rate.
template <class Point>
class PointOutput final : public LocalOutput {
 public:
  PointOutput(std::string name, std::string unit, const Point& point, int component, int order)
      : LocalOutput(std::move(name), std::move(unit), point.coordinates(), point.numbers(), 0, 0, 0, 0),
        point_(point),
        component_(component),
        order_(order) {}
  bool needs_accelerations() const override { return order_ == 2; }

 protected:
  PathDual evaluate(const MeasureArguments& x) const override { return of_point(x); }
  bool evaluate_value(const ValueArguments& x, double& value) const override {
    value = of_point(x);
    return true;
  }

 private:
  template <class S>
  S of_point(const MeasureArgumentsOf<S>& x) const {
    S r[3];
    const auto find = [&](auto&&... components) {
      if (order_ == 0) point_.position(x.q, x.p, components...);
      if (order_ == 1) point_.velocity(x.q, x.v, x.p, components...);
      if (order_ == 2) point_.acceleration(x.q, x.v, x.a, x.p, components...);
    };
    if constexpr (std::is_same_v<Point, PlanarPoint>)
      find(r[0], r[1]);
    else
      find(r);
    return r[component_];
  }

  Point point_;
  int component_, order_;
};

}  // namespace costate
