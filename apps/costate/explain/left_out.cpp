#include "left_out.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <set>

#include "costate/problem/scene_problem.h"
#include "costate/scene/toml_reader.h"
#include "costate/scene/wanted_part.h"

namespace costate::app {

namespace {

bool asks_for_everything(const Scene& scene) {
  const SceneNode root = read_toml(scene.dump(), scene.file_name());
  const SceneNode* node = find_node(root, "run.everything");
  return node && node->flag;
}

std::vector<std::string> element_paths(const Mechanism& m) {
  std::vector<std::string> paths;
  std::set<std::string> known;
  const auto add = [&](const auto& list) {
    for (const auto& e : list)
      if (known.insert(e->path()).second) paths.push_back(e->path());
  };
  add(m.bodies());
  add(m.constraints());
  add(m.forces());
  return paths;
}

std::vector<std::string> missing(const std::vector<std::string>& of_all, const std::vector<std::string>& there) {
  const std::set<std::string> known(there.begin(), there.end());
  std::vector<std::string> names;
  for (const std::string& name : of_all)
    if (!known.contains(name)) names.push_back(name);
  return names;
}

}  // namespace

std::optional<std::vector<int>> wanted_coordinates(const Setup& setup) {
  const Mechanism& m = *setup.scene.mechanism();
  std::vector<int> all;
  const auto add = [&](const std::optional<std::vector<int>>& some) {
    if (some) all.insert(all.end(), some->begin(), some->end());
    return some.has_value();
  };
  bool known = add(coordinates_of(m, setup.scene.objective()));
  for (const SceneConstraint& c : setup.scene.constraints()) known = known && add(coordinates_of(m, c.objective));
  for (const std::string& name : setup.scene.run.outputs) known = known && add(coordinates_of(m, name));
  if (const auto& end = setup.scene.run.ends_when) known = known && add(coordinates_of(m, end->output));
  return known ? std::optional(all) : std::nullopt;
}

std::string kept_because(const Setup& setup) {
  if (setup.problem.cycle) return "A cycle is one of all coordinates.";
  if (!setup.scene.constraints().empty())
    return "The scene has [[optimize.constraint]], which is built with all of it.";
  if (asks_for_everything(setup.scene)) return "[run] everything asks for it.";
  return {};
}

void leave_out_rest(Setup& setup) {
  const auto groups = acting_groups(*setup.scene.mechanism());
  const auto wanted = wanted_coordinates(setup);
  if (!wanted || wanted->empty() || *std::max_element(groups.begin(), groups.end()) == 0) return;
  if (!kept_because(setup).empty()) return;
  const std::optional<Scene> part = read_part(setup.scene, *wanted);
  if (!part) return;
  const Problem own = make_problem(*part);
  setup.problem.mechanism = own.mechanism;
  setup.problem.objective = own.objective;
  setup.problem.ends_when = own.ends_when;
}

LeftOut left_out(const Setup& setup) {
  const Mechanism &all = *setup.scene.mechanism(), &part = *setup.problem.mechanism;
  if (part.coordinate_count() == all.coordinate_count()) return {};
  return {missing(all.coordinate_names(), part.coordinate_names()), missing(element_paths(all), element_paths(part))};
}

Json left_out_json(const LeftOut& rest) {
  return {{"coordinates", rest.coordinates},
          {"elements", rest.elements},
          {"because", "No cost, no constraint, no end and none of [run] outputs depends on them."}};
}

std::string shortened(const std::vector<std::string>& names) {
  constexpr std::size_t most = 6;
  const std::vector<std::string> first(names.begin(),
                                       names.begin() + static_cast<std::ptrdiff_t>(std::min(most, names.size())));
  return fmt::format("{}{}", fmt::join(first, ", "), names.size() > most ? ", ..." : "");
}

std::string left_out_text(const LeftOut& rest) {
  if (rest.coordinates.empty()) return {};
  return fmt::format(
      "  left out, since no cost and no output depends on them: {} coordinates ({}), elements {} (--set "
      "run.everything=true builds them)\n",
      rest.coordinates.size(), shortened(rest.coordinates), shortened(rest.elements));
}

Problem whole_problem(const Setup& setup) {
  Problem whole = setup.problem;
  if (left_out(setup).coordinates.empty()) return whole;
  const Problem own = make_problem(setup.scene);
  whole.mechanism = own.mechanism;
  whole.objective = own.objective;
  whole.ends_when = own.ends_when;
  return whole;
}

}  // namespace costate::app
