// The registry of what a scene can contain: [kind.NAME] tables. A new kind is one file pair (beside its
// physics) that registers itself; nothing else changes.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "costate/scene/scene_table.h"

namespace costate {

/// Kinds are read in this order, and in the order of the file within a phase.
enum class ScenePhase {
  data,             // tables that laws and costs take values from
  points,           // ground and free points, bodies
  bars,             // what joins points
  attached_points,  // points on bodies and bars
  angles,           // angle coordinates
  elements,         // joints, drivers, forces
};

struct SceneKind {
  std::string name;
  ScenePhase phase = ScenePhase::elements;
  /// For kinds whose tables belong to different phases; empty otherwise.
  std::function<ScenePhase(const SceneTable&)> phase_of = {};
  std::string summary = {};
  /// A complete small scene that uses this kind, loads and can be started: for documentation and tests.
  std::string example = {};
  std::function<void(const std::string& name, SceneTable& table, MechanismBuilder& builder)> add;
};

/// All registered kinds by name.
const std::vector<SceneKind>& scene_kinds();
const SceneKind* find_scene_kind(const std::string& name);

struct RegisterSceneKind {
  explicit RegisterSceneKind(SceneKind kind);
};

}  // namespace costate
