// Figures of a mechanism as SVG: one, or those of a motion that plays.
#pragma once

#include <string>
#include <vector>

#include "figure.h"

namespace costate::app {

struct DrawOptions {
  std::string view;  // xy, xz, yz, isometric; empty: xy in the plane, isometric in space
  double width = 640;
  bool no_names = false;
};

/// One figure as a page.
std::string drawing(const Figure& figure, const DrawOptions& options);

/// Figures at increasing times [s] as one page that shows them one after the other (SMIL, no scripts), again and again,
/// `speed` times as fast as the motion was. All are drawn to one scale.
std::string moving_drawing(const std::vector<Figure>& figures, const std::vector<double>& times,
                           const DrawOptions& options, double speed);

}  // namespace costate::app
