// A table of a study as a spreadsheet reads it.
#pragma once

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <sstream>
#include <string>
#include <vector>

namespace costate::test {

struct Table {
  std::vector<std::string> heading;
  std::vector<std::vector<std::string>> rows;

  std::vector<std::string> texts(const std::string& name) const {
    const auto at = std::find(heading.begin(), heading.end(), name);
    INFO(name);
    REQUIRE(at != heading.end());
    std::vector<std::string> x;
    for (const auto& r : rows) x.push_back(r.at(static_cast<std::size_t>(at - heading.begin())));
    return x;
  }
  /// An empty cell is not a number; true is 1, false 0.
  std::vector<double> column(const std::string& name) const {
    std::vector<double> x;
    for (const auto& cell : texts(name))
      x.push_back(cell.empty() ? std::nan("") : cell == "true" ? 1 : cell == "false" ? 0 : std::stod(cell));
    return x;
  }
};

inline Table read_table(const std::string& text) {
  Table t;
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    std::vector<std::string> cells(1);
    bool quoted = false;
    for (const char c : line) {
      if (c == '"')
        quoted = !quoted;
      else if (c == ',' && !quoted)
        cells.emplace_back();
      else
        cells.back() += c;
    }
    if (t.heading.empty())
      t.heading = cells;
    else
      t.rows.push_back(cells);
  }
  return t;
}

}  // namespace costate::test
