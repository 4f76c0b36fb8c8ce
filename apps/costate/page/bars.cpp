#include "bars.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/record/svg_plot.h"

namespace costate::app {

std::string bars(const std::string& title, const std::vector<std::pair<std::string, double>>& values) {
  constexpr double row = 22, left = 160, middle = 420, half = 200, width = 740;
  double largest = 0;
  for (const auto& [name, x] : values) largest = std::max(largest, std::abs(x));
  const double height = row * static_cast<double>(values.size()) + 10;
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {1:.0f}\" width=\"{0:.0f}\" height=\"{1:.0f}\" "
      "role=\"img\" class=\"bars\" font-family=\"sans-serif\" font-size=\"12\" fill=\"#222222\">\n"
      "<title>{3}</title>\n<line x1=\"{2:.0f}\" x2=\"{2:.0f}\" y1=\"0\" y2=\"{1:.0f}\" "
      "stroke=\"#888888\"/>\n",
      width, height, middle, xml_escaped(title));
  double y = 5;
  for (const auto& [name, x] : values) {
    const double length = largest > 0 ? half * std::abs(x) / largest : 0;
    out +=
        fmt::format("<text x=\"{:.0f}\" y=\"{:.1f}\" text-anchor=\"end\">{}</text>\n", left, y + 13, xml_escaped(name));
    out += fmt::format("<rect x=\"{:.2f}\" y=\"{:.1f}\" width=\"{:.2f}\" height=\"14\" fill=\"{}\"/>\n",
                       x < 0 ? middle - length : middle, y + 2, length, x < 0 ? "#d1495b" : "#14316e");
    out += fmt::format("<text x=\"{:.0f}\" y=\"{:.1f}\">{:.4g}</text>\n", middle + half + 12, y + 13, x);
    y += row;
  }
  return out + "</svg>\n";
}

}  // namespace costate::app
