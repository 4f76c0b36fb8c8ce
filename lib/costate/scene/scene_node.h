// A scene file as an ordered tree of tables, arrays and values, each with its place in the file. What the
// file format's library reads is copied into this tree, so that nothing else depends on that library.
#pragma once

#include <cstdint>
#include <limits>
#include <string>
#include <variant>
#include <vector>

#include "costate/base/error.h"

namespace costate {

struct SceneNode {
  enum class Type { table, array, text, integer, number, flag, date };

  Type type = Type::table;
  std::string key;           // empty for array items and the root
  SourceLocation key_where;  // of the key; of the item itself inside arrays
  SourceLocation where;      // of the value; of its header for a table
  bool inlined = false;      // a table in braces
  int part = 0;              // which file, of a scene that includes others: they count in the order of reading
  std::string text;          // of a text or a date
  std::int64_t integer = 0;
  double number = 0;
  bool flag = false;
  std::vector<SceneNode> children;  // of a table or an array, in the order of the file

  bool is_table() const { return type == Type::table; }
  bool is_array() const { return type == Type::array; }
  bool is_number() const { return type == Type::number || type == Type::integer; }
  /// An array whose items are all tables with a header of their own: [[name]].
  bool is_table_array() const;
  double as_double() const { return type == Type::integer ? static_cast<double>(integer) : number; }

  const SceneNode* find(std::string_view child) const;
  SceneNode* find(std::string_view child);

  /// "the string \"x\"", "the number 3", "a table": for messages.
  std::string describe() const;
};

/// One step of a dotted path: a key, or an index into an array.
struct ScenePathStep {
  std::string key;
  int index = -1;  // >= 0: an item of an array
};

/// "cost.running[0].weight" -> cost, running, [0], weight. Throws Error for malformed paths.
std::vector<ScenePathStep> split_scene_path(const std::string& path);

/// The node at a path, or null; `depth` tells how many steps were found.
const SceneNode* find_node(const SceneNode& root, const std::string& path, int* depth = nullptr,
                           const SceneNode** deepest = nullptr);

/// Replaces the value at a path, adding keys and tables as needed (array items must exist).
void set_node(SceneNode& root, const std::string& path, SceneNode value);

SceneNode number_node(double value);
SceneNode text_node(const std::string& text);

}  // namespace costate
