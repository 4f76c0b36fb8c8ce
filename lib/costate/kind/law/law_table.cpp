#include "costate/kind/law/law_table.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/scene/key_recorder.h"
#include "costate/scene/key_reference.h"

namespace costate {

namespace {
std::vector<LawKind>& registry() {
  static std::vector<LawKind> kinds;
  return kinds;
}

LawOptions read_law_table(SceneTable table) {
  std::vector<std::string> names;
  for (const auto& k : law_kinds()) names.push_back(k.name);
  if (table.is_text("kind") && table.text("kind") == "map")
    table.fail("kind",
               "is \"map\", a function of two arguments, which formulas alone have (output, force, couple, "
               "actuator): give a law of one, \"data\" or \"table\".");
  const std::string name = table.one_of("kind", names);
  const auto kind = std::find_if(law_kinds().begin(), law_kinds().end(), [&](const auto& k) { return k.name == name; });
  try {
    return kind->read(table);
  } catch (const ModelError& e) {
    throw ModelError(e.subject().empty() ? table.path() : e.subject(), e.bare_message());
  }
}
}  // namespace

const std::vector<LawKind>& law_kinds() { return registry(); }

RegisterLawKind::RegisterLawKind(LawKind kind) {
  auto& kinds = registry();
  kinds.insert(std::upper_bound(kinds.begin(), kinds.end(), kind,
                                [](const LawKind& a, const LawKind& b) { return a.name < b.name; }),
               std::move(kind));
}

LawOptions read_law(SceneTable& table, const std::string& key, std::optional<double> default_value) {
  constexpr const char* what = "a number or a law";
  if (KeyRecorder* r = KeyRecorder::current())
    r->add(table.path(), key, what, default_value.has_value(),
           default_value ? fmt::format("{:g}", *default_value) : std::string());
  if (table.is_table(key)) return read_law_table(table.table(key));
  const auto keys = table.keys();
  if (std::find(keys.begin(), keys.end(), key) == keys.end()) {
    if (default_value) return *default_value;
    table.fail(fmt::format("needs '{}' ({}), which is missing.{}", key, what, also_needed(table.path(), key)));
  }
  if (!table.is_number(key)) table.fail_type(key, "a number or a law like { kind = \"sine\", ... }");
  return table.value(key);
}

std::vector<LawOptions> read_laws(SceneTable& table, const std::string& key) {
  std::vector<LawOptions> laws;
  for (const SceneTable& t : table.tables(key)) laws.push_back(read_law_table(t));
  if (laws.empty()) table.fail("needs '" + key + "', an array of laws like { kind = \"sine\", ... }.");
  return laws;
}

LawOptions find_law(SceneTable& table, const std::string& key) {
  if (KeyRecorder* r = KeyRecorder::current()) r->add(table.path(), key, "a number or a law", true);
  if (!table.has(key)) return {};
  return read_law(table, key);
}

namespace {

const RegisterLawKind constant({.name = "constant",
                                .summary = "value",
                                .example = "{ kind = \"constant\", value = 3.5 }",
                                .read = [](SceneTable& t) {
                                  LawOptions o(t.value("value"));
                                  o.numbers[0].first = "value";
                                  return o;
                                }});

const RegisterLawKind polynomial({.name = "polynomial",
                                  .summary = "coefficients[0] + coefficients[1] x + coefficients[2] x^2 + ...",
                                  .example = "{ kind = \"polynomial\", coefficients = [0.3, -1.2, 0.7, 2.0] }",
                                  .read = [](SceneTable& t) { return polynomial_law(t.values("coefficients")); }});

const RegisterLawKind sine(
    {.name = "sine",
     .summary = "mean + amplitude sin(angular_frequency_rad_per_s x + phase_rad)",
     .example = R"({ kind = "sine", mean = 0.5, amplitude = 1.5, angular_frequency_rad_per_s = 3,)"
                R"( phase_rad = 0.2 })",
     .read = [](SceneTable& t) {
       const double mean = t.value("mean", NumberRule::any, 0);
       const double amplitude = t.value("amplitude");
       const double omega = t.value("angular_frequency_rad_per_s");
       return sine_law(mean, amplitude, omega, t.value("phase_rad", NumberRule::any, 0));
     }});

const RegisterLawKind smooth_step(
    {.name = "smooth_step",
     .summary = "'before' up to x = from, 'after' beyond x = to, a quintic between",
     .example = "{ kind = \"smooth_step\", from = -0.5, to = 1.2, before = 2, after = -1 }",
     .read = [](SceneTable& t) {
       const double from = t.value("from"), to = t.value("to");
       const double before = t.value("before");
       return smooth_step_law(from, to, before, t.value("after"));
     }});

const RegisterLawKind table({.name = "table",
                             .summary = "the natural cubic spline through the points (x, y)",
                             .example = R"({ kind = "table", x = [-1, -0.3, 0.4, 1.5, 2], y = [1, -0.5, 0.2, 2, 1] })",
                             .read = [](SceneTable& t) {
                               const auto x = t.values("x");
                               return table_law(x, t.values("y"));
                             }});

}  // namespace

}  // namespace costate
