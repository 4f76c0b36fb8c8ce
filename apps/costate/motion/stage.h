// A mechanism in motion as solids in space, each with its pose at every sample: what a viewer in 3-D shows. Made of the
// figures that 'costate draw' shows, so of bars, bodies, joints, springs, wheels, contacts and ground alike.
#pragma once

#include <Eigen/Geometry>
#include <string>
#include <vector>

#include "costate/figure.h"
#include "solid_mesh.h"

namespace costate::app {

/// x -> at + turn * (scale . x)
struct Pose {
  Vector3d at = Vector3d::Zero();
  Eigen::Quaterniond turn = Eigen::Quaterniond::Identity();
  Vector3d scale = Vector3d::Ones();
};

struct Solid {
  std::string name;
  int mesh = 0;
  unsigned color = 0;  // 0xRRGGBB
  double opacity = 1;
  std::vector<Pose> poses;  // one a sample; turns go on without a change of sign
  bool reverses = false;    // an arrow, which points the other way where what it stands for has changed its sign
};

struct Stage {
  std::vector<double> times;  // [s]
  std::vector<SolidMesh> meshes;
  std::vector<Solid> solids;
  int up = 1;       // the axis against gravity: 0 x, 1 y, 2 z
  double size = 1;  // [m]
};

Stage make_stage(const std::vector<double>& times, const std::vector<Figure>& figures);

/// The largest angle [rad] that a solid turns by between two samples, and its name.
std::pair<double, std::string> largest_turn(const Stage& stage);

}  // namespace costate::app
