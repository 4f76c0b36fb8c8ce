// Files of measured data: separators, names, units, what is missing, and mistakes at their place; laws through them.
#include "costate/scene/data_table.h"

#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <numbers>

#include "costate/base/error.h"
#include "costate/element/law/data_law.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/scene/scene_files.h"
#include "record_temporary_directory.h"

using namespace costate;
using Catch::Contains;

namespace {

struct TemporaryFile {
  record_test::TemporaryDirectory own;  // tests run side by side
  std::filesystem::path path = own / "costate_data_table.csv";
  explicit TemporaryFile(const std::string& text) { std::ofstream(path) << text; }
};

std::shared_ptr<DataTable> read(const std::string& text, const DataFormat& format = {}) {
  const TemporaryFile file(text);
  return read_data_file("run", file.path.string(), format);
}

void check(const DataTable& t) {
  REQUIRE(t.columns.size() == 2);
  CHECK(t.columns[0].name == "t");
  CHECK(t.time == 0);
  const DataColumn& angle = t.column("angle");
  REQUIRE(angle.values.size() == 2);
  CHECK(std::abs(angle.values[1] - 1.5 * std::numbers::pi / 180) < 1e-15);
  CHECK(t.time_column().values[1] == 0.25);
}

}  // namespace

TEST_CASE("data: separators, units and names", "[data]") {
  check(*read("t,angle [deg]\n0,1\n0.25,1.5\n"));
  check(*read("t [s];angle (deg)\r\n0;1\r\n0.25;1.5\r\n"));
  check(*read("# a remark\nt\tangle\ns\tdeg\n0\t1\n0.25\t1.5 # the last one\n\n"));
  check(*read("t [ms]  angle [deg]\n 0   1\n 250   1.5\n"));
  check(*read("\"t\",\"angle [deg]\"\n0,1\n+0.25,1.5\n"));
  check(*read("\xEF\xBB\xBFt,angle\n[s],[deg]\n0,1\n2.5e-1,1.5\n"));
  DataFormat f;
  f.decimal_comma = true;
  check(*read("t;angle [deg]\n0;1\n0,25;1,5\n", f));
  f = {};
  f.columns = {"t", "angle [deg]"};
  check(*read("0 1\n0.25 1.5\n", f));
  check(*read("clock,deflection\n0,1\n0.25,1.5\n", f));
  f = {};
  f.time = "clock";
  f.time_shift_s = 0.5;
  const auto shifted = read("x,clock\n1,0\n2,1\n", f);
  CHECK(shifted->time_column().values[1] == 1.5);
  f = {};
  f.timed = false;
  const auto any_order = read("speed [km/h],torque\n72,3\n36,1\n", f);
  CHECK(any_order->column("speed").values == std::vector<double>{20, 10});
  CHECK_THROWS_WITH(any_order->time_column(), Contains("no time in data 'run'"));
  const auto gaps = read("t,x\n0,1\n1,\n2,nan\n3,4\n");
  CHECK(std::isnan(gaps->column("x").values[1]));
  CHECK(std::isnan(gaps->column("x").values[2]));
  CHECK(gaps->column("x").values[3] == 4);
}

TEST_CASE("data: mistakes have their place", "[data]") {
  CHECK_THROWS_WITH(read("t,x\n0,1\n1,abc\n")->column("x"),
                    Contains("costate_data_table.csv:3:3") && Contains("found 'abc'") && Contains("'x'"));
  CHECK_THROWS_WITH(read("t;x\n0;1\n1;1,5\n")->column("x"), Contains(":3:3") && Contains("decimal_comma"));
  CHECK_THROWS_WITH(read("t,x\n0,1\nlate,2\n"), Contains(":3:1") && Contains("found 'late'"));
  CHECK_THROWS_WITH(read("t,x\n0,1\nend of data\n"), Contains(":3:1") && Contains("Expected a number"));
  CHECK_THROWS_WITH(read("t,x\n0,1\n1\n"), Contains(":3:1") && Contains("Expected 2 values"));
  CHECK_THROWS_WITH(read("t,x\n1,1\n1,2\n"), Contains(":3:1") && Contains("must increase"));
  CHECK_THROWS_WITH(read("t,x [furlong]\n0,1\n"), Contains(":1:1") && Contains("'furlong'"));
  CHECK_THROWS_WITH(read("u,x\n0,1\n"), Contains("no column 't' of the time"));
  CHECK_THROWS_WITH(read("0,1\n"), Contains("name its columns"));
  CHECK_THROWS_WITH(read("t,x\n"), Contains("no row"));
  CHECK_THROWS_WITH(read("t,x,x\n0,1,2\n"), Contains("two columns 'x'"));
  CHECK_THROWS_WITH(read("t,x\n0,1\n")->column("y"), Contains("no column 'y'") && Contains("costate_data_table.csv"));
  CHECK_THROWS_WITH(read_data_file("run", "/nowhere/x.csv", {}), Contains("/nowhere/x.csv"));
}

TEST_CASE("data: columns of text are there unless they are used", "[data]") {
  const std::string text = "t,gear,x\n0,first,1\n1,2,3\n2,\"second, low\",5\n";
  const auto t = read(text);
  REQUIRE(t->columns.size() == 3);
  CHECK(t->column("x").values == std::vector<double>{1, 3, 5});
  CHECK_THROWS_WITH(t->column("gear"), Contains("costate_data_table.csv:2:3") && Contains("found 'first'") &&
                                           Contains("The scene uses this column, 'gear'"));
  // A unit says nothing of a text.
  CHECK(read("t [s],gear [word],x [mm]\n0,first,1\n")->column("x").values == std::vector<double>{1e-3});
  // With names in the scene the first line is of data where its time is a number, else of names.
  DataFormat f;
  f.columns = {"t", "gear", "x"};
  CHECK(read("0,first,1\n1,second,3\n", f)->column("x").values == std::vector<double>{1, 3});
  CHECK(read(text, f)->column("x").values == std::vector<double>{1, 3, 5});
}

// Of x^3 the natural spline is no copy, but between the points it and its derivatives belong together.
TEST_CASE("data: laws and what they say beyond their ends", "[data]") {
  const std::vector<double> x = {0, 1, 2, 4}, y = {0, 1, 8, 2};
  const double p = 2;
  const DataLaw lines(x, y, DataLaw::Between::lines, DataLaw::Beyond::refuse, "the data");
  CHECK(lines.value(3.0, &p) == 10);
  CHECK(lines.slope(0.5, &p).d[0] == 2);
  std::vector<double> kinks;
  lines.add_kinks(&p, kinks);
  CHECK(kinks == std::vector<double>{1, 2});
  CHECK_THROWS_WITH(lines.value(4.1, &p), Contains("the data goes from 0 to 4"));
  CHECK(std::abs(lines.value(4 + 1e-12, &p) - 4) < 1e-9);
  // Areas of the triangle and the trapezia.
  CHECK(std::abs(lines.integral(4, &p) - 2 * (0.5 + 4.5 + 10)) < 1e-12);
  const DataLaw hold(x, y, DataLaw::Between::spline, DataLaw::Beyond::hold, "the data");
  CHECK(hold.value(9.0, &p) == 4);
  CHECK(hold.slope(9.0, &p).d[0] == 0);
  const DataLaw tangent(x, y, DataLaw::Between::spline, DataLaw::Beyond::tangent, "the data");
  CHECK(std::abs(tangent.value(5.0, &p) - 4 - tangent.slope(4.0, &p).d[0]) < 1e-12);
  CHECK_THROWS_AS(DataLaw({0}, {1}, DataLaw::Between::lines, DataLaw::Beyond::hold, "the data"), ModelError);
}

// Values, slopes, curvatures and integrals of SciPy's CubicSpline(x, y, bc_type="periodic").
TEST_CASE("data: laws that repeat", "[data]") {
  struct At {
    double x, f, slope, curvature;
  };
  struct Case {
    std::vector<double> x, y;
    std::vector<At> at;
    double up_to, down_to;  // integrals from 0 to 9.9 and to -3.7
  };
  const std::vector<Case> cases = {
      {{-1, 0.5, 1.2, 3},
       {2, -1, 0.7, 2},
       {{-3.7, -1.0312670954387517, -0.5019564046510165, 6.080537338022367},
        {2.1, 2.4613344739093246, 0.868002091055983, -2.7440357380477147},
        {9.9, 2.2342931421108405, 1.3952122210605236, -2.5280655619976984},
        {24.5, -1, 0.8648655070810761, 7.587681779298546}},
       7.992728843459469,
       -4.0429918931977324},
      {{0, 1, 3},
       {1, 4, 1},
       {{-3.7, 1.6405, -2.595, 2.7}, {0.3, 1.774, 3.39, 3.6}, {9.9, 3.808, 2.31, -7.2}, {24.5, 2.5, 3.75, 0}},
       24.608925,
       -8.2569625},
      {{0, 0.5, 1.5, 2, 4},
       {0, 2, -1, 5, 0},
       {{-3.7, 1.4021809635722673, 4.806768507638075, -10.551821386603976},
        {2.1, 5.907816686251469, 7.593137485311396, -28.778848413631014},
        {24.5, 2, 0.40893066980023474, -33.42655699177438}},
       19.044140716803774,
       -8.831559400705059},
      {{0, 2}, {3, 3}, {{-0.5, 3, 0, 0}, {7, 3, 0, 0}}, 29.7, -11.1}};
  const double p = 1.5;
  for (const Case& c : cases) {
    const DataLaw law(c.x, c.y, DataLaw::Between::spline, DataLaw::Beyond::repeat, "the data");
    CAPTURE(c.x.size());
    for (const At& at : c.at) {
      CAPTURE(at.x);
      const Taylor2 f = law.curve(at.x, &p);
      CHECK(f.c0 == Approx(p * at.f).margin(1e-12));
      CHECK(f.c1 == Approx(p * at.slope).margin(1e-12));
      CHECK(f.c2 == Approx(p * at.curvature).margin(1e-11));
    }
    CHECK(law.integral(9.9, &p) == Approx(p * c.up_to).epsilon(1e-12));
    CHECK(law.integral(-3.7, &p) == Approx(p * c.down_to).epsilon(1e-12));
    std::vector<double> kinks;
    law.add_kinks(&p, kinks);
    CHECK(kinks.empty());
    LawPlaces places;
    places.from = 20;
    places.to = 21;
    law.add_places(&p, places);
    CHECK(places.knots.size() >= c.x.size());
    for (const double x : places.knots) CHECK((x > 10 && x < 30));
  }
  const auto repeat = [](std::vector<double> y, DataLaw::Between between) {
    return [=] { DataLaw({0, 1, 2}, y, between, DataLaw::Beyond::repeat, "the data"); };
  };
  CHECK_THROWS_WITH(repeat({0, 1, 0.1}, DataLaw::Between::spline)(), Contains("begins with 0 and ends with 0.1"));
  CHECK_THROWS_WITH(repeat({0, 1, 0}, DataLaw::Between::lines)(), Contains("can repeat as a spline alone"));
}

TEST_CASE("data: a run that goes beyond its data is refused, whatever the integrator's steps", "[data]") {
  const std::string scene = R"(
[data.push]
columns = ["t [s]", "F [N]"]
rows = [[0, 1], [1, 2], [2, 0]]

[point.P]
x_m = 0
y_m = 0

[mass.m]
point = "P"
mass_kg = 1

[force.f]
point = "P"
x_N = { kind = "data", data = "push", column = "F", between = "lines" }

[start]
given = ["P.x", "P.y"]

[[cost.terminal]]
kind = "value"
output = "P.x_dot"

[run]
t_end_s = 2
)";
  const Scene s = Scene::parse(scene, "push.toml");
  // Half the sums of neighbours.
  CHECK(std::abs(simulate(make_problem(s), {}).psi - 2.5) < 1e-6);
  CHECK_THROWS_WITH(simulate(make_problem(s.with_override("run.t_end_s", "3")), {}),
                    Contains("Column 'F' of data 'push' goes from 0 to 2"));
  CHECK_THROWS_WITH(s.with_override("force.f.x_N.data", "\"pull\""), Contains("no table of data 'pull'"));
  CHECK_THROWS_WITH(s.with_override("force.f.x_N.column", "\"f\""),
                    Contains("no column 'f' in data 'push'. Known: t, F."));
}

TEST_CASE("data: the file is part of what a scene is", "[data]") {
  const TemporaryFile file("t,x\n0,1\n1,2\n");
  const std::string text =
      "[data.run]\nfile = \"costate_data_table.csv\"\n[point.P]\nx_m = 0\ny_m = 0\n[mass.m]\npoint = "
      "\"P\"\nmass_kg = 1\n[start]\ngiven = [\"P.x\", \"P.y\"]\n";
  const std::string name = (file.path.parent_path() / "scene.toml").string();
  const SceneFileLog log(name);
  const Scene scene = Scene::parse(text, name);
  REQUIRE(log.files().size() == 1);
  CHECK(log.files()[0].path == "data.run.file");
  CHECK(log.files()[0].digest == file_digest(file.path.string()));
  CHECK_THAT(scene_text_for(scene, log.files(), file.path.parent_path() / "below"),
             Contains("file = \"../costate_data_table.csv\""));
}

TEST_CASE("data: columns in units of another kind than what they stand for are refused", "[data]") {
  const auto scene = [](const std::string& unit, const std::string& law, const std::string& output,
                        const std::string& more = {}) {
    return Scene::parse(R"([gravity]
y_m_per_s2 = -9.81
[data.D]
columns = ["t [s]", "a [)" + unit +
                            R"(]"]
rows = [[0, 1], [1, 2], [2, 3]]
[point.O]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0.6
y_m = -0.8
[bar.b]
from = "O"
to = "P"
mass_kg = 1
[angle.th]
bar = "b"
[couple.c]
angle = "th"
torque_N_m = )" + law + R"(
[[cost.samples]]
data = "D"
column = "a"
output = ")" + output + R"("
sigma = 0.1
)" + more + R"([start]
given = ["P.x"]
[run]
t_end_s = 2
)",
                        "units.toml");
  };
  const std::string none = "1", of_data = R"({ kind = "data", data = "D", column = "a" })",
                    scaled = R"({ kind = "data", data = "D", column = "a", scale = 0.5 })";
  const auto read = [&](const std::string& unit, const std::string& law, const std::string& output) {
    make_problem(scene(unit, law, output));
  };
  // Degrees are radians, N mm are joules; no unit, or none of its own, says nothing.
  for (const auto& [unit, output] : {std::pair{"deg", "th.angle"}, {"rad", "th.angle"}, {"mm", "P.x"}, {"-", "P.x"}})
    CHECK_NOTHROW(read(unit, none, output));
  // Where a hundredth of the column's numbers would be taken.
  CHECK_THROWS_WITH(read("%", none, "P.x"), Contains("Column 'a' is in % [1], and what it is used for in m."));
  CHECK_THROWS_WITH(read("%", of_data, "P.x"), Contains("is in %"));
  CHECK_NOTHROW(read("N mm", of_data, "energy.total"));
  CHECK_THROWS_WITH(read("kg", none, "th.angle"), Contains("kg") && Contains("rad") && Contains("another quantity"));
  CHECK_THROWS_WITH(read("mm", none, "P.x_dot"), Contains("m/s"));
  CHECK_THROWS_WITH(read("kg", of_data, "energy.total"), Contains("couple.c.torque_N_m") && Contains("N m"));
  // A scale may turn one into the other, of a law: here the samples are what is wrong.
  // So of targets.
  const auto read_target = [&](const std::string& unit, const std::string& output, const std::string& law) {
    make_problem(scene(unit, none, unit == "deg" ? "th.angle" : "P.x",
                       "[[cost.running]]\nkind = \"square\"\noutput = \"" + output + "\"\ntarget = " + law + "\n"));
  };
  CHECK_NOTHROW(read_target("deg", "th.angle", of_data));
  CHECK_NOTHROW(read_target("mm", "P.x", of_data));
  CHECK_NOTHROW(read_target("-", "th.angle", of_data));
  CHECK_NOTHROW(read_target("mm", "th.angle", scaled));
  CHECK_THROWS_WITH(read_target("mm", "th.angle", of_data), Contains("cost.running[0].target") &&
                                                                Contains("'a' is in mm") &&
                                                                Contains("'th.angle' is another quantity"));
  CHECK_THROWS_WITH(read("kg", scaled, "energy.total"), Contains("cost.samples") && Contains("'energy.total'"));
  // Of a term in a sum; a factor of a product may be of any.
  const auto of = [&](const std::string& kind, const std::string& parts) {
    return "{ kind = \"" + kind + "\", " + parts + " = [{ kind = \"polynomial\", coefficients = [1] }, " + of_data +
           "] }";
  };
  CHECK_THROWS_WITH(read("kg", of("sum", "terms"), "energy.total"),
                    Contains("couple.c.torque_N_m.terms[1]") && Contains("'a' is in kg"));
  CHECK_NOTHROW(read("N mm", of("sum", "terms"), "energy.total"));
  CHECK_THROWS_WITH(read("kg", of("product", "factors"), "energy.total"), Contains("'energy.total'"));
  // Of drivers, springs and roads, whose keys say nothing.
  const auto read_more = [&](const std::string& unit, const std::string& more) {
    Scene::parse("[data.D]\ncolumns = [\"t [s]\", \"x [mm]\", \"a [" + unit + R"(]"]
rows = [[0, 1, 1], [1, 2, 2], [2, 3, 3]]
[point.A]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 1
y_m = 0
[bar.b]
from = "A"
to = "P"
mass_kg = 1
[angle.th]
bar = "b"
)" + more + "[start]\ngiven = [\"P.x\"]\n[run]\nt_end_s = 2\n",
                 "users.toml");
  };
  const std::string over = R"({ kind = "data", data = "D", column = "a", over = "x", beyond = "tangent" })",
                    driver = "[driver.d]\ncoordinate = \"th.angle\"\nlaw = ",
                    spring = "[spring.s]\nfrom = \"A\"\nto = \"P\"\nnatural_length_m = 1\nspring_law = ",
                    torsion = "[torsion_spring.s]\nangle = \"th\"\nspring_law = ",
                    road = "[road.r]\nkind = \"profile\"\nlaw = ";
  CHECK_THROWS_WITH(read_more("mm", driver + of_data + "\n"),
                    Contains("driver.d.law") && Contains("'a' is in mm") && Contains("rad"));
  CHECK_THROWS_WITH(read_more("deg", driver + over + "\n"),
                    Contains("driver.d.law") && Contains("'x' is in mm") && Contains("over another quantity"));
  CHECK_THROWS_WITH(read_more("mm", spring + over + "\n"),
                    Contains("spring.s.spring_law") && Contains("used for in N"));
  CHECK_NOTHROW(read_more("kN", spring + over + "\n"));
  CHECK_THROWS_WITH(read_more("N", spring + of_data + "\n"),
                    Contains("spring.s.spring_law") && Contains("'t' is in s"));
  CHECK_THROWS_WITH(read_more("N", torsion + over + "\n"), Contains("torsion_spring.s.spring_law") && Contains("N m"));
  CHECK_THROWS_WITH(read_more("N", road + over + "\n"), Contains("road.r.law") && Contains("used for in m"));
  CHECK_NOTHROW(read_more("mm", road + over + "\n"));
}
