// Loading, dumping and loading again gives the same scene: the same text, the same numbers bit by bit, the
// same order.
#include <catch2/catch.hpp>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>

#include "costate/scene/scene.h"
#include "costate/scene/scene_kind.h"
#include "costate/scene/scene_node.h"
#include "costate/scene/toml_reader.h"
#include "costate/scene/toml_writer.h"
#include "scene_texts.h"
#include "support/paths.h"

using namespace costate;
using namespace costate::test;

namespace {

void require_same_numbers(const Mechanism& a, const Mechanism& b) {
  REQUIRE(a.numbers().size() == b.numbers().size());
  for (std::size_t i = 0; i < a.numbers().size(); ++i) {
    INFO(a.numbers()[i].path);
    REQUIRE(a.numbers()[i].path == b.numbers()[i].path);
    REQUIRE(std::memcmp(&a.numbers()[i].value, &b.numbers()[i].value, sizeof(double)) == 0);
    REQUIRE(a.numbers()[i].fixed_because == b.numbers()[i].fixed_because);
  }
}

void require_same(const Scene& a, const Scene& b) {
  REQUIRE(a.title == b.title);
  REQUIRE(a.description == b.description);
  const Mechanism &ma = *a.mechanism(), &mb = *b.mechanism();
  require_same_numbers(ma, mb);
  REQUIRE(ma.coordinate_names() == mb.coordinate_names());
  REQUIRE(ma.row_names() == mb.row_names());
  REQUIRE(ma.state_names() == mb.state_names());
  REQUIRE(output_names(ma) == output_names(mb));
  REQUIRE(ma.default_parameters() == mb.default_parameters());
  REQUIRE(ma.parameters().size() == mb.parameters().size());
  for (std::size_t i = 0; i < ma.parameters().size(); ++i) {
    const Parameter &p = ma.parameters()[i], &q = mb.parameters()[i];
    REQUIRE(p.name == q.name);
    REQUIRE(p.bindings == q.bindings);
    REQUIRE(p.value == q.value);
    REQUIRE(p.lower == q.lower);
    REQUIRE(p.upper == q.upper);
    REQUIRE(p.scale == q.scale);
  }
  REQUIRE(a.objective().running.size() == b.objective().running.size());
  REQUIRE(a.objective().terminal.size() == b.objective().terminal.size());
  REQUIRE(a.constraints().size() == b.constraints().size());
  REQUIRE(a.run.t_end_s == b.run.t_end_s);
  REQUIRE(a.run.rtol == b.run.rtol);
  REQUIRE(a.run.outputs == b.run.outputs);
  REQUIRE(a.optimize.stop_value == b.optimize.stop_value);
}

void require_round_trip(const Scene& scene) {
  const std::string text = scene.dump();
  INFO(text);
  const Scene again = Scene::parse(text, scene.file_name());
  REQUIRE(again.dump() == text);
  require_same(scene, again);
}

}  // namespace

TEST_CASE("scene: every model comes back from its dump") {
  int models = 0;
  for (const auto& file : std::filesystem::recursive_directory_iterator(COSTATE_MODELS_DIR)) {
    // A study lists runs of scenes and is none itself, nor are the parts that scenes include.
    if (file.path().extension() != ".toml" || file.path().filename() == "study.toml" ||
        file.path().parent_path().filename() == "parts")
      continue;
    INFO(file.path().string());
    ++models;
    require_round_trip(Scene::load(file.path().string()));
  }
  REQUIRE(models >= 3);
}

TEST_CASE("scene: every kind's example comes back from its dump") {
  for (const auto& kind : scene_kinds()) {
    INFO(kind.name);
    require_round_trip(Scene::parse(kind.example, kind.name));
  }
}

TEST_CASE("scene: numbers are written with the digits that give back their bits") {
  const double values[] = {0.0,
                           -0.0,
                           0.1,
                           0.1 + 0.2,
                           1.0 / 3,
                           -2.5e-17,
                           1e300,
                           4.9e-324,
                           1e22,
                           123456789012345678.0,
                           std::numeric_limits<double>::max(),
                           std::numeric_limits<double>::min(),
                           2.23606797749979};
  for (const double x : values) {
    INFO(toml_number(x));
    const SceneNode n = read_toml_value(toml_number(x), "test");
    REQUIRE(n.type == SceneNode::Type::number);
    REQUIRE(std::memcmp(&n.number, &x, sizeof x) == 0);
  }
  REQUIRE(toml_number(3) == "3.0");
  REQUIRE(toml_number(1e-8) == "1e-08");
  for (const char* special : {"inf", "-inf", "nan"})
    REQUIRE(toml_number(read_toml_value(special, "test").number) == special);
}

TEST_CASE("scene: TOML of every sort comes back from its dump") {
  const std::string text = R"(title = "quotes \" and \\, a tab \t, a line\nend, \u0001 and ü"
whole = -12
hex = 0xff
octal = 0o17
separated = 1_000.5
yes = true
no = false
day = 1979-05-27
time = 07:32:00
moment = 1979-05-27T07:32:00Z
literal = 'C:\no\escape'
long = """
two
lines"""
empty = []
nested = [[1, 2], ["a", "b"], []]
mixed = [1, 2.0, "three", { four = 4 }]
"quoted key" = 1

[z.second]
b = 1
a = 2
inner = { y = 1, x = { deep = [1, 2] }, empty = {} }
dotted.path.value = 3

[a]
[z.first]

[[list]]
name = "one"
[list.sub]
q = 1
[[list.item]]
r = 1
[[list.item]]
r = 2
[[list]]
name = "two"
[[list.item]]
r = 3

[z.first.below]
x = 1
[z]
late = 1
)";
  const std::string once = write_toml(read_toml(text, "text"));
  INFO(once);
  REQUIRE(write_toml(read_toml(once, "dump")) == once);
  const SceneNode before = read_toml(text, "text"), after = read_toml(once, "dump");
  for (const char* path : {"title",
                           "whole",
                           "hex",
                           "octal",
                           "separated",
                           "yes",
                           "day",
                           "time",
                           "moment",
                           "literal",
                           "long",
                           "nested[1][0]",
                           "mixed[3].four",
                           "z.second.inner.x.deep[1]",
                           "z.second.dotted.path.value",
                           "z.second.inner.empty",
                           "a",
                           "z.first",
                           "list[0].sub.q",
                           "list[0].item[1].r",
                           "list[1].item[0].r",
                           "list[1].name",
                           "z.first.below.x",
                           "z.late"}) {
    INFO(path);
    const SceneNode *x = find_node(before, path), *y = find_node(after, path);
    REQUIRE(x);
    REQUIRE(y);
    REQUIRE(x->describe() == y->describe());
  }
  REQUIRE(find_node(after, "title")->text == "quotes \" and \\, a tab \t, a line\nend, \x01 and \xc3\xbc");
}

TEST_CASE("scene: elements keep the order of the file, whatever their names and kinds") {
  const std::string scene = R"([point.Z]
x_m = 0
y_m = 0
[body.M]
mass_kg = 1
inertia_kg_m2 = 1
x_m = 0
y_m = 1
[point.B]
x_m = 1
y_m = 0
[point.A]
x_m = 2
y_m = 0
[spring.z]
from = "Z"
to = "A"
[distance.y]
from = "A"
to = "B"
[spring.a]
from = "A"
to = "B"
[bar.m]
from = "Z"
to = "B"
mass_kg = 1
[distance.a]
from = "Z"
to = "A"
)";
  const Scene s = Scene::parse(scene, "order.toml");
  const Scene again = Scene::parse(s.dump(), "dump");
  for (const Scene* x : {&s, &again}) {
    const Mechanism& m = *x->mechanism();
    REQUIRE(m.coordinate_names() ==
            std::vector<std::string>{"Z.x", "Z.y", "M.x", "M.y", "M.angle", "B.x", "B.y", "A.x", "A.y"});
    REQUIRE(m.row_names() == std::vector<std::string>{"bar.m.length", "distance.y.length", "distance.a.length"});
    REQUIRE(m.forces()[0]->name() == "z");
    REQUIRE(m.forces()[1]->name() == "a");
  }
}

TEST_CASE("scene: overrides replace and add values, and belong to the dump") {
  const Scene s =
      Scene::parse(pendulum, "s.toml",
                   {"spring.S1.stiffness_N_per_m=120.5", "spring.S1.preload_N=3", "gravity.y_m_per_s2=-1.62",
                    "run.method=cvodes-forward", "start.given=['P.y']", "title=A pendulum, heavier",
                    "cost.running[0].target={ kind = 'sine', amplitude = 1, angular_frequency_rad_per_s = 2 }",
                    "parameter.g.number=gravity.y_m_per_s2"});
  const Mechanism& m = *s.mechanism();
  const auto number = [&](const char* path) { return m.numbers()[m.number(path)].value; };
  REQUIRE(number("spring.S1.stiffness_N_per_m") == 120.5);
  REQUIRE(number("spring.S1.preload_N") == 3);
  REQUIRE(number("gravity.y_m_per_s2") == -1.62);
  REQUIRE(number("cost.running[0].target.amplitude") == 1);
  REQUIRE(s.run.method == "cvodes-forward");
  REQUIRE(s.title == "A pendulum, heavier");
  REQUIRE(m.coordinates()[m.given_positions()[0].coordinate].name == "P.y");
  REQUIRE(m.parameters().size() == 2);
  require_round_trip(s);
}

TEST_CASE("scene: numbers and parameters are written back") {
  const Scene s = Scene::parse(pendulum, "s.toml");
  const Scene longer = s.with_number("bar.arm.length_m", 0.1 + 0.2);
  REQUIRE(longer.mechanism()->numbers()[longer.mechanism()->number("bar.arm.length_m")].value == 0.1 + 0.2);
  require_round_trip(longer);
  REQUIRE(s.dump() == Scene::parse(pendulum, "s.toml").dump());  // the first one is untouched

  const ParameterSelection k = s.mechanism()->select({"k"});
  const Scene stiffer = s.with_parameters(k, {150.25});
  REQUIRE(stiffer.mechanism()->select({"k"}).values() == std::vector<double>{150.25});
  REQUIRE(stiffer.dump().find("stiffness_N_per_m = 150.25\n") != std::string::npos);
  require_round_trip(stiffer);
  REQUIRE(s.with_override("run.rtol", "1e-5").run.rtol == 1e-5);
  REQUIRE_THROWS_AS(s.with_parameters(k, {1e9}), SceneError);  // beyond its bounds
}
