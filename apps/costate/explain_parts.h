// What 'costate explain' looks at: element kinds with their share of the work, and parts that nothing connects.
#pragma once

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
/// `wanted`: coordinates that what is asked for is of; null: all.
std::vector<Part> independent_parts(const Mechanism& mechanism, const std::optional<std::vector<int>>& wanted);

/// A weld, [fixed.*], and what one body in the place of two would save: rows of the weld and of the second body's own
/// coordinates among themselves, and those coordinates.
struct Weld {
  std::string path;
  std::vector<std::string> bodies;  // one: to the ground
  int rows = 0, coordinates = 0;
};
std::vector<Weld> welds(const Mechanism& mechanism);

}  // namespace costate::app
