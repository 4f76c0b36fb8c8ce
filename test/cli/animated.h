// What tests of animations read: bytes inside text, and the coordinates of a stored run.
#pragma once

#include <catch2/catch.hpp>
#include <sstream>
#include <string>
#include <vector>

namespace costate::test {

/// Bytes from base64.
inline std::string decoded(const std::string& text) {
  const std::string digits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string bytes;
  unsigned word = 0;
  int bits = 0;
  for (const char c : text) {
    const auto digit = digits.find(c);
    if (digit == std::string::npos) break;
    word = word << 6 | static_cast<unsigned>(digit);
    bits += 6;
    if (bits < 8) continue;
    bits -= 8;
    bytes += static_cast<char>(word >> bits & 0xff);
  }
  return bytes;
}

/// The numbers of a coordinate in a trajectory as CSV.
inline std::vector<double> csv_column(const std::string& text, const std::string& name) {
  std::istringstream lines(text);
  std::string line, cell;
  std::vector<double> values;
  std::size_t at = std::string::npos;
  while (std::getline(lines, line)) {
    if (line.empty() || line[0] == '#') continue;
    std::vector<std::string> cells;
    for (std::istringstream row(line); std::getline(row, cell, ',');) cells.push_back(cell);
    if (at == std::string::npos) {
      for (std::size_t i = 0; i < cells.size(); ++i)
        if (cells[i].rfind("coordinates/" + name + " ", 0) == 0) at = i;
      REQUIRE(at != std::string::npos);
    } else {
      values.push_back(std::stod(cells.at(at)));
    }
  }
  return values;
}

}  // namespace costate::test
