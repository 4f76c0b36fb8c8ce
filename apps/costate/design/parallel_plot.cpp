#include "parallel_plot.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/record/svg_plot.h"

namespace costate::app {

namespace {

constexpr double kHeight = 320, kTop = 44, kBottom = kHeight - 30, kLeft = 60;

struct Range {
  double low = std::numeric_limits<double>::infinity(), high = -low;
  /// 0 to 1; in the middle where all are equal.
  double part(double x) const { return high > low ? (x - low) / (high - low) : 0.5; }
};

/// From blue over grey to red, far apart also in their lightness.
std::string color_at(double part) {
  const auto mix = [&](double a, double b, double c) {
    const double x = part < 0.5 ? a + 2 * part * (b - a) : b + (2 * part - 1) * (c - b);
    return static_cast<int>(std::lround(x));
  };
  return fmt::format("#{:02x}{:02x}{:02x}", mix(20, 150, 209), mix(49, 150, 73), mix(110, 160, 60));
}

}  // namespace

std::string svg_of(const ParallelPlot& plot) {
  const std::size_t count = plot.axes.size();
  std::vector<Range> ranges(count);
  for (const auto& p : plot.points)
    for (std::size_t k = 0; k < count; ++k)
      if (std::isfinite(p[k])) {
        ranges[k].low = std::min(ranges[k].low, p[k]);
        ranges[k].high = std::max(ranges[k].high, p[k]);
      }
  const double gap = std::clamp(900.0 / static_cast<double>(count - 1), 110.0, 240.0),
               width = 2 * kLeft + gap * static_cast<double>(count - 1);
  const auto across = [&](std::size_t k) { return kLeft + gap * static_cast<double>(k); };
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "role=\"img\" class=\"parallel\" font-family=\"sans-serif\" font-size=\"12\" fill=\"#222222\">\n<title>parallel "
      "coordinates</title>\n",
      width, kHeight);
  // The best, those of the least value that colors, on top.
  std::vector<std::size_t> order(plot.points.size());
  for (std::size_t i = 0; i < order.size(); ++i) order[i] = i;
  const auto value = [&](std::size_t i) {
    const double x = plot.points[i][plot.colored_by];
    return std::isfinite(x) ? x : std::numeric_limits<double>::infinity();
  };
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return value(a) > value(b); });
  for (const std::size_t i : order) {
    const auto& p = plot.points[i];
    const bool colored = std::isfinite(p[plot.colored_by]);
    std::string path;
    bool open = false;
    for (std::size_t k = 0; k < count; ++k) {
      if (!std::isfinite(p[k])) {
        open = false;
        continue;
      }
      path += fmt::format("{}{:.1f} {:.1f}", open ? "L" : "M", across(k),
                          kBottom - (kBottom - kTop) * ranges[k].part(p[k]));
      open = true;
    }
    out += fmt::format(
        "<path d=\"{}\" fill=\"none\" stroke=\"{}\" stroke-opacity=\"0.7\" stroke-width=\"1.3\">"
        "<title>{}</title></path>\n",
        path, colored ? color_at(ranges[plot.colored_by].part(p[plot.colored_by])) : "#bbbbbb",
        xml_escaped(plot.names[i]));
  }
  const auto text = [&](double x, double y, const std::string& what) {
    out += fmt::format("<text x=\"{:.1f}\" y=\"{:.1f}\" text-anchor=\"middle\">{}</text>\n", x, y, xml_escaped(what));
  };
  for (std::size_t k = 0; k < count; ++k) {
    out += fmt::format("<line x1=\"{0:.1f}\" x2=\"{0:.1f}\" y1=\"{1:.1f}\" y2=\"{2:.1f}\" stroke=\"#888888\"/>\n",
                       across(k), kTop, kBottom);
    text(across(k), 14, plot.axes[k]);
    if (!(ranges[k].low <= ranges[k].high)) continue;
    text(across(k), kTop - 6, fmt::format("{:.5g}", ranges[k].high));
    text(across(k), kBottom + 16, fmt::format("{:.5g}", ranges[k].low));
  }
  return out + "</svg>\n";
}

}  // namespace costate::app
