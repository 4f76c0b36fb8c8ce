// Vectors of three numbers as scenes write them.
#pragma once

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <string>

#include "costate/scene/scene_node.h"

namespace costate::app {

/// With the digits that a start solved to 1e-12 has.
inline double in_start_digits(double x) { return std::stod(fmt::format("{:.13g}", x + 0.0)); }

inline SceneNode vector_node(const Eigen::Vector3d& x) {
  SceneNode n;
  n.type = SceneNode::Type::array;
  for (const double v : x) n.children.push_back(number_node(in_start_digits(v)));
  return n;
}

inline bool is_vector(const SceneNode& n) {
  return n.is_array() && n.children.size() == 3 &&
         std::all_of(n.children.begin(), n.children.end(), [](const SceneNode& c) { return c.is_number(); });
}

inline Eigen::Vector3d vector_of(const SceneNode& n) {
  return {n.children[0].as_double(), n.children[1].as_double(), n.children[2].as_double()};
}

}  // namespace costate::app
