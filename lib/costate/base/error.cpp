#include "costate/base/error.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <numeric>

namespace costate {

namespace {
std::string located(const SourceLocation& w, const std::string& message) {
  if (w.line > 0) return fmt::format("{}:{}:{}: {}", w.file, w.line, w.column, message);
  if (!w.file.empty()) return fmt::format("{}: {}", w.file, message);
  return message;
}

std::size_t edit_distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), std::size_t{0});
  for (std::size_t i = 1; i <= a.size(); ++i) {
    std::size_t diagonal = row[0];
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const std::size_t above = row[j];
      const std::size_t cost = a[i - 1] == b[j - 1] ? 0 : 1;
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, diagonal + cost});
      diagonal = above;
    }
  }
  return row.back();
}
}  // namespace

SceneError::SceneError(const SourceLocation& where, const std::string& message)
    : Error(located(where, message)), where_(where) {}

ModelError::ModelError(std::string subject, const std::string& message)
    : Error(subject.empty() ? message : subject + ": " + message), subject_(std::move(subject)), message_(message) {}

namespace {
/// The candidate that says the same by another word for it, or empty: keys, coordinates and outputs each have their
/// own; "crank" for "crank.angle".
std::string synonym(const std::string& name, const std::vector<std::string>& candidates) {
  const auto is_there = [&](const std::string& text) {
    return std::find(candidates.begin(), candidates.end(), text) != candidates.end();
  };
  if (const std::string owner = name.substr(0, name.rfind('.')); owner != name && is_there(owner)) return owner;
  constexpr std::string_view words[] = {"omega", "angular_velocity", "angle_dot", "angle"};
  for (const std::string_view word : words) {
    const std::size_t at = name.find(word);
    if (at == std::string::npos) continue;
    for (const std::string_view other : words) {
      std::string same = name;
      same.replace(at, word.size(), other);
      if (is_there(same)) return same;
    }
  }
  return {};
}
}  // namespace

std::string nearest_name(std::string_view name, const std::vector<std::string>& candidates) {
  if (const std::string same = synonym(std::string(name), candidates); !same.empty()) return same;
  std::string best;
  std::size_t best_distance = std::max<std::size_t>(2, name.size() / 3) + 1;
  for (const auto& c : candidates) {
    const std::size_t d = edit_distance(name, c);
    if (d < best_distance && d < std::max(name.size(), c.size())) {  // 'Q' is not near 'A'
      best_distance = d;
      best = c;
    }
  }
  return best;
}

std::string suggestion(std::string_view name, const std::vector<std::string>& candidates) {
  const std::string near = nearest_name(name, candidates);
  if (!near.empty()) return fmt::format(" Did you mean '{}'?", near);
  if (candidates.empty()) return {};
  std::vector<std::string> own;  // "crank.angle", "crank.angle_dot" of "crank"
  for (const auto& c : candidates)
    if (c.starts_with(std::string(name) + ".")) own.push_back(c);
  if (own.size() == 1) return fmt::format(" Did you mean '{}'?", own.front());
  if (!own.empty() && own.size() <= 12) return fmt::format(" Did you mean one of {}?", fmt::join(own, ", "));
  constexpr std::size_t limit = 24;
  if (candidates.size() <= limit) return fmt::format(" Known: {}.", fmt::join(candidates, ", "));
  return fmt::format(" Known: {}, ... ({} in all).", fmt::join(candidates.begin(), candidates.begin() + limit, ", "),
                     candidates.size());
}

}  // namespace costate
