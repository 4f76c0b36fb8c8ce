#include "costate/scene/scene_kind.h"

#include <algorithm>

namespace costate {

namespace {
std::vector<SceneKind>& kind_registry() {
  static std::vector<SceneKind> kinds;
  return kinds;
}
}  // namespace

const std::vector<SceneKind>& scene_kinds() { return kind_registry(); }

const SceneKind* find_scene_kind(const std::string& name) {
  for (const auto& k : kind_registry())
    if (k.name == name) return &k;
  return nullptr;
}

RegisterSceneKind::RegisterSceneKind(SceneKind kind) {
  auto& kinds = kind_registry();
  kinds.insert(std::upper_bound(kinds.begin(), kinds.end(), kind,
                                [](const SceneKind& a, const SceneKind& b) { return a.name < b.name; }),
               std::move(kind));
}

}  // namespace costate
