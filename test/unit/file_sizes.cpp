// A source file has one subject, which 400 lines are room enough for; the front page is a door, not the house.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "support/paths.h"

namespace fs = std::filesystem;

namespace {
int lines_of(const fs::path& path) {
  std::ifstream file(path);
  int lines = 0;
  for (std::string line; std::getline(file, line);) ++lines;
  return lines;
}
}  // namespace

TEST_CASE("no source file is longer than 400 lines") {
  constexpr int kMostLines = 400;
  std::vector<std::string> longer;
  int seen = 0;
  for (const char* tree : {"lib", "solvers", "apps", "test"})
    for (const auto& entry : fs::recursive_directory_iterator(fs::path(COSTATE_SOURCE_DIR) / tree)) {
      if (!entry.is_regular_file() || (entry.path().extension() != ".cpp" && entry.path().extension() != ".h"))
        continue;
      ++seen;
      const int lines = lines_of(entry.path());
      if (lines > kMostLines) longer.push_back(fmt::format("{}: {} lines", entry.path().string(), lines));
    }
  CHECK(longer == std::vector<std::string>{});
  CHECK(seen > 700);
}

TEST_CASE("the front page is at most 180 lines") {
  const int lines = lines_of(fs::path(COSTATE_SOURCE_DIR) / "README.md");
  CHECK(lines > 100);
  CHECK(lines <= 180);
}
