// A view of one table of a scene file with typed getters. It remembers which keys were asked for, so that
// finish() can refuse the others; every complaint carries file:line:column, what was expected and what is
// there.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "costate/base/error.h"
#include "costate/mechanism/builder.h"
#include "costate/mechanism/number_rule.h"

namespace costate {

struct SceneNode;

class SceneTable {
 public:
  /// The root of a file; the node must outlive every view.
  explicit SceneTable(const SceneNode& root);

  /// "spring.S1", "cost.running[0]"; empty for the root.
  const std::string& path() const { return path_; }
  std::string path(const std::string& key) const { return path_.empty() ? key : path_ + "." + key; }
  SourceLocation where() const;
  /// Which of the files that a scene is made of (scene_include.h).
  int part() const;
  /// Of a key's value, or of the table when the key is absent.
  SourceLocation where(const std::string& key) const;

  // Presence and type of a key. These count as asking for it.
  bool has(const std::string& key) const;
  bool is_number(const std::string& key) const;
  bool is_text(const std::string& key) const;
  bool is_table(const std::string& key) const;

  /// Registers a number of the scene under its path and returns its index in the mechanism.
  int number(const std::string& key, MechanismBuilder& builder, NumberRule rule = NumberRule::any,
             std::optional<double> default_value = {});
  /// Registers an array of numbers: "path.key[0]", ...
  std::vector<int> numbers(const std::string& key, MechanismBuilder& builder, NumberRule rule = NumberRule::any);

  double value(const std::string& key, NumberRule rule = NumberRule::any, std::optional<double> default_value = {});
  std::optional<double> find_value(const std::string& key, NumberRule rule = NumberRule::any);
  int whole_number(const std::string& key, int default_value);
  std::string text(const std::string& key, const std::optional<std::string>& default_value = {});
  std::string one_of(const std::string& key, const std::vector<std::string>& allowed,
                     const std::optional<std::string>& default_value = {});
  bool flag(const std::string& key, bool default_value);
  std::vector<double> values(const std::string& key, NumberRule rule = NumberRule::any);
  /// An array of arrays of numbers.
  std::vector<std::vector<double>> value_rows(const std::string& key, NumberRule rule = NumberRule::any);
  /// Empty when the key is absent and not required.
  std::vector<std::string> texts(const std::string& key, bool required = true);
  /// An array of exactly two strings.
  std::pair<std::string, std::string> text_pair(const std::string& key);

  SceneTable table(const std::string& key);
  /// The tables of an array of tables; empty when the key is absent.
  std::vector<SceneTable> tables(const std::string& key);
  /// All keys in the order of the file (this asks for none of them).
  std::vector<std::string> keys() const;
  /// The keys that were asked for, present or not.
  std::vector<std::string> known_keys() const;

  /// Refuses every key of this table, and of the tables in it that were read, that nobody asked for.
  void finish() const;

  /// Throws SceneError at a key's value (or at the table): "[spring.S1] message" or "'key' in [spring.S1]
  /// message".
  [[noreturn]] void fail(const std::string& key, const std::string& message) const;
  [[noreturn]] void fail(const std::string& message) const;
  /// "'key' in [spring.S1] must be (expected), found (what is there)." The key must be present.
  [[noreturn]] void fail_type(const std::string& key, const std::string& expected) const;

 private:
  struct Record;
  SceneTable(const SceneNode& node, std::string path, std::shared_ptr<Record> record);
  const SceneNode* ask(const std::string& key) const;
  const SceneNode& require(const std::string& key, const char* what) const;
  [[noreturn]] void missing(const std::string& key, const char* what) const;
  [[noreturn]] void unknown(const SceneNode& node, bool all_asked, const std::string& meant = {}) const;
  [[noreturn]] void wrong_type(const SceneNode& node, const std::string& key, const std::string& expected) const;
  double checked(const SceneNode& node, const std::string& key, NumberRule rule) const;
  std::string title() const;  // "[spring.S1]" or "the scene"

  const SceneNode* node_;
  std::string path_;
  std::shared_ptr<Record> record_;
};

}  // namespace costate
