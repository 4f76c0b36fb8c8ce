// The reference of keys: made from what kinds read in their examples, with the meanings that they state.
#include "costate/scene/key_reference.h"

#include <algorithm>
#include <catch2/catch.hpp>

#include "costate/kind/law/law_reference.h"
#include "costate/scene/scene.h"

using namespace costate;

namespace {

/// Keys read without a meaning, and meanings of keys that nothing reads.
std::vector<std::string> loose_ends(const std::string& name, const std::vector<KeyEntry>& keys,
                                    const std::vector<KeyMeaning>& meanings) {
  std::vector<std::string> wrong;
  for (const KeyEntry& k : keys)
    if (k.meaning.empty()) wrong.push_back(name + ": '" + k.key + "' has no meaning");
  for (const KeyMeaning& m : meanings)
    for (std::size_t from = 0; from < m.keys.size();) {
      const std::size_t comma = std::min(m.keys.find(", ", from), m.keys.size());
      const std::string key = m.keys.substr(from, comma - from);
      if (std::none_of(keys.begin(), keys.end(), [&](const auto& k) { return k.key == key; }))
        wrong.push_back(name + ": nothing reads '" + key + "'");
      from = comma + 2;
    }
  return wrong;
}

const KeyEntry& key(const std::vector<KeyEntry>& keys, const std::string& name) {
  const auto found = std::find_if(keys.begin(), keys.end(), [&](const auto& k) { return k.key == name; });
  INFO(name);
  REQUIRE(found != keys.end());
  return *found;
}

}  // namespace

TEST_CASE("key reference: units stand at the end of keys") {
  CHECK(unit_of_key("x_m") == "m");
  CHECK(unit_of_key("mass_kg") == "kg");
  CHECK(unit_of_key("stiffness_N_per_m") == "N/m");
  CHECK(unit_of_key("damping_N_m_s_per_rad") == "N m s/rad");
  CHECK(unit_of_key("inertia_xy_kg_m2") == "kg m^2");
  CHECK(unit_of_key("air_density_kg_per_m3") == "kg/m^3");
  CHECK(unit_of_key("n_min_1_per_m") == "1/m");
  CHECK(unit_of_key("lead_m_per_turn") == "m/turn");
  CHECK(unit_of_key("yaw_gain_m_s_per_rad") == "m s/rad");
  CHECK(unit_of_key("coordinate").empty());
  CHECK(unit_of_key("s").empty());
}

TEST_CASE("key reference: every key of every kind, law, cost and setting has a meaning, and every meaning a key") {
  for (const SceneKind& k : scene_kinds())
    CHECK(loose_ends(k.name, scene_kind_keys(k), key_meanings(k.name)) == std::vector<std::string>{});
  for (const LawKind& k : law_kinds()) {
    const auto keys = law_keys(k);
    CHECK(loose_ends(k.name, keys, key_meanings("law " + k.name)) == std::vector<std::string>{});
  }
  for (const CostKind& k : cost_kinds())
    CHECK(loose_ends(k.name, cost_kind_keys(k), key_meanings("cost " + k.name)) == std::vector<std::string>{});
  const auto settings = settings_reference();
  const auto meanings = settings_meanings();
  REQUIRE(settings.size() == meanings.size());
  for (std::size_t i = 0; i < settings.size(); ++i)
    CHECK(loose_ends(settings[i].header, settings[i].keys, meanings[i].keys) == std::vector<std::string>{});
}

TEST_CASE("key reference: types, defaults and needs follow from reading") {
  using Need = KeyEntry::Need;
  const auto bar = scene_kind_keys(*find_scene_kind("bar"));
  CHECK(key(bar, "mass_kg").need == Need::always);
  CHECK(key(bar, "from").what == "a string");
  CHECK(key(bar, "length_m").need == Need::never);
  CHECK(key(bar, "length_m").default_value.empty());
  const auto drag = scene_kind_keys(*find_scene_kind("drag"));
  CHECK(key(drag, "air_density_kg_per_m3").default_value == "1.2");
  CHECK(key(drag, "wind_x_m_per_s").what == "a number or a law");
  const auto actuator = scene_kind_keys(*find_scene_kind("actuator"));
  CHECK(key(actuator, "from").need == Need::in_its_form);
  CHECK(key(actuator, "time_constant_s").need == Need::always);
  CHECK(key(actuator, "command_N").need == Need::in_its_form);
  const auto spring = scene_kind_keys(*find_scene_kind("spring"));
  CHECK(key(spring, "stiffness_N_per_m").rule == NumberRule::non_negative);
  CHECK(key(spring, "spring_law").need == Need::never);
  for (const auto& s : settings_reference())
    if (s.header == "[formulation]") {
      CHECK(key(s.keys, "discrete_scheme").what == "one of newmark, generalized-alpha");
      CHECK(key(s.keys, "discrete_scheme").default_value == "\"newmark\"");
      CHECK(key(s.keys, "baumgarte_omega_rad_per_s").default_value == "10");
    }
}

TEST_CASE("key reference: a missing key's message names all that are required") {
  const std::string scene = "[body.plate]\nx_m = 1\nmass_kg = 2\n";
  CHECK_THROWS_WITH(Scene::parse(scene, "s.toml"),
                    Catch::Contains("[body.plate] needs 'inertia_kg_m2' (a number), which is missing. Each [body.NAME] "
                                    "needs mass_kg, inertia_kg_m2, x_m, y_m."));
}

TEST_CASE("key reference: a kind without an example has no keys to show, and its complaints stay short") {
  const SceneKind bare{.name = "bare", .add = [](const std::string&, SceneTable&, MechanismBuilder&) {}};
  CHECK(scene_kind_keys(bare).empty());
  CHECK(also_needed("nothing.of", "that_name").empty());
}
