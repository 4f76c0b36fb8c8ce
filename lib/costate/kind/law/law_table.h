// Laws in scene files: a number, or a table { kind = "sine", mean = ..., ... }. New kinds of law register
// themselves: one pair of files in kind/law/, as bump_stop_law, with an example that the tests over all laws pick up.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "costate/kind/law/law_options.h"
#include "costate/scene/scene_table.h"

namespace costate {

struct LawKind {
  std::string name;
  std::string summary;
  /// A law of this kind as a scene writes it: for documentation and tests.
  std::string example;
  std::function<LawOptions(SceneTable& table)> read;
};
const std::vector<LawKind>& law_kinds();
struct RegisterLawKind {
  explicit RegisterLawKind(LawKind kind);
};

/// The law under a key; when the key is absent, the constant `default_value`, or an error without one.
LawOptions read_law(SceneTable& table, const std::string& key, std::optional<double> default_value = {});
/// The laws in an array of tables.
std::vector<LawOptions> read_laws(SceneTable& table, const std::string& key);
/// The law under a key, or none.
LawOptions find_law(SceneTable& table, const std::string& key);

}  // namespace costate
