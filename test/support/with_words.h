// Scenes as text with gaps to fill.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace costate::test {

/// The text with each of the first words replaced by the second, wherever it stands.
inline std::string with_words(std::string text, const std::vector<std::pair<std::string, std::string>>& with) {
  for (const auto& [from, to] : with)
    for (std::size_t at = text.find(from); at != std::string::npos; at = text.find(from, at + to.size()))
      text.replace(at, from.size(), to);
  return text;
}

}  // namespace costate::test
