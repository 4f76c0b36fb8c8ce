#include "costate/scene/scene_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <unordered_map>
#include <unordered_set>

#include "costate/scene/key_recorder.h"
#include "costate/scene/key_reference.h"
#include "costate/scene/scene_node.h"

namespace costate {

/// The keys of this table that were asked for, and the same of every table inside that was read.
struct SceneTable::Record {
  std::vector<std::string> asked;
  std::unordered_set<std::string> was_asked;
  std::vector<SceneTable> inner;
  std::unordered_map<const SceneNode*, std::size_t> inner_place;  // of those by key
  std::unordered_map<std::string_view, const SceneNode*> child;   // of a table with many keys
};

namespace {
constexpr std::size_t kManyKeys = 32;

/// For the reference of keys, while one is made.
template <class Default>
void record(const std::string& path, const std::string& key, const std::string& what, bool may_be_missing,
            const Default& default_value, NumberRule rule = NumberRule::any) {
  if (KeyRecorder* r = KeyRecorder::current()) r->add(path, key, what, may_be_missing, default_value(), rule);
}
const auto no_default = [] { return std::string(); };
}  // namespace

SceneTable::SceneTable(const SceneNode& root) : SceneTable(root, "", std::make_shared<Record>()) {}

SceneTable::SceneTable(const SceneNode& node, std::string path, std::shared_ptr<Record> record)
    : node_(&node), path_(std::move(path)), record_(std::move(record)) {
  if (node.is_table() && node.children.size() > kManyKeys)
    for (const auto& c : node.children) record_->child.emplace(c.key, &c);
}

std::string SceneTable::title() const { return path_.empty() ? "the scene" : "[" + path_ + "]"; }

SourceLocation SceneTable::where() const { return node_->where; }

int SceneTable::part() const { return node_->part; }

SourceLocation SceneTable::where(const std::string& key) const {
  const SceneNode* n = node_->find(key);
  return n ? n->where : node_->where;
}

void SceneTable::fail(const std::string& key, const std::string& message) const {
  throw SceneError(where(key), fmt::format("'{}' in {} {}", key, title(), message));
}

void SceneTable::fail(const std::string& message) const {
  throw SceneError(where(), fmt::format("{} {}", title(), message));
}

void SceneTable::fail_type(const std::string& key, const std::string& expected) const {
  wrong_type(*node_->find(key), key, expected);
}

const SceneNode* SceneTable::ask(const std::string& key) const {
  if (record_->was_asked.insert(key).second) record_->asked.push_back(key);
  if (record_->child.empty()) return node_->find(key);
  const auto at = record_->child.find(key);
  return at == record_->child.end() ? nullptr : at->second;
}

void SceneTable::missing(const std::string& key, const char* what) const {
  // A key nobody has asked for whose name is almost the missing one, or the same without its unit, is a slip.
  const auto alike = [](std::string s) {  // x_m and y_m are no slips of each other
    std::replace(s.begin(), s.end(), 'y', 'x');
    return s;
  };
  std::vector<std::string> others;
  for (const auto& c : node_->children) {
    if (record_->was_asked.count(c.key) > 0) continue;
    if (key.rfind(c.key + "_", 0) == 0 || c.key.rfind(key + "_", 0) == 0) unknown(c, false, key);
    if (c.key.size() > 4 && alike(c.key) != alike(key)) others.push_back(c.key);
  }
  const std::string near = nearest_name(key, others);
  if (!near.empty()) unknown(*node_->find(near), false, key);
  throw SceneError(where(),
                   fmt::format("{} needs '{}' ({}), which is missing.{}", title(), key, what, also_needed(path_, key)));
}

const SceneNode& SceneTable::require(const std::string& key, const char* what) const {
  record(path_, key, what, false, no_default);
  const SceneNode* n = ask(key);
  if (!n) missing(key, what);
  return *n;
}

void SceneTable::wrong_type(const SceneNode& node, const std::string& key, const std::string& expected) const {
  throw SceneError(node.where,
                   fmt::format("'{}' in {} must be {}, found {}.", key, title(), expected, node.describe()));
}

double SceneTable::checked(const SceneNode& node, const std::string& key, NumberRule rule) const {
  if (!node.is_number()) wrong_type(node, key, "a number");
  const double x = node.as_double();
  if (const char* wrong = violation(rule, x))
    throw SceneError(node.where, fmt::format("'{}' in {} {}, found {}.", key, title(), wrong, x));
  return x;
}

bool SceneTable::has(const std::string& key) const {
  record(path_, key, "", true, no_default);
  return ask(key) != nullptr;
}

bool SceneTable::is_number(const std::string& key) const {
  const SceneNode* n = ask(key);
  return n && n->is_number();
}

bool SceneTable::is_text(const std::string& key) const {
  const SceneNode* n = ask(key);
  return n && n->type == SceneNode::Type::text;
}

bool SceneTable::is_table(const std::string& key) const {
  const SceneNode* n = ask(key);
  return n && n->is_table();
}

int SceneTable::number(const std::string& key, MechanismBuilder& builder, NumberRule rule,
                       std::optional<double> default_value) {
  return builder.add_number(path(key), value(key, rule, default_value));
}

std::vector<int> SceneTable::numbers(const std::string& key, MechanismBuilder& builder, NumberRule rule) {
  std::vector<int> r;
  const auto x = values(key, rule);
  for (std::size_t i = 0; i < x.size(); ++i) r.push_back(builder.add_number(fmt::format("{}[{}]", path(key), i), x[i]));
  return r;
}

double SceneTable::value(const std::string& key, NumberRule rule, std::optional<double> default_value) {
  record(
      path_, key, "a number", default_value.has_value(),
      [&] { return default_value ? fmt::format("{:g}", *default_value) : ""; }, rule);
  const SceneNode* n = ask(key);
  if (!n && default_value) return *default_value;
  if (!n) missing(key, "a number");
  return checked(*n, key, rule);
}

std::optional<double> SceneTable::find_value(const std::string& key, NumberRule rule) {
  record(path_, key, "a number", true, no_default, rule);
  const SceneNode* n = ask(key);
  if (!n) return {};
  return checked(*n, key, rule);
}

int SceneTable::whole_number(const std::string& key, int default_value) {
  record(path_, key, "a whole number", true, [&] { return fmt::format("{}", default_value); });
  const SceneNode* n = ask(key);
  if (!n) return default_value;
  if (n->type != SceneNode::Type::integer || n->integer < 0 || n->integer > 1000000000)
    wrong_type(*n, key, "a whole number");
  return static_cast<int>(n->integer);
}

std::string SceneTable::text(const std::string& key, const std::optional<std::string>& default_value) {
  record(path_, key, "a string", default_value.has_value(),
         [&] { return default_value && !default_value->empty() ? fmt::format("\"{}\"", *default_value) : ""; });
  const SceneNode* n = ask(key);
  if (!n && default_value) return *default_value;
  if (!n) missing(key, "a string");
  if (n->type != SceneNode::Type::text) wrong_type(*n, key, "a string");
  return n->text;
}

std::string SceneTable::one_of(const std::string& key, const std::vector<std::string>& allowed,
                               const std::optional<std::string>& default_value) {
  if (KeyRecorder::current()) record(path_, key, fmt::format("one of {}", fmt::join(allowed, ", ")), false, no_default);
  const std::string found = text(key, default_value);
  if (std::find(allowed.begin(), allowed.end(), found) != allowed.end()) return found;
  const std::string near = nearest_name(found, allowed);
  fail(key, fmt::format("must be one of {}, found \"{}\".{}", fmt::join(allowed, ", "), found,
                        near.empty() ? "" : fmt::format(" Did you mean '{}'?", near)));
}

bool SceneTable::flag(const std::string& key, bool default_value) {
  record(path_, key, "true or false", true, [&] { return default_value ? "true" : "false"; });
  const SceneNode* n = ask(key);
  if (!n) return default_value;
  if (n->type != SceneNode::Type::flag) wrong_type(*n, key, "true or false");
  return n->flag;
}

std::vector<double> SceneTable::values(const std::string& key, NumberRule rule) {
  const SceneNode& n = require(key, "an array of numbers");
  if (!n.is_array()) wrong_type(n, key, "an array of numbers");
  std::vector<double> r;
  for (std::size_t i = 0; i < n.children.size(); ++i)
    r.push_back(checked(n.children[i], fmt::format("{}[{}]", key, i), rule));
  return r;
}

std::vector<std::vector<double>> SceneTable::value_rows(const std::string& key, NumberRule rule) {
  const char* what = "an array of arrays of numbers";
  const SceneNode& n = require(key, what);
  if (!n.is_array()) wrong_type(n, key, what);
  std::vector<std::vector<double>> r;
  for (std::size_t i = 0; i < n.children.size(); ++i) {
    const std::string item = fmt::format("{}[{}]", key, i);
    if (!n.children[i].is_array()) wrong_type(n.children[i], item, "an array of numbers");
    auto& row = r.emplace_back();
    for (std::size_t k = 0; k < n.children[i].children.size(); ++k)
      row.push_back(checked(n.children[i].children[k], fmt::format("{}[{}]", item, k), rule));
  }
  return r;
}

std::vector<std::string> SceneTable::texts(const std::string& key, bool required) {
  record(path_, key, "an array of strings", !required, no_default);
  const SceneNode* n = ask(key);
  if (!n && !required) return {};
  if (!n) missing(key, "an array of strings");
  if (!n->is_array()) wrong_type(*n, key, "an array of strings");
  std::vector<std::string> r;
  for (std::size_t i = 0; i < n->children.size(); ++i) {
    const SceneNode& item = n->children[i];
    if (item.type != SceneNode::Type::text) wrong_type(item, fmt::format("{}[{}]", key, i), "a string");
    r.push_back(item.text);
  }
  return r;
}

std::pair<std::string, std::string> SceneTable::text_pair(const std::string& key) {
  const auto r = texts(key);
  if (r.size() != 2) fail(key, fmt::format("must hold two names, found {}.", r.size()));
  return {r[0], r[1]};
}

SceneTable SceneTable::table(const std::string& key) {
  const SceneNode& n = require(key, "a table");
  if (!n.is_table()) wrong_type(n, key, "a table");
  const auto [at, is_new] = record_->inner_place.emplace(&n, record_->inner.size());
  if (!is_new) return record_->inner[at->second];
  record_->inner.push_back(SceneTable(n, path(key), std::make_shared<Record>()));
  return record_->inner.back();
}

std::vector<SceneTable> SceneTable::tables(const std::string& key) {
  record(path_, key, "an array of tables", true, no_default);
  const SceneNode* n = ask(key);
  if (!n) return {};
  if (!n->is_array()) wrong_type(*n, key, fmt::format("an array of tables, each with the header [[{}]]", path(key)));
  std::vector<SceneTable> r;
  for (std::size_t i = 0; i < n->children.size(); ++i) {
    if (!n->children[i].is_table()) wrong_type(n->children[i], fmt::format("{}[{}]", key, i), "a table");
    r.push_back(SceneTable(n->children[i], fmt::format("{}[{}]", path(key), i), std::make_shared<Record>()));
    record_->inner.push_back(r.back());
  }
  return r;
}

std::vector<std::string> SceneTable::keys() const {
  std::vector<std::string> r;
  for (const auto& c : node_->children) r.push_back(c.key);
  return r;
}

std::vector<std::string> SceneTable::known_keys() const { return record_->asked; }

void SceneTable::unknown(const SceneNode& node, bool all_asked, const std::string& meant) const {
  const auto& known = record_->asked;
  const std::string near = meant.empty() ? nearest_name(node.key, known) : meant;
  throw SceneError(node.key_where,
                   fmt::format("Unknown key '{}' in {}.{}{}", node.key, title(),
                               near.empty() ? "" : fmt::format(" Did you mean '{}'?", near),
                               all_asked ? fmt::format(" Known here: {}.", fmt::join(known, ", ")) : ""));
}

void SceneTable::finish() const {
  for (const auto& c : node_->children)
    if (record_->was_asked.count(c.key) == 0) unknown(c, true);
  for (const SceneTable& t : record_->inner) t.finish();
}

}  // namespace costate
