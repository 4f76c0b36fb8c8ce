// A page that shows a stage in 3-D by itself: no network, nothing else to install.
#pragma once

#include <string>

#include "stage.h"

namespace costate::app {

/// HTML with the stage as glTF and a viewer (WebGL) inside: play, pause, a slider of time, a camera. Without scripts or
/// WebGL it shows `drawing`, an SVG.
std::string viewer_page(const Stage& stage, const std::string& title, const std::string& drawing);

}  // namespace costate::app
