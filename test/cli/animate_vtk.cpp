// costate animate -o motion.pvd: that the series is VTK's XML (its structure as the format's description has it), shows
// the run's motion at the run's times, and is whole whatever happens while it is written.
#include <algorithm>
#include <array>
#include <catch2/catch.hpp>
#include <cmath>
#include <csignal>
#include <cstring>
#include <map>
#include <set>

#include "animated.h"
#include "costate/scene/scene_kind.h"
#include "process.h"
#include "support/markup.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Words = std::vector<std::string>;
using Point = std::array<double, 3>;

namespace {

const std::string kFiveBar = COSTATE_MODELS_DIR "/five_bar/five_bar.toml";

/// One .vtp taken apart; counts must be consistent.
class Frame {
 public:
  explicit Frame(const std::string& file) {
    INFO(file.substr(0, 200));
    REQUIRE(xml_fault(file).empty());
    REQUIRE(file.rfind("<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\" header_type=\"UInt64\">",
                       0) == 0);
    for (const std::string& text : all_between(file, "Array type=\"", "Array>")) {
      const std::size_t body = text.find('>') + 1;
      const std::string attributes = "type=\"" + text.substr(0, body);
      const auto value = [&](const std::string& key) {
        const auto found = all_between(attributes, key + "=\"", "\"");
        return found.empty() ? "" : found[0];
      };
      REQUIRE(value("format") == "binary");
      const std::string bytes = decoded(text.substr(body, text.find('<') - body));
      std::uint64_t count = 0;
      REQUIRE(bytes.size() >= sizeof count);
      std::memcpy(&count, bytes.data(), sizeof count);
      REQUIRE(bytes.size() == sizeof count + count);
      arrays_[value("Name")] = {value("type"), value("NumberOfComponents"), bytes.substr(sizeof count)};
      if (value("Name") == "element_names") name_count_ = std::stoul(value("NumberOfTuples"));
    }
    const auto time = numbers<double>("TimeValue", "Float64", "");
    REQUIRE(time.size() == 1);
    t = time[0];
    const std::string& list = arrays_.at("element_names").bytes;
    for (std::size_t at = 0, end; (end = list.find('\0', at)) != std::string::npos; at = end + 1)
      names.push_back(list.substr(at, end - at));
    REQUIRE(names.size() == name_count_);
    CHECK(std::set<std::string>(names.begin(), names.end()).size() == names.size());
    const auto x = numbers<float>("Points", "Float32", "3");
    for (std::size_t i = 0; i < x.size(); i += 3) points.push_back({x[i], x[i + 1], x[i + 2]});
    connectivity = numbers<std::int32_t>("connectivity", "Int32", "");
    element = numbers<std::int32_t>("element", "Int32", "");
    const auto offsets = numbers<std::int32_t>("offsets", "Int32", "");
    CHECK(file.find("<Piece NumberOfPoints=\"" + std::to_string(points.size()) +
                    "\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"" +
                    std::to_string(offsets.size()) + "\">") != std::string::npos);
    REQUIRE(element.size() == offsets.size());
    REQUIRE(connectivity.size() == 3 * offsets.size());
    REQUIRE(numbers<std::uint8_t>("color", "UInt8", "4").size() == 4 * offsets.size());
    std::set<std::int32_t> used;
    for (std::size_t i = 0; i < offsets.size(); ++i) {
      REQUIRE(offsets[i] == static_cast<std::int32_t>(3 * i + 3));
      REQUIRE((element[i] >= 0 && static_cast<std::size_t>(element[i]) < names.size()));
    }
    for (const auto i : connectivity) {
      REQUIRE((i >= 0 && static_cast<std::size_t>(i) < points.size()));
      used.insert(i);
    }
    CHECK(used.size() == points.size());
    for (const Point& p : points)
      for (const double c : p) REQUIRE(std::isfinite(c));
  }

  /// The points of an element's cells, in the order of the file.
  std::vector<Point> points_of(const std::string& name) const {
    const auto id = std::find(names.begin(), names.end(), name) - names.begin();
    std::set<std::int32_t> indices;
    for (std::size_t k = 0; k < connectivity.size(); ++k)
      if (element[k / 3] == id) indices.insert(connectivity[k]);
    std::vector<Point> found;
    for (const auto i : indices) found.push_back(points[static_cast<std::size_t>(i)]);
    REQUIRE(!found.empty());
    return found;
  }

  double t = 0;
  std::vector<std::string> names;
  std::vector<Point> points;
  std::vector<std::int32_t> connectivity, element;

 private:
  struct Array {
    std::string type, components, bytes;
  };
  template <class Number>
  std::vector<Number> numbers(const std::string& name, const std::string& type, const std::string& components) const {
    INFO(name);
    REQUIRE(arrays_.count(name) == 1);
    const Array& a = arrays_.at(name);
    CHECK(a.type == type);
    CHECK(a.components == components);
    REQUIRE(a.bytes.size() % sizeof(Number) == 0);
    std::vector<Number> x(a.bytes.size() / sizeof(Number));
    std::memcpy(x.data(), a.bytes.data(), a.bytes.size());
    return x;
  }
  std::map<std::string, Array> arrays_;
  std::size_t name_count_ = 0;
};

/// All frames of a collection, in its order; cells are the same ones in each, and no other frame is beside them.
std::vector<Frame> series(const WorkingDirectory& here, const std::string& name = "m") {
  const std::string collection = file_text(here / (name + ".pvd"));
  REQUIRE(xml_fault(collection).empty());
  REQUIRE(collection.rfind("<VTKFile type=\"Collection\" version=\"1.0\" byte_order=", 0) == 0);
  const auto times = all_between(collection, "<DataSet timestep=\"", "\""),
             files = all_between(collection, " file=\"", "\"");
  REQUIRE(times.size() == files.size());
  std::vector<Frame> frames;
  std::set<std::string> beside;
  for (const std::string& entry : here.entries())
    if (entry.rfind(name + "/", 0) == 0) beside.insert(entry);
  CHECK(beside == std::set<std::string>(files.begin(), files.end()));
  for (std::size_t i = 0; i < files.size(); ++i) {
    frames.emplace_back(file_text(here / files[i]));
    CHECK(std::stod(times[i]) == frames[i].t);  // all digits
    if (i > 0) CHECK(frames[i].t > frames[i - 1].t);
    CHECK(frames[i].connectivity == frames[0].connectivity);
    CHECK(frames[i].element == frames[0].element);
    CHECK(frames[i].names == frames[0].names);
  }
  return frames;
}

std::vector<Frame> written(const std::string& scene, Words options = {}) {
  const WorkingDirectory here;
  options.insert(options.begin(), {"animate", scene, "-o", "m.pvd"});
  const Outcome o = run_costate(options, here.path());
  INFO(scene << ": " << o.err);
  REQUIRE(o.status == 0);
  return series(here);
}

std::string stored(const std::string& scene, const std::string& step) {
  const WorkingDirectory here;
  REQUIRE(run_costate({"simulate", scene, "--csv", "--output-step", step, "--output", "r"}, here.path()).status == 0);
  return file_text(here / "r/trajectory.csv");
}

}  // namespace

TEST_CASE("animate: a series for ParaView has points and springs where and when the run has them") {
  const auto frames = written(kFiveBar, {"--output-step", "0.05"});
  const std::string csv = stored(kFiveBar, "0.05");
  const auto x = csv_column(csv, "P2.x"), y = csv_column(csv, "P2.y"), x3 = csv_column(csv, "P3.x"),
             y3 = csv_column(csv, "P3.y");
  REQUIRE(x.size() == 101);
  REQUIRE(frames.size() == x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    CHECK(frames[i].t == Approx(0.05 * static_cast<double>(i)).margin(1e-15));
    // P2 is a ball about the point: its middle, of floats below 4 m, which are off by 1.2e-7 m, as is its radius.
    Point low = frames[i].points_of("P2")[0], high = low;
    for (const Point& p : frames[i].points_of("P2"))
      for (std::size_t k = 0; k < 3; ++k) {
        low[k] = std::min(low[k], p[k]);
        high[k] = std::max(high[k], p[k]);
      }
    CHECK(0.5 * (low[0] + high[0]) == Approx(x[i]).margin(2.4e-7));
    CHECK(0.5 * (low[1] + high[1]) == Approx(y[i]).margin(2.4e-7));
    CHECK(0.5 * (low[2] + high[2]) == Approx(0).margin(2.4e-7));
    // The wire of the spring S1 leads from A, the origin, to P3: from end to end along the way between them.
    const double length = std::hypot(x3[i], y3[i]);
    double from = HUGE_VAL, to = -HUGE_VAL;
    for (const Point& p : frames[i].points_of("S1")) {
      const double along = (p[0] * x3[i] + p[1] * y3[i]) / length;
      from = std::min(from, along);
      to = std::max(to, along);
    }
    CHECK((std::abs(from) < 0.1 * length && std::abs(to - length) < 0.1 * length));
  }
}

TEST_CASE("animate: a series for ParaView turns bodies with their quaternions, in the scene's axes") {
  const std::string scene = COSTATE_MODELS_DIR "/heavy_top/heavy_top.toml";
  const auto frames = written(scene, {"--output-step", "0.1"});
  const std::string csv = stored(scene, "0.1");
  std::vector<std::vector<double>> e, at;
  for (const char* name : {"top.e0", "top.e1", "top.e2", "top.e3"}) e.push_back(csv_column(csv, name));
  for (const char* name : {"top.x", "top.y", "top.z"}) at.push_back(csv_column(csv, name));
  REQUIRE(frames.size() == e[0].size());
  /// The columns of the body's axes in the ground's, from Euler parameters.
  const auto turned = [&](std::size_t i) {
    // Of length 1 to the solver's tolerance; the drawing has them of length 1.
    const double s = std::hypot(std::hypot(e[0][i], e[1][i]), std::hypot(e[2][i], e[3][i]));
    const double a = e[0][i] / s, b = e[1][i] / s, c = e[2][i] / s, d = e[3][i] / s;
    return std::array<Point, 3>{Point{a * a + b * b - c * c - d * d, 2 * (b * c + a * d), 2 * (b * d - a * c)},
                                Point{2 * (b * c - a * d), a * a - b * b + c * c - d * d, 2 * (c * d + a * b)},
                                Point{2 * (b * d + a * c), 2 * (c * d - a * b), a * a - b * b - c * c + d * d}};
  };
  const auto first = frames[0].points_of("top");
  const auto axes0 = turned(0);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const auto now = frames[i].points_of("top");
    const auto axes = turned(i);
    REQUIRE(now.size() == first.size());
    for (std::size_t n = 0; n < now.size(); ++n)
      for (std::size_t k = 0; k < 3; ++k) {
        double r = at[k][i];
        for (std::size_t axis = 0; axis < 3; ++axis)
          for (std::size_t l = 0; l < 3; ++l) r += axes[axis][k] * axes0[axis][l] * (first[n][l] - at[l][0]);
        // Floats below 2 m are off by 6e-8 m: here, and in each coordinate of what is turned.
        CHECK(now[n][k] == Approx(r).margin(2e-7));
      }
  }
}

TEST_CASE("animate: a series for ParaView of every kind's example, and of wheels, contacts and ground") {
  const WorkingDirectory here;
  for (const auto& kind : costate::scene_kinds()) {
    INFO(kind.name);
    if (kind.example.empty()) continue;
    write_text(here / "s.toml", kind.example);
    written((here / "s.toml").string(), {"--t-end", "0.02", "--output-step", "0.01"});
  }
  const auto car =
      written(COSTATE_MODELS_DIR "/iltis/double_lane_change.toml", {"--t-end", "0.1", "--output-step", "0.05"});
  CHECK(!car[0].points_of("chassis").empty());
  const auto ball = written(COSTATE_MODELS_DIR "/bouncing_ball/bouncing_ball.toml", {"--output-step", "0.5"});
  CHECK(std::any_of(ball[0].names.begin(), ball[0].names.end(),
                    [](const std::string& name) { return name.rfind("ground.", 0) == 0; }));
}

TEST_CASE("animate: a new series for ParaView replaces all of the old one and nothing else") {
  const WorkingDirectory here;
  const auto run = [&](const std::string& step) {
    const Outcome o = run_costate({"animate", kFiveBar, "-o", "m.pvd", "--output-step", step}, here.path());
    INFO(o.err);
    CHECK(o.status == 0);
    return o;
  };
  CHECK_THAT(run("0.1").out, Contains("m.pvd: 51 samples of t = 0 .. 5 s"));
  CHECK(series(here).size() == 51);
  const auto before = here.entries();
  run("0.1");  // the same motion has the same names
  CHECK(here.entries() == before);
  run("1");
  CHECK(series(here).size() == 6);
  write_text(here / "m/mine.vtp", "");
  run("0.5");
  CHECK(file_text(here / "m/mine.vtp").empty());
  CHECK(here.entries().size() == 1 + 1 + 11 + 1);
}

TEST_CASE("animate: an interrupted series for ParaView leaves what was there") {
  const WorkingDirectory here;
  const auto frames = [&] {
    const auto entries = here.entries();
    return std::count_if(entries.begin(), entries.end(),
                         [](const std::string& e) { return std::filesystem::path(e).extension() == ".vtp"; });
  };
  const auto interrupt = [&](long beyond) {
    Process process(COSTATE_EXECUTABLE, {"animate", kFiveBar, "-o", "m.pvd", "--output-step", "0.001"}, here.path());
    REQUIRE(process.wait_until([&] { return frames() > beyond; }));
    process.send(SIGINT);
    const Outcome o = process.finish();
    CHECK(o.status == 128 + SIGINT);
    CHECK_THAT(o.err, Contains("interrupted"));
  };
  interrupt(3);
  CHECK(here.entries().empty());
  REQUIRE(run_costate({"animate", kFiveBar, "-o", "m.pvd", "--output-step", "1"}, here.path()).status == 0);
  const auto before = here.entries();
  interrupt(9);
  CHECK(here.entries() == before);
  CHECK(series(here).size() == 6);
}

TEST_CASE("animate: turns too fast for the samples are told of every sort of file") {
  const WorkingDirectory here;
  write_text(here / "s.toml",
             "[body.disk]\nx_m = 0\ny_m = 0\nangle_rad = 0\nangular_velocity_rad_per_s = 20\nmass_kg = 1\n"
             "inertia_kg_m2 = 1\n[start]\ngiven = [\"disk.x\", \"disk.y\", \"disk.angle\"]\n[run]\nt_end_s = 1\n");
  for (const char* file : {"m.gltf", "m.html", "m.svg", "m.pvd"}) {
    const Outcome o = run_costate({"animate", "s.toml", "-o", file, "--output-step", "0.1", "--no-files"}, here.path());
    CHECK(o.status == 0);
    CHECK_THAT(o.err, Contains("'disk' turns by up to 115 degrees from one sample to the next"));
  }
}

TEST_CASE("animate: mistakes with series for ParaView") {
  const WorkingDirectory here;
  const Outcome slow = run_costate({"animate", kFiveBar, "-o", "m.pvd", "--speed", "0.5"}, here.path());
  CHECK(slow.status == 1);
  CHECK_THAT(slow.err, Contains("--speed is not for .pvd"));
  const Outcome none = run_costate({"animate", kFiveBar, "-o", "m.pvd", "--no-files"}, here.path());
  CHECK(none.status == 0);
  CHECK(here.entries().empty());
  write_text(here / "m", "a file");
  const Outcome taken = run_costate({"animate", kFiveBar, "-o", "m.pvd"}, here.path());
  CHECK(taken.status == 1);
  CHECK_THAT(taken.err, Contains("go into the folder 'm', but that is a file"));
  CHECK(here.entries() == Words{"m"});
  // Names that XML has to write otherwise, and one that it cannot.
  REQUIRE(run_costate({"animate", kFiveBar, "-o", "a & b.pvd", "--output-step", "5"}, here.path()).status == 0);
  CHECK_THAT(file_text(here / "a & b.pvd"), Contains("file=\"a &amp; b/"));
  const Outcome bytes = run_costate({"animate", kFiveBar, "-o", "a\xff.pvd"}, here.path());
  CHECK(bytes.status == 1);
  CHECK_THAT(bytes.err, Contains("which XML cannot hold"));
}
