// Reports in a browser: the motion is drawn and plays, and nothing goes wrong on the way. Without Chromium, or
// three.js, these are passed over.
#include <catch2/catch.hpp>

#include "browser.h"
#include "five_bar.h"
#include "support/markup.h"
#include "support/paths.h"

using namespace costate::test;
using Catch::Matchers::Contains;
using Json = nlohmann::json;

TEST_CASE("pages: the report of an optimization shows both motions and plays") {
  if (!no_viewer().empty()) {
    WARN("skipped: " << no_viewer());
    return;
  }
  const WorkingDirectory here;
  costate_json({"optimize", kFiveBar, "--output", "out"}, here.path());
  const std::string page = file_text(here / "out/report.html");
  CHECK(all_between(page, "data-name=\"before\">", "</script>").size() == 1);
  CHECK(page.size() < 6'000'000);
  const Json told = told_by(here, "out/report.html", R"js(
const slider = document.getElementById('time'), button = document.getElementById('play'), layout = document.getElementById('layout');
told.drawn = document.body.dataset.drawn;
told.still = document.getElementById('still').hidden;
told.layouts = Array.from(layout.options, o => o.value);
const later = () => {
  told.played = Number(slider.value);
  told.label = document.getElementById('label').textContent;
  button.click();
  told.paused = button.textContent;
  for (const way of told.layouts) { layout.value = way; layout.onchange(); }
};)js");
  CHECK(std::stoi(told.at("drawn").get<std::string>()) > 10);
  CHECK(told.at("still") == true);
  CHECK(told.at("layouts") == Json({"over", "beside", "before", "after"}));
  CHECK(told.at("played").get<double>() > 0.1);  // it plays on frames of some 1/60 s, at most 0.1 s each
  CHECK_THAT(told.at("label").get<std::string>(), Contains("t = "));
  CHECK(told.at("paused") == "Play");
}

TEST_CASE("pages: events are marks at the slider, which lead there") {
  if (!no_viewer().empty()) {
    WARN("skipped: " << no_viewer());
    return;
  }
  const WorkingDirectory here;
  const std::string scene = std::string(COSTATE_MODELS_DIR) + "/bouncing_ball/bouncing_ball.toml";
  const Json j = costate_json({"simulate", scene, "--report", "--output", "out"}, here.path());
  const Json told = told_by(here, "out/simulate.html", R"js(
const marks = document.querySelectorAll('#marks span');
told.marks = marks.length;
marks[0].click();
told.label = document.getElementById('label').textContent;
told.paths = document.querySelectorAll('svg[data-across]')[0].querySelectorAll('path.mark').length;
const later = () => {};)js");
  REQUIRE(j.at("events").size() > 3);
  CHECK(told.at("marks") == j.at("events").size());
  CHECK(told.at("paths") == j.at("events").size());
  CHECK_THAT(told.at("label").get<std::string>(), Contains("contact.floor: touch at"));
}

// Pixels are read before the browser takes the picture away, within the same task.
constexpr const char* kPicture = R"js(
const canvas = document.getElementById('view');
const picture = at => {  // at a time, or as it is
  if (at !== undefined) document.dispatchEvent(new CustomEvent('costate-seek', {detail: at}));
  const gl = canvas.getContext('webgl'), p = new Uint8Array(4 * canvas.width * canvas.height);
  gl.readPixels(0, 0, canvas.width, canvas.height, gl.RGBA, gl.UNSIGNED_BYTE, p);
  return new Uint32Array(p.buffer);
};
const ink = a => a.filter(x => x !== 0xffffffff).length;
const changed = (a, b) => a.filter((x, i) => x !== b[i]).length;
const mouse = (target, type, x, more) => target.dispatchEvent(
    new MouseEvent(type, {clientX: x, clientY: 300, bubbles: true, cancelable: true, ...more}));
const dragged = more => {
  mouse(canvas, 'mousedown', 400, more);
  mouse(document, 'mousemove', 500, more);
  const p = picture();
  mouse(document, 'mouseup', 500, more);
  return p;
};
const wheel = () => canvas.dispatchEvent(new WheelEvent('wheel', {deltaY: -100, bubbles: true, cancelable: true}));
)js";

TEST_CASE("pages: a motion is drawn by three.js, from several sides, and nothing is fetched for it") {
  if (!no_viewer().empty()) {
    WARN("skipped: " << no_viewer());
    return;
  }
  const WorkingDirectory here;
  const std::string scene = std::string(COSTATE_MODELS_DIR) + "/five_bar/five_bar.toml";
  REQUIRE(run_costate({"animate", scene, "-o", "m.html"}, here.path()).status == 0);
  const auto library = all_between(file_text(here / "m.html"), "<script id=\"three\">", "</script>");
  REQUIRE(library.size() == 1);
  CHECK_THAT(library[0], Contains("Copyright (c) 2010-2019 three.js authors") && Contains("shall be included in"));
#ifdef COSTATE_THREE_DIR
  for (const char* file : {"/three.min.js", "/examples/js/controls/OrbitControls.js"})
    CHECK(library[0].find(file_text(std::string(COSTATE_THREE_DIR) + file)) != std::string::npos);
#endif
  const Json told = told_by(here, "m.html", std::string(kPicture) + R"js(
told.revision = THREE.REVISION;
const first = picture(0), second = picture(1.3);
told.size = first.length;
told.ink = [ink(first), ink(second)];
told.moved = changed(first, second);
told.same = changed(second, picture(1.3));
const turned = dragged({});
told.turned = changed(second, turned);
told.shifted = changed(turned, dragged({shiftKey: true}));
canvas.style.height = '200px';
const later = () => {
  told.tall = canvas.height;
  told.fetched = performance.getEntriesByType('resource').map(e => e.name);
  const before = ink(picture(1.3));
  for (let i = 0; i < 10; ++i) wheel();
  told.nearer = ink(picture()) / before;
};)js");
  CHECK(std::stoi(told.at("revision").get<std::string>()) >= 111);
  const int size = told.at("size");
  for (const int ink : told.at("ink")) CHECK((ink > size / 1000 && ink < size / 2));
  CHECK(told.at("moved") > size / 1000);
  CHECK(told.at("same") == 0);
  CHECK(told.at("turned") > size / 1000);
  CHECK(told.at("shifted") > size / 1000);
  CHECK(told.at("tall") == 200);
  CHECK(told.at("nearer") > 1.5);
  CHECK(told.at("fetched").empty());
}

TEST_CASE("pages: of two motions the earlier is a ghost, each has half the view, and the wheel is a long page's") {
  if (!no_viewer().empty()) {
    WARN("skipped: " << no_viewer());
    return;
  }
  const WorkingDirectory here;
  costate_json({"optimize", kFiveBar, "--output", "out"}, here.path());
  const Json told = told_by(here, "out/report.html", std::string(kPicture) + R"js(
const layout = document.getElementById('layout');
const shown = way => { layout.value = way; layout.onchange(); return picture(2); };
const over = shown('over'), after = shown('after'), before = shown('before'), beside = shown('beside');
told.ghost = changed(over, after);
told.red = over.filter((x, i) => x !== after[i] && (x & 0xff) > (x >> 16 & 0xff)).length;  // its colour, over white
told.alone = changed(before, after);
const half = (p, right) => p.filter((x, i) => (2 * (i % canvas.width) >= canvas.width) === right);
told.halves = [ink(half(beside, false)), ink(half(beside, true))];
told.size = over.length;
const still = wheel(), far = picture();
told.left = still && changed(beside, far) === 0;
canvas.focus();
told.taken = !wheel();
told.nearer = changed(far, picture());
const later = () => {};)js");
  const int size = told.at("size");
  CHECK(told.at("ghost") > size / 2000);
  CHECK(told.at("red") > 0.8 * told.at("ghost").get<int>());  // but where it crosses blue
  CHECK(told.at("alone") > size / 2000);
  for (const int ink : told.at("halves")) CHECK(ink > size / 2000);
  CHECK(told.at("left") == true);
  CHECK(told.at("taken") == true);
  CHECK(told.at("nearer") > size / 2000);
}

TEST_CASE("pages: where there is no WebGL the drawing stays") {
  if (!no_viewer().empty()) {
    WARN("skipped: " << no_viewer());
    return;
  }
  const WorkingDirectory here;
  const std::string scene = std::string(COSTATE_MODELS_DIR) + "/five_bar/five_bar.toml";
  REQUIRE(run_costate({"animate", scene, "-o", "m.html"}, here.path()).status == 0);
  std::string page = file_text(here / "m.html");
  page.insert(page.find("<body>") + 6, "<script>HTMLCanvasElement.prototype.getContext = () => null;</script>");
  write_text(here / "without.html", page);
  const Json told = told_by(here, "without.html", R"js(
told.viewer = document.getElementById('viewer').hidden;
told.drawing = document.querySelector('#still svg').getBoundingClientRect().height;
const later = () => { told.drawn = document.body.dataset.drawn === undefined; };)js");
  CHECK(told.at("viewer") == true);
  CHECK(told.at("drawing") > 100);
  CHECK(told.at("drawn") == true);
}

TEST_CASE("pages: a motion of very many solids is left out, and the page says where it is seen") {
  const WorkingDirectory here;
  std::string scene = "[gravity]\ny_m_per_s2 = -9.81\n\n[point.P0]\nground = true\nx_m = 0\ny_m = 0\n";
  const int count = 1900;  // two solids each
  for (int i = 1; i <= count; ++i)
    scene += "\n[point.P" + std::to_string(i) + "]\nx_m = " + std::to_string(i) + "\ny_m = 0\n[mass.m" +
             std::to_string(i) + "]\npoint = \"P" + std::to_string(i) + "\"\nmass_kg = 1\n";
  scene += "\n[run]\nt_end_s = 0.01\noutputs = [\"P1.y\"]\nformulation = \"baumgarte\"\n";
  write_text(here / "s.toml", scene);
  costate_json({"simulate", "s.toml", "--report", "--output", "out", "--output-step", "0.005"}, here.path());
  const std::string page = file_text(here / "out/simulate.html");
  CHECK(page.size() < 1'000'000);
  CHECK(xml_fault(page).empty());
  CHECK_THAT(page, Contains("costate animate&#39; shows it") && !Contains("<canvas"));
}
