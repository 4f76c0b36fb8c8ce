// What is read is bounded: keys, includes, files, counts; and what a complaint about it says.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <clocale>
#include <fstream>

#include "costate/base/error.h"
#include "costate/base/text_file.h"
#include "costate/element/law/spline_law.h"
#include "costate/scene/scene.h"
#include "unit/record_temporary_directory.h"
#include "unit/scene_texts.h"

using namespace costate;
using namespace costate::test;
using Catch::Contains;
using record_test::TemporaryDirectory;

TEST_CASE("scene limits: keys of many parts and deep nesting are refused with a place") {
  std::string key = "a";
  for (int i = 0; i < 20000; ++i) key += ".a";
  CHECK_THAT(complaint("title = \"x\"\n" + key + " = 1\n"), Contains("s.toml:2:") && Contains("more than 64 parts"));
  CHECK_THAT(complaint("x = " + std::string(20000, '[') + std::string(20000, ']') + "\n"),
             Contains("s.toml:1:") && Contains("more than 64 deep"));
  // Dots and brackets in texts and comments are neither.
  CHECK(complaint("# " + key + std::string(100, '[') + "\ndescription = \"" + key + "\"\n" + pendulum) == "no error");
}

TEST_CASE("scene limits: includes that go too deep, or double, end") {
  const TemporaryDirectory here;
  const auto write = [&](const std::string& name, const std::string& text) {
    std::ofstream(here.path() / name) << text;
  };
  for (int i = 0; i < 50; ++i) write(fmt::format("d{}.toml", i), fmt::format("include = [\"d{}.toml\"]\n", i + 1));
  CHECK_THROWS_WITH(Scene::load((here.path() / "d0.toml").string()),
                    Contains("more than 32 deep") && Contains("d0.toml"));
  for (int i = 0; i < 20; ++i)
    write(fmt::format("t{}.toml", i), fmt::format("include = [\"t{}.toml\", \"t{}.toml\"]\n", i + 1, i + 1));
  write("t20.toml", "title = \"x\"\n");
  CHECK_THROWS_WITH(Scene::load((here.path() / "t0.toml").string()), Contains("more than 1000 files"));
}

TEST_CASE("scene limits: endless and unreadable files") {
  CHECK_THROWS_WITH(read_text_file("/dev/zero", 1000, "The scene file"),
                    Contains("/dev/zero") && Contains("1000 bytes"));
  CHECK_THROWS_WITH(read_text_file("/nowhere/at/all", 1000, "The scene file"), Contains("cannot be read"));
  CHECK_THROWS_WITH(read_text_file("/proc/self/mem", 1000, "The scene file"),
                    Contains("cannot be read"));  // fails in read()
  CHECK_THROWS_WITH(Scene::load("/dev/zero"), Contains("/dev/zero") && Contains("limit"));
}

TEST_CASE("scene limits: numbers in files do not depend on the program's locale") {
  double x = 0;
  for (const char* locale : {"C", "de_DE.UTF-8", "fr_FR.UTF-8"}) {
    const std::string before = std::setlocale(LC_ALL, nullptr);
    std::setlocale(LC_ALL, locale);  // where it is installed
    CHECK((read_number("1.5e-3", x) && x == 1.5e-3));
    CHECK((read_number("+2", x) && x == 2));
    for (const char* bad : {"", "1,5", "+-1", "1 ", "inf", "nan", "1e999", "0x10"}) CHECK(!read_number(bad, x));
    std::setlocale(LC_ALL, before.c_str());
  }
}

// The parser's own assertions ended builds that keep them.
TEST_CASE("scene limits: brackets with nothing behind them are refused with a place") {
  for (const std::string text : {"[\npoint.s]\nx_m = 1\n", "a = { b = }\n", "a = [ , ]\n", "[[\nx]]\n"})
    CHECK_THAT(complaint(text), Contains(":1:") && Contains("No valid TOML"));
}

TEST_CASE("scene limits: elements of different kinds may share a name, and their outputs are told apart by the kind") {
  const Scene scene = Scene::parse(R"([point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1
y_m = 0
[mass.P]
point = "P"
mass_kg = 1
[spring.S]
from = "A"
to = "P"
stiffness_N_per_m = 10
natural_length_m = 1
damping_N_s_per_m = 0
[maxwell.S]
from = "A"
to = "P"
stiffness_N_per_m = 20
natural_length_m = 0.5
damping_N_s_per_m = 1
[force.push]
point = "P"
y_N = 2
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 1
)",
                                   "shared.toml");
  const auto names = output_names(*scene.mechanism());
  const auto has = [&](const char* name) { return std::find(names.begin(), names.end(), name) != names.end(); };
  CHECK(has("spring.S.length"));
  CHECK(has("maxwell.S.length"));
  CHECK_FALSE(has("S.length"));
  CHECK(has("push.power"));
  CHECK_FALSE(has("force.push.power"));
  CHECK(make_output(*scene.mechanism(), "maxwell.S.length")->name() == "maxwell.S.length");
  CHECK_THROWS_WITH(make_output(*scene.mechanism(), "S.length"), Contains("no output 'S.length'"));
}

TEST_CASE("scene limits: two meanings are named both") {
  CHECK_THAT(complaint(replaced(pendulum, "[bar.arm]",
                                "[body.one]\nx_m = 0\ny_m = 0\nmass_kg = 1\ninertia_kg_m2 = 1\n"
                                "[point.one]\non = \"one\"\nx_m = 0\ny_m = 0\n[bar.arm]")),
             Contains("'one.x' has two meanings: body.one and point.one share a name"));
}

TEST_CASE("scene limits: a table of many points", "[law]") {
  // The spline of a cubic's values: away from the ends, where its second derivative is not the cubic's, it is the
  // cubic.
  const int n = 30000;
  std::vector<double> x, y;
  for (int i = 0; i < n; ++i) {
    x.push_back(i + 0.3 * (i % 2));
    const double s = x.back() / n;
    y.push_back(s * (1 - s * s));
  }
  const SplineLaw law(x);
  for (const double at : {1000.4, 15000.7, 28000.1}) {
    const double s = at / n;
    CHECK(law.value(at, y.data()) == Approx(s * (1 - s * s)).epsilon(1e-13));
    CHECK(law.curve(at, y.data()).c1 * n == Approx(1 - 3 * s * s).epsilon(1e-9));
  }
  // Linear in the ordinates, so that the derivative by y_k is the spline of the unit vector; it dies out within some 60
  // knots.
  std::vector<double> unit(x.size(), 0.0);
  unit[15000] = 1;
  CHECK(law.value(x[15000], unit.data()) == 1);
  CHECK(std::abs(law.value(15003.5, unit.data())) > 1e-3);
  CHECK(std::abs(law.value(15100.5, unit.data())) < 1e-30);
}
