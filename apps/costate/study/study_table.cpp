#include "study_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "costate/design/indices.h"
#include "study_row.h"

namespace costate::app {

namespace {

std::string csv_text(const Json& value) {
  if (value.is_null()) return "";
  std::string text = value.is_string() ? value.get<std::string>() : value.dump();
  if (text.find_first_of(",\"\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

/// psi where a run ended: of an optimization the best.
std::vector<double> psi_of(const std::vector<Json>& rows) {
  std::vector<double> psi;
  for (const auto& r : rows)
    for (const char* key : {"psi", "psi_after"})
      if (r.contains(key) && r[key].is_number()) psi.push_back(r[key].get<double>());
  return psi;
}

bool ended_well(const Json& row) { return row["status"] == "ok" || row["status"] == "kept"; }

/// The names in a group of any of the rows, in order.
std::vector<std::string> names_in(const std::vector<Json>& rows, const std::string& group) {
  std::vector<std::string> names;
  for (const Json& r : rows)
    if (r.contains(group) && r[group].is_object())
      for (const auto& [name, x] : r[group].items())
        if (std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  return names;
}

Json value_in(const Json& row, const std::string& group, const std::string& name) {
  return row.contains(group) && row[group].is_object() && row[group].contains(name) ? row[group][name] : Json();
}

std::vector<double> numbers_in(const std::vector<Json>& rows, const std::string& group, const std::string& name) {
  std::vector<double> x;
  for (const Json& r : rows)
    if (const Json value = value_in(r, group, name); value.is_number()) x.push_back(value.get<double>());
  return x;
}

std::string spread_text(const std::string& name, const std::vector<double>& values) {
  double mean = 0, square = 0;
  for (const double x : values) mean += x / static_cast<double>(values.size());
  for (const double x : values) square += (x - mean) * (x - mean);
  const double deviation = values.size() > 1 ? std::sqrt(square / static_cast<double>(values.size() - 1)) : 0;
  const auto [least, most] = std::minmax_element(values.begin(), values.end());
  return fmt::format("    {} {:.8g} .. {:.8g}, mean {:.8g}, standard deviation {:.4g}\n", name, *least, *most, mean,
                     deviation);
}

/// How the numbers of its points spread: outputs and cycles; of fits what was estimated.
std::string spreads_text(const std::vector<Json>& rows) {
  std::string text;
  for (const std::string& name : names_in(rows, "outputs")) {
    if (const auto x = numbers_in(rows, "outputs", name); !x.empty()) text += spread_text(name, x);
    std::size_t yes = 0, no = 0, open = 0;
    for (const Json& r : rows) {
      const Json value = value_in(r, "outputs", name);
      if (value.is_boolean()) ++(value.get<bool>() ? yes : no);
      if (value.is_null() && ended_well(r)) ++open;
    }
    if (yes + no > 0)
      text += fmt::format("    {}: {} of {}{}\n", name, yes, yes + no + open,
                          open > 0 ? fmt::format(", {} not decided", open) : "");
  }
  for (const std::string& name : names_in(rows, "standard_errors")) {
    text += spread_text(name, numbers_in(rows, "parameters_after", name));
    const auto errors = numbers_in(rows, "standard_errors", name);
    const auto count = numbers_in(rows, "parameters_after", name).size();
    if (!errors.empty()) {
      const auto [least, most] = std::minmax_element(errors.begin(), errors.end());
      text += fmt::format("      standard error {:.4g} .. {:.4g}{}\n", *least, *most,
                          errors.size() < count ? fmt::format(", none in {} of {}", count - errors.size(), count) : "");
    } else {
      text += "      no standard error: at its bound or not identified\n";
    }
  }
  return text;
}

/// A design in some lines: how its psi and what else it has spread; of optimizations and fits how many came to the
/// best, a multi-start.
std::string design_text(const std::string& design, const std::vector<Json>& rows) {
  const std::vector<double> psi = psi_of(rows);
  std::string text =
      fmt::format("  {}: {} of {} points\n", design, std::count_if(rows.begin(), rows.end(), ended_well), rows.size());
  if (psi.empty()) return text + spreads_text(rows);
  text += spread_text("psi", psi);
  const auto [least, most] = std::minmax_element(psi.begin(), psi.end());
  const auto best = std::find_if(rows.begin(), rows.end(), [&, least = *least](const Json& r) {
    return (r.contains("psi_after") && r["psi_after"] == least) || (r.contains("psi") && r["psi"] == least);
  });
  std::vector<std::string> at;
  for (const auto& [name, x] : (*best)[best->contains("psi_after") ? "parameters_after" : "varied"].items())
    at.push_back(fmt::format("{} = {:.6g}", name, x.get<double>()));
  text += fmt::format("    least in {}: {}\n", (*best)["name"].get<std::string>(), fmt::join(at, ", "));
  if (best->contains("psi_after")) {
    constexpr double same = 1e-6;
    const auto count = std::count_if(psi.begin(), psi.end(), [&, least = *least, most = *most](double x) {
      return std::abs(x - least) <= same * std::max(std::abs(least), std::abs(most - least));
    });
    text += fmt::format("    {} of {} starts came there, to {:g} of psi\n", count, psi.size(), same);
  }
  return text + spreads_text(rows) + sensitivity_text(sensitivity_json(rows));
}

std::string csv_of(const std::vector<StudyColumn>& columns) {
  std::string text;
  for (const auto& c : columns) text += (text.empty() ? "" : ",") + csv_text(Json(c.heading));
  text += "\n";
  for (std::size_t i = 0; i < columns.front().values.size(); ++i) {
    for (std::size_t k = 0; k < columns.size(); ++k) text += (k ? "," : "") + csv_text(columns[k].values[i]);
    text += "\n";
  }
  return text;
}

/// Its values in all rows; none where a row has no such key.
StudyColumn column_of(const std::vector<Json>& rows, const std::string& key) {
  StudyColumn c{"", key, key, {}};
  for (const Json& r : rows) c.values.push_back(r.contains(key) ? r[key] : Json());
  return c;
}

StudyColumn column_in(const std::vector<Json>& rows, const std::string& group, const std::string& name,
                      const std::string& heading) {
  StudyColumn c{group, name, heading, {}};
  for (const Json& r : rows) c.values.push_back(value_in(r, group, name));
  return c;
}

/// What stands over a column of a group.
std::string heading_of(const std::string& group, const std::string& name) {
  return group == "gradient"              ? "dpsi/d" + name
         : group == "period_gradient"     ? "dperiod_s/d" + name
         : group == "speed_gradient"      ? "dspeed_m_per_s/d" + name
         : group == "multiplier_gradient" ? "dmultiplier/d" + name
         : group == "cases"               ? "psi." + name
         : group == "parameters_before"   ? name + ".before"
         : group == "parameters_after"    ? name + ".after"
         : group == "standard_errors"     ? name + ".standard_error"
                                          : name;
}

}  // namespace

std::vector<std::pair<std::string, std::vector<Json>>> rows_by_design(const Json& rows) {
  std::vector<std::pair<std::string, std::vector<Json>>> designs;
  for (const auto& r : rows) {
    if (!r.contains("design")) continue;
    const std::string design = r["design"];
    if (designs.empty() || designs.back().first != design) designs.emplace_back(design, std::vector<Json>());
    designs.back().second.push_back(r);
  }
  return designs;
}

Json study_sensitivity(const Json& rows) {
  Json j = Json::object();
  for (const auto& [design, own] : rows_by_design(rows))
    if (Json s = sensitivity_json(own); !s.is_null()) j[design] = std::move(s);
  return j;
}

std::vector<StudyColumn> study_columns(const std::vector<Json>& rows) {
  std::vector<StudyColumn> columns;
  for (const char* key : {"name", "status", "psi_before", "psi_after", "improvement", "projected_gradient_before",
                          "projected_gradient_after", "evaluations", "wall_s", "stop_reason", "verdict"})
    columns.push_back(column_of(rows, key));
  for (const std::string& name : names_in(rows, "parameters_after"))
    for (const char* group : {"parameters_before", "parameters_after"})
      columns.push_back(column_in(rows, group, name, heading_of(group, name)));
  for (const std::string& name : names_in(rows, "standard_errors"))
    columns.push_back(column_in(rows, "standard_errors", name, heading_of("standard_errors", name)));
  if (std::any_of(rows.begin(), rows.end(), [](const Json& r) { return r.contains("psi"); }))
    columns.push_back(column_of(rows, "psi"));
  for (const std::string& name : names_in(rows, "outputs")) columns.push_back(column_in(rows, "outputs", name, name));
  return columns;
}

std::vector<StudyColumn> design_columns(const std::vector<Json>& rows) {
  std::vector<StudyColumn> columns = {column_of(rows, "name"), column_of(rows, "status"), {"", "psi", "psi", {}}};
  for (const Json& r : rows)
    columns.back().values.push_back(r.contains("psi") ? r["psi"] : r.contains("psi_after") ? r["psi_after"] : Json());
  for (const char* group : {"varied", "outputs", "cases", "gradient", "period_gradient", "speed_gradient",
                            "multiplier_gradient", "parameters_after", "standard_errors"})
    for (const std::string& name : names_in(rows, group))
      columns.push_back(column_in(rows, group, name, heading_of(group, name)));
  return columns;
}

std::string study_csv(const Json& rows) { return csv_of(study_columns({rows.begin(), rows.end()})); }

std::string study_table(const std::string& title, const Json& rows) {
  std::size_t width = 3;
  for (const auto& r : rows)
    if (!r.contains("design")) width = std::max(width, r["name"].get<std::string>().size());
  std::string text = fmt::format("{}\n  {:<{}} {:>14} {:>14} {:>8} {:>6} {:>9}  {}\n", title, "run", width,
                                 "psi before", "psi after", "change", "evals", "time [s]", "end");
  for (const auto& r : rows) {
    if (r.contains("design")) continue;
    const std::string name = r["name"];
    if (!r.contains("psi_after")) {
      text += fmt::format("  {:<{}} {}{}\n", name, width, r["status"].get<std::string>(),
                          r.contains("error") ? ": " + r["error"].get<std::string>()
                          : ended_well(r)     ? ": " + numbers_text(r)
                                              : "");
      continue;
    }
    text += fmt::format("  {:<{}} {:>14.8g} {:>14.8g} {:>7.2f}% {:>6} {:>9.3g}  {}{}\n", name, width,
                        r["psi_before"].get<double>(), r["psi_after"].get<double>(),
                        r["improvement"].is_null() ? 0.0 : -100 * r["improvement"].get<double>(),
                        r["evaluations"].get<int>(), r["wall_s"].get<double>(), r["stop_reason"].get<std::string>(),
                        r["status"] == "kept" ? " (kept)" : "");
    std::vector<std::string> moves;
    for (const auto& [p, x] : r["parameters_after"].items()) {
      const Json error = value_in(r, "standard_errors", p);
      moves.push_back(fmt::format("{} {:.6g} -> {:.6g}{}", p, r["parameters_before"][p].get<double>(), x.get<double>(),
                                  error.is_number() ? fmt::format(" +- {:.2g}", error.get<double>()) : ""));
    }
    text += fmt::format("  {:<{}} {}\n", "", width, fmt::join(moves, ", "));
  }
  for (const auto& [design, own] : rows_by_design(rows)) text += design_text(design, own);
  return text;
}

std::vector<std::pair<std::string, std::string>> design_csvs(const Json& rows) {
  std::vector<std::pair<std::string, std::string>> files;
  for (const auto& [design, own] : rows_by_design(rows)) files.emplace_back(design, csv_of(design_columns(own)));
  return files;
}

}  // namespace costate::app
