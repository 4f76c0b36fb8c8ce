// Outputs of points: their places, velocities and accelerations, component by component.
#pragma once

#include <string>
#include <utility>

#include "costate/element/point/planar_point.h"
#include "costate/element/point/spatial_point.h"
#include "costate/objective/local_output.h"

namespace costate {

/// x or y of a point, its rate or its second rate.
class PointOutput final : public LocalOutput {
 public:
  PointOutput(std::string name, std::string unit, const PlanarPoint& point, int component, int order)
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
    S r[2];
    if (order_ == 0) point_.position(x.q, x.p, r[0], r[1]);
    if (order_ == 1) point_.velocity(x.q, x.v, x.p, r[0], r[1]);
    if (order_ == 2) point_.acceleration(x.q, x.v, x.a, x.p, r[0], r[1]);
    return r[component_];
  }

  PlanarPoint point_;
  int component_, order_;
};

/// The same of a point of space.
class SpatialPointOutput final : public LocalOutput {
 public:
  SpatialPointOutput(std::string name, std::string unit, const SpatialPoint& point, int component, int order)
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
    if (order_ == 0) point_.position(x.q, x.p, r);
    if (order_ == 1) point_.velocity(x.q, x.v, x.p, r);
    if (order_ == 2) point_.acceleration(x.q, x.v, x.a, x.p, r);
    return r[component_];
  }

  SpatialPoint point_;
  int component_, order_;
};

}  // namespace costate
