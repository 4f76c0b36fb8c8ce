// The page of costate compare.
#include <fmt/format.h>

#include "command_pages.h"
#include "costate/named_outputs.h"
#include "costate/page_parts.h"

namespace costate::app {

namespace {
constexpr std::size_t kOutputs = 8;
}

std::string compare_page(const Setup& a, const Json& j, const std::string& text, const TrajectoryTable& motion_a,
                         const TrajectoryTable& motion_b) {
  HtmlPage page(title_of(a));
  for (const char* side : {"a", "b"}) add_warnings(page, j.at(side));
  page.heading("Comparison");
  add_text(page, text);
  page.heading("Outputs");
  std::vector<SvgPlot> plots;
  std::string left_out;
  for (const Json& output : j.at("outputs")) {
    const std::string name = output.at("name").get<std::string>(), unit = output.at("unit").get<std::string>();
    const Column *of_a = column_of_output(motion_a, name), *of_b = column_of_output(motion_b, name);
    if (!of_a || !of_b || of_a->values.size() != of_b->values.size()) continue;
    if (plots.size() >= 2 * kOutputs) {
      left_out += (left_out.empty() ? "" : ", ") + name;
      continue;
    }
    const std::string label = unit.empty() || unit == "1" ? name : fmt::format("{} [{}]", name, unit);
    SvgPlot both, apart;
    both.x_label = apart.x_label = "time [s]";
    both.y_label = label;
    both.curves = {{"B", motion_b.time_s, of_b->values, SvgCurve::Stroke::light, false},
                   {"A", motion_a.time_s, of_a->values, SvgCurve::Stroke::dark, false}};
    std::vector<double> difference;
    for (std::size_t k = 0; k < of_a->values.size(); ++k) difference.push_back(of_a->values[k] - of_b->values[k]);
    apart.y_label = label + ", A - B";
    apart.curves = {{"", motion_b.time_s, difference, SvgCurve::Stroke::dark, false}};
    plots.push_back(std::move(both));
    plots.push_back(std::move(apart));
  }
  page.plots(plots);
  if (!left_out.empty()) page.paragraph("Not drawn: " + left_out + ".");
  return page.text();
}

}  // namespace costate::app
