// The program that makes the plots of a page (costate/record/svg_plot.h) answer the mouse, drawn by Chart.js.
#pragma once

namespace costate::app {

/// Values under the pointer, a span of the abscissa by dragging, all of it by a double click; a curve is hidden by a
/// click on its name. In plots over time a click is the moment that the viewer shows ('costate-seek'), and a line marks
/// the one that it shows ('costate-time'). It reads the SVG of a plot and hides it on the screen, not on paper.
const char* plot_script();
/// What it needs in the page's style.
const char* plot_style();
/// Chart.js: empty where the build did not find it; pages show their SVG then.
const char* plot_library();

}  // namespace costate::app
