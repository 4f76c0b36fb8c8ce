#include "costate/scene/key_reference.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cctype>
#include <map>
#include <set>

#include "costate/scene/scene_reader.h"
#include "costate/scene/toml_reader.h"

namespace costate {

namespace {

/// A scene for what every scene can have besides kinds.
constexpr const char* kPlain = R"(
title = "reference"
description = ""

[gravity]
y_m_per_s2 = -9.81

[body.plate]
x_m = 0
y_m = 0
mass_kg = 1
inertia_kg_m2 = 1

[start]
given = ["plate.x", "plate.y", "plate.angle"]
given_velocities = ["plate.x", "plate.y", "plate.angle"]

[parameter.one]
number = "body.plate.mass_kg"

[parameter.several]
numbers = ["body.plate.x_m", "body.plate.y_m"]
factors = [1, 2]

[run]
t_end_s = 1
cvodes_method = "bdf"
sensitivity_corrector = "staggered"
ends_when = { output = "plate.x", above = 0.5 }

[cycle]
section = { output = "plate.x", above = 0.5 }
travel = "plate.x"
travel_angle_rad = 0.1

[formulation]

[data.measured]
columns = ["t [s]", "x [m]"]
rows = [[0, 0.1], [1, 0.2]]

[[cost.samples]]
data = "measured"
column = "x"
output = "plate.x"
sigma = 0.01

[[case]]
name = "light"
scene = "light.toml"

[[optimize.constraint]]
name = "limit"
upper = 1

[[optimize.constraint.terminal]]
kind = "value"
output = "plate.x"
)";

using Tables = std::map<std::string, std::vector<KeyRead>>;

/// What a scene's tables were asked for, by their paths.
Tables tables_of(const std::string& text, const std::string& name) {
  const SceneNode root = read_toml(text, name);
  KeyRecorder recorded;
  SceneReader reader(root);
  reader.read();
  return recorded.tables();
}

/// Those at "group.NAME".
std::vector<std::vector<KeyRead>> entries_of(const Tables& tables, const std::string& group) {
  std::vector<std::vector<KeyRead>> r;
  for (const auto& [path, reads] : tables)
    if (path.rfind(group + ".", 0) == 0 && path.find('.', group.size() + 1) == std::string::npos) r.push_back(reads);
  return r;
}

const std::set<std::string>& unit_symbols() {
  static const std::set<std::string> symbols = {"m",   "m2",  "m3", "s", "s2", "kg",   "N",
                                                "rad", "deg", "Hz", "W", "Pa", "turn", "rad2"};
  return symbols;
}

std::string meaning_of(const std::string& key, const std::vector<KeyMeaning>& meanings) {
  for (const KeyMeaning& m : meanings)
    for (std::size_t from = 0; from < m.keys.size();) {
      const std::size_t comma = std::min(m.keys.find(", ", from), m.keys.size());
      if (m.keys.compare(from, comma - from, key) == 0) return m.meaning;
      from = comma + 2;
    }
  return {};
}

}  // namespace

std::string unit_of_key(const std::string& key) {
  std::vector<std::string> words;
  for (std::size_t from = 0; from <= key.size();) {
    const std::size_t end = std::min(key.find('_', from), key.size());
    words.push_back(key.substr(from, end - from));
    from = end + 1;
  }
  std::size_t first = words.size();
  while (first > 1 && (words[first - 1] == "per" || unit_symbols().count(words[first - 1]) > 0)) --first;
  std::string unit;
  bool below = false;
  for (std::size_t i = first; i < words.size(); ++i) {
    if (words[i] == "1") continue;
    if (words[i] == "per") {
      unit += unit.empty() ? "1/" : "/";
      below = true;
      continue;
    }
    std::string symbol = words[i];
    if (std::isdigit(static_cast<unsigned char>(symbol.back())) != 0) symbol.insert(symbol.size() - 1, "^");
    unit += (unit.empty() || unit.back() == '/' ? "" : " ") + symbol;
  }
  // Several behind one "per" would be read as factors of the whole.
  if (below && unit.find(' ', unit.find('/')) != std::string::npos)
    unit = unit.substr(0, unit.find('/') + 1) + "(" + unit.substr(unit.find('/') + 1) + ")";
  return unit;
}

std::vector<KeyEntry> key_entries(const std::vector<std::vector<KeyRead>>& tables,
                                  const std::vector<KeyMeaning>& meanings) {
  std::vector<KeyEntry> entries;
  std::map<std::string, std::size_t> count;
  for (const auto& reads : tables)
    for (const KeyRead& read : reads) {
      auto e = std::find_if(entries.begin(), entries.end(), [&](const auto& x) { return x.key == read.key; });
      if (e == entries.end()) {
        entries.push_back({read.key, unit_of_key(read.key), {}, {}, meaning_of(read.key, meanings)});
        e = entries.end() - 1;
        e->need = KeyEntry::Need::always;
      }
      if (e->what.empty()) e->what = read.what;
      if (e->default_value.empty()) e->default_value = read.default_value;
      if (read.rule != NumberRule::any) e->rule = read.rule;
      if (read.may_be_missing) e->need = KeyEntry::Need::never;
      ++count[read.key];
    }
  // Keys that were asked for only to learn that they are not there are other kinds'.
  entries.erase(
      std::remove_if(entries.begin(), entries.end(), [](const auto& e) { return e.what.empty() && e.meaning.empty(); }),
      entries.end());
  for (KeyEntry& e : entries)
    if (e.need == KeyEntry::Need::always && count[e.key] < tables.size()) e.need = KeyEntry::Need::in_its_form;
  return entries;
}

std::vector<KeyEntry> scene_kind_keys(const SceneKind& kind) {
  if (kind.example.empty()) return {};
  const std::string text = kind.example + key_example(kind.name);
  return key_entries(entries_of(tables_of(text, "the example of '" + kind.name + "'"), kind.name),
                     key_meanings(kind.name));
}

std::vector<KeyEntry> cost_kind_keys(const CostKind& kind) {
  const std::string& example = key_example("cost " + kind.name);
  if (example.empty()) return {};
  const std::string term = fmt::format("\n[[cost.running]]\nkind = \"{}\"\n{}\n", kind.name, example);
  Tables tables = tables_of(kPlain + term, "the example of cost '" + kind.name + "'");
  std::vector<KeyEntry> entries = key_entries({tables["cost.running[0]"]}, key_meanings("cost " + kind.name));
  entries.erase(entries.begin());  // 'kind' itself
  return entries;
}

std::vector<SettingsReference> settings_reference() {
  Tables tables = tables_of(kPlain, "the reference");
  std::vector<SettingsReference> r;
  for (const SettingsMeaning& s : settings_meanings()) {
    const bool named = s.header.find(".NAME") != std::string::npos;
    std::vector<std::vector<KeyRead>> read = {tables[s.path]};
    if (named) read = entries_of(tables, s.path);
    std::vector<KeyEntry> entries = key_entries(read, s.keys);
    // Tables inside are told of by themselves.
    entries.erase(std::remove_if(entries.begin(), entries.end(), [](const auto& e) { return e.meaning.empty(); }),
                  entries.end());
    r.push_back({s.header, s.summary, std::move(entries)});
  }
  return r;
}

std::string also_needed(const std::string& path, const std::string& missing) {
  static thread_local bool busy = false;  // an example that lacks a key itself
  const std::size_t dot = path.find('.');
  const std::string name = path.substr(0, dot);
  const SceneKind* kind = find_scene_kind(name);
  if (busy || !kind || dot == std::string::npos || path.find('.', dot + 1) != std::string::npos) return {};
  busy = true;
  std::vector<std::string> needed;
  try {
    for (const KeyEntry& e : scene_kind_keys(*kind))
      if (e.need == KeyEntry::Need::always) needed.push_back(e.key);
  } catch (const std::exception&) {
    needed.clear();
  }
  busy = false;
  if (needed.empty() || needed == std::vector<std::string>{missing}) return {};
  return fmt::format(" Each [{}.NAME] needs {}.", name, fmt::join(needed, ", "));
}

}  // namespace costate
