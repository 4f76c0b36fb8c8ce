// All there is to say of what a scene or a command line can name: kinds, laws, costs, settings, formulations, methods,
// algorithms. Everything comes from the registries.
#pragma once

#include <string>
#include <vector>

#include "command.h"
#include "costate/scene/key_reference.h"

namespace costate::app {

struct ReferenceEntry {
  std::string family;   // "kind", "law", ...
  std::string name;     // "body"
  std::string title;    // "[body.NAME]"
  std::string summary;  // one line
  std::vector<std::string> remarks;
  std::vector<KeyEntry> keys;
  std::string example;  // of a kind a whole scene
};

/// The families as `costate list` names them, "kinds", with the titles of their sections.
const std::vector<std::pair<std::string, std::string>>& reference_families();

/// Of all families, in the order of reading.
std::vector<ReferenceEntry> reference_entries();

std::string reference_text(const ReferenceEntry& entry, bool with_example);
Json reference_json(const ReferenceEntry& entry);
/// The tables of models/README.md: settings, kinds, laws and costs.
std::string reference_markdown(const std::vector<ReferenceEntry>& entries);

}  // namespace costate::app
