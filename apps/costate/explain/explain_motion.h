// What 'costate explain' sees along a motion: whether one in space stays in a plane, and which contacts stay open.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "costate/event/gap_trace.h"

namespace costate::app {

struct PlaneMotion {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double out_of_plane = 0;  // the largest displacement along the normal against the largest of all
  /// Set where everything moves along this one direction: the normal is then one of many.
  std::optional<Eigen::Vector3d> line = std::nullopt;
};
/// Positions of bodies, rotors and free points of a motion in space, by sample: coordinates in the mechanism's order.
/// Nothing for mechanisms of the plane, and where nothing moves.
std::optional<PlaneMotion> plane_of(const Mechanism& mechanism, const std::vector<std::vector<double>>& positions);

/// Watches the gaps of all elements that may touch, from sample to sample. A gap g has stayed open between two samples
/// at a and b where both are positive and g(a) + g(b) > 2 V (b - a), V being the largest |g'| of any sample whatever
/// its body is turned to: of what may have touched for less than the time between samples nobody says that it never
/// did.
class GapWatch {
 public:
  explicit GapWatch(const Mechanism& mechanism);
  void add(const StateView& s, const Assembly& assembly);
  /// The paths of elements all of whose gaps have stayed open.
  std::vector<std::string> open() const;

 private:
  struct Gap {
    GapTrace trace;
    double fastest = 0;               // m/s
    std::vector<double> values = {};  // m, one a sample
  };
  std::vector<Gap> gaps_;
  std::vector<double> times_;
};

}  // namespace costate::app
