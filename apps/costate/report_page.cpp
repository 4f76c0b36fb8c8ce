#include "report_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/integrator/integrators.h"
#include "costate/record/svg_plot.h"
#include "digits.h"
#include "drawing.h"
#include "evaluation_text.h"
#include "html_page.h"
#include "motion/figures.h"
#include "motion/viewer.h"
#include "named_outputs.h"

namespace costate::app {

namespace {

constexpr std::size_t kHistories = 8;    // plots over time
constexpr std::size_t kParameters = 12;  // plots over the evaluations

std::string number(double x) {
  if (x == HUGE_VAL || x == -HUGE_VAL) return "none";
  return fmt::format("{:.6g}", x);
}
/// A number of a summary; null and what is missing are "-".
std::string number(const Json& j, const char* key) {
  return j.contains(key) && j.at(key).is_number() ? number(j.at(key).get<double>()) : "-";
}

std::string title_of(const Setup& setup) {
  return setup.scene.title.empty() ? setup.scene.file_name() : setup.scene.title;
}

void add_run(HtmlPage& page, const Setup& setup, const Json& j) {
  if (!setup.scene.description.empty()) page.paragraph(setup.scene.description);
  page.heading("What was run");
  const SolverOptions& s = setup.problem.solver;
  const auto text = [&](const char* key) {
    return j.contains(key) && j.at(key).is_string() ? j.at(key).get<std::string>() : "-";
  };
  std::vector<std::vector<std::string>> rows = {
      {"Scene", setup.scene.file_name()},
      {"Time", j.contains("end")
                   ? fmt::format("{:g} to {:.9g} s, ended by {}", s.t_start, j.at("end").at("t").get<double>(),
                                 j.at("end").at("name").get<std::string>())
                   : fmt::format("{:g} to {:g} s", s.t_start, s.t_end)},
      {"Formulation", fmt::format("{} on {}", text("formulation"), text("integrator"))},
      {"Tolerances", fmt::format("relative {:g}, absolute {:g}", s.rtol, s.absolute())}};
  if (j.at("method").is_string()) rows.push_back({"Gradient", text("method")});
  if (j.contains("algorithm")) rows.push_back({"Optimizer", text("algorithm")});
  std::string versions;
  for (const auto& [name, version] : j.at("settings").at("versions").items())
    versions += fmt::format("{}{} {}", versions.empty() ? "" : ", ", name, version.get<std::string>());
  rows.push_back({"Versions", versions});
  rows.push_back({"Wall time", fmt::format("{:.3g} s", j.at("wall_s").get<double>())});
  page.table({}, rows);
  if (j.contains("warnings"))
    for (const Json& warning : j.at("warnings")) page.paragraph("Warning: " + warning.get<std::string>(), true);
}

/// "It fell by 2 (40 %)."
std::string improvement(double before, double after) {
  const double fall = before - after;
  if (fall == 0) return "It did not change.";
  std::string text = fmt::format("It {} by {}", fall > 0 ? "fell" : "rose", number(std::abs(fall)));
  if (before != 0) text += fmt::format(", {:.4g} % of where it began", 100 * std::abs(fall / before));
  if (after > 0 && before > 100 * after) text += fmt::format(", to 1/{:.3g} of it", before / after);
  return text + ".";
}

void add_result(HtmlPage& page, const Json& j) {
  const double before = j.at("initial").at("psi").get<double>(), after = j.at("psi").get<double>();
  page.heading("Result");
  const double relative = has_fixed_steps(j.at("integrator")) ? 0 : j.at("rtol").get<double>();  // psi of its own steps
  const auto digits = [relative](double psi) { return known_digits(psi, uncertainty_of(psi, relative)); };
  page.paragraph(fmt::format("psi went from {} to {}. {}", digits(before), digits(after), improvement(before, after)),
                 true);
  page.paragraph(fmt::format("Stopped after {} evaluations by {}. The best is evaluation {}.",
                             j.at("evaluations").size(), j.at("stop_reason").get<std::string>(),
                             j.at("best_evaluation").get<int>()));
  if (j.contains("adaptation")) page.paragraph("Evaluations: " + adaptation_text(j.at("adaptation")) + ".");
  // What the optimizer says and what the certificate says are two things; where they differ the page says so.
  const bool converged = j.at("converged").get<bool>(), certified = j.contains("certificate");
  const std::string verdict = certified ? j.at("certificate").at("verdict").get<std::string>() : "";
  const bool minimum = verdict.rfind("strict local minimum", 0) == 0,
             unproven = verdict.rfind("not stationary", 0) == 0;
  if (j.at("status") != "ok")
    page.paragraph("The run did not come to its end: this is the best point until then.", true);
  else if (!converged && minimum)
    page.paragraph(
        "The optimizer ended before its own criterion was met, but the certificate below finds a minimum at the "
        "best point.",
        true);
  else if (!converged)
    page.paragraph("It ended before it converged: a limit or a failed step stopped it.", true);
  else if (unproven)
    page.paragraph("The optimizer's criterion was met, but the certificate below says that this is no minimum yet.",
                   true);
  if (j.at("failed_evaluations").get<int>() > 0) {
    page.paragraph("Evaluations that failed; their steps were rejected and shortened:");
    std::vector<std::vector<std::string>> rows;
    for (const Json& e : j.at("evaluations"))
      if (e.contains("failure"))
        rows.push_back({std::to_string(e.at("index").get<int>()), e.at("failure").get<std::string>()});
    page.table({"#evaluation", "why"}, rows);
  }
  for (const Json& n : j.at("notes")) page.paragraph(n.get<std::string>());
}

void add_parameters(HtmlPage& page, const Setup& setup, const Json& j) {
  page.heading("Parameters");
  std::vector<std::vector<std::string>> rows;
  for (const Parameter& p : setup.problem.parameters.parameters) {
    const double before = j.at("initial").at("parameters").at(p.name).get<double>(),
                 after = j.at("parameters").at(p.name).get<double>();
    std::string numbers;
    for (const auto& [index, factor] : p.bindings)
      numbers +=
          (numbers.empty() ? "" : ", ") + setup.scene.mechanism()->numbers()[static_cast<std::size_t>(index)].path;
    rows.push_back({p.name, number(before), number(after),
                    before != 0 ? fmt::format("{:+.3g} %", 100 * (after - before) / std::abs(before)) : "-",
                    number(p.lower), number(p.upper),
                    after == p.lower   ? "at lower"
                    : after == p.upper ? "at upper"
                                       : "",
                    number(j.at("gradient").at(p.name).get<double>()), numbers});
  }
  page.table({"parameter", "#before", "#after", "#change", "#lower", "#upper", "active bound", "#d(psi)/d(parameter)",
              "what it is in the scene"},
             rows);
}

void add_constraints(HtmlPage& page, const Setup& setup, const Json& j) {
  if (setup.scene.constraints().empty()) return;
  const Json& evaluations = j.at("evaluations");
  const Json &first = evaluations.front(), &best = evaluations.at(j.at("best_evaluation").get<std::size_t>() - 1);
  page.heading("Constraints");
  std::vector<std::vector<std::string>> rows;
  for (const auto& c : setup.scene.constraints()) {
    const double before = first.at("constraints").at(c.name).get<double>(),
                 after = best.at("constraints").at(c.name).get<double>();
    rows.push_back({c.name, number(before + c.upper), number(after + c.upper), number(c.upper),
                    after > 0 ? fmt::format("exceeded by {:.3g}", after) : "kept"});
  }
  page.table({"constraint", "#before", "#after", "#upper", ""}, rows);
}

void add_certificate(HtmlPage& page, const Json& j) {
  if (!j.contains("certificate")) return;
  const Json& c = j.at("certificate");
  page.heading("Certificate");
  page.paragraph(c.at("verdict").get<std::string>(), true);
  std::vector<std::vector<std::string>> rows = {
      {"Projected gradient, scaled", number(c, "projected_gradient")},
      {"KKT residual",
       fmt::format("{} (within {} counts as zero)", number(c, "kkt_residual"), number(c, "kkt_tolerance"))}};
  for (const auto& [name, value] : c.at("multipliers").items())
    rows.push_back({"Multiplier of " + name, fmt::format("{:.6g}", value.get<double>())});
  if (c.at("smallest_eigenvalue").is_number()) {
    const std::string least = number(c, "smallest_eigenvalue"), largest = number(c, "largest_eigenvalue");
    const std::string which = c.at("hessian_eigenvalues").size() == 1 ? least : fmt::format("{} to {}", least, largest);
    rows.push_back({"Eigenvalues of the Hessian, scaled", which});
  }
  if (c.at("newton_step").is_number())
    rows.push_back({"Newton's step from here", fmt::format("{} of the scales; psi would fall by {}",
                                                           number(c, "newton_step"), number(c, "predicted_decrease"))});
  if (c.at("hessian_note").is_string()) rows.push_back({"Note", c.at("hessian_note").get<std::string>()});
  page.table({}, rows);
}

/// Whether values are best seen on a logarithmic axis: positive, over more than two decades.
bool spans_decades(const std::vector<double>& values) {
  double low = HUGE_VAL, high = 0;
  for (const double v : values) {
    if (!(v > 0)) return false;
    low = std::min(low, v);
    high = std::max(high, v);
  }
  return high > 100 * low;
}

void add_evaluations(HtmlPage& page, const Setup& setup, const Json& j) {
  page.heading("Evaluations");
  std::vector<double> index, psi;
  for (const Json& e : j.at("evaluations")) {
    if (e.contains("failure")) continue;
    index.push_back(e.at("index").get<double>());
    psi.push_back(e.at("psi").get<double>());
  }
  const auto plot = [&](const std::string& label, const std::vector<double>& values) {
    SvgPlot p;
    p.x_label = "evaluation";
    p.y_label = label;
    p.curves = {{"", index, values, SvgCurve::Stroke::dark, true}};
    p.counting = true;
    p.width = 370;
    p.height = 200;
    return p;
  };
  std::vector<SvgPlot> plots = {plot("psi", psi)};
  plots.front().logarithmic = spans_decades(psi);

  // Where there are many, those that went farthest, in their order.
  const auto& parameters = setup.problem.parameters.parameters;
  std::vector<std::vector<double>> scaled(parameters.size());
  std::vector<std::pair<double, std::size_t>> way;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    for (const Json& e : j.at("evaluations"))
      if (!e.contains("failure"))
        scaled[i].push_back(e.at("parameters").at(parameters[i].name).get<double>() / parameters[i].scale);
    const auto [low, high] = std::minmax_element(scaled[i].begin(), scaled[i].end());
    way.emplace_back(*low - *high, i);
  }
  std::sort(way.begin(), way.end());
  way.resize(std::min(way.size(), kParameters));
  std::sort(way.begin(), way.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  for (const auto& [minus_span, i] : way) {
    const Parameter& p = parameters[i];
    SvgPlot one = plot(fmt::format("{} / {:g}", p.name, p.scale), scaled[i]);
    const auto [low, high] = std::minmax_element(scaled[i].begin(), scaled[i].end());
    const double lower = p.lower / p.scale, upper = p.upper / p.scale;
    const auto line = [&](const char* name, double bound) {
      one.curves.insert(one.curves.begin(),
                        SvgCurve{name, {index.front(), index.back()}, {bound, bound}, SvgCurve::Stroke::dashed, false});
    };
    if (*low == lower) line("lower bound", lower);  // where it was reached
    if (*high == upper) line("upper bound", upper);
    plots.push_back(std::move(one));
  }
  page.paragraph("Each parameter is divided by its scale.");
  if (parameters.size() > kParameters)
    page.paragraph(fmt::format("Of {} parameters the {} that moved most.", parameters.size(), kParameters));
  page.plots(plots);
}

struct Motion {
  std::string name;
  const TrajectoryTable* table;
  Scene scene;  // with its parameters
};

constexpr std::size_t kSamples = 300, kLeastSamples = 20;  // of motions in 3-D
constexpr std::size_t kBytes = 4'000'000;                  // that they may take together

/// The motions in 3-D, the later over the earlier ones.
void add_viewer(HtmlPage& page, const std::vector<Motion>& motions) {
  Viewed viewed;
  std::size_t solids = 0;
  for (const Motion& m : motions)
    solids += make_stage({0}, figures_of_table(m.scene, *m.table, 1).figures).solids.size();
  // Of every solid at every sample ten floats, in base 64.
  const std::size_t samples = std::min(kSamples, kBytes / (54 * std::max<std::size_t>(1, solids)));
  if (samples < kLeastSamples) {
    page.paragraph(
        fmt::format("The motion of {} solids is too much for this page; 'costate animate' shows it.", solids));
    return;
  }
  FiguresOfRun last;
  for (const Motion& m : motions) {
    last = figures_of_table(m.scene, *m.table, samples);
    viewed.motions.emplace_back(m.name, make_stage(last.times, last.figures));
  }
  for (const TableEvent& e : motions.back().table->events) viewed.events.emplace_back(e.t, e.name);
  // Short and long motions play in some seconds: at 1, 2 or 5 times a power of ten of their own time.
  const double duration = last.times.back() - last.times.front(), wanted = duration < 2 ? duration / 4 : duration / 20;
  if (duration > 0 && (duration < 2 || duration > 30)) {
    const double power = std::pow(10, std::floor(std::log10(wanted)));
    viewed.speed = (wanted < 2 * power ? 1 : wanted < 5 * power ? 2 : 5) * power;
  }
  // Without scripts: some of the samples, one after the other.
  FiguresOfRun few;
  for (std::size_t i = 0; i < last.times.size(); i += 1 + last.times.size() / 25) {
    few.times.push_back(last.times[i]);
    few.figures.push_back(last.figures[i]);
  }
  if (solids <= 200) viewed.drawing = moving_drawing(few.figures, few.times, {"", 640, true}, viewed.speed);
  page.part(viewer_element(viewed, ""), viewer_style());
}

/// One plot an output; tables with their names in the legend, drawn in this order.
void add_motion(HtmlPage& page, const Setup& setup, const std::vector<Motion>& motions) {
  page.heading("Motion");
  add_viewer(page, motions);
  std::vector<std::string> names = outputs_of_interest(setup.scene);
  if (names.empty()) {
    names = setup.scene.mechanism()->coordinate_names();
    page.paragraph("Neither a cost nor [run] outputs name any output; these are coordinates.");
  }
  std::vector<SvgPlot> plots;
  std::string left_out;
  for (const std::string& name : names) {
    SvgPlot plot;
    plot.x_label = "time [s]";
    for (const auto& [label, table, scene] : motions)
      if (const Column* c = column_of_output(*table, name)) {
        plot.y_label = c->unit.empty() || c->unit == "1" ? name : fmt::format("{} [{}]", name, c->unit);
        const bool last = label == motions.back().name;
        if (last)
          for (const TableEvent& e : table->events) plot.marks.push_back(e.t);
        plot.curves.push_back({motions.size() > 1 ? label : "", table->time_s, c->values,
                               last ? SvgCurve::Stroke::dark : SvgCurve::Stroke::light, false});
      }
    if (plot.curves.empty()) continue;
    if (plots.size() < kHistories)
      plots.push_back(std::move(plot));
    else
      left_out += (left_out.empty() ? "" : ", ") + name;
  }
  page.plots(plots);
  if (const std::size_t events = motions.back().table->events.size())
    page.paragraph(fmt::format("Marks below the curves: {} events.", events));
  if (!left_out.empty()) page.paragraph("Not drawn, but in the files: " + left_out + ".");
}

}  // namespace

std::string optimize_page(const Setup& setup, const Json& summary, const TrajectoryTable* before,
                          const TrajectoryTable* after) {
  HtmlPage page(title_of(setup));
  add_run(page, setup, summary);
  add_result(page, summary);
  add_parameters(page, setup, summary);
  add_constraints(page, setup, summary);
  add_certificate(page, summary);
  add_evaluations(page, setup, summary);
  if (before && after) {
    const ParameterSelection& p = setup.problem.parameters;
    const auto scene = [&](const Json& at) {
      std::vector<double> rho;
      for (const std::string& name : p.names()) rho.push_back(at.at(name).get<double>());
      return setup.scene.with_parameters(p, rho);
    };
    add_motion(page, setup,
               {{"before", before, scene(summary.at("initial").at("parameters"))},
                {"after", after, scene(summary.at("parameters"))}});
  }
  return page.text();
}

std::string simulate_page(const Setup& setup, const Json& summary, const TrajectoryTable& motion) {
  HtmlPage page(title_of(setup));
  add_run(page, setup, summary);
  const Precision precision = precision_of(setup.problem.solver, summary.at("integrator").get<std::string>(),
                                           summary.at("counters").at("steps").get<long>());
  const Json& error = summary.at("psi_error");
  page.paragraph(psi_text(summary.at("psi").get<double>(), precision,
                          error.is_null() ? std::nullopt : std::optional(error.get<double>())),
                 true);
  add_motion(page, setup, {{"", &motion, setup.scene}});
  return page.text();
}

}  // namespace costate::app
