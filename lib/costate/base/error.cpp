#include "costate/base/error.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <iterator>

#include "costate/base/letters.h"

namespace costate {

namespace {
std::string located(const SourceLocation& w, const std::string& message) {
  if (w.line > 0) return fmt::format("{}:{}:{}: {}", w.file, w.line, w.column, message);
  if (!w.file.empty()) return fmt::format("{}: {}", w.file, message);
  return message;
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
  // An output by the path of its element: "force.f.work" of "f.work".
  if (const auto dot = name.find('.'); dot != std::string_view::npos)
    if (const auto rest = std::find(candidates.begin(), candidates.end(), name.substr(dot + 1));
        rest != candidates.end())
      return *rest;
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
  const auto of = [&](const std::string& element) {
    std::vector<std::string> list;
    std::copy_if(candidates.begin(), candidates.end(), std::back_inserter(list),
                 [&](const std::string& c) { return c.starts_with(element + "."); });
    return list;
  };
  std::vector<std::string> own = of(std::string(name));  // "crank.angle", "crank.angle_dot" of "crank"
  if (const auto dot = name.rfind('.'); own.empty() && dot != std::string_view::npos)
    own = of(std::string(name.substr(0, dot)));  // and of "crank.force"
  if (own.size() == 1) return fmt::format(" Did you mean '{}'?", own.front());
  if (!own.empty() && own.size() <= 12) return fmt::format(" Did you mean one of {}?", fmt::join(own, ", "));
  constexpr std::size_t limit = 24;
  if (candidates.size() <= limit) return fmt::format(" Known: {}.", fmt::join(candidates, ", "));
  return fmt::format(" Known: {}, ... ({} in all).", fmt::join(candidates.begin(), candidates.begin() + limit, ", "),
                     candidates.size());
}

}  // namespace costate
