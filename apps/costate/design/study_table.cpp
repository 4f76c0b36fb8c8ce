#include "study_table.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "indices.h"

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

/// A design in a line or two: how its psi spreads; of optimizations how many came to the best, a multi-start.
std::string design_text(const std::string& design, const std::vector<Json>& rows) {
  const std::vector<double> psi = psi_of(rows);
  std::string text = fmt::format("  {}: {} of {} points\n", design, psi.size(), rows.size());
  if (psi.empty()) return text;
  double mean = 0, square = 0;
  for (const double x : psi) mean += x / static_cast<double>(psi.size());
  for (const double x : psi) square += (x - mean) * (x - mean);
  const double deviation = psi.size() > 1 ? std::sqrt(square / static_cast<double>(psi.size() - 1)) : 0;
  const auto [least, most] = std::minmax_element(psi.begin(), psi.end());
  text +=
      fmt::format("    psi {:.8g} .. {:.8g}, mean {:.8g}, standard deviation {:.4g}\n", *least, *most, mean, deviation);
  const auto best = std::find_if(rows.begin(), rows.end(), [&](const Json& r) {
    return (r.contains("psi_after") && r["psi_after"] == *least) || (r.contains("psi") && r["psi"] == *least);
  });
  std::vector<std::string> at;
  for (const auto& [name, x] : (*best)[best->contains("psi_after") ? "parameters_after" : "varied"].items())
    at.push_back(fmt::format("{} = {:.6g}", name, x.get<double>()));
  text += fmt::format("    least in {}: {}\n", (*best)["name"].get<std::string>(), fmt::join(at, ", "));
  if (best->contains("psi_after")) {
    constexpr double same = 1e-6;
    const auto count = std::count_if(psi.begin(), psi.end(), [&](double x) {
      return std::abs(x - *least) <= same * std::max(std::abs(*least), std::abs(*most - *least));
    });
    text += fmt::format("    {} of {} starts came there, to {:g} of psi\n", count, psi.size(), same);
  }
  return text + sensitivity_text(sensitivity_json(rows));
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

Json study_row(const StudyJob& j) {
  Json r;
  r["name"] = j.run.name;
  r["scene"] = j.run.scene.string();
  r["status"] = j.status();
  r["directory"] = j.directory.string();
  if (!j.error.empty()) r["error"] = j.error;
  if (j.run.blocks) r["blocks"] = true;
  if (!j.run.pareto.empty()) r["pareto"] = j.run.pareto;
  if (!j.ok()) {
    if (!j.run.design.empty()) {
      r["design"] = j.run.design;
      for (const auto& [path, value] : j.run.varied) r["varied"][path] = value;
    }
    r["evaluations"] = j.evaluations();
    return r;
  }
  if (!j.run.design.empty()) {
    r["design"] = j.run.design;
    for (const auto& [path, value] : j.run.varied) r["varied"][path] = value;
  }
  r["task"] = j.run.task;
  if (j.result.contains("cases"))
    for (const Json& c : j.result["cases"]) r["cases"][c.at("name").get<std::string>()] = c.at("psi");
  if (j.run.task != "optimize") {
    r["psi"] = j.result["psi"];
    r["gradient"] = j.result["gradient"];
    for (std::size_t k = 0; k < j.run.slope_parameters.size(); ++k)
      if (const Json& g = r["gradient"]; g.is_object() && g.contains(j.run.slope_parameters[k]))
        r["slopes"][j.run.varied[k].first] = j.run.slope_factors[k] * g[j.run.slope_parameters[k]].get<double>();
    for (const auto& name : j.run.outputs) {
      const Json& terminal = j.result.contains("terminal") ? j.result["terminal"] : Json::object();
      r["outputs"][name] = terminal.contains(name) ? terminal[name] : Json();
    }
    r["wall_s"] = j.result["wall_s"];
    return r;
  }
  const double before = j.result["initial"]["psi"], after = j.result["psi"];
  r["psi_before"] = before;
  r["psi_after"] = after;
  r["improvement"] = before != 0 ? Json((before - after) / std::abs(before)) : Json();
  r["parameters_before"] = j.result["initial"]["parameters"];
  r["parameters_after"] = j.result["parameters"];
  r["bounds_active"] = j.result["bounds_active"];
  r["evaluations"] = j.result["evaluations"].size();
  const auto& list = j.result["evaluations"];
  for (const auto& [key, at] :
       {std::pair{"projected_gradient_before", std::size_t{0}},
        std::pair{"projected_gradient_after", j.result["best_evaluation"].get<std::size_t>() - 1}})
    r[key] = at < list.size() ? list[at]["projected_gradient"] : Json();
  r["stop_reason"] = j.result["stop_reason"];
  r["converged"] = j.result["converged"];
  r["verdict"] = j.result.contains("certificate") ? j.result["certificate"]["verdict"] : Json();
  r["formulation"] = j.result["formulation"];
  r["method"] = j.result["method"];
  r["wall_s"] = j.result["wall_s"];
  return r;
}

std::string study_csv(const Json& rows) {
  const std::vector<std::string> keys = {"name",
                                         "status",
                                         "psi_before",
                                         "psi_after",
                                         "improvement",
                                         "projected_gradient_before",
                                         "projected_gradient_after",
                                         "evaluations",
                                         "wall_s",
                                         "stop_reason",
                                         "verdict"};
  std::vector<std::string> parameters;
  for (const auto& r : rows)
    if (r.contains("parameters_after"))
      for (const auto& [name, x] : r["parameters_after"].items())
        if (std::find(parameters.begin(), parameters.end(), name) == parameters.end()) parameters.push_back(name);
  std::string text = fmt::format("{}", fmt::join(keys, ","));
  for (const auto& p : parameters) text += fmt::format(",{0}.before,{0}.after", p);
  text += "\n";
  for (const auto& r : rows) {
    for (std::size_t k = 0; k < keys.size(); ++k)
      text += (k ? "," : "") + csv_text(r.contains(keys[k]) ? r[keys[k]] : Json());
    for (const auto& p : parameters)
      for (const char* when : {"parameters_before", "parameters_after"})
        text += "," + csv_text(r.contains(when) && r[when].contains(p) ? r[when][p] : Json());
    text += "\n";
  }
  return text;
}

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
                          r.contains("error") ? ": " + r["error"].get<std::string>() : "");
      continue;
    }
    text += fmt::format("  {:<{}} {:>14.8g} {:>14.8g} {:>7.2f}% {:>6} {:>9.3g}  {}{}\n", name, width,
                        r["psi_before"].get<double>(), r["psi_after"].get<double>(),
                        r["improvement"].is_null() ? 0.0 : -100 * r["improvement"].get<double>(),
                        r["evaluations"].get<int>(), r["wall_s"].get<double>(), r["stop_reason"].get<std::string>(),
                        r["status"] == "kept" ? " (kept)" : "");
    std::vector<std::string> moves;
    for (const auto& [p, x] : r["parameters_after"].items())
      moves.push_back(fmt::format("{} {:.6g} -> {:.6g}", p, r["parameters_before"][p].get<double>(), x.get<double>()));
    text += fmt::format("  {:<{}} {}\n", "", width, fmt::join(moves, ", "));
  }
  for (const auto& [design, own] : rows_by_design(rows)) text += design_text(design, own);
  return text;
}

std::vector<std::pair<std::string, std::string>> design_csvs(const Json& rows) {
  std::vector<std::pair<std::string, std::string>> files;
  for (const auto& [design, own] : rows_by_design(rows)) {
    // Columns: what any of the points has, group by group.
    std::vector<std::pair<std::string, std::string>> columns;
    for (const char* group : {"varied", "outputs", "cases", "gradient", "parameters_after"})
      for (const auto& r : own)
        if (r.contains(group) && r[group].is_object())
          for (const auto& [name, x] : r[group].items())
            if (std::find(columns.begin(), columns.end(), std::pair<std::string, std::string>(group, name)) ==
                columns.end())
              columns.emplace_back(group, name);
    std::string text = "name,status,psi";
    for (const auto& [group, name] : columns)
      text += "," + csv_text(Json(group == "gradient"           ? "dpsi/d" + name
                                  : group == "cases"            ? "psi." + name
                                  : group == "parameters_after" ? name + ".after"
                                                                : name));
    text += "\n";
    for (const auto& r : own) {
      const Json psi = r.contains("psi") ? r["psi"] : r.contains("psi_after") ? r["psi_after"] : Json();
      text += csv_text(r["name"]) + "," + csv_text(r["status"]) + "," + csv_text(psi);
      for (const auto& [group, name] : columns)
        text += "," + csv_text(r.contains(group) && r[group].is_object() && r[group].contains(name) ? r[group][name]
                                                                                                    : Json());
      text += "\n";
    }
    files.emplace_back(design, text);
  }
  return files;
}

std::string study_sentence(const Json& result) {
  if (!result.contains("initial"))
    return fmt::format("psi {:.6g}, {:.3g} s", result["psi"].get<double>(), result["wall_s"].get<double>());
  return fmt::format("psi {:.6g} -> {:.6g} in {} evaluations, {:.3g} s", result["initial"]["psi"].get<double>(),
                     result["psi"].get<double>(), result["evaluations"].size(), result["wall_s"].get<double>());
}

}  // namespace costate::app
