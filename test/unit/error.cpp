// Messages: where a mistake is, and what was probably meant.
#include "costate/base/error.h"

#include <catch2/catch.hpp>

using namespace costate;

TEST_CASE("errors: near names", "[error]") {
  const std::vector<std::string> names = {"stiffness_N_per_m", "damping_N_s_per_m", "natural_length_m", "L01", "L02"};
  CHECK(nearest_name("stiffnes_N_per_m", names) == "stiffness_N_per_m");
  CHECK(nearest_name("natural_lenght_m", names) == "natural_length_m");
  CHECK(nearest_name("L03", names) == "L01");  // the first of equals
  CHECK(nearest_name("completely_different_name", names).empty());
  CHECK(nearest_name("L01", {}).empty());
  CHECK(nearest_name("Q", {"A"}).empty());  // no letter in common
  CHECK(nearest_name("", {"ab"}).empty());
  CHECK(nearest_name("force.f.work", {"z.force.f.work", "f.work"}) == "f.work");  // by its element's path
  CHECK(nearest_name("QA", {"A"}) == "A");
}

TEST_CASE("errors: suggestions", "[error]") {
  CHECK(suggestion("idaa", {"idas", "cvodes"}) == " Did you mean 'idas'?");
  CHECK(suggestion("rk4_fixed_step", {"idas", "cvodes"}) == " Known: idas, cvodes.");
  CHECK(suggestion("x", {}).empty());
  // An element that is known has other outputs.
  CHECK(suggestion("elbow.force", {"arm.x", "arm.y", "elbow.reaction_x", "elbow.reaction_y"}) ==
        " Did you mean one of elbow.reaction_x, elbow.reaction_y?");
  std::vector<std::string> many;
  for (int i = 0; i < 30; ++i) many.push_back("some_rather_long_name_" + std::to_string(100 + i));
  const std::string text = suggestion("unlike", many);
  CHECK(text.find("some_rather_long_name_123") != std::string::npos);
  CHECK(text.find("some_rather_long_name_124") == std::string::npos);  // 24 are listed
  CHECK(text.find("(30 in all)") != std::string::npos);
}

TEST_CASE("errors: places", "[error]") {
  CHECK(std::string(SceneError({"a.toml", 12, 3}, "Wrong.").what()) == "a.toml:12:3: Wrong.");
  CHECK(std::string(SceneError({"a.toml", 0, 0}, "Wrong.").what()) == "a.toml: Wrong.");
  CHECK(std::string(SceneError({"", 0, 0}, "Wrong.").what()) == "Wrong.");
  CHECK(SceneError({"a.toml", 12, 3}, "Wrong.").where().line == 12);
  const ModelError e("bar.A1", "Too long.");
  CHECK(std::string(e.what()) == "bar.A1: Too long.");
  CHECK(e.subject() == "bar.A1");
  CHECK(e.bare_message() == "Too long.");
  CHECK(std::string(ModelError("", "Too long.").what()) == "Too long.");
}
