// The folders of the library and of the solvers are floors: no include runs from a lower one to a higher one.
#include <fmt/format.h>

#include <algorithm>
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <regex>
#include <string>
#include <vector>

#include "support/paths.h"

namespace {
namespace fs = std::filesystem;

// From the ground up, as lib/README.md and solvers/README.md list them.
const std::vector<std::string> kLibrary{"base",      "derivative", "linear", "element", "mechanism", "assembly",
                                        "objective", "analysis",   "level",  "event",   "adjoint",   "formulation",
                                        "candidate", "discrete",   "scene",  "kind"};
const std::vector<std::string> kSolvers{"record",      "sundials", "problem",   "integrator", "hessian", "cycle",
                                        "sensitivity", "fit",      "candidate", "optimize",   "tradeoff"};

// All #include "costate/FOLDER/..." of a tree that break the order, as "file: include".
std::vector<std::string> upward(const fs::path& tree, const std::vector<std::string>& floors,
                                const std::vector<std::string>& below, int& seen) {
  const auto floor = [&](const std::string& folder) {
    const auto at = std::find(floors.begin(), floors.end(), folder);
    return at == floors.end() ? -1 : static_cast<int>(at - floors.begin());
  };
  static const std::regex include("^#include \"costate/([a-z_0-9]+)/([^\"]+)\"");
  std::vector<std::string> wrong;
  for (const auto& entry : fs::recursive_directory_iterator(tree)) {
    if (!entry.is_regular_file()) continue;
    const std::string folder = fs::relative(entry.path(), tree).begin()->string();
    const int own = floor(folder);
    if (own < 0) wrong.push_back(fmt::format("{}: a folder that is no floor", entry.path().string()));
    std::ifstream file(entry.path());
    std::smatch m;
    for (std::string line; std::getline(file, line);) {
      if (!std::regex_search(line, m, include)) continue;
      ++seen;
      // Two floors of the same name (candidate): that of the tree where the file is.
      const bool here = fs::exists(tree / m[1].str() / m[2].str());
      const int other = floor(m[1]);
      const bool known = here ? other >= 0 : std::find(below.begin(), below.end(), m[1]) != below.end();
      if (!known || (here && other > own)) wrong.push_back(fmt::format("{}: {}", entry.path().string(), line));
    }
  }
  return wrong;
}
}  // namespace

TEST_CASE("no include runs from a lower floor to a higher one") {
  const fs::path root = COSTATE_SOURCE_DIR;
  int seen = 0;
  CHECK(upward(root / "lib/costate", kLibrary, {}, seen) == std::vector<std::string>{});
  CHECK(seen > 500);
  seen = 0;
  CHECK(upward(root / "solvers/costate", kSolvers, kLibrary, seen) == std::vector<std::string>{});
  CHECK(seen > 200);
}
