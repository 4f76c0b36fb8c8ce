#include "tradeoff_summary.h"

#include <fmt/format.h>

#include <cmath>

#include "digits.h"

namespace costate::app {

namespace {

Json or_null(const std::optional<double>& x) { return x ? Json(*x) : Json(nullptr); }

Json combination_json(const Combination& c) {
  return {{"formulation", c.formulation},
          {"integrator", c.integrator},
          {"method", c.method.empty() ? Json(nullptr) : Json(c.method)}};
}

int digits_of(double error) { return error >= 1 ? 0 : static_cast<int>(std::floor(-std::log10(error))); }

Json reference_json(const TradeStudy& study) {
  const TradeReference& r = study.reference();
  const auto run = [](const Combination& c, double rtol, const std::string& method) {
    Json j = combination_json(c);
    j["method"] = method.empty() ? Json(nullptr) : Json(method);
    j["rtol"] = rtol;
    return j;
  };
  Json j;
  j["proven"] = r.proven;
  j["first"] = run(r.first, r.rtol_first, r.gradient_first);
  j["second"] = r.second.formulation.empty() ? Json(nullptr) : run(r.second, r.rtol_second, r.gradient_second);
  j["certified"] = Json::object();
  j["digits"] = Json::object();
  for (const TradeMeasure m : measures_of(study.table())) {
    const double floor = r.floor[static_cast<std::size_t>(m)];
    j["certified"][name_of(m)] = r.proven ? Json(floor) : Json(nullptr);
    j["digits"][name_of(m)] = r.proven ? digits_of(floor) : 0;
  }
  j["outputs"] = Json::object();
  for (std::size_t o = 0; o < study.probe().outputs().size(); ++o)
    j["outputs"][study.probe().outputs()[o]->name()] = {{"unit", study.probe().outputs()[o]->unit()},
                                                        {"size", r.output_unit[o]}};
  j["energy_kept"] = r.energy_unit > 0;
  j["notes"] = r.notes;
  return j;
}

Json row_json(const TradeTable& table, const TradeRow& r) {
  Json j = combination_json(table.combinations[r.combination]);
  j["rtol"] = r.rtol > 0 ? Json(r.rtol) : Json(nullptr);
  j["step_s"] = r.step_s > 0 ? Json(r.step_s) : Json(nullptr);
  j["status"] = name_of(r.status);
  if (r.status != TradeStatus::ok) {
    j["why"] = r.why;
    return j;
  }
  j["psi"] = r.psi;
  j["errors"] = Json::object();
  j["below_certified"] = Json::object();
  for (const TradeMeasure m : kTradeMeasures) {
    const auto e = r.error_of(m);
    j["errors"][name_of(m)] = or_null(e);
    if (e) j["below_certified"][name_of(m)] = *e <= table.floor_of(m);
  }
  j["worst"] = r.worst;
  j["drift"] = {{"position", or_null(r.position_drift)},
                {"velocity", or_null(r.velocity_drift)},
                {"energy", or_null(r.energy_drift)}};
  j["steps"] = r.counters.steps;
  j["callbacks"] = callbacks(r.counters);
  j["factorizations"] = r.counters.factorizations;
  j["counters"] = counters_json(r.counters);
  j["time_s"] = r.time_s;
  j["repeats"] = r.repeats;
  j["warnings"] = r.warnings;
  return j;
}

const char* name_of(OutOfLine::Kind kind) {
  switch (kind) {
    case OutOfLine::Kind::does_not_fall:
      return "does not fall";
    case OutOfLine::Kind::rises:
      return "rises";
    case OutOfLine::Kind::far_off:
      break;
  }
  return "far off";
}

std::string quoted(const std::string& text) {
  std::string out = "\"";
  for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c == '\n' ? ' ' : c);
  return out + "\"";
}

}  // namespace

std::vector<TradeMeasure> measures_of(const TradeTable& table) {
  std::vector<TradeMeasure> measures;
  for (const TradeMeasure m : kTradeMeasures)
    if (!trade_curves(table, m).empty()) measures.push_back(m);
  return measures;
}

std::string error_text(const TradeTable& table, TradeMeasure measure, std::optional<double> error) {
  if (!error) return "-";
  return *error <= table.floor_of(measure) ? fmt::format("<{:.0e}", table.floor_of(measure))
                                           : fmt::format("{:.1e}", *error);
}

std::vector<std::string> reference_sentences(const TradeStudy& study) {
  const TradeReference& r = study.reference();
  const auto run = [](const Combination& c, double rtol) { return fmt::format("{} at rtol {:g}", c.name(), rtol); };
  std::vector<std::string> said;
  if (r.second.formulation.empty()) {
    said.push_back(fmt::format(
        "Errors are distances to {}. No second combination of another formulation and another integrator carries this "
        "scene so far, so that nothing is certified.",
        run(r.first, r.rtol_first)));
  } else {
    std::string agree;
    for (const TradeMeasure m : measures_of(study.table())) {
      const double floor = r.floor[static_cast<std::size_t>(m)];
      agree +=
          fmt::format("{}{} to {:.0e} ({} digits)", agree.empty() ? "" : ", ", name_of(m), floor, digits_of(floor));
    }
    said.push_back(
        fmt::format("Reference: {}. Apart from it: {}. They share neither formulation nor integrator and "
                    "agree in {}.",
                    run(r.first, r.rtol_first), run(r.second, r.rtol_second), agree));
    said.push_back(r.proven ? "Errors are certified down to there; what is smaller is shown as \"<\"."
                            : "That is less than two digits: nothing is certified; errors are distances to the first "
                              "of the two.");
  }
  if (r.energy_unit > 0)
    said.push_back(
        "The energy is constant along the reference; its drift is measured against the largest kinetic one.");
  for (const auto& n : r.notes) said.push_back(n);
  return said;
}

Json tradeoff_json(const Setup& setup, const TradeStudy& study) {
  const TradeTable& t = study.table();
  const TradeReference& r = study.reference();
  GradientResult result;
  result.psi = r.values.psi;
  result.gradient = r.values.gradient;
  result.counters = r.values.counters;
  result.integrator = r.first.integrator;
  Json j = run_json(setup, result, r.gradient_first, study.spent_s());
  j["formulation"] = r.first.formulation;
  j["rtol"] = r.rtol_first;
  j["reference"] = reference_json(study);
  j["runs_beside"] = study.runs_beside();
  j["rows"] = Json::array();
  for (const TradeRow& row : t.rows) j["rows"].push_back(row_json(t, row));
  j["fronts"] = Json::object();
  j["choices"] = Json::object();
  for (const TradeMeasure m : measures_of(t)) {
    j["fronts"][name_of(m)] = pareto_front(t, m);
    Json choices = Json::array();
    for (const TradeChoice& c : trade_choices(t, m))
      choices.push_back({{"target", c.target},
                         {"row", c.row},
                         {"error", c.error},
                         {"next_digit", or_null(c.next_digit)},
                         {"text", sentence(t, m, c)}});
    j["choices"][name_of(m)] = choices;
  }
  j["out_of_line"] = Json::array();
  for (const OutOfLine& o : out_of_line(t)) {
    Json e = combination_json(t.combinations[o.combination]);
    e["kind"] = name_of(o.kind);
    e["measure"] = costate::name_of(o.measure);
    e["rows"] = o.rows;
    e["text"] = o.sentence;
    j["out_of_line"].push_back(e);
  }
  j["refusals"] = Json::array();
  for (const TradeRefusal& x : study.refusals()) {
    Json e = combination_json(x.what);
    e["why"] = x.why;
    j["refusals"].push_back(e);
  }
  return j;
}

std::string tradeoff_csv(const TradeStudy& study) {
  const TradeTable& t = study.table();
  std::string csv =
      "formulation,integrator,method,rtol,step_s,status,psi,psi_error,outputs_error,gradient_error,position_drift,"
      "velocity_drift,energy_drift,steps,callbacks,factorizations,time_s,repeats,why\n";
  const auto number = [](const std::optional<double>& x) { return x ? fmt::format("{}", *x) : std::string(); };
  for (const TradeRow& r : t.rows) {
    const Combination& c = t.combinations[r.combination];
    const bool ok = r.status == TradeStatus::ok;
    csv += fmt::format("{},{},{},{},{},{},", c.formulation, c.integrator, c.method,
                       number(r.rtol > 0 ? std::optional(r.rtol) : std::nullopt),
                       number(r.step_s > 0 ? std::optional(r.step_s) : std::nullopt), costate::name_of(r.status));
    csv += (ok ? fmt::format("{}", r.psi) : "") + ",";
    for (const auto& e : r.error) csv += number(ok ? e : std::nullopt) + ",";
    for (const auto& d : {r.position_drift, r.velocity_drift, r.energy_drift}) csv += number(d) + ",";
    csv += ok ? fmt::format("{},{},{},{},{},", r.counters.steps, callbacks(r.counters), r.counters.factorizations,
                            r.time_s, r.repeats)
              : ",,,,,";
    csv += r.why.empty() ? "\n" : quoted(r.why) + "\n";
  }
  return csv;
}

std::string tradeoff_text(const Setup& setup, const TradeStudy& study) {
  const TradeTable& t = study.table();
  std::size_t ended = 0;
  for (const TradeRow& r : t.rows) ended += r.status == TradeStatus::ok ? 1 : 0;
  std::string text = fmt::format("{}: {} of {} runs of {} combinations, {:.1f} s\n", setup.scene.title, ended,
                                 t.rows.size(), t.combinations.size(), study.spent_s());
  for (const auto& s : reference_sentences(study)) text += "  " + s + "\n";
  for (const TradeMeasure m : measures_of(t)) {
    text += fmt::format("\n{}\n", m == TradeMeasure::outputs ? "outputs along the motion" : costate::name_of(m));
    const auto choices = trade_choices(t, m);
    if (choices.empty()) text += "  no setting that was run reaches 1e-01\n";
    for (const TradeChoice& c : choices) text += "  " + sentence(t, m, c) + "\n";
  }
  std::size_t beside = 0;
  for (const TradeRow& r : t.rows) beside += r.status == TradeStatus::ok && r.repeats == 0 ? 1 : 0;
  if (beside > 0 && study.runs_beside() > 0)
    text += fmt::format(
        "\n{} runs had no turn at the clock; their times were taken with {} other run{} beside them (--jobs 1: none)\n",
        beside, study.runs_beside(), study.runs_beside() == 1 ? "" : "s");
  const auto found = out_of_line(t);
  if (!found.empty()) text += "\nout of line\n";
  for (const OutOfLine& o : found) text += "  " + o.sentence + "\n";
  std::size_t failed = 0;
  for (const TradeRow& r : t.rows)
    if (r.status == TradeStatus::failed || r.status == TradeStatus::cut) {
      if (failed++ == 0) text += "\ndid not end\n";
      if (failed <= 12)
        text += fmt::format("  {} at {}: {} {}\n", t.combinations[r.combination].name(), r.setting(),
                            costate::name_of(r.status), r.why);
    }
  if (failed > 12) text += fmt::format("  and {} more, see the summary\n", failed - 12);
  if (!study.refusals().empty())
    text += fmt::format("\n{} combinations are not possible; the page says why\n", study.refusals().size());
  return text + "\n";
}

}  // namespace costate::app
