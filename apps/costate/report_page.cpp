#include "report_page.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/integrator/integrators.h"
#include "costate/record/svg_plot.h"
#include "digits.h"
#include "evaluation_text.h"
#include "page_parts.h"

namespace costate::app {

namespace {

constexpr std::size_t kParameters = 12;  // plots over the evaluations

/// "It fell by 2 (40 %)."
std::string improvement(double before, double after) {
  const double fall = before - after;
  if (fall == 0) return "It did not change.";
  std::string text = fmt::format("It {} by {}", fall > 0 ? "fell" : "rose", page_number(std::abs(fall)));
  if (before != 0) text += fmt::format(", {:.4g} % of where it began", 100 * std::abs(fall / before));
  if (after > 0 && before > 100 * after) text += fmt::format(", to 1/{:.3g} of it", before / after);
  return text + ".";
}

void add_result(HtmlPage& page, const Json& j) {
  const double before = j.at("initial").at("psi").get<double>(), after = j.at("psi").get<double>();
  page.heading("Result");
  const bool own_steps = j.at("integrator").is_string() && has_fixed_steps(j.at("integrator"));
  const double relative = own_steps ? 0 : j.at("rtol").get<double>();
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
    rows.push_back({p.name, page_number(before), page_number(after),
                    before != 0 ? fmt::format("{:+.3g} %", 100 * (after - before) / std::abs(before)) : "-",
                    page_number(p.lower), page_number(p.upper),
                    after == p.lower   ? "at lower"
                    : after == p.upper ? "at upper"
                                       : "",
                    page_number(j.at("gradient").at(p.name).get<double>()), numbers});
  }
  page.table({"parameter", "#before", "#after", "#change", "#lower", "#upper", "active bound", "#d(psi)/d(parameter)",
              "what it is in the scene"},
             rows);
}

void add_constraints(HtmlPage& page, const Json& j) {
  if (!j.contains("constraints")) return;
  page.heading("Constraints");
  std::vector<std::vector<std::string>> rows;
  for (const Json& c : j.at("constraints")) {
    const double after = c.at("psi").get<double>(), upper = c.at("upper").get<double>();
    rows.push_back({c.at("name").get<std::string>(), page_number(c, "initial"), page_number(after), page_number(upper),
                    after > upper ? fmt::format("exceeded by {:.3g}", after - upper) : "kept"});
  }
  page.table({"constraint", "#before", "#after", "#upper", ""}, rows);
}

void add_certificate(HtmlPage& page, const Json& j) {
  if (!j.contains("certificate")) return;
  const Json& c = j.at("certificate");
  page.heading("Certificate");
  page.paragraph(c.at("verdict").get<std::string>(), true);
  std::vector<std::vector<std::string>> rows = {
      {"Projected gradient, scaled", page_number(c, "projected_gradient")},
      {"KKT residual",
       fmt::format("{} (within {} counts as zero)", page_number(c, "kkt_residual"), page_number(c, "kkt_tolerance"))}};
  for (const auto& [name, value] : c.at("multipliers").items())
    rows.push_back({"Multiplier of " + name, fmt::format("{:.6g}", value.get<double>())});
  if (c.at("smallest_eigenvalue").is_number()) {
    const std::string least = page_number(c, "smallest_eigenvalue"), largest = page_number(c, "largest_eigenvalue");
    const std::string which = c.at("hessian_eigenvalues").size() == 1 ? least : fmt::format("{} to {}", least, largest);
    rows.push_back({"Eigenvalues of the Hessian, scaled",
                    fmt::format("{}, known to {}", which, page_number(c, "eigenvalue_error"))});
  }
  if (c.at("newton_step").is_number())
    rows.push_back(
        {"Newton's step from here", fmt::format("{} of the scales; psi would fall by {}", page_number(c, "newton_step"),
                                                page_number(c, "predicted_decrease"))});
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
  for (std::size_t i = 0; j.contains("cases") && i < j.at("cases").size(); ++i) {
    std::vector<double> of_case;
    for (const Json& e : j.at("evaluations"))
      if (!e.contains("failure")) of_case.push_back(e.at("cases")[i].get<double>());
    plots.push_back(plot("psi of " + j.at("cases")[i].at("name").get<std::string>(), of_case));
  }
  for (SvgPlot& p : plots) p.logarithmic = spans_decades(p.curves.front().y);

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

}  // namespace

std::string optimize_page(const Setup& setup, const Json& summary, const std::vector<RunMotion>& motions) {
  HtmlPage page(title_of(setup));
  add_run(page, setup, summary);
  add_result(page, summary);
  add_parameters(page, setup, summary);
  add_constraints(page, summary);
  add_certificate(page, summary);
  add_evaluations(page, setup, summary);
  bool viewer = true;  // of one run: a page has one
  for (const RunMotion& m : motions) {
    if (!m.before || !m.after) continue;
    const auto scene = [&](const std::vector<double>& rho) {
      return m.setup->scene.with_parameters(m.setup->problem.parameters, rho);
    };
    add_motion(page, *m.setup, {{"before", &*m.before, scene(m.rho_before)}, {"after", &*m.after, scene(m.rho_after)}},
               m.name.empty() ? "Motion" : "Motion of the case " + m.name, viewer);
    viewer = false;
  }
  if (motions.size() > 1)
    page.paragraph("In 3-D the first case alone; 'costate animate SCENE --case NAME' shows the others.");
  return page.text();
}

std::string simulate_page(const Setup& setup, const Json& summary, const TrajectoryTable& motion) {
  HtmlPage page(title_of(setup));
  add_run(page, setup, summary);
  page.paragraph(page_psi(setup, summary), true);
  add_motion(page, setup, {{"", &motion, setup.scene}}, "Motion", true);
  return page.text();
}

}  // namespace costate::app
