#include "pareto_report.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "html_page.h"
#include "page_parts.h"

namespace costate::app {

namespace {

/// Along the front by the first target; the start, if wanted, before all.
std::vector<const ParetoPoint*> along_front(const ParetoFront& front) {
  std::vector<const ParetoPoint*> points;
  for (const ParetoPoint& p : front.points) points.push_back(&p);
  std::stable_sort(points.begin(), points.end(),
                   [](const auto* a, const auto* b) { return a->targets.front() < b->targets.front(); });
  return points;
}

std::string point_kind(const ParetoPoint& p, const Design& design) {
  std::string text = p.end() ? "least " + design.targets[static_cast<std::size_t>(p.least_of)].name : "front";
  if (p.dominated) text += ", dominated";
  if (!p.converged) text += ", not converged";
  if (!p.feasible()) text += ", constraints exceeded";
  if (p.repeated) text += ", the same as another";
  return text;
}

SvgPlot front_picture(const Design& design, const ParetoFront& front, std::size_t a, std::size_t b) {
  SvgPlot plot;
  plot.x_label = design.targets[a].name;
  plot.y_label = design.targets[b].name;
  plot.width = 560;
  plot.height = 400;
  SvgCurve good{"Pareto front", {}, {}}, others{"dominated, exceeding or not converged", {}, {}},
      start{"start", {}, {}};
  good.markers = true;
  good.joined = design.targets.size() == 2;
  others.joined = start.joined = false;
  good.color = "#14316e";
  others.color = "#e09f3e";
  start.color = "#d1495b";
  const auto add = [&](SvgCurve& c, const ParetoPoint& p) {
    c.x.push_back(p.targets[a]);
    c.y.push_back(p.targets[b]);
    c.names.push_back(point_kind(p, design));
  };
  for (const ParetoPoint* p : along_front(front)) add(p->on_front() ? good : others, *p);
  if (!front.start.targets.empty()) add(start, front.start);
  for (SvgCurve* c : {&others, &start, &good})
    if (!c->x.empty()) plot.curves.push_back(std::move(*c));
  return plot;
}

}  // namespace

std::string point_line(const DesignSetup& whole, const Design& design, const ParetoPoint& p) {
  std::string line = fmt::format("  {:<24}", point_kind(p, design));
  for (std::size_t g = 0; g < p.targets.size(); ++g)
    line += fmt::format(" {} = {:<10.6g}", design.targets[g].name, p.targets[g]);
  const std::vector<std::string> names = whole.setup.problem.parameters.names();
  for (std::size_t j = 0; j < names.size() && j < 4; ++j) line += fmt::format(" {} = {:.6g}", names[j], p.rho[j]);
  if (names.size() > 4) line += " ...";
  return line + fmt::format(" ({} evaluations)\n", p.evaluations);
}

std::string pareto_text(const DesignSetup& whole, const Design& design, const ParetoFront& front, double wall_s) {
  const Setup& s = whole.setup;
  int evaluations = 0, on_front = 0, dominated = 0, unconverged = 0, repeated = 0;
  for (const ParetoPoint& p : front.points) {
    evaluations += p.evaluations;
    on_front += p.on_front();
    repeated += p.repeated;
    dominated += p.dominated;
    unconverged += !p.converged;
  }
  std::string text = fmt::format("{}: {} points of the Pareto front, {} evaluations of {} cases, {:.3g} s\n",
                                 title_of(s), on_front, evaluations, whole.cases.size(), wall_s);
  if (dominated > 0)
    text += fmt::format("  {} more are dominated by others: a search ended in a local minimum\n", dominated);
  if (repeated > 0) text += fmt::format("  {} are the same as others\n", repeated);
  if (unconverged > 0) text += fmt::format("  {} did not converge (more --max-evaluations?)\n", unconverged);
  for (std::size_t g = 0; g < design.targets.size() && g < front.ideal.size(); ++g)
    text += fmt::format("  {}: {:.6g} at its least, {:.6g} where the others are; {:.6g} at the start\n",
                        design.targets[g].name, front.ideal[g], front.nadir[g], front.start.targets[g]);
  for (const std::string& note : front.notes) text += "  " + note + "\n";
  return text;
}

std::string pareto_csv(const DesignSetup& whole, const Design& design, const ParetoFront& front) {
  std::string text = "point,kind,dominated,converged,repeated,violation,evaluations";
  for (const DesignTarget& t : design.targets) text += "," + t.name;
  for (const DesignCase& c : design.cases) text += ",psi." + c.name;
  for (const std::string& name : whole.setup.problem.parameters.names()) text += "," + name;
  text += "\n";
  const auto row = [&](const std::string& number, const std::string& kind, const ParetoPoint& p) {
    text += fmt::format("{},{},{},{},{},{},{}", number, kind, p.dominated ? 1 : 0, p.converged ? 1 : 0,
                        p.repeated ? 1 : 0, p.violation, p.evaluations);
    for (const auto* list : {&p.targets, &p.cases, &p.rho})
      for (const double x : *list) text += fmt::format(",{}", x);
    text += "\n";
  };
  if (!front.start.targets.empty()) row("0", "start", front.start);
  int count = 0;
  for (const ParetoPoint* p : along_front(front)) row(std::to_string(++count), p->end() ? "end" : "front", *p);
  return text;
}

Json pareto_json(const DesignSetup& whole, const Design& design, const ParetoFront& front, const ParetoOptions& options,
                 double wall_s) {
  const std::vector<std::string> names = whole.setup.problem.parameters.names();
  std::vector<std::string> targets, cases;
  for (const DesignTarget& t : design.targets) targets.push_back(t.name);
  for (const DesignCase& c : design.cases) cases.push_back(c.name);
  const auto point = [&](const ParetoPoint& p) {
    Json j;
    j["targets"] = named(targets, p.targets);
    j["cases"] = named(cases, p.cases);
    j["parameters"] = named(names, p.rho);
    return j;
  };
  Json j;
  j["title"] = whole.setup.scene.title;
  j["objectives"] = targets;
  j["algorithm"] = options.search.algorithm;
  j["cases"] = front.start.cases.empty()
                   ? Json::array()
                   : whole.cases_json(front.start.cases, std::vector<std::vector<double>>(
                                                             cases.size(), std::vector<double>(names.size())));
  for (Json& c : j["cases"]) c.erase("gradient");
  j["initial"] = point(front.start);
  j["ideal"] = front.ideal.empty() ? Json() : named(targets, front.ideal);
  j["nadir"] = front.nadir.empty() ? Json() : named(targets, front.nadir);
  j["points"] = Json::array();
  for (const ParetoPoint* p : along_front(front)) {
    Json of = point(*p);
    of["end"] = p->end();
    of["converged"] = p->converged;
    of["dominated"] = p->dominated;
    of["repeated"] = p->repeated;
    of["violation"] = p->violation;
    of["stop_reason"] = p->stop_reason;
    of["evaluations"] = p->evaluations;
    j["points"].push_back(std::move(of));
  }
  j["notes"] = front.notes;
  j["wall_s"] = wall_s;
  j["settings"] = settings_json(whole.setup);
  return j;
}

std::string pareto_page(const DesignSetup& whole, const Design& design, const ParetoFront& front, const Json& summary) {
  const Setup& s = whole.setup;
  HtmlPage page(title_of(s));
  if (!s.scene.description.empty()) page.paragraph(s.scene.description);
  page.heading("Pareto front");
  page.paragraph(
      "Of each point of the front no objective can become less without another one becoming more, as far as a local "
      "search by exact gradients tells.");
  if (summary.at("status") != "ok")
    page.paragraph("The run did not come to its end: these are the points until then.", true);
  for (const std::string& note : front.notes) page.paragraph(note, true);
  std::vector<SvgPlot> plots;
  for (std::size_t a = 0; a < design.targets.size(); ++a)
    for (std::size_t b = a + 1; b < design.targets.size(); ++b) plots.push_back(front_picture(design, front, a, b));
  page.plots(plots);

  const auto& parameters = s.problem.parameters.parameters;
  std::vector<std::string> header = {"point"};
  for (const DesignTarget& t : design.targets) header.push_back("#" + t.name);
  for (const Parameter& p : parameters) header.push_back("#" + p.name);
  header.emplace_back("#evaluations");
  header.emplace_back("stopped by");
  std::vector<std::vector<std::string>> rows;
  const auto row = [&](const std::string& kind, const ParetoPoint& p) {
    std::vector<std::string> cells = {kind};
    for (const double x : p.targets) cells.push_back(page_number(x));
    for (const double x : p.rho) cells.push_back(page_number(x));
    cells.push_back(p.evaluations > 0 ? std::to_string(p.evaluations) : "");
    cells.push_back(p.stop_reason);
    rows.push_back(std::move(cells));
  };
  if (!front.start.targets.empty()) row("start", front.start);
  for (const ParetoPoint* p : along_front(front)) row(point_kind(*p, design), *p);
  page.table(header, rows);

  page.heading("Parameters along the front");
  std::vector<SvgPlot> along;
  for (std::size_t j = 0; j < parameters.size(); ++j) {
    SvgPlot plot;
    plot.x_label = design.targets.front().name;
    plot.y_label = parameters[j].name;
    plot.width = 370;
    plot.height = 200;
    SvgCurve c;
    c.markers = true;
    for (const ParetoPoint* p : along_front(front)) {
      if (!p->on_front()) continue;
      c.x.push_back(p->targets.front());
      c.y.push_back(p->rho[j]);
    }
    plot.curves.push_back(std::move(c));
    along.push_back(std::move(plot));
  }
  page.plots(along);

  page.heading("What was run");
  std::vector<std::vector<std::string>> runs;
  for (const Json& c : summary.at("cases"))
    runs.push_back({c.at("name").get<std::string>(),
                    c.at("objective").is_string() ? c.at("objective").get<std::string>() : "a bound",
                    page_number(c, "weight"), page_number(c, "scale"), run_of_case(c)});
  page.table({"case", "objective", "#weight", "#scale", "run"}, runs);
  page.paragraph(fmt::format("Optimizer: {}. Wall time: {:.3g} s.", summary.at("algorithm").get<std::string>(),
                             summary.at("wall_s").get<double>()));
  return page.text();
}

}  // namespace costate::app
