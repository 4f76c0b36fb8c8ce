#include "costate/scene/scene_node.h"

#include <fmt/format.h>

namespace costate {

bool SceneNode::is_table_array() const {
  if (!is_array() || children.empty()) return false;
  for (const auto& c : children)
    if (!c.is_table() || c.inlined) return false;
  return true;
}

const SceneNode* SceneNode::find(std::string_view child) const {
  if (!is_table()) return nullptr;
  for (const auto& c : children)
    if (c.key == child) return &c;
  return nullptr;
}

SceneNode* SceneNode::find(std::string_view child) {
  return const_cast<SceneNode*>(static_cast<const SceneNode*>(this)->find(child));
}

std::string SceneNode::describe() const {
  switch (type) {
    case Type::table:
      return "a table";
    case Type::array:
      return fmt::format("an array of {}", children.size());
    case Type::text:
      return fmt::format("the string \"{}\"", text);
    case Type::integer:
      return fmt::format("the number {}", integer);
    case Type::number:
      return fmt::format("the number {}", number);
    case Type::flag:
      return flag ? "true" : "false";
    case Type::date:
      return "a date or time";
  }
  return {};
}

std::vector<ScenePathStep> split_scene_path(const std::string& path) {
  std::vector<ScenePathStep> steps;
  const auto malformed = [&](const char* what) {
    return Error(
        fmt::format("'{}' is not a path of the scene ({}). A path looks like spring.S1.stiffness_N_per_m or "
                    "cost.running[0].weight.",
                    path, what));
  };
  std::size_t i = 0;
  while (i <= path.size()) {
    const std::size_t end = std::min(path.find_first_of(".[", i), path.size());
    if (end == i) throw malformed("an empty key");
    steps.push_back({path.substr(i, end - i), -1});
    i = end;
    while (i < path.size() && path[i] == '[') {
      const std::size_t close = path.find(']', i);
      if (close == std::string::npos) throw malformed("']' is missing");
      const std::string digits = path.substr(i + 1, close - i - 1);
      if (digits.empty() || digits.size() > 6 || digits.find_first_not_of("0123456789") != std::string::npos)
        throw malformed("an index is not a whole number");
      steps.push_back({{}, std::stoi(digits)});
      i = close + 1;
    }
    if (i == path.size()) break;
    if (path[i] != '.') throw malformed("a '.' is expected after ']'");
    ++i;
  }
  return steps;
}

const SceneNode* find_node(const SceneNode& root, const std::string& path, int* depth, const SceneNode** deepest) {
  const SceneNode* at = &root;
  if (depth) *depth = 0;
  if (deepest) *deepest = at;
  if (path.empty()) return at;
  for (const auto& step : split_scene_path(path)) {
    const SceneNode* next = nullptr;
    if (step.index < 0)
      next = at->find(step.key);
    else if (at->is_array() && step.index < static_cast<int>(at->children.size()))
      next = &at->children[step.index];
    if (!next) return nullptr;
    at = next;
    if (depth) ++*depth;
    if (deepest) *deepest = at;
  }
  return at;
}

void set_node(SceneNode& root, const std::string& path, SceneNode value) {
  SceneNode* at = &root;
  const auto steps = split_scene_path(path);
  for (std::size_t k = 0; k < steps.size(); ++k) {
    const ScenePathStep& step = steps[k];
    if (step.index >= 0) {
      if (!at->is_array() || step.index >= static_cast<int>(at->children.size()))
        throw Error(fmt::format("'{}' cannot be set: there is no item [{}] in {}.", path, step.index, at->describe()));
      at = &at->children[step.index];
      continue;
    }
    if (!at->is_table())
      throw Error(
          fmt::format("'{}' cannot be set: '{}' is looked for in {}, not in a table.", path, step.key, at->describe()));
    SceneNode* next = at->find(step.key);
    if (!next) {
      SceneNode added;
      added.key = step.key;
      added.key_where = added.where = value.where;
      added.inlined = at->inlined || k >= 2;  // only [kind] and [kind.NAME] get headers
      at->children.push_back(std::move(added));
      next = &at->children.back();
    }
    at = next;
  }
  value.key = at->key;
  value.key_where = at->key_where;
  if (value.is_table()) value.inlined = true;
  *at = std::move(value);
}

SceneNode number_node(double value) {
  SceneNode n;
  n.type = SceneNode::Type::number;
  n.number = value;
  return n;
}

SceneNode text_node(const std::string& text) {
  SceneNode n;
  n.type = SceneNode::Type::text;
  n.text = text;
  return n;
}

}  // namespace costate
