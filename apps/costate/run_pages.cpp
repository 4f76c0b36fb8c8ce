#include "run_pages.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "costate/base/notice.h"
#include "costate/record/atomic_file.h"
#include "costate/record/interrupt.h"
#include "digits.h"
#include "page/bars.h"
#include "page_parts.h"
#include "trajectory.h"

namespace costate::app {

namespace {

/// The multipliers and the unit circle in the complex plane.
std::string circle(const Json& multipliers) {
  constexpr double size = 320, centre = size / 2;
  double reach = 1.15;
  for (const Json& m : multipliers)
    reach = std::max(reach, 1.1 * std::hypot(m.at(0).get<double>(), m.at(1).get<double>()));
  const double unit = (centre - 10) / reach;
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {0:.0f} {0:.0f}\" width=\"{0:.0f}\" height=\"{0:.0f}\" "
      "role=\"img\" class=\"multipliers\">\n<title>multipliers and the unit circle</title>\n"
      "<circle cx=\"{1:.1f}\" cy=\"{1:.1f}\" r=\"{2:.2f}\" fill=\"none\" stroke=\"#888888\"/>\n"
      "<path d=\"M0 {1:.1f}H{0:.0f}M{1:.1f} 0V{0:.0f}\" stroke=\"#dddddd\"/>\n",
      size, centre, unit);
  for (const Json& m : multipliers) {
    const double re = m.at(0).get<double>(), im = m.at(1).get<double>();
    out += fmt::format(
        "<circle class=\"m\" cx=\"{:.2f}\" cy=\"{:.2f}\" r=\"4\" fill=\"{}\"><title>{:.6g} {} {:.6g} "
        "i</title></circle>\n",
        centre + unit * re, centre - unit * im, std::hypot(re, im) < 1 ? "#14316e" : "#d1495b", re, im < 0 ? '-' : '+',
        std::abs(im));
  }
  return out + "</svg>\n";
}

void add_page_motion(HtmlPage& page, const Setup& setup, const TrajectoryTable* motion) {
  if (motion) add_motion(page, setup, {{"", motion, setup.scene}}, "Motion", true);
}

}  // namespace

std::optional<TrajectoryTable> motion_for_page(const Setup& setup, const Json& settings) try {
  TrajectoryTable table = shown_trajectory(setup, setup.rho, settings);
  for (const auto& remark : not_finite_remarks(table)) notice(remark);
  return table;
} catch (const Interrupted&) {
  throw;
} catch (const SolverError& e) {
  notice(fmt::format("The motion of the page could not be computed: {}", e.what()));
  return {};
}

std::string written_page(const Setup& setup, const std::string& file, const std::string& page) {
  const bool written = setup.write_file(file, [&](const auto& path) { write_file_atomically(path, page); });
  return written ? fmt::format("  report: {}\n", (setup.directory / file).string()) : "";
}

std::string gradient_page(const Setup& setup, const Json& j, const TrajectoryTable* motion) {
  HtmlPage page(title_of(setup));
  add_run(page, setup, j);
  page.heading("Gradient");
  page.paragraph(page_psi(setup, j), true);
  std::vector<std::string> header = {"parameter",        "#value", "#d(psi)/d(parameter)",
                                     "#estimated error", "#scale", "#times scale"};
  const bool several = j.contains("cases");
  for (std::size_t i = 0; several && i < j.at("cases").size(); ++i)
    header.push_back("#psi of " + j.at("cases")[i].at("name").get<std::string>());
  std::vector<std::vector<std::string>> rows;
  std::vector<std::pair<std::string, double>> scaled;
  double largest = 0;
  for (const Parameter& p : setup.problem.parameters.parameters)
    largest = std::max(largest, std::abs(j.at("gradient").at(p.name).get<double>() * p.scale));
  for (const Parameter& p : setup.problem.parameters.parameters) {
    const double g = shown(j.at("gradient").at(p.name).get<double>(), largest / p.scale);
    const Json& errors = j.at("gradient_error");
    scaled.emplace_back(p.name, g * p.scale);
    rows.push_back({p.name, fmt::format("{:.9g}", j.at("parameters").at(p.name).get<double>()),
                    fmt::format("{:.9g}", g), errors.is_object() ? page_number(errors, p.name.c_str()) : "-",
                    page_number(p.scale), page_number(g * p.scale)});
    for (std::size_t i = 0; several && i < j.at("cases").size(); ++i)
      rows.back().push_back(page_number(j.at("cases")[i].at("gradient").at(p.name).get<double>()));
  }
  page.table(header, rows);
  page.paragraph("What a change of each parameter by its scale would make of psi, to first order:");
  page.part("<div class=\"plots\">\n" + bars("derivatives times scales", scaled) + "</div>\n", "");
  add_page_motion(page, setup, motion);
  return page.text();
}

std::string cycle_page(const Setup& setup, const Json& j, const std::string& text, const TrajectoryTable* motion) {
  HtmlPage page(title_of(setup));
  if (!setup.scene.description.empty()) page.paragraph(setup.scene.description);
  page.heading("Cycle");
  std::vector<std::string> lines;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);)
    if (line.find_first_not_of(' ') != std::string::npos) lines.push_back(line);
  if (!lines.empty()) lines.erase(lines.begin());  // the title
  std::string body;
  for (const std::string& line : lines) body += line + "\n";
  add_text(page, body);
  if (!j.at("multipliers").empty()) {
    page.heading("Multipliers");
    page.paragraph("Inside of the circle a disturbance dies out, outside it grows.");
    page.part("<div class=\"plots\">\n" + circle(j.at("multipliers")) + "</div>\n", "");
  }
  add_warnings(page, j);
  add_page_motion(page, setup, motion);
  return page.text();
}

}  // namespace costate::app
