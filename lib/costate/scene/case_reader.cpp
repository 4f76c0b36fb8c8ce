// [[case]] of a scene, and the scenes that they name.
#include <fmt/format.h>

#include <algorithm>

#include "costate/scene/key_recorder.h"
#include "costate/scene/scene_files.h"
#include "costate/scene/scene_reader.h"
#include "costate/scene/toml_writer.h"

namespace costate {

/// The values of 'set' as "path=value".
static void read_overrides(SceneTable& t, const SceneNode* set, std::vector<std::string>& out) {
  if (KeyRecorder* recorder = KeyRecorder::current()) recorder->add(t.path(), "set", "a table of values by path", true);
  if (!t.has("set")) return;
  if (!t.is_table("set")) t.fail_type("set", "a table of values by path, such as { \"run.t_end_s\" = 2 }");
  add_overrides(*set, "", out);
}

void SceneReader::read_cases() {
  if (root_.find("case") && !root_.find("case")->is_table_array())
    throw SceneError(root_.find("case")->where, "Cases are tables of an array: write the header [[case]] for each.");
  std::vector<SceneTable> tables = table_.tables("case");
  if (root_.find("case") && tables.empty()) table_.fail("case", "must hold one case at least.");
  for (std::size_t i = 0; i < tables.size(); ++i) {
    SceneTable& t = tables[i];
    here_ = t.where();
    CaseSettings c;
    c.where = t.where();
    c.name = t.text("name");
    check_name(t, c.name);
    c.objective = t.text("objective", "");
    if (c.objective.empty()) c.objective = c.name;
    if (t.has("scene")) c.file = named_file(t, "scene");
    read_overrides(t, root_.find("case")->children[i].find("set"), c.overrides);
    c.weight = t.value("weight", NumberRule::positive, 1);
    c.scale = t.value("scale", NumberRule::positive, 1);
    c.upper = t.find_value("upper");
    if (c.upper && (t.has("weight") || t.has("scale") || t.has("objective")))
      t.fail("upper",
             "bounds the case's psi, which then is no part of what is minimised: leave 'weight', 'scale' and "
             "'objective' out.");
    c.without = t.texts("without", false);
    t.finish();
    for (const CaseSettings& other : cases)
      if (other.name == c.name) t.fail("name", fmt::format("is that of another case, too: '{}'.", c.name));
    cases.push_back(std::move(c));
  }
  here_.reset();
  if (!cases.empty() && std::all_of(cases.begin(), cases.end(), [](const auto& c) { return c.upper.has_value(); }))
    table_.fail("case", "leaves nothing to minimise: every case has an 'upper' bound.");
}

}  // namespace costate
