#include "fleet.h"

#include <fmt/format.h>

#include <set>

#include "costate/scene/scene_node.h"
#include "costate/scene/toml_reader.h"
#include "costate/scene/toml_writer.h"

namespace costate::bench {

namespace {

using Names = std::set<std::string, std::less<>>;

bool is_shared(const std::string& table) { return table == "gravity" || table == "run" || table == "formulation"; }

bool is_left_out(const std::string& table) { return table == "parameter" || table == "optimize"; }

/// The names of all [kind.NAME].
Names names_of(const SceneNode& root) {
  Names names;
  for (const SceneNode& kind : root.children) {
    if (!kind.is_table() || is_shared(kind.key) || is_left_out(kind.key) || kind.key == "start" || kind.key == "cost")
      continue;
    for (const SceneNode& element : kind.children) names.insert(element.key);
  }
  return names;
}

void rename_texts(SceneNode& node, const Names& names, const std::string& prefix) {
  if (node.type == SceneNode::Type::text && node.key != "kind" && node.key != "model" &&
      names.contains(node.text.substr(0, node.text.find('.'))))
    node.text = prefix + node.text;
  for (SceneNode& child : node.children) rename_texts(child, names, prefix);
}

/// The items of arrays of `from` behind those of the same arrays of `to`, in tables within tables likewise.
void append_lists(SceneNode& to, const SceneNode& from) {
  for (const SceneNode& child : from.children) {
    SceneNode* same = to.find(child.key);
    if (!same) {
      to.children.push_back(child);
    } else if (child.is_array()) {
      same->children.insert(same->children.end(), child.children.begin(), child.children.end());
    } else if (child.is_table()) {
      append_lists(*same, child);
    }
  }
}

}  // namespace

Scene make_fleet(const Scene& one, int count) {
  const SceneNode source = read_toml(one.dump(), one.file_name());
  const Names names = names_of(source);
  SceneNode fleet;
  for (int i = 0; i < count; ++i) {
    const std::string prefix = fmt::format("v{}_", i);
    for (const SceneNode& table : source.children) {
      if (is_left_out(table.key)) continue;
      SceneNode* same = fleet.find(table.key);
      if (!table.is_table() || is_shared(table.key)) {
        if (!same) fleet.children.push_back(table);
        continue;
      }
      SceneNode copy = table;
      rename_texts(copy, names, prefix);
      const bool listed = table.key == "start" || table.key == "cost";
      if (!listed)
        for (SceneNode& element : copy.children) element.key = prefix + element.key;
      if (!same) {
        fleet.children.push_back(std::move(copy));
      } else if (listed) {
        append_lists(*same, copy);
      } else {
        for (SceneNode& element : copy.children) same->children.push_back(std::move(element));
      }
    }
    if (i == 0)
      if (SceneNode* run = fleet.find("run"))
        std::erase_if(run->children, [](const SceneNode& n) { return n.key == "parameters" || n.key == "outputs"; });
  }
  return Scene::parse(write_toml(fleet), one.file_name());
}

}  // namespace costate::bench
