// Scenes made of several files: what is laid over what, and what is said of mistakes.
#include <catch2/catch.hpp>
#include <fstream>

#include "costate/base/error.h"
#include "costate/scene/scene.h"
#include "unit/record_temporary_directory.h"

using namespace costate;
using Catch::Contains;

namespace {

const char* base = R"(title = "base"

[gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0

[point.P]
x_m = 1
y_m = 0

[mass.bob]
point = "P"
mass_kg = 2

[distance.rod]
from = "A"
to = "P"

[start]
given = ["P.y"]

[[cost.running]]
kind = "square"
output = "P.y"

[run]
t_end_s = 1
rtol = 1e-6
)";

struct Files {
  record_test::TemporaryDirectory directory;
  std::string write(const std::string& name, const std::string& text) {
    const auto path = directory / name;
    std::ofstream(path) << text;
    return path.string();
  }
};

std::string complaint(const std::string& path) {
  try {
    Scene::load(path);
  } catch (const Error& e) {
    return e.what();
  }
  return "none";
}

}  // namespace

TEST_CASE("scene include: patterns remove what fits them, and complain where nothing does") {
  Files files;
  files.write("base.toml", base);
  const Scene scene = Scene::load(files.write("run.toml", R"(include = ["base.toml"]
remove = ["*.ro?", "mass.b*", "start"]
[mass.other]
point = "P"
mass_kg = 3
[start]
given = ["P.x", "P.y"]
)"));
  CHECK(scene.mechanism()->row_names().empty());
  CHECK(scene.mechanism()->coordinate_count() == 2);
  CHECK_THAT(
      complaint(files.write("wrong.toml", "include = [\"base.toml\"]\nremove = [\"tyre.*\"]\n")),
      Contains("wrong.toml:2:11") && Contains("'tyre.*' is to be removed, but nothing in the included files fits it."));
}

TEST_CASE("scene include: own keys lie over included ones") {
  Files files;
  files.write("base.toml", base);
  const std::string run = files.write("run.toml", R"(title = "run"
include = ["base.toml"]
remove = ["distance.rod"]

[run]
t_end_s = 3

[mass.bob]
mass_kg = 5

[mass.more]
point = "P"
mass_kg = 1

[start]
given = ["P.x", "P.y"]
)");
  const Scene scene = Scene::load(run);
  CHECK(scene.title == "run");
  CHECK(scene.run.t_end_s == 3);
  CHECK(scene.run.rtol == 1e-6);
  const auto& m = *scene.mechanism();
  CHECK(m.base_numbers()[m.number("mass.bob.mass_kg")] == 5);
  CHECK(m.row_count() == 0);
  CHECK(m.bodies().size() == 2);
  // Dumped, it is one file that says the same, in the same order.
  const Scene again = Scene::parse(scene.dump(), "dumped.toml");
  CHECK(again.dump() == scene.dump());
  CHECK_THAT(scene.dump(), !Contains("include") && !Contains("remove"));
  REQUIRE(again.mechanism()->numbers().size() == m.numbers().size());
  for (std::size_t i = 0; i < m.numbers().size(); ++i) {
    CHECK(again.mechanism()->numbers()[i].path == m.numbers()[i].path);
    CHECK(again.mechanism()->numbers()[i].value == m.numbers()[i].value);
  }
}

TEST_CASE("scene include: elements keep the order of the files when dumped") {
  Files files;
  files.write("first.toml", "\n\n\n\n\n\n[point.B]\nx_m = 2\ny_m = 0\n[mass.b]\npoint = \"B\"\nmass_kg = 1\n");
  const std::string run =
      files.write("run.toml",
                  "include = [\"first.toml\"]\n[point.A]\nx_m = 1\ny_m = 0\n[mass.a]\npoint = \"A\"\nmass_kg = 1\n"
                  "[start]\ngiven = [\"A.x\", \"A.y\", \"B.x\", \"B.y\"]\n");
  const Scene scene = Scene::load(run);
  CHECK(scene.mechanism()->coordinates()[0].name == "B.x");
  const Scene again = Scene::parse(scene.dump(), "dumped.toml");
  CHECK(again.mechanism()->coordinates()[0].name == "B.x");
}

TEST_CASE("scene include: an error names the file it stands in") {
  Files files;
  const std::string bad = files.write("bad.toml", "[point.A]\nx_m = 1\ny_m = 0\ncolour = 1\n");
  const std::string run = files.write("run.toml", "include = [\"bad.toml\"]\n[run]\nt_end_s = 1\n");
  CHECK_THAT(complaint(run), Contains(bad + ":4:1") && Contains("colour"));
}

TEST_CASE("scene include: mistakes are named where they are made") {
  Files files;
  files.write("base.toml", base);
  const auto say = [&](const std::string& text) { return complaint(files.write("run.toml", text)); };
  CHECK_THAT(say("include = [\"bse.toml\"]\n"), Contains("run.toml:1:12") && Contains("cannot be read"));
  CHECK_THAT(say("include = \"base.toml\"\n"), Contains("run.toml:1:11") && Contains("array of strings"));
  CHECK_THAT(say("include = [\"run.toml\"]\n"), Contains("includes itself"));
  CHECK_THAT(say("include = [\"base.toml\"]\nremove = [\"distance.rd\"]\n"),
             Contains("run.toml:2:11") && Contains("Did you mean 'rod'?"));
  CHECK_THAT(say("remove = [\"distance.rod\"]\n"), Contains("nothing is included"));
}
