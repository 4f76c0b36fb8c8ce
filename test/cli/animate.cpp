// costate animate: that what it writes is glTF 2.0 (its structure as the specification has it), that nodes are where
// the motion is, and that drawings play.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>
#include <cstring>
#include <map>
#include <set>

#include "animated.h"
#include "browser.h"
#include "costate/scene/scene_kind.h"
#include "process.h"
#include "support/markup.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

namespace {

const std::string kModels = COSTATE_MODELS_DIR;

/// A file taken apart as the specification says; every use is checked.
class Gltf {
 public:
  explicit Gltf(const std::string& file) {
    if (file.rfind("glTF", 0) == 0) {
      const auto word = [&](std::size_t at) {
        std::uint32_t x = 0;
        REQUIRE(at + 4 <= file.size());
        std::memcpy(&x, file.data() + at, 4);
        return x;
      };
      CHECK(word(4) == 2);
      CHECK(word(8) == file.size());
      const std::size_t text = word(12), data = word(20 + text);
      CHECK(word(16) == 0x4E4F534A);
      CHECK(word(24 + text) == 0x004E4942);
      CHECK((text % 4 == 0 && data % 4 == 0 && 28 + text + data == file.size()));
      json = Json::parse(file.substr(20, text));
      bytes_ = file.substr(28 + text);
    } else {
      json = Json::parse(file);
      const std::string uri = json.at("buffers").at(0).at("uri"), head = "data:application/octet-stream;base64,";
      REQUIRE(uri.rfind(head, 0) == 0);
      bytes_ = decoded(uri.substr(head.size()));
    }
    CHECK(json.at("asset").at("version") == "2.0");
    REQUIRE(json.at("buffers").size() == 1);
    const std::size_t length = json.at("buffers").at(0).at("byteLength");
    REQUIRE(bytes_.size() >= length);
    CHECK(bytes_.size() - length < 4);  // a binary file is filled up
    check_nodes();
    for (const Json& m : json.at("meshes")) check_mesh(m);
    for (const Json& m : json.at("materials"))
      for (const Json& c : m.at("pbrMetallicRoughness").at("baseColorFactor"))
        CHECK((c.get<double>() >= 0 && c.get<double>() <= 1));
    if (json.contains("animations"))
      for (const Json& a : json.at("animations")) check_animation(a);
  }

  template <class Number>
  std::vector<Number> numbers(std::size_t accessor, int component, const std::string& type) const {
    const Json& a = json.at("accessors").at(accessor);
    CHECK(a.at("componentType") == component);
    CHECK(a.at("type") == type);
    const std::map<std::string, std::size_t> widths = {{"SCALAR", 1}, {"VEC3", 3}, {"VEC4", 4}};
    const std::size_t count = a.at("count"), width = widths.at(type);
    CHECK(count > 0);
    const Json& v = json.at("bufferViews").at(a.at("bufferView").get<std::size_t>());
    const std::size_t offset = v.value("byteOffset", 0UL), length = v.at("byteLength");
    CHECK(v.at("buffer") == 0);
    CHECK(offset % 4 == 0);
    REQUIRE(offset + length <= json.at("buffers").at(0).at("byteLength").get<std::size_t>());
    REQUIRE(count * width * sizeof(Number) <= length);
    std::vector<Number> x(count * width);
    std::memcpy(x.data(), bytes_.data() + offset, x.size() * sizeof(Number));
    for (const Number n : x) REQUIRE(std::isfinite(static_cast<double>(n)));
    if (a.contains("min"))
      for (std::size_t k = 0; k < width; ++k) {
        Number low = x[k], high = x[k];
        for (std::size_t i = k; i < x.size(); i += width) {
          low = std::min(low, x[i]);
          high = std::max(high, x[i]);
        }
        CHECK(a.at("min").at(k).get<Number>() == low);
        CHECK(a.at("max").at(k).get<Number>() == high);
      }
    return x;
  }

  /// What a node's channel holds, or its constant value at each time.
  std::vector<float> channel(const std::string& name, const std::string& path) const {
    std::size_t node = 0;
    while (json.at("nodes").at(node).value("name", "") != name) ++node;
    for (const Json& c : json.at("animations").at(0).at("channels"))
      if (c.at("target").at("node") == node && c.at("target").at("path") == path) {
        const std::size_t s = c.at("sampler");
        return numbers<float>(json.at("animations").at(0).at("samplers").at(s).at("output"), 5126,
                              path == "rotation" ? "VEC4" : "VEC3");
      }
    return json.at("nodes").at(node).at(path).get<std::vector<float>>();
  }
  bool has(const std::string& name) const {
    for (const Json& n : json.at("nodes"))
      if (n.value("name", "") == name) return true;
    return false;
  }

  Json json;

 private:
  /// Unit to the rounding of floats: four squares, each rounded, and the components themselves.
  static void check_unit(const float* q) {
    const double norm =
        std::sqrt(double(q[0]) * q[0] + double(q[1]) * q[1] + double(q[2]) * q[2] + double(q[3]) * q[3]);
    CHECK(norm == Approx(1).margin(4e-7));
  }

  void check_nodes() {
    const Json& nodes = json.at("nodes");
    std::multiset<std::size_t> children;
    for (const Json& n : nodes) {
      if (n.contains("children")) {
        CHECK(!n.at("children").empty());
        for (const Json& c : n.at("children")) children.insert(c.get<std::size_t>());
      }
      if (n.contains("mesh")) CHECK(n.at("mesh").get<std::size_t>() < json.at("meshes").size());
      if (n.contains("rotation")) {
        const auto q = n.at("rotation").get<std::vector<float>>();
        REQUIRE(q.size() == 4);
        check_unit(q.data());
      }
    }
    // A tree: every node but the roots of the scene is somebody's child, once.
    for (const Json& root : json.at("scenes").at(json.at("scene").get<std::size_t>()).at("nodes"))
      children.insert(root.get<std::size_t>());
    CHECK(children.size() == nodes.size());
    CHECK((children.size() == std::set<std::size_t>(children.begin(), children.end()).size()));
    CHECK((children.empty() || *children.rbegin() < nodes.size()));
  }

  void check_mesh(const Json& mesh) {
    for (const Json& p : mesh.at("primitives")) {
      const std::size_t position = p.at("attributes").at("POSITION");
      CHECK(json.at("accessors").at(position).contains("min"));
      const auto corners = numbers<float>(position, 5126, "VEC3");
      const auto normals = numbers<float>(p.at("attributes").at("NORMAL"), 5126, "VEC3");
      REQUIRE(normals.size() == corners.size());
      for (std::size_t i = 0; i < normals.size(); i += 3)
        REQUIRE(std::hypot(normals[i], normals[i + 1], normals[i + 2]) == Approx(1).margin(1e-6));
      const auto triangles = numbers<std::uint32_t>(p.at("indices"), 5125, "SCALAR");
      CHECK(triangles.size() % 3 == 0);
      CHECK(*std::max_element(triangles.begin(), triangles.end()) < corners.size() / 3);
      CHECK(p.at("material").get<std::size_t>() < json.at("materials").size());
    }
  }

  void check_animation(const Json& animation) {
    std::set<std::pair<std::size_t, std::string>> targets;
    REQUIRE(!animation.at("channels").empty());
    for (const Json& c : animation.at("channels")) {
      const std::size_t node = c.at("target").at("node");
      const std::string path = c.at("target").at("path");
      CHECK(node < json.at("nodes").size());
      CHECK(targets.insert({node, path}).second);
      const Json& sampler = animation.at("samplers").at(c.at("sampler").get<std::size_t>());
      CHECK(sampler.at("interpolation") == "LINEAR");
      CHECK(json.at("accessors").at(sampler.at("input").get<std::size_t>()).contains("min"));
      const auto times = numbers<float>(sampler.at("input"), 5126, "SCALAR");
      CHECK(times.front() >= 0);
      for (std::size_t i = 1; i < times.size(); ++i) REQUIRE(times[i] > times[i - 1]);
      const bool turns = path == "rotation";
      CHECK((turns || path == "translation" || path == "scale"));
      const auto values = numbers<float>(sampler.at("output"), 5126, turns ? "VEC4" : "VEC3");
      REQUIRE(values.size() == times.size() * (turns ? 4 : 3));
      if (turns)
        for (std::size_t i = 0; i < values.size(); i += 4) check_unit(values.data() + i);
    }
  }

  std::string bytes_;
};

Gltf animated(const std::string& scene, std::vector<std::string> options = {}, const std::string& name = "m.gltf") {
  const WorkingDirectory here;
  options.insert(options.begin(), {"animate", scene, "-o", name});
  const Outcome o = run_costate(options, here.path());
  INFO(scene << ": " << o.err);
  REQUIRE(o.status == 0);
  CHECK(here.entries() == std::vector<std::string>{name});
  return Gltf(file_text(here / name));
}

}  // namespace

TEST_CASE("animate: points and springs are where the motion has them") {
  const std::string scene = kModels + "/five_bar/five_bar.toml";
  const Gltf g = animated(scene, {"--output-step", "0.05"});
  const WorkingDirectory here;
  REQUIRE(run_costate({"simulate", scene, "--csv", "--output-step", "0.05", "--output", "r"}, here.path()).status == 0);
  const std::string csv = file_text(here / "r/trajectory.csv");
  const auto x = csv_column(csv, "P2.x"), y = csv_column(csv, "P2.y"), x3 = csv_column(csv, "P3.x"),
             y3 = csv_column(csv, "P3.y");
  const auto at = g.channel("P2", "translation"), stretch = g.channel("S1", "scale");
  REQUIRE(x.size() == 101);
  REQUIRE(at.size() == 3 * x.size());
  for (std::size_t i = 0; i < x.size(); ++i) {
    // Floats, and CSV's digits.
    CHECK(at[3 * i] == Approx(x[i]).margin(1e-6));
    CHECK(at[3 * i + 1] == Approx(y[i]).margin(1e-6));
    CHECK(at[3 * i + 2] == 0);
    // The spring S1 leads from A, the origin, to P3.
    CHECK(stretch[3 * i + 1] == Approx(std::hypot(x3[i], y3[i])).margin(1e-6));
  }
  CHECK(g.json.at("nodes").at(0).contains("rotation") == false);  // y is up already
}

TEST_CASE("animate: bodies turn with their quaternions, z becomes y") {
  const std::string scene = kModels + "/heavy_top/heavy_top.toml";
  const Gltf g = animated(scene, {"--output-step", "0.01"}, "m.glb");
  const WorkingDirectory here;
  REQUIRE(run_costate({"simulate", scene, "--csv", "--output-step", "0.01", "--output", "r"}, here.path()).status == 0);
  const std::string csv = file_text(here / "r/trajectory.csv");
  const auto turn = g.channel("top", "rotation");
  std::vector<std::vector<double>> e;
  for (const char* name : {"top.e1", "top.e2", "top.e3", "top.e0"}) e.push_back(csv_column(csv, name));
  REQUIRE(turn.size() == 4 * e[0].size());
  for (std::size_t i = 0; i < e[0].size(); ++i) {
    double dot = 0, before = 1;
    for (std::size_t k = 0; k < 4; ++k) dot += e[k][i] * turn[4 * i + k];
    if (i > 0) {
      before = 0;
      for (std::size_t k = 0; k < 4; ++k) before += double(turn[4 * i + k]) * turn[4 * i - 4 + k];
    }
    CHECK(std::abs(dot) == Approx(1).margin(1e-6));
    CHECK(before > 0);  // no jump to the other sign of the same turn
  }
  const auto q = g.json.at("nodes").at(0).at("rotation").get<std::vector<double>>();
  CHECK(q[0] == Approx(-std::sqrt(0.5)));
  CHECK(q[3] == Approx(std::sqrt(0.5)));
}

TEST_CASE("animate: every kind's example, and models with wheels, contacts and ground") {
  const WorkingDirectory here;
  for (const auto& kind : costate::scene_kinds()) {
    INFO(kind.name);
    if (kind.example.empty()) continue;
    write_text(here / "s.toml", kind.example);
    animated((here / "s.toml").string(), {"--t-end", "0.02", "--output-step", "0.01"});
  }
  const Gltf car = animated(kModels + "/iltis/double_lane_change.toml", {"--t-end", "0.2", "--output-step", "0.05"});
  CHECK(car.has("chassis"));
  const Gltf ball = animated(kModels + "/bouncing_ball/bouncing_ball.toml");
  int grounds = 0;
  for (const Json& n : ball.json.at("nodes")) grounds += n.value("name", "").rfind("ground.", 0) == 0 ? 1 : 0;
  CHECK(grounds == 1);
}

TEST_CASE("animate: a drawing that plays, at the speed asked for") {
  const WorkingDirectory here;
  const std::string scene = kModels + "/five_bar/five_bar.toml";
  const Outcome o = run_costate({"animate", scene, "-o", "m.svg", "--output-step", "0.5", "--speed", "2"}, here.path());
  CHECK(o.status == 0);
  CHECK_THAT(o.out, Contains("m.svg: 11 samples of t = 0 .. 5 s"));
  const std::string svg = file_text(here / "m.svg");
  std::size_t frames = 0;
  for (std::size_t at = 0; (at = svg.find("<animate ", at)) != std::string::npos; ++at) ++frames;
  CHECK(frames == 11);
  CHECK_THAT(svg, Contains("<title>t = 4.5 s</title>") && Contains("dur=\"2.5s\"") &&
                      Contains("values=\"hidden;visible;hidden\" keyTimes=\"0;0.100000;0.200000\""));
}

TEST_CASE("animate: mistakes, and spins too fast to be shown") {
  const WorkingDirectory here;
  const std::string scene = kModels + "/five_bar/five_bar.toml";
  const Outcome kind = run_costate({"animate", scene, "-o", "m.mp4"}, here.path());
  CHECK(kind.status == 1);
  CHECK_THAT(kind.err, Contains("ends in .gltf, .glb, .html, .svg or .pvd, found 'm.mp4'"));
  CHECK(run_costate({"animate", scene}, here.path()).status == 2);
  const Outcome slow = run_costate({"animate", scene, "-o", "m.svg", "--speed", "0"}, here.path());
  CHECK_THAT(slow.err, Contains("--speed must be a positive number"));
  CHECK(here.entries().empty());
  const Outcome fast =
      run_costate({"animate", kModels + "/heavy_top/heavy_top.toml", "-o", "m.gltf", "--output-step", "0.1", "--json"},
                  here.path());
  CHECK(fast.status == 0);
  const Json j = one_object(fast.out);
  CHECK_THAT(j.at("warnings").dump(), Contains("take a smaller --output-step"));
  CHECK(j.at("samples") == 21);
  // An arrow that points the other way is no spin.
  write_text(here / "push.toml", R"TOML(
[point.P]
x_m = 0
y_m = 0
[mass.m]
point = "P"
mass_kg = 1
[force.push]
point = "P"
formula_x_N = "cos(20*t)"
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 1
)TOML");
  CHECK(one_object(run_costate({"animate", "push.toml", "-o", "p.gltf", "--no-files", "--json"}, here.path()).out)
            .at("warnings")
            .empty());
  std::filesystem::remove(here / "push.toml");
  const Outcome none = run_costate({"animate", scene, "-o", "n.gltf", "--no-files"}, here.path());
  CHECK(none.status == 0);
  CHECK(here.entries() == std::vector<std::string>{"m.gltf"});
}

TEST_CASE("animate: a page with a viewer inside, which plays in a browser") {
  const WorkingDirectory here;
  const std::string scene = kModels + "/five_bar/five_bar.toml";
  REQUIRE(run_costate({"animate", scene, "-o", "m.html"}, here.path()).status == 0);
  const std::string page = file_text(here / "m.html");
  CHECK(xml_fault(page).empty());
  CHECK_THAT(without_libraries(page), Contains("<svg ") && !Contains("src=") && !Contains("https://"));
  if (!has_three) {  // the drawing alone
    CHECK_THAT(page, !Contains("<script") && !Contains("<canvas ") && !Contains("hidden="));
    WARN("skipped: built without three.js");
    return;
  }
  CHECK_THAT(page, Contains("<canvas "));
  const std::string head = "<script class=\"gltf\" type=\"application/json\" data-name=\"\">";
  const auto from = page.find(head) + head.size();
  const Gltf g(page.substr(from, page.find("</script>", from) - from));
  CHECK(g.has("P2"));
  // In Chromium, where it is there: every node is drawn, and nothing is said on the console.
  if (!has_browser()) {
    WARN("skipped: no chromium");
    return;
  }
  const Outcome o = browsed(here.path(), "m.html");
  INFO(o.err);
  CHECK(o.status == 0);
  CHECK_THAT(o.out, Contains("data-drawn=\"" + std::to_string(g.json.at("nodes").size() - 1) + "\""));
  CHECK_THAT(o.err, !Contains("CONSOLE"));
}
