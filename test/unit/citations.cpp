// lib/README.md numbers its sections and equations; comments cite them by these numbers.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <regex>
#include <set>
#include <string>
#include <vector>

#include "support/paths.h"

namespace {
namespace fs = std::filesystem;

struct Page {
  std::vector<int> sections;                   // "### (3) ..."
  std::vector<std::pair<int, int>> equations;  // "(3.2)" at the beginning of a line of a block
};

Page read_page(const fs::path& file) {
  Page page;
  std::ifstream in(file);
  const std::regex section("^### \\((\\d+)\\) "), equation("^\\((\\d+)\\.(\\d+)\\)");
  bool block = false;
  std::smatch m;
  for (std::string line; std::getline(in, line);) {
    if (line.rfind("```", 0) == 0) block = !block;
    if (!block && std::regex_search(line, m, section)) page.sections.push_back(std::stoi(m[1]));
    if (block && std::regex_search(line, m, equation)) page.equations.emplace_back(std::stoi(m[1]), std::stoi(m[2]));
  }
  return page;
}

}  // namespace

TEST_CASE("the notation's sections and equations are in order and complete") {
  const Page page = read_page(fs::path(COSTATE_SOURCE_DIR) / "lib/README.md");
  REQUIRE(page.sections.size() > 15);
  for (std::size_t i = 0; i < page.sections.size(); ++i) CHECK(page.sections[i] == static_cast<int>(i));
  REQUIRE(page.equations.size() > 80);
  std::pair<int, int> last{-1, 0};
  for (const auto& e : page.equations) {
    INFO(fmt::format("({}.{}) after ({}.{})", e.first, e.second, last.first, last.second));
    CHECK((e.first == last.first ? e.second == last.second + 1 : e.first > last.first && e.second == 1));
    last = e;
  }
}

TEST_CASE("every equation that a comment cites exists") {
  const fs::path root = COSTATE_SOURCE_DIR;
  const Page page = read_page(root / "lib/README.md");
  const std::set<std::pair<int, int>> equations(page.equations.begin(), page.equations.end());
  const std::set<int> sections(page.sections.begin(), page.sections.end());
  const std::regex cited("(^|[^A-Za-z0-9_>\\]])\\((\\d{1,2})\\.(\\d{1,2})\\)"),
      section("README\\.md,? \\((\\d{1,2})\\)");
  int seen = 0;
  std::vector<std::string> wrong;
  const auto look = [&](const fs::path& file, int number, const std::string& text) {
    for (std::sregex_iterator i(text.begin(), text.end(), cited), end; i != end; ++i, ++seen)
      if (equations.count({std::stoi((*i)[2]), std::stoi((*i)[3])}) == 0)
        wrong.push_back(fmt::format("{}:{}: ({}.{})", file.string(), number, (*i)[2].str(), (*i)[3].str()));
    for (std::sregex_iterator i(text.begin(), text.end(), section), end; i != end; ++i, ++seen)
      if (sections.count(std::stoi((*i)[1])) == 0)
        wrong.push_back(fmt::format("{}:{}: ({})", file.string(), number, (*i)[1].str()));
  };
  for (const char* tree : {"lib", "solvers", "apps", "test"})
    for (const auto& entry : fs::recursive_directory_iterator(root / tree)) {
      const std::string kind = entry.path().extension().string();
      if (!entry.is_regular_file() || (kind != ".h" && kind != ".cpp")) continue;
      std::ifstream in(entry.path());
      int number = 0;
      for (std::string line; std::getline(in, line);) {
        ++number;
        if (const std::size_t comment = line.find("//"); comment != std::string::npos)
          look(entry.path(), number, line.substr(comment));
      }
    }
  // The page itself, where it speaks of its own equations.
  std::ifstream in(root / "lib/README.md");
  int number = 0;
  for (std::string line; std::getline(in, line);) look("lib/README.md", ++number, line);
  CHECK(wrong == std::vector<std::string>{});
  CHECK(seen > 100);
}
