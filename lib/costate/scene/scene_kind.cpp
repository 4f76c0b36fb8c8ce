#include "costate/scene/scene_kind.h"

#include <algorithm>

namespace costate {

namespace {
std::vector<SceneKind>& registry() {
  static std::vector<SceneKind> kinds;
  return kinds;
}
}  // namespace

const std::vector<SceneKind>& scene_kinds() { return registry(); }

const SceneKind* find_scene_kind(const std::string& name) {
  for (const auto& k : registry())
    if (k.name == name) return &k;
  return nullptr;
}

RegisterSceneKind::RegisterSceneKind(SceneKind kind) {
  auto& kinds = registry();
  kinds.insert(std::upper_bound(kinds.begin(), kinds.end(), kind,
                                [](const SceneKind& a, const SceneKind& b) { return a.name < b.name; }),
               std::move(kind));
}

}  // namespace costate
