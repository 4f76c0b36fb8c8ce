// The directions in which a point slides in space behind an impact (lib/README.md (19.8)).
#pragma once

#include <Eigen/Core>
#include <vector>

namespace costate {

/// A point that strikes: its gap first and then the two directions of the ground.
struct StrikingPoint {
  Eigen::Matrix3d response;  // J K^-1 J^T
  Eigen::Vector3d before;    // J v-
  double friction = 0;
  bool given = false;  // whether p_n = normal; if not the gap's speed changes by `normal`
  double normal = 0;
};

/// All unit vectors s along which v_t+ points with p_t = -mu p_n s, be it forward or back; none where all do.
std::vector<Eigen::Vector2d> slips_behind(const StrikingPoint& point);

}  // namespace costate
