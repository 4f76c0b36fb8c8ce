// Formulations, methods and algorithms are asked what they can do: no source outside the one that registers a name
// holds it as a string. Comments and the texts of messages may.
#include <catch2/catch.hpp>
#include <filesystem>
#include <fstream>
#include <map>
#include <set>
#include <string>
#include <vector>

#include "costate/formulation/formulation.h"
#include "costate/optimize/optimizer.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;

TEST_CASE("names of formulations, methods and algorithms are written once") {
  namespace fs = std::filesystem;
  std::set<std::string> names;
  for (const auto& f : formulations()) names.insert(f.name);
  for (const auto& m : sensitivity_methods()) names.insert(m.name);
  for (const auto& a : optimizer_algorithms()) names.insert(a.name);
  REQUIRE(names.size() > 20);
  std::set<std::string> wrong;
  std::map<std::string, int> written;
  const fs::path root = COSTATE_SOURCE_DIR;
  for (const char* tree : {"lib", "solvers", "apps/costate"})
    for (const auto& entry : fs::recursive_directory_iterator(root / tree)) {
      const std::string kind = entry.path().extension().string();
      if (!entry.is_regular_file() || (kind != ".h" && kind != ".cpp")) continue;
      const std::string file = fs::relative(entry.path(), root).string();
      std::ifstream in(entry.path());
      for (std::string line; std::getline(in, line);) {
        const std::string code = line.substr(0, line.find("//"));
        // The fixed steps of a formulation are registered apart, under its name.
        if (code.find("RegisterDiscreteForm ") != std::string::npos || file == "lib/costate/discrete/index3_steps.cpp")
          continue;
        for (const auto& name : names)
          if (code.find("\"" + name + "\"") != std::string::npos && ++written[name] > 1)
            wrong.insert(name + ", again in " + file);
      }
    }
  CHECK(wrong == std::set<std::string>{});
}
