#include "study_keys.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"

namespace costate::app::study_keys {

void fail(const SourceLocation& where, const std::string& message) { throw SceneError(where, message); }

void require_known(const SceneNode& table, const std::string& title, const std::vector<std::string>& known) {
  for (const auto& c : table.children)
    if (std::find(known.begin(), known.end(), c.key) == known.end())
      fail(c.key_where, fmt::format("Unknown key '{}' in {}.{}", c.key, title, suggestion(c.key, known)));
}

const SceneNode& require_table(const SceneNode& n, const std::string& title) {
  if (!n.is_table()) fail(n.where, fmt::format("{} must be a table, found {}.", title, n.describe()));
  return n;
}

std::string text_of(const SceneNode& table, const std::string& key, const std::string& title, bool required) {
  const SceneNode* n = table.find(key);
  if (!n && !required) return {};
  if (!n) fail(table.where, fmt::format("{} needs '{}' (a string), which is missing.", title, key));
  if (n->type != SceneNode::Type::text)
    fail(n->where, fmt::format("'{}' in {} must be a string, found {}.", key, title, n->describe()));
  return n->text;
}

std::string word_of(const SceneNode& table, const std::string& key, const std::string& title,
                    const std::vector<std::string>& words, bool required) {
  const std::string word = text_of(table, key, title, required);
  if (word.empty() && !required) return words.front();
  if (std::find(words.begin(), words.end(), word) == words.end())
    fail(table.find(key)->where,
         fmt::format("'{}' in {} must be one of {}, found '{}'.", key, title, fmt::join(words, ", "), word));
  return word;
}

std::vector<std::string> texts_of(const SceneNode& table, const std::string& key, const std::string& title) {
  std::vector<std::string> texts;
  const SceneNode* list = table.find(key);
  if (list == nullptr) return texts;
  if (!list->is_array())
    fail(list->where, fmt::format("'{}' in {} must be an array, found {}.", key, title, list->describe()));
  for (const auto& p : list->children) {
    if (p.type != SceneNode::Type::text)
      fail(p.where, fmt::format("'{}' in {} must hold strings, found {}.", key, title, p.describe()));
    texts.push_back(p.text);
  }
  return texts;
}

double number_of(const SceneNode& table, const std::string& key, const std::string& title) {
  const SceneNode* n = table.find(key);
  if (n == nullptr) fail(table.where, fmt::format("{} needs '{}' (a number), which is missing.", title, key));
  if (!n->is_number() || !std::isfinite(n->as_double()))
    fail(n->where, fmt::format("'{}' in {} must be a finite number, found {}.", key, title, n->describe()));
  return n->as_double();
}

int count_of(const SceneNode& table, const std::string& key, const std::string& title, int least) {
  const double x = number_of(table, key, title);
  if (!(x >= least && x <= kMostPoints) || x != std::floor(x))
    fail(table.find(key)->where,
         fmt::format("'{}' in {} must be an integer from {} to {:g}, found {:g}.", key, title, least, kMostPoints, x));
  return static_cast<int>(x);
}

}  // namespace costate::app::study_keys
