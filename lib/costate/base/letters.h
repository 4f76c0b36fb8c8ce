// Blanks around texts, their letters in capitals, and how many make one of another: ASCII alone, whatever the locale.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace costate {

/// Without blanks at both ends.
inline std::string trimmed(const std::string& text) {
  constexpr const char* blanks = " \t\r\n\v\f";
  const auto first = text.find_first_not_of(blanks), last = text.find_last_not_of(blanks);
  return first == std::string::npos ? "" : text.substr(first, last - first + 1);
}

inline std::string in_capitals(std::string text) {
  for (char& c : text)
    if (c >= 'a' && c <= 'z') c = static_cast<char>(c - 'a' + 'A');
  return text;
}

/// How many letters are to be added, taken away or replaced.
std::size_t edit_distance(std::string_view a, std::string_view b);

}  // namespace costate
