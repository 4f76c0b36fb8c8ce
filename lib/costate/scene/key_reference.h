// The reference of keys, made by reading examples: which keys a table knows, what each has to be, its unit and its
// default follow from the calls that read it; only the meaning is written down, beside the kind.
#pragma once

#include <string>
#include <vector>

#include "costate/scene/cost_kind.h"
#include "costate/scene/key_meaning.h"
#include "costate/scene/key_recorder.h"
#include "costate/scene/scene_kind.h"

namespace costate {

struct KeyEntry {
  enum class Need {
    always,       // the table is refused without it
    in_its_form,  // where it is read at all: the table has several forms
    never,
  };
  std::string key;
  std::string unit;           // from the end of the key: "N/m"; empty for what has none
  std::string what;           // "a number", "one of lower, upper"
  std::string default_value;  // as a scene writes it, or empty
  std::string meaning;
  Need need = Need::never;
  NumberRule rule = NumberRule::any;
};

/// "stiffness_N_per_m" -> "N/m"; empty for a key that does not end with a unit.
std::string unit_of_key(const std::string& key);

/// The keys that these tables of one kind were asked for, in the order of asking.
std::vector<KeyEntry> key_entries(const std::vector<std::vector<KeyRead>>& tables,
                                  const std::vector<KeyMeaning>& meanings);

/// From the kind's own example; empty without one. Throws what a faulty example throws.
std::vector<KeyEntry> scene_kind_keys(const SceneKind& kind);
std::vector<KeyEntry> cost_kind_keys(const CostKind& kind);

/// What is said of a table that is no kind (setting_keys.cpp).
struct SettingsMeaning {
  std::string path;    // of the table in the reference's scene; empty: the top of the file
  std::string header;  // "[parameter.NAME]"
  std::string summary;
  std::vector<KeyMeaning> keys;
};
std::vector<SettingsMeaning> settings_meanings();

/// A table of the scene that is no kind: [run], [start], [parameter.NAME], ...
struct SettingsReference {
  std::string header, summary;
  std::vector<KeyEntry> keys;
};
std::vector<SettingsReference> settings_reference();

/// " [body.NAME] needs x_m, y_m, mass_kg." for the message about a missing key of a table at this path; empty where
/// that is all there is to say, and where nothing is known.
std::string also_needed(const std::string& path, const std::string& missing);

}  // namespace costate
