// What 'costate explain' looks at: element kinds with their share of the work, parts that nothing connects, and whether
// a motion in space stays in a plane.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate::app {

/// One kind of bodies, constraints or forces.
struct KindShare {
  std::string kind;
  int elements = 0, rows = 0, states = 0;
  long square_entries = 0, jacobian_entries = 0;  // written into n x n and m x n patterns, overlaps counted each time
  int constant_mass = 0, constant_force = 0;      // bodies whose M, whose Q is evaluated once
  double dynamics_s = 0, partials_s = 0;          // processor time of all kernels of this kind once
};
/// In the order of their first element; timed at the start.
std::vector<KindShare> kind_shares(const Problem& problem, const std::vector<double>& rho);

/// Coordinates and elements that act on each other, directly or through others.
struct Part {
  std::vector<std::string> coordinates, elements;
  bool needed = false;  // by an output or a cost that was named
};
/// `outputs` by name; the problem's cost is added to them.
std::vector<Part> independent_parts(const Problem& problem, const std::vector<double>& rho,
                                    const std::vector<std::string>& outputs);

struct PlaneMotion {
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  double out_of_plane = 0;  // the largest displacement along the normal against the largest of all
};
/// Positions of bodies and free points of a motion in space, by sample: coordinates in the mechanism's order. Nothing
/// for mechanisms of the plane.
std::optional<PlaneMotion> plane_of(const Mechanism& mechanism, const std::vector<std::vector<double>>& positions);

}  // namespace costate::app
