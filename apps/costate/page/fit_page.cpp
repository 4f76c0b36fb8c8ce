// The page of costate fit.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "command_pages.h"
#include "costate/objective/sampled_cost.h"
#include "costate/page_parts.h"

namespace costate::app {

namespace {

constexpr std::size_t kResiduals = 1000;   // of one channel's residuals
constexpr std::size_t kCorrelations = 20;  // parameters of a table that can be read

/// The output that a term's samples are of.
std::string output_of(const Problem& problem, const std::string& term) {
  for (const auto& t : problem.objective.terminal)
    if (const auto* samples = dynamic_cast<const SampledCost*>(&ungated(*t)))
      if (samples->data().path == term) return samples->output().name();
  return term;
}

std::string scene_of(const std::vector<FittedRun>& runs, std::size_t k) {
  return runs.size() > 1 ? runs[k].setup.scene.file_name() + " " : "";
}

void add_outcome(HtmlPage& page, const FitResult& r) {
  page.heading("Result");
  std::string squares = fmt::format("{} samples, {}, {} iterations. Sum of squares: {:.6g} -> {:.6g}", r.residuals,
                                    r.termination, r.iterations, r.start_chi_square, r.chi_square);
  if (r.degrees_of_freedom > 0)
    squares +=
        fmt::format(", {:.4g} a degree of freedom ({})", r.chi_square / r.degrees_of_freedom, r.degrees_of_freedom);
  page.paragraph(squares + ".", true);
  if (!r.converged) page.paragraph("It has not converged: these are the values where it ended.", true);
  if (r.failed_evaluations > 0)
    page.paragraph(
        fmt::format("{} of {} evaluations failed; their steps were shortened.", r.failed_evaluations, r.evaluations));
}

void add_parameters(HtmlPage& page, const FitResult& r, double confidence) {
  page.heading("Parameters");
  std::vector<std::vector<std::string>> rows;
  for (const FittedParameter& p : r.parameters) {
    const bool known = std::isfinite(p.standard_error);
    rows.push_back({p.name, fmt::format("{:.8g}", p.start), fmt::format("{:.8g}", p.value),
                    known ? fmt::format("{:.3g}", p.standard_error) : "-",
                    known ? fmt::format("{:.6g} ... {:.6g}", p.confidence_lower, p.confidence_upper) : "-",
                    page_number(p.lower), page_number(p.upper),
                    p.at_bound      ? "at its bound"
                    : !p.identified ? "not identified"
                                    : ""});
  }
  page.table({"parameter", "#start", "#value", "#std error", fmt::format("#{:g} % interval", 100 * confidence),
              "#lower", "#upper", ""},
             rows);
  page.list(r.identifiability);
}

void add_correlation(HtmlPage& page, const FitResult& r) {
  const std::size_t n = r.parameters.size();
  if (n < 2) return;
  page.heading("Correlation");
  if (n > kCorrelations) {
    page.paragraph(fmt::format("Of {} parameters: in fit.json.", n));
    return;
  }
  std::vector<std::string> header = {""};
  std::vector<std::vector<std::string>> rows;
  for (std::size_t i = 0; i < n; ++i) {
    header.push_back("#" + r.parameters[i].name);
    rows.push_back({r.parameters[i].name});
    for (std::size_t j = 0; j < n; ++j) {
      const double c = r.correlation(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j));
      rows.back().push_back(std::isfinite(c) ? fmt::format("{:.3f}", c) : "-");
    }
  }
  page.table(header, rows);
}

void add_data(HtmlPage& page, const std::vector<FittedRun>& runs, const FitResult& r) {
  page.heading("Data");
  std::vector<std::vector<std::string>> rows;
  std::vector<SvgPlot> plots;
  for (const FitResult::Set& s : r.sets) {
    const std::string output = output_of(runs[s.problem].setup.problem, s.term);
    rows.push_back({scene_of(runs, s.problem) + s.term, output, std::to_string(s.count),
                    fmt::format("{:.3g}", s.start_rms), fmt::format("{:.3g}", s.rms)});
    if (s.times.empty()) continue;
    SvgPlot plot;
    plot.x_label = "time [s]";
    const std::filesystem::path file = runs[s.problem].setup.scene.file_name();
    plot.y_label = (runs.size() > 1 ? file.stem().string() + " " : "") + output + ": residual [sigma]";
    for (const double sigma : {-1.0, 1.0})
      plot.curves.push_back({sigma > 0 ? "one sigma" : "",
                             {s.times.front(), s.times.back()},
                             {sigma, sigma},
                             SvgCurve::Stroke::dashed,
                             false});
    SvgCurve dots;
    const std::size_t stride = 1 + (s.times.size() - 1) / kResiduals;
    for (std::size_t k = 0; k < s.times.size(); k += stride) {
      dots.x.push_back(s.times[k]);
      dots.y.push_back(s.residuals[k]);
    }
    dots.joined = false;
    if (stride > 1) dots.name = fmt::format("1 of {}", stride);
    plot.curves.push_back(std::move(dots));
    plots.push_back(std::move(plot));
  }
  page.table({"samples", "output", "#number", "#rms at the start [sigma]", "#rms [sigma]"}, rows);
  page.paragraph("Residuals are the model's output less the measured value, in sigmas of the measurement.");
  page.plots(plots);
}

}  // namespace

std::string fit_page(const std::vector<FittedRun>& runs, const FitResult& r, const Json& j) {
  HtmlPage page(title_of(runs.front().setup));
  add_warnings(page, j);
  if (!runs.front().setup.scene.description.empty()) page.paragraph(runs.front().setup.scene.description);
  add_outcome(page, r);
  add_parameters(page, r, j.at("confidence").get<double>());
  add_correlation(page, r);
  add_data(page, runs, r);
  bool viewer = true;  // of one run: a page has one
  for (std::size_t k = 0; k < runs.size(); ++k) {
    if (!runs[k].motion) continue;
    add_motion(page, runs[k].setup, {{"", &*runs[k].motion, runs[k].setup.scene}},
               "Fitted motion" + (runs.size() > 1 ? " of " + runs[k].setup.scene.file_name() : ""), viewer);
    viewer = false;
  }
  return page.text();
}

}  // namespace costate::app
