// The start that a run solves for, written in the place of first guesses.
#pragma once

#include <functional>
#include <set>
#include <string>

#include "costate/analysis/start.h"
#include "costate/mechanism/mechanism.h"
#include "costate/scene/scene_node.h"

namespace costate::app {

/// Writes positions and velocities of bodies and other coordinates as they start, and the numbers that were taken from
/// the first guesses (lengths, offsets of gears): with other bodies or constraints the same guesses, where they do not
/// fit together, would start elsewhere. Does nothing where they do. Not of bodies that are `gone`, nor of the numbers
/// in `kept`.
void write_start(SceneNode& scene, const Mechanism& mechanism, const Start& start, const std::set<std::string>& kept,
                 const std::function<bool(const std::string&)>& gone);

}  // namespace costate::app
