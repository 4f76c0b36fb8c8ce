#include "study_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <sstream>

#include "costate/design/parallel_plot.h"
#include "costate/html_page.h"
#include "costate/page_parts.h"
#include "study_row.h"
#include "study_table.h"

namespace costate::app {

namespace {

constexpr std::size_t kScatters = 12, kAxes = 10;  // plots and axes of a design
constexpr std::size_t kPoints = 2000;              // drawn of a design

/// The last part of a path, or two where one alone would be that of another.
std::string short_name(const std::string& name) {
  const std::size_t dot = name.rfind('.');
  const std::size_t before = dot == std::string::npos || dot == 0 ? std::string::npos : name.rfind('.', dot - 1);
  return before == std::string::npos ? name : name.substr(before + 1);
}

struct Quantity {
  std::string name;
  std::vector<double> values;  // a run each; not a number where there is none
};

/// Yes is 1, no is 0; not a number where there is none.
double number_in(const Json& value) {
  return value.is_number() ? value.get<double>() : value.is_boolean() ? static_cast<double>(value.get<bool>()) : NAN;
}

std::vector<Quantity> quantities_of(const std::vector<Json>& rows, const std::vector<const char*>& groups) {
  std::vector<Quantity> list;
  for (const char* group : groups) {
    std::vector<std::string> names;
    for (const Json& r : rows)
      if (r.contains(group) && r[group].is_object())
        for (const auto& [name, x] : r[group].items())
          if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
    for (const std::string& name : names) {
      Quantity q{name, {}};
      for (const Json& r : rows) {
        const bool there = r.contains(group) && r[group].is_object() && r[group].contains(name);
        q.values.push_back(there ? number_in(r[group][name]) : NAN);
      }
      list.push_back(std::move(q));
    }
  }
  return list;
}

/// What came out of each run: psi, where there is one or nothing else, that of cases, outputs.
std::vector<Quantity> results_of(const std::vector<Json>& rows) {
  std::vector<Quantity> list(1);
  list[0].name = "psi";
  for (const Json& r : rows) {
    const char* key = r.contains("psi_after") ? "psi_after" : "psi";
    list[0].values.push_back(r.contains(key) ? number_in(r[key]) : NAN);
  }
  for (Quantity& q : quantities_of(rows, {"cases", "outputs"})) list.push_back(std::move(q));
  const auto& psi = list[0].values;
  if (list.size() > 1 && std::none_of(psi.begin(), psi.end(), [](double x) { return std::isfinite(x); }))
    list.erase(list.begin());
  return list;
}

std::vector<std::string> names_of(const std::vector<Json>& rows) {
  std::vector<std::string> names;
  for (const Json& r : rows) names.push_back(r["name"].get<std::string>());
  return names;
}

SvgPlot scatter(const Quantity& x, const Quantity& y, const std::vector<std::string>& names) {
  SvgPlot plot;
  plot.x_label = short_name(x.name);
  plot.y_label = short_name(y.name);
  plot.width = 370;
  plot.height = 240;
  plot.curves = {{"", x.values, y.values}};
  plot.curves.front().joined = false;
  for (std::size_t i = 0; i < names.size(); ++i)
    plot.curves.front().names.push_back(
        fmt::format("{}: {} = {:.6g}, {} = {:.6g}", names[i], x.name, x.values[i], y.name, y.values[i]));
  return plot;
}

void add_front(HtmlPage& page, const Json& pareto, const std::vector<Quantity>& results,
               const std::vector<std::string>& names) {
  const auto wanted = pareto.at("quantities").get<std::vector<std::string>>(),
             front = pareto.at("front").get<std::vector<std::string>>();
  page.paragraph(fmt::format("Pareto front: {} of {} runs are such that no other one is as small in all of these.",
                             front.size(), names.size()));
  const auto find = [&](const std::string& name) {
    return std::find_if(results.begin(), results.end(), [&](const Quantity& q) { return q.name == name; });
  };
  std::vector<SvgPlot> plots;
  for (std::size_t a = 0; a < wanted.size(); ++a)
    for (std::size_t b = a + 1; b < wanted.size(); ++b) {
      const auto x = find(wanted[a]), y = find(wanted[b]);
      if (x == results.end() || y == results.end()) continue;
      SvgPlot plot = scatter(*x, *y, names);
      plot.width = 560;
      plot.height = 400;
      plot.curves.front().color = "#b8b8b8";
      SvgCurve best = plot.curves.front();
      best.color = "#14316e";
      best.name = "Pareto front";
      for (std::size_t i = 0; i < names.size(); ++i)
        if (std::find(front.begin(), front.end(), names[i]) == front.end()) best.x[i] = best.y[i] = NAN;
      plot.curves.push_back(std::move(best));
      plots.push_back(std::move(plot));
    }
  page.plots(plots);
}

void add_design(HtmlPage& page, const std::string& design, std::vector<Json> rows, const Json& pareto) {
  page.heading("Design " + design);
  std::vector<std::vector<std::string>> failed;
  for (const Json& r : rows)
    if (r.contains("error")) failed.push_back({r["name"].get<std::string>(), r["error"].get<std::string>()});
  if (!failed.empty()) {
    page.paragraph(fmt::format("{} of {} points could not be run:", failed.size(), rows.size()));
    failed.resize(std::min<std::size_t>(failed.size(), 20));
    page.table({"run", "why"}, failed);
  }
  if (rows.size() > kPoints) {
    page.paragraph(fmt::format("Of {} points the first {} are drawn; {}.csv has all.", rows.size(), kPoints, design));
    rows.resize(kPoints);
  }
  const std::vector<std::string> names = names_of(rows);
  const std::vector<Quantity> varied = quantities_of(rows, {"varied"}), results = results_of(rows),
                              optima = quantities_of(rows, {"parameters_after"});
  if (pareto.contains(design)) add_front(page, pareto.at(design), results, names);
  std::vector<SvgPlot> plots;
  for (const Quantity& y : results)
    for (const Quantity& x : varied)
      if (plots.size() < kScatters) plots.push_back(scatter(x, y, names));
  page.plots(plots);
  if (results.size() * varied.size() > kScatters)
    page.paragraph(fmt::format("More pairs than these {} are in {}.csv.", kScatters, design));
  ParallelPlot parallel;
  parallel.names = names;
  parallel.points.resize(names.size());
  const std::string& shade = results.front().name;
  for (const auto* list : {&varied, &optima, &results})
    for (const Quantity& q : *list) {
      const bool shades = q.name == shade && list == &results;
      if (parallel.axes.size() >= kAxes && !shades) continue;
      if (shades) parallel.colored_by = parallel.axes.size();
      parallel.axes.push_back(list == &optima ? "best " + short_name(q.name) : short_name(q.name));
      for (std::size_t i = 0; i < names.size(); ++i) parallel.points[i].push_back(q.values[i]);
    }
  page.paragraph(
      fmt::format("A line for each run across all quantities, from blue, the least {}, to red, the largest:", shade));
  page.part("<div class=\"plots\">\n" + svg_of(parallel) + "</div>\n", "");
}

}  // namespace

Json pareto_of_designs(const Json& rows) {
  Json all = Json::object();
  for (const auto& [design, own] : rows_by_design(rows)) {
    if (!own.front().contains("pareto")) continue;
    const auto wanted = own.front()["pareto"].get<std::vector<std::string>>();
    std::vector<std::vector<double>> values(own.size());
    for (const Quantity& q : results_of(own))
      if (std::find(wanted.begin(), wanted.end(), q.name) != wanted.end())
        for (std::size_t i = 0; i < own.size(); ++i) values[i].push_back(q.values[i]);
    Json front = Json::array();
    for (std::size_t i = 0; i < own.size(); ++i) {
      const auto bad = [&](const std::vector<double>& v) {
        return v.size() != wanted.size() || std::any_of(v.begin(), v.end(), [](double x) { return !std::isfinite(x); });
      };
      if (bad(values[i])) continue;
      const bool beaten = std::any_of(values.begin(), values.end(), [&](const std::vector<double>& other) {
        if (bad(other) || other == values[i]) return false;
        for (std::size_t k = 0; k < other.size(); ++k)
          if (other[k] > values[i][k]) return false;
        return true;
      });
      if (!beaten) front.push_back(own[i]["name"]);
    }
    all[design] = {{"quantities", wanted}, {"front", front}};
  }
  return all;
}

std::string study_page(const std::string& title, const Json& rows, const Json& pareto, const std::string& text) {
  HtmlPage page(title);
  std::vector<std::vector<std::string>> runs;
  for (const Json& r : rows) {
    if (r.contains("design")) continue;
    const Json change = r.contains("improvement") ? r["improvement"] : Json();
    const bool verdict = r.contains("verdict") && r["verdict"].is_string();
    runs.push_back({r["name"].get<std::string>(), r["status"].get<std::string>(), page_number(r, "psi_before"),
                    page_number(r, "psi_after"),
                    change.is_number() ? fmt::format("{:+.3g} %", -100 * change.get<double>()) : "-",
                    page_number(r, "evaluations"), page_number(r, "wall_s"),
                    r.contains("error")         ? r["error"].get<std::string>()
                    : verdict                   ? r["verdict"].get<std::string>()
                    : r.contains("stop_reason") ? r["stop_reason"].get<std::string>()
                                                : numbers_text(r)});
  }
  if (!runs.empty()) {
    page.heading("Runs");
    page.table({"run", "status", "#psi before", "#psi after", "#change", "#evaluations", "#time [s]", "end"}, runs);
  }
  const auto designs = rows_by_design(rows);
  for (const auto& [design, own] : designs) add_design(page, design, own, pareto);
  if (!designs.empty()) {
    page.heading("In words");
    std::istringstream lines(text);
    std::string line;
    std::vector<std::string> items;
    bool of_design = false;  // behind the table of runs
    while (std::getline(lines, line)) {
      for (const auto& [design, own] : designs) of_design = of_design || line.rfind("  " + design + ": ", 0) == 0;
      if (of_design) items.push_back(line.substr(std::min(line.find_first_not_of(' '), line.size())));
    }
    page.list(items);
  }
  return page.text();
}

}  // namespace costate::app
