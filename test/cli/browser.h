// Pages opened in headless Chromium, for tests.
#pragma once

#include <cstdlib>

#include "process.h"

namespace costate::test {

inline bool has_browser() { return std::system("command -v chromium > /dev/null 2>&1") == 0; }

/// Whether the tool was built with what shows motions in 3-D.
#ifdef COSTATE_THREE_DIR
inline constexpr bool has_three = true;
#else
inline constexpr bool has_three = false;
#endif

/// Why no motion can be seen in 3-D here, or empty.
inline std::string no_viewer() { return !has_three ? "built without three.js" : !has_browser() ? "no chromium" : ""; }

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

}  // namespace costate::test
