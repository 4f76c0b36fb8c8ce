#include "study_row.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

namespace costate::app {

namespace {

void add_change(Json& r, const Json& before, const Json& after) {
  const double from = before.get<double>(), to = after.get<double>();
  r["psi_before"] = before;
  r["psi_after"] = after;
  r["improvement"] = from != 0 ? Json((from - to) / std::abs(from)) : Json();
}

void add_optimum(Json& r, const Json& result) {
  add_change(r, result["initial"]["psi"], result["psi"]);
  r["parameters_before"] = result["initial"]["parameters"];
  r["parameters_after"] = result["parameters"];
  r["bounds_active"] = result["bounds_active"];
  r["evaluations"] = result["evaluations"].size();
  const auto& list = result["evaluations"];
  for (const auto& [key, at] :
       {std::pair{"projected_gradient_before", std::size_t{0}},
        std::pair{"projected_gradient_after", result["best_evaluation"].get<std::size_t>() - 1}})
    r[key] = at < list.size() ? list[at]["projected_gradient"] : Json();
  r["stop_reason"] = result["stop_reason"];
  r["converged"] = result["converged"];
  r["verdict"] = result.contains("certificate") ? result["certificate"]["verdict"] : Json();
  r["formulation"] = result["formulation"];
  r["method"] = result["method"];
}

void add_fit(Json& r, const Json& result) {
  add_change(r, result["start_chi_square"], result["chi_square"]);
  r["bounds_active"] = Json::array();
  for (const auto& [name, p] : result["parameters"].items()) {
    r["parameters_before"][name] = p["start"];
    r["parameters_after"][name] = p["value"];
    r["standard_errors"][name] = p["standard_error"];
    if (p["at_bound"].get<bool>()) r["bounds_active"].push_back(name);
  }
  for (const char* key : {"degrees_of_freedom", "reduced_chi_square", "identifiability", "evaluations"})
    r[key] = result[key];
  r["stop_reason"] = result["termination"];
}

void add_cycle(Json& r, const Json& result) {
  double largest = 0;
  for (const Json& m : result["multipliers"])
    largest = std::max(largest, std::hypot(m[0].get<double>(), m[1].get<double>()));
  r["outputs"]["period_s"] = result["period_s"];
  r["outputs"]["multiplier"] = result["multipliers"].empty() ? Json() : Json(largest);
  r["outputs"]["stable"] = result["multipliers"].empty() ? Json() : result["stable"];
  if (result.contains("speed_m_per_s")) r["outputs"]["speed_m_per_s"] = result["speed_m_per_s"];
  for (const char* key : {"period_gradient", "speed_gradient", "multiplier_gradient"})
    if (result.contains(key)) r[key] = result[key];
}

void add_psi(Json& r, const StudyJob& j) {
  r["psi"] = j.result["psi"];
  r["gradient"] = j.result["gradient"];
  for (std::size_t k = 0; k < j.run.slope_parameters.size(); ++k)
    if (const Json& g = r["gradient"]; g.is_object() && g.contains(j.run.slope_parameters[k]))
      r["slopes"][j.run.varied[k].first] = j.run.slope_factors[k] * g[j.run.slope_parameters[k]].get<double>();
}

}  // namespace

Json study_row(const StudyJob& j) {
  Json r;
  r["name"] = j.run.name;
  r["scene"] = j.run.scene.string();
  r["task"] = j.run.task;
  r["status"] = j.status();
  r["directory"] = j.directory.string();
  if (!j.error.empty()) r["error"] = j.error;
  if (j.run.blocks) r["blocks"] = true;
  if (!j.run.pareto.empty()) r["pareto"] = j.run.pareto;
  if (!j.run.design.empty()) {
    r["design"] = j.run.design;
    for (const auto& [path, value] : j.run.varied) r["varied"][path] = value;
  }
  if (!j.ok()) {
    r["evaluations"] = j.evaluations();
    return r;
  }
  if (j.result.contains("cases"))
    for (const Json& c : j.result["cases"]) r["cases"][c.at("name").get<std::string>()] = c.at("psi");
  if (j.run.task == "optimize") {
    add_optimum(r, j.result);
  } else if (j.run.task == "fit") {
    add_fit(r, j.result);
  } else {
    if (j.run.task != "cycle" || j.run.costs) add_psi(r, j);
    if (j.run.task == "cycle") add_cycle(r, j.result);
    for (const auto& name : j.run.outputs) {
      const Json& terminal = j.result.contains("terminal") ? j.result["terminal"] : Json::object();
      r["outputs"][name] = terminal.contains(name) ? terminal[name] : Json();
    }
  }
  r["wall_s"] = j.result["wall_s"];
  return r;
}

std::string numbers_text(const Json& row) {
  std::vector<std::string> parts;
  const auto add = [&](const std::string& name, const Json& value) {
    if (value.is_number()) parts.push_back(fmt::format("{} {:.8g}", name, value.get<double>()));
    if (value.is_boolean()) parts.push_back((value.get<bool>() ? "" : "not ") + name);
  };
  if (row.contains("psi")) add("psi", row["psi"]);
  if (row.contains("outputs"))
    for (const auto& [name, value] : row["outputs"].items()) add(name, value);
  return fmt::format("{}", fmt::join(parts, ", "));
}

std::string study_sentence(const StudyJob& job) {
  const Json r = study_row(job);
  const double wall = r["wall_s"].get<double>();
  if (!r.contains("psi_after")) return fmt::format("{}, {:.3g} s", numbers_text(r), wall);
  return fmt::format("psi {:.6g} -> {:.6g} in {} evaluations, {:.3g} s", r["psi_before"].get<double>(),
                     r["psi_after"].get<double>(), r["evaluations"].get<long>(), wall);
}

}  // namespace costate::app
