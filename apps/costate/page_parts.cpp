#include "page_parts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "costate/integrator/integrators.h"
#include "digits.h"
#include "drawing.h"
#include "motion/figures.h"
#include "motion/viewer.h"
#include "named_outputs.h"
#include "page/targets.h"

namespace costate::app {

namespace {

constexpr std::size_t kHistories = 8;                      // plots over time
constexpr std::size_t kSamples = 300, kLeastSamples = 20;  // of motions in 3-D
constexpr std::size_t kBytes = 4'000'000;                  // that they may take together
constexpr std::size_t kDrawn = 200;                        // solids of a drawing that plays

/// The motions in 3-D, the later over the earlier ones.
void add_viewer(HtmlPage& page, const std::vector<Motion>& motions) {
  Viewed viewed;
  std::size_t solids = 0;
  for (const Motion& m : motions)
    solids += make_stage({0}, figures_of_table(m.scene, *m.table, 1).figures).solids.size();
  // Of every solid at every sample ten floats, in base 64.
  const std::size_t samples = std::min(kSamples, kBytes / (54 * std::max<std::size_t>(1, solids)));
  if (samples < kLeastSamples || (!has_viewer() && solids > kDrawn)) {
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
  if (solids <= kDrawn) viewed.drawing = moving_drawing(few.figures, few.times, {"", 640, true}, viewed.speed);
  page.part(viewer_element(viewed, ""), viewer_style());
}

/// What the cost wants of an output, under the names that tell it from the motions.
void add_targets(SvgPlot& plot, const std::string& output, const std::vector<Motion>& motions) {
  std::vector<SvgCurve> wanted;
  for (auto m = motions.rbegin(); m != motions.rend(); ++m)
    for (SvgCurve& c : target_curves(m->scene, output, *m->table)) {
      const bool drawn = std::any_of(wanted.begin(), wanted.end(),
                                     [&](const SvgCurve& other) { return other.x == c.x && other.y == c.y; });
      if (drawn) continue;
      if (m != motions.rbegin()) c.name += " " + m->name;  // it depends on the parameters
      wanted.push_back(std::move(c));
    }
  if (wanted.empty()) return;
  if (motions.size() == 1 && plot.curves.front().name.empty()) plot.curves.front().name = "simulated";
  // Many dots would hide the curve that goes through them.
  for (SvgCurve& c : wanted)
    plot.curves.insert(c.x.size() > 1 && !c.joined ? plot.curves.begin() : plot.curves.end(), c);
}

/// The runs that a design is judged by, and what became of each, where there are evaluations.
void add_cases(HtmlPage& page, const Json& j) {
  page.heading("Cases");
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < j.at("cases").size(); ++i) {
    const Json& c = j.at("cases")[i];
    const double after = c.at("psi").get<double>(),
                 before = j.contains("evaluations") ? j.at("evaluations").front().at("cases")[i].get<double>() : after;
    rows.push_back({c.at("name").get<std::string>(), page_number(before), page_number(after),
                    before != 0 ? fmt::format("{:+.3g} %", 100 * (after - before) / std::abs(before)) : "-",
                    page_number(c, "weight"), page_number(c, "scale"), page_number(c, "upper"), run_of_case(c)});
  }
  page.table({"case", "#psi before", "#after", "#change", "#weight", "#scale", "#at most", "run"}, rows);
}

}  // namespace

std::string page_number(double x) {
  if (x == HUGE_VAL || x == -HUGE_VAL) return "none";
  return fmt::format("{:.6g}", shown(x));
}
std::string page_number(const Json& j, const char* key) {
  return j.contains(key) && j.at(key).is_number() ? page_number(j.at(key).get<double>()) : "-";
}

std::string page_psi(const Setup& setup, const Json& summary) {
  const Json &integrator = summary.at("integrator"), &error = summary.at("psi_error");
  const Precision held = precision_of(
      setup.problem.solver, integrator.is_string() ? integrator.get<std::string>() : integrator_of(setup.problem),
      summary.at("counters").at("steps").get<long>());
  return psi_text(summary.at("psi").get<double>(), held, std::nullopt,
                  error.is_number() ? std::optional(KnownError{error.get<double>()}) : std::nullopt);
}

std::string run_of_case(const Json& c) {
  return fmt::format("{}, {} by {}, rtol {:g}", c.at("scene").get<std::string>(),
                     c.at("formulation").get<std::string>(), c.at("method").get<std::string>(),
                     c.at("rtol").get<double>());
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
  const bool several = j.contains("cases");
  std::vector<std::vector<std::string>> rows = {{"Scene", setup.scene.file_name()}};
  const std::vector<std::vector<std::string>> run = {
      {"Time", j.contains("end")
                   ? fmt::format("{:g} to {:.9g} s, ended by {}", s.t_start, j.at("end").at("t").get<double>(),
                                 j.at("end").at("name").get<std::string>())
                   : fmt::format("{:g} to {:g} s", s.t_start, s.t_end)},
      {"Formulation", fmt::format("{} on {}", text("formulation"), text("integrator"))},
      {"Tolerances", fmt::format("relative {:g}, absolute {:g}", s.rtol, s.absolute())}};
  if (several)
    rows.push_back({"psi", fmt::format("the {} of the cases' weight psi / scale", text("goal"))});
  else
    rows.insert(rows.end(), run.begin(), run.end());
  if (!several && j.at("method").is_string()) rows.push_back({"Gradient", text("method")});
  if (j.contains("algorithm")) rows.push_back({"Optimizer", text("algorithm")});
  std::string versions;
  for (const auto& [name, version] : j.at("settings").at("versions").items())
    versions += fmt::format("{}{} {}", versions.empty() ? "" : ", ", name, version.get<std::string>());
  rows.push_back({"Versions", versions});
  rows.push_back({"Wall time", fmt::format("{:.3g} s", j.at("wall_s").get<double>())});
  page.table({}, rows);
  if (several) add_cases(page, j);
  add_warnings(page, j);
}

void add_text(HtmlPage& page, const std::string& text) {
  std::string body = "<pre>\n";
  std::istringstream in(text);
  for (std::string line; std::getline(in, line);) body += xml_escaped(line) + "\n";
  page.part(body + "</pre>\n", "pre { overflow-x: auto; }\n");
}

void add_warnings(HtmlPage& page, const Json& j) {
  if (!j.contains("warnings")) return;
  for (const Json& warning : j.at("warnings")) page.paragraph("Warning: " + warning.get<std::string>(), true);
}

void add_motion(HtmlPage& page, const Setup& setup, const std::vector<Motion>& motions, const std::string& title,
                bool viewer) {
  page.heading(title);
  if (viewer) add_viewer(page, motions);
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
    add_targets(plot, name, motions);
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

}  // namespace costate::app
