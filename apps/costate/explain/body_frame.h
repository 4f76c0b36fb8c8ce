// Where a body in space stands at a start, and how fast its frame moves, whatever its coordinates.
#pragma once

#include <Eigen/Core>
#include <string>

#include "costate/analysis/start.h"
#include "costate/mechanism/mechanism.h"

namespace costate::app {

struct BodyFrame {
  Eigen::Vector3d r;     // its origin [m]
  Eigen::Matrix3d A;     // its base vectors, a column each
  Eigen::Matrix3d rate;  // of these [1/s]
};

/// kind: rigid_body or natural_body.
BodyFrame body_frame(const Mechanism& mechanism, const Start& start, const std::string& kind, const std::string& name);

}  // namespace costate::app
