#include "costate/scene/scene_include.h"

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <fnmatch.h>

#include <algorithm>
#include <filesystem>
#include <unordered_map>
#include <utility>

#include "costate/base/stop.h"
#include "costate/base/text_file.h"
#include "costate/scene/scene_files.h"
#include "costate/scene/toml_reader.h"

namespace costate {

namespace {

namespace fs = std::filesystem;

constexpr int kDeepestInclude = 32;
constexpr int kMostFiles = 1000;
constexpr std::size_t kLongestFile = 64 << 20, kLongestScene = 128 << 20;  // bytes

/// What reading a scene has come to.
struct Reading {
  std::vector<std::string> open;  // files, each included by the one before
  int parts = 0, files = 0;
  std::size_t bytes = 0;
};

void set_part(SceneNode& node, int part) {
  node.part = part;
  for (auto& c : node.children) set_part(c, part);
}

/// Takes a list of texts out of the root.
std::vector<std::pair<std::string, SourceLocation>> take_texts(SceneNode& root, const char* key, const char* example) {
  std::vector<std::pair<std::string, SourceLocation>> texts;
  const auto at =
      std::find_if(root.children.begin(), root.children.end(), [&](const SceneNode& c) { return c.key == key; });
  if (at == root.children.end()) return texts;
  const auto wrong = [&](const SceneNode& n) {
    return SceneError(n.where, fmt::format("'{}' must be an array of strings, as in {} = [\"{}\"]; found {}.", key, key,
                                           example, n.describe()));
  };
  if (!at->is_array()) throw wrong(*at);
  for (const auto& item : at->children) {
    if (item.type != SceneNode::Type::text) throw wrong(item);
    texts.emplace_back(item.text, item.where);
  }
  root.children.erase(at);
  return texts;
}

/// Lays `over` on `base`, which keeps its places where both are tables.
void lay_over(SceneNode& base, SceneNode&& over) {
  std::unordered_map<std::string, std::size_t> places;
  for (std::size_t i = 0; i < base.children.size(); ++i) places.emplace(base.children[i].key, i);
  for (auto& child : over.children) {
    const auto place = places.find(child.key);
    SceneNode* below = place == places.end() ? nullptr : &base.children[place->second];
    if (!below)
      base.children.push_back(std::move(child));
    else if (below->is_table() && !below->inlined && child.is_table() && !child.inlined)
      lay_over(*below, std::move(child));
    else
      *below = std::move(child);
  }
}

void remove_node(SceneNode& root, const std::string& path, const SourceLocation& where) {
  const std::size_t dot = path.rfind('.');
  const std::string key = dot == std::string::npos ? path : path.substr(dot + 1);
  SceneNode* parent = &root;
  try {
    for (const auto& step :
         dot == std::string::npos ? std::vector<ScenePathStep>() : split_scene_path(path.substr(0, dot)))
      parent = parent && step.index < 0 ? parent->find(step.key) : nullptr;
  } catch (const Error& e) {
    throw SceneError(where, e.what());
  }
  const auto gone = [&] {
    return parent ? std::find_if(parent->children.begin(), parent->children.end(),
                                 [&](const SceneNode& c) { return c.key == key; })
                  : std::vector<SceneNode>::iterator();
  }();
  if (!parent || gone == parent->children.end()) {
    std::vector<std::string> known;
    if (parent)
      for (const auto& c : parent->children) known.push_back(c.key);
    throw SceneError(where, fmt::format("'{}' is to be removed, but the included files hold no such table or key.{}",
                                        path, suggestion(key, known)));
  }
  parent->children.erase(gone);
  if (parent != &root && parent->children.empty() && dot != std::string::npos && path.find('.') == dot)
    remove_node(root, path.substr(0, dot), where);
}

/// The paths below `node` that fit a pattern in the way of file names, such as "*.*_FR" or "tyre.?R".
void collect_paths(const SceneNode& node, const std::string& pattern, const std::string& path,
                   std::vector<std::string>& found) {
  const std::size_t dot = pattern.find('.');
  for (const auto& c : node.children)
    if (!c.key.empty() && fnmatch(pattern.substr(0, dot).c_str(), c.key.c_str(), 0) == 0) {
      if (dot == std::string::npos)
        found.push_back(path + c.key);
      else
        collect_paths(c, pattern.substr(dot + 1), path + c.key + ".", found);
    }
}

void remove_all(SceneNode& root, const std::string& path, const SourceLocation& where) {
  if (path.find_first_of("*?[") == std::string::npos) return remove_node(root, path, where);
  std::vector<std::string> found;
  collect_paths(root, path, "", found);
  if (found.empty())
    throw SceneError(where, fmt::format("'{}' is to be removed, but nothing in the included files fits it.", path));
  for (const auto& p : found) remove_node(root, p, where);
}

SceneNode read(const std::string& text, const std::string& file_name, Reading& reading) {
  std::vector<std::string>& open = reading.open;
  check_stop();
  SceneNode own = read_toml(text, file_name);
  const auto includes = take_texts(own, "include", "vehicle.toml");
  const auto removed = take_texts(own, "remove", "tyre.front");
  if (!removed.empty() && includes.empty())
    throw SceneError(removed.front().second, "'remove' takes away what 'include' brought, but nothing is included.");
  SceneNode root = own;
  root.children.clear();
  for (const auto& [name, where] : includes) {
    const std::string path = (fs::path(file_name).parent_path() / name).lexically_normal().string();
    if (std::find(open.begin(), open.end(), path) != open.end())
      throw SceneError(where, fmt::format("'{}' includes itself: {} -> {}.", path, fmt::join(open, " -> "), path));
    if (open.size() > kDeepestInclude)
      throw SceneError(where, fmt::format("Files include each other more than {} deep: {} -> ... -> {}.",
                                          kDeepestInclude, open.front(), path));
    if (++reading.files > kMostFiles)
      throw SceneError(
          where,
          fmt::format("The scene includes more than {} files (one that is included twice counts twice).", kMostFiles));
    std::string included;
    try {
      included = read_scene_text(path);
    } catch (const Error& e) {
      throw SceneError(where, fmt::format("'{}' is included here. {}", name, e.what()));
    }
    SceneFileLog::add({"", path, ""});
    reading.bytes += included.size();
    if (reading.bytes > kLongestScene)
      throw SceneError(where,
                       fmt::format("The files of this scene hold more than {} MB together.", kLongestScene >> 20));
    open.push_back(path);
    lay_over(root, read(included, path, reading));
    open.pop_back();
  }
  for (const auto& [path, where] : removed) remove_all(root, path, where);
  set_part(own, reading.parts++);
  lay_over(root, std::move(own));
  return root;
}

}  // namespace

std::string read_scene_text(const std::string& path) {
  std::error_code ignored;
  if (fs::is_directory(path, ignored))
    throw SceneError({path, 0, 0},
                     "This is a directory; expected a scene file, such as models/five_bar/five_bar.toml.");
  return read_text_file(path, kLongestFile, "The scene file");
}

SceneNode read_with_includes(const std::string& text, const std::string& file_name) {
  Reading reading;
  reading.open = {fs::path(file_name).lexically_normal().string()};
  reading.bytes = text.size();
  return read(text, file_name, reading);
}

}  // namespace costate
