#include "costate/kind/law/law_reference.h"

#include "costate/scene/scene_node.h"
#include "costate/scene/toml_reader.h"

namespace costate {

std::vector<KeyEntry> law_keys(const LawKind& kind) {
  const SceneNode node = read_toml_value(kind.example, "the example of law '" + kind.name + "'");
  KeyRecorder recorder;
  SceneTable table(node);
  table.text("kind");
  kind.read(table);
  std::vector<KeyEntry> entries = key_entries({recorder.tables().at("")}, key_meanings("law " + kind.name));
  entries.erase(entries.begin());  // 'kind' itself
  return entries;
}

}  // namespace costate
