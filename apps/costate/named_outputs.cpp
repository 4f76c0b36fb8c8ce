#include "named_outputs.h"

#include <algorithm>

#include "costate/objective/output.h"
#include "costate/scene/toml_reader.h"

namespace costate::app {

namespace {

/// Collects the texts below a node that name outputs: "P2.x", or "output:P2.x" as the target of another. Whatever kind
/// a term of the cost is, its outputs are found.
void collect(const SceneNode& node, const std::vector<std::string>& known, std::vector<std::string>& found) {
  if (node.type == SceneNode::Type::text && node.key != "kind" && node.key != "name") {
    const std::string prefix = "output:";
    const std::string name = node.text.rfind(prefix, 0) == 0 ? node.text.substr(prefix.size()) : node.text;
    if (std::find(known.begin(), known.end(), name) != known.end()) found.push_back(name);
  }
  for (const SceneNode& child : node.children) collect(child, known, found);
}

}  // namespace

std::vector<std::string> outputs_of_interest(const Scene& scene) {
  const SceneNode root = read_toml(scene.dump(), scene.file_name());
  const auto known = output_names(*scene.mechanism());
  std::vector<std::string> found;
  if (const SceneNode* cost = root.find("cost")) collect(*cost, known, found);
  found.insert(found.end(), scene.run.outputs.begin(), scene.run.outputs.end());
  if (const SceneNode* constraints = find_node(root, "optimize.constraint")) collect(*constraints, known, found);
  std::vector<std::string> names;
  for (const auto& name : found)
    if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  return names;
}

std::string output_of_column(const Column& c) {
  return c.group == "velocities"      ? c.name + "_dot"
         : c.group == "accelerations" ? c.name + "_ddot"
         : c.group == "multipliers"   ? "lambda." + c.name
         : c.group == "states"        ? "z." + c.name
                                      : c.name;
}

const Column* column_of_output(const TrajectoryTable& table, const std::string& output) {
  for (const Column& c : table.columns)
    if (output_of_column(c) == output) return &c;
  return nullptr;
}

}  // namespace costate::app
