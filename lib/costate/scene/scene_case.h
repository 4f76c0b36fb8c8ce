// [[case]]: the scenes that one design is judged by together. The scene that lists them is the design's: parameters,
// bounds and [optimize] are its own; a case takes its parameters by name and counts with its own cost, time and
// settings.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "costate/base/error.h"

namespace costate {

class Scene;

struct CaseSettings {
  std::string name;
  std::string objective;               // cases of one objective belong together; by default the case's name
  std::string file;                    // of its scene, as it can be opened from here; empty: the one that lists it
  std::vector<std::string> overrides;  // "path=value", in order
  double weight = 1, scale = 1;        // it counts by weight psi / scale
  std::optional<double> upper;         // psi must stay below, and is no part of what is minimised
  std::vector<std::string> without;    // parameters of the design that it does not depend on
  SourceLocation where;
};

struct SceneCase : CaseSettings {
  std::shared_ptr<const Scene> scene;
};

}  // namespace costate
