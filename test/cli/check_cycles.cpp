// 'costate check' on scenes with a limit cycle.
#include <algorithm>
#include <catch2/catch.hpp>

#include "five_bar.h"
#include "process.h"

using costate::test::costate_json;
using costate::test::WorkingDirectory;
using Json = nlohmann::json;

TEST_CASE("check: cycles of every formulation agree, and with the closed form") {
  // The simplest walker's long gait at slope 0.009, of feet without mass, by an independent program (Garcia et al.
  // 1998's equations): period 3.88246375285, |multiplier| 0.58911318550. Feet of 1e-6 are off by as much, to first
  // order (models/walker/README.md).
  const WorkingDirectory here;
  const Json j = costate_json({"check", COSTATE_MODELS_DIR "/walker/simplest.toml", "--no-files", "--formulations",
                               "index1,baumgarte,penalty", "--methods", "cvodes-forward", "--patience", "50"},
                              here.path());
  CHECK(j.at("cycles").size() == 6);
  for (const Json& c : j.at("cycles")) {
    INFO(c.dump());
    CHECK(c.at("status") == "ok");
    CHECK(std::abs(c.at("period_s").get<double>() - 3.88246375285) < 1e-6);
    CHECK(std::abs(c.at("multiplier").get<double>() - 0.58911318550) < 2e-5);
    CHECK(c.at("error") < 1e-5);
    CHECK(c.at("quantity").is_string());
  }
  // Without motions there are no cycles, and without a cycle none.
  CHECK(!costate_json({"check", COSTATE_MODELS_DIR "/walker/simplest.toml", "--no-files", "--formulations", "baumgarte",
                       "--methods", "cvodes-forward", "--no-motions"},
                      here.path())
             .contains("cycles"));
}
