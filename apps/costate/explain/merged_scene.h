// The scene in which bodies that are welded (`[fixed.*]`) are one.
#pragma once

#include <string>
#include <vector>

#include "costate/command.h"

namespace costate::app {

struct MergedScene {
  std::string toml;
  std::vector<std::string> bodies;  // that are part of another one, or of the ground, there
  std::vector<std::string> kept;    // welds that stay, with the reason
};

/// As TOML: of each group of welded bodies one stays (the one that the scene names most), or the ground. Points,
/// directions, masses and inertias of the others become its own, at the start's relative poses; masses that a parameter
/// varies stay masses at points of it. Position and velocity of the others' origins stay outputs, as do angular
/// velocities in the global frame. Welds whose reactions are asked for stay. Throws CapabilityError that names what
/// cannot be written so.
MergedScene merged_scene(const Setup& setup);

}  // namespace costate::app
