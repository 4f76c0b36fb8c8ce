// [cycle] of a scene.
#include <fmt/format.h>

#include <algorithm>

#include "costate/objective/cycle_output.h"
#include "costate/scene/scene_reader.h"

namespace costate {

/// Whether a text in here names this output, alone or in a formula.
static bool names_output(const SceneNode& node, const std::string& name) {
  if (node.type == SceneNode::Type::text && node.text.find(name) != std::string::npos) return true;
  return std::any_of(node.children.begin(), node.children.end(),
                     [&](const SceneNode& child) { return names_output(child, name); });
}

void SceneReader::read_cycle() {
  if (table_.has("run")) {
    SceneTable run_table = table_.table("run");
    run.cycle = run_table.flag("cycle", false);
    if (run.cycle && !table_.has("cycle"))
      run_table.fail("cycle", "is that of a table [cycle], which is missing: give its 'section' or 'period_s'.");
  }
  if (!table_.has("cycle")) return;
  SceneTable t = table_.table("cycle");
  here_ = t.where();
  CycleSettings c;
  const bool section = t.has("section"), period = t.has("period_s");
  if (section == period)
    t.fail(
        fmt::format("needs one of 'section', the event or the crossing that a cycle begins with, and 'period_s'; found "
                    "{}.",
                    section ? "both" : "none"));
  if (section && t.is_table("section")) {
    SceneTable s = t.table("section");
    c.output = s.text("output");
    const bool above = s.has("above"), below = s.has("below");
    if (above == below)
      s.fail(fmt::format("needs one of 'above' and 'below', the level that '{}' crosses; found {}.", c.output,
                         above ? "both" : "none"));
    c.above = above;
    c.level_number = s.number(above ? "above" : "below", builder_);
    s.finish();
  } else if (section) {
    if (!t.is_text("section"))
      t.fail_type("section",
                  "an event such as \"contact.left touch\", or a table such as { output = \"mass.x\", above = 0.0 }");
    c.event = t.text("section");
  }
  c.period_s = t.find_value("period_s", NumberRule::positive);
  c.after_s = t.value("after_s", NumberRule::non_negative, 0);
  if (c.period_s && c.after_s > 0)
    t.fail("after_s",
           "is when a section is looked for; a cycle of a given period begins where the run does, at run.t_start_s.");
  c.count = t.whole_number("count", 1);
  if (c.count < 1) t.fail("count", fmt::format("must be 1 or more, found {}.", c.count));
  c.settle = t.whole_number("settle", 0);
  if (c.settle < 0) t.fail("settle", fmt::format("must not be negative, found {}.", c.settle));
  if (t.has("relabel")) {
    if (!t.is_table("relabel"))
      t.fail_type("relabel", "a table of names that swap roles, such as { left = \"right\" }");
    SceneTable pairs = t.table("relabel");
    for (const std::string& name : pairs.keys()) {
      const std::string other = pairs.text(name);
      if (other == name) pairs.fail(name, "must name another one than itself.");
      for (const auto& [from, to] : {std::pair(name, other), std::pair(other, name)})
        if (const auto [at, fresh] = c.relabel.emplace(from, to); !fresh && at->second != to)
          pairs.fail(name, fmt::format("gives '{}' a second partner, '{}' besides '{}'.", from, to, at->second));
    }
    pairs.finish();
  }
  c.travel = t.text("travel", "");
  if (t.has("travel_angle_rad")) {
    if (t.is_text("travel_angle_rad"))
      c.travel_angle_number = t.text("travel_angle_rad");
    else
      c.travel_angle_rad = t.value("travel_angle_rad");
    if (c.travel.empty()) t.fail("travel_angle_rad", "is that of 'travel', which is missing.");
  }
  c.turns = t.texts("turns", false);
  t.finish();
  std::vector<bool> named(kCycleValues, false);
  for (const char* where : {"cost", "optimize", "output"})
    if (const SceneNode* part = root_.find(where))
      for (std::size_t i = 0; i < named.size(); ++i) named[i] = named[i] || names_output(*part, cycle_value_names()[i]);
  for (const int i : {kCycleTravel, kCycleSpeed})
    if (named[static_cast<std::size_t>(i)] && c.travel.empty())
      throw ModelError("cycle",
                       fmt::format("'{}' needs 'travel' here, the coordinate that moves on: travel = \"hip.x\".",
                                   cycle_value_names()[static_cast<std::size_t>(i)]));
  if (std::find(named.begin(), named.end(), true) != named.end()) add_cycle_values(builder_);
  cycle = c;
  here_.reset();
}

}  // namespace costate
