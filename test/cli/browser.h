// Pages opened in headless Chromium, for tests.
#pragma once

#include <catch2/catch.hpp>
#include <cstdlib>
#include <nlohmann/json.hpp>

#include "process.h"
#include "support/markup.h"
#include "support/paths.h"

namespace costate::test {

inline bool has_browser() { return std::system("command -v chromium > /dev/null 2>&1") == 0; }

/// Whether the tool was built with what shows motions in 3-D.
#ifdef COSTATE_THREE_DIR
inline constexpr bool has_three = true;
#else
inline constexpr bool has_three = false;
#endif

/// Whether it was built with what draws plots that are read off and zoomed.
#ifdef COSTATE_CHART_DIR
inline constexpr bool has_chart = true;
#else
inline constexpr bool has_chart = false;
#endif

/// Why no motion can be seen in 3-D here, or empty.
inline std::string no_viewer() { return !has_three ? "built without three.js" : !has_browser() ? "no chromium" : ""; }

/// Why no plot can be read off here, or empty.
inline std::string no_chart() { return !has_chart ? "built without Chart.js" : !has_browser() ? "no chromium" : ""; }

/// Opens a page of a folder for two seconds of its own time. What the page is then is the output, what it said on the
/// console is among the errors, with the word CONSOLE.
inline Outcome browsed(const std::filesystem::path& folder, const std::string& page) {
  return Process("/bin/sh",
                 {"-c",
                  "timeout 120 chromium --headless --no-sandbox --user-data-dir=$PWD/profile --enable-logging=stderr "
                  "--use-gl=angle --use-angle=swiftshader --enable-unsafe-swiftshader --virtual-time-budget=2000 "
                  "--dump-dom file://$PWD/" +
                      page},
                 folder)
      .finish();
}

/// Opens the page with a program at its end, which tells what it found as JSON in the body's data-told.
inline nlohmann::json told_by(const WorkingDirectory& here, const std::string& page, const std::string& program) {
  std::string text = file_text(here / page);
  const std::size_t end = text.rfind("</body>");
  REQUIRE(end != std::string::npos);
  text.insert(end, "<script>\n'use strict';\n(function () {\nconst told = {};\n" + program +
                       "\nsetTimeout(() => { later(); document.body.dataset.told = JSON.stringify(told); }, "
                       "1000);\n})();\n</script>\n");
  write_text(here / "probed.html", text);
  const Outcome o = browsed(here.path(), "probed.html");
  INFO(o.err);
  REQUIRE(o.status == 0);
  CHECK_THAT(o.err, !Catch::Matchers::Contains("CONSOLE"));
  const auto found = all_between(o.out, "data-told=\"", "\"");
  REQUIRE(found.size() == 1);
  std::string json = found[0];
  for (std::size_t at = 0; (at = json.find("&quot;", at)) != std::string::npos; ++at) json.replace(at, 6, "\"");
  return nlohmann::json::parse(json);
}

}  // namespace costate::test
