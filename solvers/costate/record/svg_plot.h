// Line plots as SVG, for reports: axes with ticks at round numbers, labels, a legend, and curves that stay apart in
// black and white (a light broad line under a dark thin one). No scripts, no fonts or styles from elsewhere.
#pragma once

#include <string>
#include <vector>

namespace costate {

/// Text inside XML or HTML, or inside a quoted attribute: & < > " ' are escaped; what is no valid UTF-8, and characters
/// that XML forbids, become U+FFFD.
std::string xml_escaped(const std::string& text);

struct SvgCurve {
  enum class Stroke {
    dark,    // thin and dark: what the plot is about
    light,   // broad and light: what it is compared with
    dashed,  // a limit
  };
  std::string name;          // in the legend; empty: not there
  std::vector<double> x, y;  // of equal length; the line breaks at values that are not finite
  Stroke stroke = Stroke::dark;
  bool markers = false;  // a dot a point
  // Of plots with many curves: a color ("#14316e") and a pattern of dashes ("6 3") of its own; empty: the stroke's.
  std::string color = {}, dashes = {};
  /// Not joined: dots alone, each with its name, which browsers show under the mouse, where there are names.
  bool joined = true;
  std::vector<std::string> names = {};
};

struct SvgPlot {
  std::string x_label, y_label;    // with units: "time [s]"
  std::vector<SvgCurve> curves;    // the last is drawn on top
  std::vector<double> marks = {};  // along x, as thin lines: events
  bool logarithmic = false;        // y; values that are not positive are left out
  bool counting = false;           // x counts something: ticks at whole numbers only
  int width = 560, height = 260;   // of the drawing; it scales with the page
  bool logarithmic_x = false;      // values that are not positive are left out
  bool legend_beside = false;      // a column at the right, for many curves; else a line above
};

/// The plot as one <svg> element, well-formed XML. Curves of many points are thinned to what can be seen, extremes
/// kept. Attributes tell a program what a pixel is (data-across, data-up: from and to in pixels, low and high there,
/// linear or log10), as do data-name which curve is which and data-markers which dots are those of the line before.
/// Throws Error when a curve's x and y differ in length.
std::string svg_of(const SvgPlot& plot);

}  // namespace costate
