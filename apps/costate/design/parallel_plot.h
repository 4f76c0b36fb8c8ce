// Parallel coordinates: an upright axis for each quantity, a line across them for each point. As SVG, without scripts;
// a browser names the line under the mouse.
#pragma once

#include <string>
#include <vector>

namespace costate::app {

struct ParallelPlot {
  std::vector<std::string> axes;            // at least two
  std::vector<std::string> names;           // of the points
  std::vector<std::vector<double>> points;  // of each a value an axis; where one is not finite the line breaks
  std::size_t colored_by = 0;               // an axis: from blue, its least, to red
};

/// One <svg> element, well-formed XML.
std::string svg_of(const ParallelPlot& plot);

}  // namespace costate::app
