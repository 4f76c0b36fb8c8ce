// What 'costate tradeoff --levels' says: as text, as a page, as JSON and as a table for other programs.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/objective/output.h"
#include "html_page.h"
#include "page_parts.h"
#include "tradeoff_levels.h"

namespace costate::app {

namespace {

std::string measure_name(TradeMeasure m) { return m == TradeMeasure::gradient ? "the gradient" : name_of(m); }

std::string level_error_text(const std::optional<LevelError>& e) {
  return !e ? "-" : fmt::format("{}{:.1e}", e->resolved ? "" : "<", e->error);
}

/// Of an output or a parameter: nothing is known below what integration leaves open.
std::string level_part(const LevelStudy& study, std::size_t level, TradeMeasure m, std::size_t full_index) {
  const auto e = study.model_error(level, m);
  if (!e) return "-";
  const LevelRun& r = study.runs()[e->run];
  std::size_t at = full_index;
  if (m == TradeMeasure::outputs) {
    const auto& own = study.levels()[level].outputs;
    const auto found = std::find(own.begin(), own.end(), study.levels()[0].outputs[full_index]);
    if (found == own.end()) return "-";
    at = static_cast<std::size_t>(found - own.begin());
  }
  const double error = (m == TradeMeasure::outputs ? r.of_output : r.of_parameter)[at];
  const auto k = static_cast<std::size_t>(m);
  const double open = *r.integration[k] + study.reference().floor[k];
  return error > open ? fmt::format("{:.1e}", error) : fmt::format("<{:.1e}", open + error);
}

std::string level_setting(const LevelRun& r) { return fmt::format("{} at rtol {:.1e}", r.what.name(), r.rtol); }

std::string level_reference(const LevelStudy& study) {
  const TradeReference& r = study.reference();
  std::string own;
  for (const TradeMeasure m : kTradeMeasures)
    if (study.measures(m))
      own += fmt::format("{}{} {:.0e}", own.empty() ? "" : ", ", measure_name(m), r.floor[static_cast<std::size_t>(m)]);
  return fmt::format("Reference: {}, {} at rtol {:.1e}{}; estimated errors of its own: {}.", study.levels()[0].name,
                     r.first.name(), r.rtol_first, r.gradient_first.empty() ? "" : ", gradient by " + r.gradient_first,
                     own);
}

std::string choice_sentence(const LevelStudy& study, TradeMeasure m, const LevelChoice& c) {
  const LevelRun& r = study.runs()[c.run];
  std::string text = fmt::format("for {:.0e} in {}: {}, {}, {:.3g} ms", c.target, measure_name(m),
                                 study.levels()[r.level].name, level_setting(r), 1e3 * r.time_s);
  if (r.level == 0) return text;
  if (!c.full) return text + "; no run of the full model reached it";
  const LevelRun& full = study.runs()[*c.full];
  return text + fmt::format(", {:.2g} of the full model's {:.3g} ms", r.time_s / full.time_s, 1e3 * full.time_s);
}

/// The fastest run of the full model that is as near to the reference as this level is; null: none was as far off.
const LevelRun* full_as_good(const LevelStudy& study, TradeMeasure m, double error) {
  const LevelRun* best = nullptr;
  const auto k = static_cast<std::size_t>(m);
  for (const LevelRun& r : study.runs())
    if (r.level == 0 && r.error[k] && r.what.method.empty() == (m != TradeMeasure::gradient) &&
        std::max({*r.error[k], *r.integration[k], study.reference().floor[k]}) <= error &&
        (!best || r.time_s < best->time_s))
      best = &r;
  return best;
}

const std::vector<std::string> kLevelHeader = {"level",          "#coordinates", "#rows",     "#psi",
                                               "#outputs",       "#gradient",    "#run [ms]", "#full [ms]",
                                               "#gradient [ms]", "#full [ms]"};

std::vector<std::vector<std::string>> level_rows(const LevelStudy& study) {
  std::vector<std::vector<std::string>> rows;
  for (std::size_t level = 0; level < study.levels().size(); ++level) {
    const Mechanism& m = *study.levels()[level].problem.mechanism;
    std::vector<std::string> row = {study.levels()[level].name, std::to_string(m.coordinate_count()),
                                    std::to_string(m.row_count())};
    for (const TradeMeasure measure : kTradeMeasures)
      row.push_back(level == 0 ? "0" : level_error_text(study.model_error(level, measure)));
    for (const TradeMeasure measure : {TradeMeasure::outputs, TradeMeasure::gradient}) {
      const auto e = study.model_error(level, measure);
      const LevelRun* full = e && level > 0 ? full_as_good(study, measure, e->error) : nullptr;
      row.push_back(e ? fmt::format("{:.3g}", 1e3 * study.runs()[e->run].time_s) : "-");
      row.push_back(full ? fmt::format("{:.3g}", 1e3 * full->time_s) : "-");
    }
    rows.push_back(row);
  }
  return rows;
}

/// Levels across, outputs or parameters down.
std::vector<std::vector<std::string>> part_rows(const LevelStudy& study, TradeMeasure m) {
  const DetailLevel& full = study.levels()[0];
  std::vector<std::vector<std::string>> rows;
  const std::size_t count = m == TradeMeasure::outputs ? full.outputs.size() : full.rho.size();
  for (std::size_t k = 0; k < count; ++k) {
    std::vector<std::string> row;
    if (m == TradeMeasure::outputs) {
      const std::string unit = study.probe(0).outputs()[k]->unit();
      row.push_back(fmt::format("{} [{}], of {:.3g}", full.outputs[k], unit, study.reference().output_unit[k]));
    } else {
      row.push_back("d(psi)/d " + full.problem.parameters.names()[k]);
    }
    for (std::size_t level = 1; level < study.levels().size(); ++level) row.push_back(level_part(study, level, m, k));
    rows.push_back(row);
  }
  return rows;
}

std::vector<std::string> part_header(const LevelStudy& study) {
  std::vector<std::string> header = {"against its range, or the largest derivative"};
  for (std::size_t level = 1; level < study.levels().size(); ++level)
    header.push_back("#" + study.levels()[level].name);
  return header;
}

std::string level_table(const std::vector<std::string>& header, const std::vector<std::vector<std::string>>& rows) {
  std::vector<std::size_t> width;
  for (const auto& h : header) width.push_back(h.size() - (h[0] == '#' ? 1 : 0));
  for (const auto& row : rows)
    for (std::size_t k = 0; k < row.size(); ++k) width[k] = std::max(width[k], row[k].size());
  const auto line = [&](const std::vector<std::string>& cells) {
    std::string text = " ";
    for (std::size_t k = 0; k < cells.size(); ++k) {
      const std::string cell = cells[k].substr(!cells[k].empty() && cells[k][0] == '#' ? 1 : 0);
      text += k == 0 ? fmt::format(" {:<{}}", cell, width[k]) : fmt::format("  {:>{}}", cell, width[k]);
    }
    return text + "\n";
  };
  std::string text = line(header);
  for (const auto& row : rows) text += line(row);
  return text;
}

Json finite_or_null(const std::optional<double>& x) { return x && std::isfinite(*x) ? Json(*x) : Json(); }

Json run_of_level_json(const LevelStudy& study, const LevelRun& r) {
  const DetailLevel &l = study.levels()[r.level], &full = study.levels()[0];
  const bool ok = r.status == TradeStatus::ok;
  Json j = {{"level", l.name},
            {"accuracy", r.accuracy},
            {"formulation", ok ? Json(r.what.formulation) : Json()},
            {"integrator", ok ? Json(r.what.integrator) : Json()},
            {"method", r.what.method.empty() ? Json() : Json(r.what.method)},
            {"status", name_of(r.status)}};
  if (!ok) {
    j["why"] = r.why;
    return j;
  }
  j["rtol"] = r.rtol;
  j["psi"] = r.psi;
  for (const TradeMeasure m : kTradeMeasures) {
    j["errors"][name_of(m)] = finite_or_null(r.error[static_cast<std::size_t>(m)]);
    j["integration_errors"][name_of(m)] = finite_or_null(r.integration[static_cast<std::size_t>(m)]);
  }
  j["output_errors"] = j["gradient_errors"] = Json::object();
  for (std::size_t o = 0; o < r.of_output.size(); ++o) j["output_errors"][l.outputs[o]] = r.of_output[o];
  for (std::size_t p = 0; p < r.of_parameter.size(); ++p)
    j["gradient_errors"][full.problem.parameters.names()[p]] = r.of_parameter[p];
  j["steps"] = r.counters.steps;
  j["callbacks"] = callbacks(r.counters);
  j["counters"] = counters_json(r.counters);
  j["time_s"] = r.time_s;
  j["repeats"] = r.repeats;
  return j;
}

}  // namespace

Json levels_json(const Setup& setup, const LevelStudy& study, const std::vector<std::string>& notes) {
  const TradeReference& r = study.reference();
  GradientResult result;
  result.psi = r.values.psi;
  result.gradient = r.values.gradient;
  result.counters = r.values.counters;
  result.integrator = r.first.integrator;
  Json j = run_json(setup, result, r.gradient_first, study.spent_s());
  j["formulation"] = r.first.formulation;
  j["rtol"] = r.rtol_first;
  j["notes"] = notes;
  j["reference_errors"] = Json::object();
  for (const TradeMeasure m : kTradeMeasures)
    j["reference_errors"][name_of(m)] = study.measures(m) ? Json(r.floor[static_cast<std::size_t>(m)]) : Json();
  j["levels"] = Json::array();
  for (std::size_t level = 0; level < study.levels().size(); ++level) {
    const DetailLevel& l = study.levels()[level];
    const Mechanism& m = *l.problem.mechanism;
    Json e = {{"name", l.name},
              {"coordinates", m.coordinate_count()},
              {"multipliers", m.row_count()},
              {"states", m.state_count()},
              {"outputs", l.outputs}};
    for (const TradeMeasure measure : kTradeMeasures) {
      const auto error = study.model_error(level, measure);
      e["errors"][name_of(measure)] =
          error ? Json({{"error", error->error}, {"resolved", error->resolved}, {"row", error->run}}) : Json();
    }
    j["levels"].push_back(e);
  }
  j["rows"] = Json::array();
  for (const LevelRun& run : study.runs()) j["rows"].push_back(run_of_level_json(study, run));
  j["choices"] = Json::object();
  for (const TradeMeasure m : kTradeMeasures) {
    if (!study.measures(m)) continue;
    Json list = Json::array();
    for (const LevelChoice& c : study.choices(m))
      list.push_back({{"target", c.target},
                      {"level", study.levels()[study.runs()[c.run].level].name},
                      {"row", c.run},
                      {"full", c.full ? Json(*c.full) : Json()},
                      {"text", choice_sentence(study, m, c)}});
    j["choices"][name_of(m)] = list;
  }
  return j;
}

std::string levels_csv(const LevelStudy& study) {
  std::string csv =
      "level,coordinates,multipliers,accuracy,formulation,integrator,method,rtol,status,psi,psi_error,outputs_error,"
      "gradient_error,psi_integration,outputs_integration,gradient_integration,steps,callbacks,time_s,repeats,why\n";
  const auto csv_text = [](const std::string& text) {
    std::string out = "\"";
    for (const char c : text) out += c == '"' ? "\"\"" : std::string(1, c == '\n' ? ' ' : c);
    return out + "\"";
  };
  for (const LevelRun& r : study.runs()) {
    const DetailLevel& l = study.levels()[r.level];
    const bool ok = r.status == TradeStatus::ok;
    csv +=
        fmt::format("{},{},{},{},{},{},{},{},{},{},", csv_text(l.name), l.problem.mechanism->coordinate_count(),
                    l.problem.mechanism->row_count(), r.accuracy, r.what.formulation, r.what.integrator, r.what.method,
                    ok ? fmt::format("{}", r.rtol) : "", name_of(r.status), ok ? fmt::format("{}", r.psi) : "");
    for (const auto* errors : {&r.error, &r.integration})
      for (const auto& e : *errors) csv += (ok && e ? fmt::format("{}", *e) : "") + ",";
    csv += ok ? fmt::format("{},{},{},{},", r.counters.steps, callbacks(r.counters), r.time_s, r.repeats) : ",,,,";
    csv += (r.why.empty() ? "" : csv_text(r.why)) + "\n";
  }
  return csv;
}

std::string levels_text(const Setup& setup, const LevelStudy& study, const std::vector<std::string>& notes) {
  std::string text = fmt::format("{}: {} levels of less detail, {} runs, {:.1f} s\n", setup.scene.title,
                                 study.levels().size() - 1, study.runs().size(), study.spent_s());
  text += "  " + level_reference(study) + "\n";
  for (const auto& n : notes) text += "  " + n + "\n";
  text += "\n" + level_table(kLevelHeader, level_rows(study));
  text +=
      "  (errors of the model, that of integration a small part of them, or together below \"<\"; full: the full "
      "model to the same error)\n";
  text += "\n" + level_table(part_header(study), part_rows(study, TradeMeasure::outputs));
  if (study.options().gradient) text += level_table(part_header(study), part_rows(study, TradeMeasure::gradient));
  for (const TradeMeasure m : kTradeMeasures) {
    if (!study.measures(m)) continue;
    text += fmt::format("\n{}\n", m == TradeMeasure::outputs ? "outputs along the motion" : name_of(m));
    const auto choices = study.choices(m);
    if (choices.empty()) text += "  no run reaches 1e-01\n";
    for (const LevelChoice& c : choices) text += "  " + choice_sentence(study, m, c) + "\n";
  }
  for (const LevelRun& r : study.runs())
    if (r.status != TradeStatus::ok)
      text += fmt::format("  {}, {} at accuracy {:.0e}: {}: {}\n", study.levels()[r.level].name,
                          r.what.method.empty() ? "motion" : "gradient", r.accuracy, name_of(r.status), r.why);
  return text + "\n";
}

std::string levels_page(const Setup& setup, const LevelStudy& study, const std::vector<std::string>& notes,
                        const std::string& note) {
  HtmlPage page(fmt::format("Levels of detail: {}", title_of(setup)));
  if (!note.empty()) page.paragraph(note, true);
  page.paragraph(level_reference(study));
  if (!notes.empty()) page.list(notes);
  page.table(kLevelHeader, level_rows(study));
  page.paragraph(fmt::format(
      "Errors of a level are its distances to the full model: of psi to psi, of outputs the largest along the motion, "
      "at "
      "{} times, against each one's range, of the gradient against its largest scaled component. Each level runs at "
      "accuracies that rise until its integration's error is a fifth of that or less; where that is not reached at "
      "1e-6, the error is below what stands behind \"<\". psi may agree by chance where outputs do not. \"full\" is "
      "the "
      "time of the full model to the same error. Time is the processor's, the median of interleaved runs.",
      study.probe(0).times().size()));
  page.table(part_header(study), part_rows(study, TradeMeasure::outputs));
  if (study.options().gradient) page.table(part_header(study), part_rows(study, TradeMeasure::gradient));
  constexpr const char* kLevelColors[] = {"#14316e", "#d1495b", "#2a9d8f", "#e09f3e", "#7b2d8b", "#6c757d", "#118ab2"};
  for (const TradeMeasure m : kTradeMeasures) {
    if (!study.measures(m)) continue;
    page.heading(m == TradeMeasure::outputs ? "Outputs along the motion" : m == TradeMeasure::psi ? "psi" : "Gradient");
    std::vector<std::string> sentences;
    for (const LevelChoice& c : study.choices(m)) sentences.push_back(choice_sentence(study, m, c));
    if (sentences.empty()) page.paragraph("No run reaches 1e-01.");
    page.list(sentences);
    SvgPlot plot;
    plot.x_label = fmt::format("distance of {} to the full model", name_of(m));
    plot.y_label = "processor time [ms]";
    plot.logarithmic = plot.logarithmic_x = plot.legend_beside = true;
    plot.width = 720;
    plot.height = 400;
    const auto k = static_cast<std::size_t>(m);
    for (std::size_t level = 0; level < study.levels().size(); ++level) {
      SvgCurve curve{study.levels()[level].name, {}, {}};
      curve.markers = true;
      curve.color = kLevelColors[level % std::size(kLevelColors)];
      for (const LevelRun& r : study.runs()) {
        if (r.level != level || !r.error[k] || r.what.method.empty() != (m != TradeMeasure::gradient)) continue;
        curve.x.push_back(std::max({*r.error[k], study.reference().floor[k], 1e-16}));
        curve.y.push_back(1e3 * r.time_s);
      }
      if (!curve.x.empty()) plot.curves.push_back(std::move(curve));
    }
    page.plots({plot});
  }
  page.heading("All runs");
  std::vector<std::vector<std::string>> rows;
  for (const LevelRun& r : study.runs()) {
    std::vector<std::string> row = {study.levels()[r.level].name, r.what.method.empty() ? "motion" : "gradient",
                                    fmt::format("{:.0e}", r.accuracy)};
    const bool ok = r.status == TradeStatus::ok;
    row.push_back(ok ? level_setting(r) : fmt::format("{}: {}", name_of(r.status), r.why));
    for (std::size_t k = 0; k < r.error.size(); ++k)
      row.push_back(r.error[k] ? fmt::format("{:.1e} ({:.0e})", *r.error[k], *r.integration[k]) : "-");
    row.push_back(ok ? std::to_string(r.counters.steps) : "");
    row.push_back(ok ? std::to_string(callbacks(r.counters)) : "");
    row.push_back(ok ? fmt::format("{:.3g}", 1e3 * r.time_s) : "");
    rows.push_back(row);
  }
  page.table({"level", "of", "#asked for", "by", "#psi (integration)", "#outputs", "#gradient", "#steps", "#callbacks",
              "#time [ms]"},
             rows);
  return page.text();
}

}  // namespace costate::app
