#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "html_page.h"
#include "page_parts.h"
#include "tradeoff_summary.h"

namespace costate::app {

namespace {

// One a formulation, far apart also for those who do not see red and green alike.
constexpr const char* kColors[] = {"#14316e", "#d1495b", "#2a9d8f", "#e09f3e", "#7b2d8b",
                                   "#6c757d", "#118ab2", "#a7754d", "#4f772d", "#f08080"};

std::string color_of(const std::string& formulation) {
  const auto& all = formulations();
  const auto at = std::find_if(all.begin(), all.end(), [&](const auto& f) { return f.name == formulation; });
  return kColors[static_cast<std::size_t>(at - all.begin()) % std::size(kColors)];
}

std::string dashes_of(const std::string& integrator) {
  return integrator == "idas" ? "" : integrator == "cvodes" ? "7 3" : "2 2";
}

using Cost = std::function<double(const TradeRow&)>;

/// Cost over error, both logarithmic, a curve a combination; `method`: of the gradient, or empty.
SvgPlot work_precision(const TradeTable& t, TradeMeasure m, const std::string& method, const std::string& label,
                       const Cost& cost, bool front) {
  SvgPlot plot;
  plot.x_label = fmt::format("error of {}{}", name_of(m), method.empty() ? "" : ", " + method);
  plot.y_label = label;
  plot.logarithmic = plot.logarithmic_x = plot.legend_beside = true;
  plot.width = 720;
  plot.height = 400;
  const auto shown = [&](double error) { return std::max(error, std::max(t.floor_of(m), 1e-16)); };
  if (front) {
    SvgCurve best{"Pareto front", {}, {}, SvgCurve::Stroke::light};
    const auto errors = dependable_errors(t, m);
    for (const std::size_t i : pareto_front(t, m)) {
      best.x.push_back(shown(errors[i]));
      best.y.push_back(cost(t.rows[i]));
    }
    plot.curves.push_back(std::move(best));
  }
  for (const auto& curve : trade_curves(t, m)) {
    const Combination& c = t.combinations[t.rows[curve.front()].combination];
    if (c.method != method) continue;
    SvgCurve one{method.empty() ? c.name() : c.formulation, {}, {}};
    one.markers = true;
    one.color = color_of(c.formulation);
    one.dashes = method.empty() ? dashes_of(c.integrator) : "";
    for (const std::size_t i : curve) {
      one.x.push_back(shown(*t.rows[i].error_of(m)));
      one.y.push_back(cost(t.rows[i]));
    }
    plot.curves.push_back(std::move(one));
  }
  return plot;
}

void add_plots(HtmlPage& page, const TradeTable& t, TradeMeasure m) {
  std::vector<std::string> methods;
  for (const auto& c : t.combinations)
    if (std::find(methods.begin(), methods.end(), c.method) == methods.end()) methods.push_back(c.method);
  std::vector<SvgPlot> plots;
  for (const auto& method : methods) {
    if (method.empty() == (m == TradeMeasure::gradient)) continue;
    SvgPlot time = work_precision(
        t, m, method, "processor time [ms]", [](const TradeRow& r) { return 1e3 * r.time_s; }, true);
    if (time.curves.size() < 2) continue;
    plots.push_back(std::move(time));
    if (m != TradeMeasure::gradient)
      plots.push_back(work_precision(
          t, m, method, "callbacks", [](const TradeRow& r) { return static_cast<double>(callbacks(r.counters)); },
          false));
  }
  page.plots(plots);
}

void add_choices(HtmlPage& page, const TradeTable& t, TradeMeasure m) {
  std::vector<std::vector<std::string>> rows;
  for (const TradeChoice& c : trade_choices(t, m)) {
    const TradeRow& r = t.rows[c.row];
    rows.push_back({fmt::format("{:.0e}", c.target), t.combinations[r.combination].name(), r.setting(),
                    error_text(t, m, c.error), fmt::format("{:.3g}", 1e3 * r.time_s),
                    std::to_string(callbacks(r.counters)), std::to_string(r.counters.factorizations),
                    c.next_digit ? fmt::format("{:.2g} x", *c.next_digit) : "-"});
  }
  if (rows.empty()) return page.paragraph("No setting that was run reaches 1e-01.");
  page.table({"#error wanted", "cheapest", "at", "#error", "#time [ms]", "#callbacks", "#factorizations", "next digit"},
             rows);
}

void add_rows(HtmlPage& page, const TradeTable& t) {
  page.heading("All runs");
  std::vector<std::vector<std::string>> rows;
  const auto small = [](const std::optional<double>& x) { return x ? fmt::format("{:.1e}", *x) : "-"; };
  for (std::size_t c = 0; c < t.combinations.size(); ++c)
    for (const TradeRow& r : t.rows) {
      if (r.combination != c) continue;
      const std::string name = t.combinations[c].name();
      if (r.status != TradeStatus::ok) {
        rows.push_back({name, r.setting(), "", "", "", "", "", "", "", "", "", "",
                        fmt::format("{}: {}", costate::name_of(r.status), r.why)});
        continue;
      }
      const auto error = [&](TradeMeasure m) { return error_text(t, m, r.error_of(m)); };
      std::string said;
      for (const auto& w : r.warnings) said += (said.empty() ? "" : " ") + w;
      rows.push_back({name, r.setting(), error(TradeMeasure::psi), error(TradeMeasure::outputs),
                      error(TradeMeasure::gradient), small(r.position_drift), small(r.velocity_drift),
                      small(r.energy_drift), std::to_string(r.counters.steps), std::to_string(callbacks(r.counters)),
                      std::to_string(r.counters.factorizations), fmt::format("{:.3g}", 1e3 * r.time_s), said});
    }
  page.table({"combination", "at", "#psi", "#outputs", "#gradient", "#|Phi|", "#|Phid|", "#energy", "#steps",
              "#callbacks", "#factorizations", "#time [ms]", "said"},
             rows);
}

}  // namespace

std::string tradeoff_page(const Setup& setup, const TradeStudy& study, const std::string& note) {
  const TradeTable& t = study.table();
  HtmlPage page(fmt::format("Accuracy against cost: {}", title_of(setup)));
  if (!note.empty()) page.paragraph(note, true);
  for (const auto& s : reference_sentences(study)) page.paragraph(s);
  std::string outputs;
  for (const auto& o : study.probe().outputs()) outputs += (outputs.empty() ? "" : ", ") + o->name();
  page.paragraph(fmt::format(
      "Errors of psi are relative to psi; those of the outputs ({}) are the largest along the motion, at {} times, "
      "each "
      "against its range; those of the gradient against its largest scaled component. What is recommended counts for a "
      "setting the largest error of its own and of the next two tighter ones, since an error may be small by chance. "
      "Time is the processor's, the median of interleaved runs.",
      outputs, study.probe().times().size()));
  for (const TradeMeasure m : measures_of(t)) {
    page.heading(m == TradeMeasure::outputs ? "Outputs along the motion" : m == TradeMeasure::psi ? "psi" : "Gradient");
    std::vector<std::string> sentences;
    for (const TradeChoice& c : trade_choices(t, m)) sentences.push_back(sentence(t, m, c));
    page.list(sentences);
    add_choices(page, t, m);
    add_plots(page, t, m);
  }
  const auto found = out_of_line(t);
  page.heading("Out of line");
  if (found.empty()) page.paragraph("Nothing: every error falls with its tolerance or step.");
  std::vector<std::string> sentences;
  for (const OutOfLine& o : found) sentences.push_back(o.sentence);
  if (!sentences.empty()) page.list(sentences);
  add_rows(page, t);
  if (!study.refusals().empty()) {
    page.heading("Not possible");
    std::vector<std::vector<std::string>> rows;
    for (const TradeRefusal& x : study.refusals()) rows.push_back({x.what.name(), x.why});
    page.table({"combination", "why"}, rows);
  }
  return page.text();
}

}  // namespace costate::app
