// Commands that run on all cores: their numbers are those of one.
#include <catch2/catch.hpp>

#include "five_bar.h"
#include "process.h"

using costate::test::costate_json;
using costate::test::kFiveBar;
using costate::test::WorkingDirectory;
using Json = nlohmann::json;

TEST_CASE("check: rows that run beside each other have the numbers that they have one by one, to the bit") {
  const WorkingDirectory here;
  const auto rows = [&](const char* jobs) {
    // Nothing is cut: what a row may take is measured by the clock.
    const Json j = costate_json({"check", kFiveBar, "--t-end", "1", "--rtol", "1e-5", "--no-motions", "--no-files",
                                 "--patience", "1e6", "--jobs", jobs},
                                here.path());
    std::vector<std::string> r;
    for (const Json& row : j.at("rows"))
      r.push_back(row.at("formulation").dump() + row.at("method").dump() + row.at("status").dump() +
                  row.at("psi").dump() + row.at("gradient").dump() + row.at("error").dump());
    return r;
  };
  const auto one = rows("1");
  REQUIRE(one.size() > 40);
  CHECK(rows("4") == one);
}
