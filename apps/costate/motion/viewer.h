// Pages that show motions in 3-D by themselves, with three.js inside: no network, nothing else to install.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "stage.h"

namespace costate::app {

/// Motions to be seen at once, of one start.
struct Viewed {
  std::vector<std::pair<std::string, Stage>> motions;  // with their names; over the last one the others are ghosts
  std::vector<std::pair<double, std::string>> events;  // [s], in order: marks at the slider
  double speed = 1;                                    // how many times as fast as the motion it plays
  std::string drawing;                                 // what is shown without scripts or WebGL: SVG, or nothing
};

/// A part of a page, well-formed XML: the stages as glTF and a viewer (WebGL) with play, pause, a slider of time and a
/// camera; of several motions over each other, side by side, or one. The page needs viewer_style() and room for one.
/// Built without three.js it is the drawing alone.
std::string viewer_element(const Viewed& viewed, const std::string& title);
std::string viewer_style();

/// A page with the viewer alone.
std::string viewer_page(const Viewed& viewed, const std::string& title);

/// The viewer's program, in JavaScript, and three.js, which it draws with: empty where the build did not find it.
const char* viewer_script();
const char* viewer_library();
inline bool has_viewer() { return *viewer_library() != '\0'; }

}  // namespace costate::app
