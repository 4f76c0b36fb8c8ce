#include "costate/element/force/path_driver.h"

namespace costate {

PathDriver::PathDriver(std::string name, SpatialPoint point, int coordinate, std::shared_ptr<const ScalarLaw> path,
                       const std::vector<int>& own, const std::vector<int>& path_numbers)
    : ForceOf("path_driver", std::move(name)), point_(std::move(point)), path_(std::move(path)) {
  append_coordinates(point_.coordinates());
  append_coordinates({coordinate});
  append_numbers(own);
  append_numbers(point_.numbers());
  append_numbers(path_numbers);
}

PathDual PathDriver::measure(int i, const MeasureArguments& x) const {
  if (i == 0) return error(x.q, x.p);
  const int s = point_.size();
  if (i == 1)
    return x.p[stiffness] * (x.z[1] - x.q[s]) + x.p[damping] * ((x.z[0] - x.z[1]) / x.p[arm_lag] - x.v[s]);
  PathDual r[3];
  point_.position(x.q, x.p + own_numbers, r);
  return r[1] - path_->value(r[0], x.p + own_numbers + 3);
}

}  // namespace costate
