// The page of costate modes.
#include <algorithm>
#include <cmath>

#include "command_pages.h"
#include "costate/page_parts.h"

namespace costate::app {

namespace {

/// Each root with its conjugate; those to the right of the dashed line grow.
SvgPlot plane_of_roots(const Json& modes) {
  SvgPlot plot;
  plot.x_label = "real [1/s]";
  plot.y_label = "imaginary [1/s]";
  plot.height = 360;
  SvgCurve stable, growing;
  double high = 0;
  for (std::size_t k = 0; k < modes.size(); ++k) {
    const double found = modes[k].at("real_per_s").get<double>(), im = modes[k].at("imaginary_per_s").get<double>();
    // What rounding leaves of an undamped root neither grows nor stretches the axis.
    const double re = std::abs(found) > 1e-12 * std::hypot(found, im) ? found : 0;
    SvgCurve& c = re > 0 ? growing : stable;
    for (const double y : {im, -im}) {
      c.x.push_back(re);
      c.y.push_back(y);
      c.names.push_back("mode " + std::to_string(k + 1));
      if (im == 0) break;
    }
    high = std::max(high, std::abs(im));
  }
  stable.joined = growing.joined = false;
  growing.color = "#d1495b";
  if (!growing.x.empty()) growing.name = "growing";
  if (high == 0) high = 1;
  plot.curves = {
      {"", {0, 0}, {-1.1 * high, 1.1 * high}, SvgCurve::Stroke::dashed, false}, std::move(stable), std::move(growing)};
  return plot;
}

}  // namespace

std::string modes_page(const Scene& scene, const Json& j, const std::string& head,
                       const std::vector<std::vector<std::string>>& rows) {
  HtmlPage page(scene.title.empty() ? scene.file_name() : scene.title);
  add_warnings(page, j);
  if (!scene.description.empty()) page.paragraph(scene.description);
  page.heading("Modes");
  add_text(page, head);
  page.table({"#mode", "#frequency [Hz]", "#damping", "#real [1/s]", "kinetic energy in"}, rows);
  if (j.at("modes").empty()) return page.text();
  page.heading("Roots");
  page.paragraph("Left of the dashed line a disturbance dies out, right of it it grows.");
  page.plots({plane_of_roots(j.at("modes"))});
  return page.text();
}

}  // namespace costate::app
