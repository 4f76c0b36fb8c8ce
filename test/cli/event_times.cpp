// Times of events carry the digits that are known: those of the run's tolerance, or those that two runs to an accuracy
// have in common.
#include <catch2/catch.hpp>
#include <cmath>
#include <regex>

#include "process.h"
#include "support/paths.h"

using namespace costate::test;

namespace {

const std::string kDrop = COSTATE_SOURCE_DIR "/models/bouncing_ball/drop.toml";

/// As printed of the first touch: "0.45".
std::string first_touch(const std::vector<std::string>& words) {
  const WorkingDirectory here;
  std::vector<std::string> all{"simulate", kDrop, "--no-files"};
  all.insert(all.end(), words.begin(), words.end());
  const Outcome o = run_costate(all, here.path());
  INFO(o.err);
  REQUIRE(o.status == 0);
  std::smatch found;
  REQUIRE(std::regex_search(o.out, found, std::regex("floor: touch at ([0-9.]+) s")));
  return found[1];
}

}  // namespace

// It falls from a metre for sqrt(2/g).
TEST_CASE("event times: they are printed to the digits that are known") {
  const double t = std::sqrt(2 / 9.81);
  const std::string loose = first_touch({"--rtol", "1e-3"}), tight = first_touch({"--rtol", "1e-10"}),
                    accurate = first_touch({"--accuracy", "1e-3"});
  CHECK(loose.size() == 4);  // to 0.01 s, of ten tolerances of 2.8 s
  CHECK(tight == "0.451524");
  for (const std::string& of : {loose, tight, accurate}) {
    const double last = std::pow(10.0, -static_cast<double>(of.size() - 2));
    CHECK(std::abs(std::stod(of) - t) <= last);
  }
}
