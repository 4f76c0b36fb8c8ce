// The page of costate sweep.
#include <fmt/format.h>

#include <cmath>

#include "command_pages.h"
#include "costate/page_parts.h"

namespace costate::app {

namespace {

constexpr std::size_t kPlots = 24;
constexpr std::size_t kRows = 200;

/// What is no number is null in JSON; plots leave it out.
std::vector<double> numbers(const Json& list) {
  std::vector<double> values;
  for (const Json& x : list) values.push_back(x.is_number() ? x.get<double>() : NAN);
  return values;
}

std::string with_unit(const std::string& name, const std::string& unit) {
  return unit.empty() || unit == "1" ? name : fmt::format("{} [{}]", name, unit);
}

}  // namespace

std::string sweep_page(const Scene& scene, const Json& j) {
  HtmlPage page(scene.title.empty() ? scene.file_name() : scene.title);
  if (j.contains("error")) page.paragraph("Stopped: " + j.at("error").get<std::string>(), true);
  add_warnings(page, j);
  if (!scene.description.empty()) page.paragraph(scene.description);
  const auto coordinate = with_unit(j.at("coordinate").get<std::string>(), j.at("unit").get<std::string>());
  const std::vector<double> at = numbers(j.at("values"));
  page.heading("Sweep of " + j.at("coordinate").get<std::string>());
  if (!at.empty())
    page.paragraph(fmt::format("{} points of {} from {:g} to {:g} {}", at.size(), j.at("coordinate").get<std::string>(),
                               at.front(), at.back(), j.at("unit").get<std::string>()));
  std::vector<std::pair<std::string, std::vector<double>>> columns;
  for (const auto& [name, list] : j.at("outputs").items())
    columns.emplace_back(with_unit(name, j.at("units").at(name).get<std::string>()), numbers(list));
  columns.emplace_back("held_force", numbers(j.at("held_force")));
  std::vector<SvgPlot> plots;
  std::string left_out;
  for (const auto& [label, values] : columns) {
    if (plots.size() >= kPlots) {
      left_out += (left_out.empty() ? "" : ", ") + label;
      continue;
    }
    SvgPlot plot;
    plot.x_label = coordinate;
    plot.y_label = label;
    plot.curves = {{"", at, values, SvgCurve::Stroke::dark, at.size() <= 60}};
    plots.push_back(std::move(plot));
  }
  page.plots(plots);
  page.paragraph("held_force is what pushes the coordinate there.");
  if (!left_out.empty()) page.paragraph("Not drawn, but in sweep.csv: " + left_out + ".");
  if (at.size() > kRows || columns.size() > kPlots) {
    page.paragraph(fmt::format("The table of {} points is in sweep.csv.", at.size()));
    return page.text();
  }
  std::vector<std::string> header = {"#" + coordinate};
  for (const auto& [label, values] : columns) header.push_back("#" + label);
  std::vector<std::vector<std::string>> rows;
  for (std::size_t k = 0; k < at.size(); ++k) {
    rows.push_back({page_number(at[k])});
    for (const auto& [label, values] : columns) rows.back().push_back(page_number(values[k]));
  }
  page.table(header, rows);
  return page.text();
}

}  // namespace costate::app
