// costate fit: parameters from measured data, with intervals and what the data tell of them.
#include "costate/fit/fit.h"

#include <fmt/format.h>

#include <chrono>
#include <cmath>

#include "command.h"
#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/record/atomic_file.h"
#include "costate/record/print.h"
#include "costate/scene/scene_files.h"
#include "design_setup.h"
#include "explain/left_out.h"
#include "page/command_pages.h"
#include "run_pages.h"

namespace costate::app {

namespace {

struct FitCommandOptions {
  std::vector<std::string> others;
  int max_iterations = FitOptions().max_iterations;
  double confidence = FitOptions().confidence;
  bool sigma_from_residuals = false;
};

/// Not a number becomes null.
Json matrix_json(const Eigen::MatrixXd& m) {
  Json rows = Json::array();
  for (Eigen::Index i = 0; i < m.rows(); ++i) {
    Json row = Json::array();
    for (Eigen::Index j = 0; j < m.cols(); ++j) row.push_back(m(i, j));
    rows.push_back(row);
  }
  return rows;
}

Json fit_json(const std::vector<Setup>& setups, const FitResult& r, const FitOptions& options, double wall) {
  Json j;
  j["status"] = r.converged ? "ok" : "stopped";
  j["termination"] = r.termination;
  j["scene"] = setups.front().scene.file_name();
  j["title"] = setups.front().scene.title;
  j["scenes"] = Json::array();
  for (const Setup& s : setups) j["scenes"].push_back(s.scene.file_name());
  j["parameters"] = Json::object();
  for (const FittedParameter& p : r.parameters) {
    Json e;
    e["start"] = p.start;
    e["value"] = p.value;
    e["standard_error"] = p.standard_error;
    e["confidence_interval"] = {p.confidence_lower, p.confidence_upper};
    e["integration_error"] = std::isfinite(p.standard_error) ? Json(p.integration_error) : Json();
    e["lower"] = p.lower;
    e["upper"] = p.upper;
    e["at_bound"] = p.at_bound;
    e["identified"] = p.identified;
    j["parameters"][p.name] = e;
  }
  j["confidence"] = options.confidence;
  j["sigma_from_residuals"] = options.sigma_from_residuals;
  j["covariance"] = matrix_json(r.covariance);
  j["correlation"] = matrix_json(r.correlation);
  j["chi_square"] = r.chi_square;
  j["start_chi_square"] = r.start_chi_square;
  j["residuals"] = r.residuals;
  j["degrees_of_freedom"] = r.degrees_of_freedom;
  j["reduced_chi_square"] =
      r.degrees_of_freedom > 0 ? r.chi_square / r.degrees_of_freedom : std::numeric_limits<double>::quiet_NaN();
  j["data"] = Json::array();
  for (const FitResult::Set& s : r.sets)
    j["data"].push_back({{"scene", setups[s.problem].scene.file_name()},
                         {"term", s.term},
                         {"samples", s.count},
                         {"start_rms", s.start_rms},
                         {"rms", s.rms}});
  j["identifiability"] = r.identifiability;
  j["iterations"] = r.iterations;
  j["evaluations"] = r.evaluations;
  j["failed_evaluations"] = r.failed_evaluations;
  j["counters"] = counters_json(r.counters);
  j["wall_s"] = wall;
  j["warnings"] = take_notices();
  j["settings"] = settings_json(setups.front());
  return j;
}

/// Significant ones, to the third of the standard error.
int digits_to(const FittedParameter& p) {
  if (!(p.standard_error > 0) || p.value == 0) return 6;
  return std::clamp(static_cast<int>(std::ceil(std::log10(std::abs(p.value) / p.standard_error))) + 3, 6, 15);
}

std::string fit_text(const std::vector<Setup>& setups, const FitResult& r, const FitOptions& options) {
  const Scene& scene = setups.front().scene;
  std::string text = fmt::format("{}\n  {} samples, {}, {} iterations\n  sum of squares: {:.6g} -> {:.6g}",
                                 scene.title.empty() ? scene.file_name() : scene.title, r.residuals, r.termination,
                                 r.iterations, r.start_chi_square, r.chi_square);
  if (r.degrees_of_freedom > 0)
    text += fmt::format(", {:.4g} a degree of freedom ({})", r.chi_square / r.degrees_of_freedom, r.degrees_of_freedom);
  text += "\n\n";
  std::size_t width = 9;
  for (const FittedParameter& p : r.parameters) width = std::max(width, p.name.size());
  text += fmt::format("  {:<{}} {:>14} {:>14} {:>12}   {:g} % interval\n", "parameter", width, "start", "value",
                      "std error", 100 * options.confidence);
  for (const FittedParameter& p : r.parameters) {
    const int digits = digits_to(p);
    text += fmt::format("  {:<{}} {:>14.8g} {:>14.{}g}", p.name, width, p.start, p.value, std::max(digits, 8));
    text += std::isfinite(p.standard_error)
                ? fmt::format(" {:>12.3g}   {:.{}g} ... {:.{}g}\n", p.standard_error, p.confidence_lower, digits,
                              p.confidence_upper, digits)
                : fmt::format(" {:>12}   {}\n", "-", p.at_bound ? "at its bound" : "not identified");
  }
  text += "\n";
  for (const FitResult::Set& s : r.sets)
    text += fmt::format("  {}{}: {} samples, residuals of {:.3g} sigma (at the start {:.3g})\n",
                        setups.size() > 1 ? setups[s.problem].scene.file_name() + " " : "", s.term, s.count, s.rms,
                        s.start_rms);
  for (const auto& sentence : r.identifiability) text += fmt::format("  {}\n", sentence);
  return text;
}

int run(const CommonOptions& common, const FitCommandOptions& options) {
  if (!(options.confidence > 0 && options.confidence < 1))
    throw Error(fmt::format("--confidence must lie between 0 and 1, found {}.", options.confidence));
  if (options.max_iterations < 1)
    throw Error(fmt::format("--max-iterations must be at least 1, found {}.", options.max_iterations));
  std::vector<Setup> setups;
  std::vector<std::vector<SceneFile>> files;
  const auto load = [&](const std::string& path) {
    CommonOptions own = common;
    own.scene = path;
    const SceneFileLog log(path);
    setups.emplace_back(own, Purpose::simulate);
    leave_out_rest(setups.back());
    files.push_back(log.files());
  };
  load(common.scene);
  for (const auto& path : options.others) load(path);
  std::vector<Problem> problems;
  for (const Setup& s : setups) problems.push_back(s.problem);
  FitOptions o;
  o.max_iterations = options.max_iterations;
  o.confidence = options.confidence;
  o.sigma_from_residuals = options.sigma_from_residuals;
  const bool told = !common.quiet && !common.json && common.verbose;
  const auto begin = std::chrono::steady_clock::now();
  const FitResult r = setups.front().located([&] {
    return fit(problems, o, [&](int evaluation, double chi_square, const std::vector<double>&) {
      if (told) print_message(fmt::format("evaluation {}: sum of squares {:.9g}", evaluation, chi_square));
    });
  });
  const double wall = seconds_since(begin);
  Setup& first = setups.front();
  std::string text = fit_text(setups, r, o);
  std::vector<FittedRun> runs;
  for (std::size_t k = 0; k < setups.size(); ++k) {
    FittedRun run{setups[k], {}};
    run.setup.rho.clear();
    for (const Parameter& p : problems[k].parameters.parameters)
      for (const FittedParameter& f : r.parameters)
        if (f.name == p.name) run.setup.rho.push_back(f.value);
    try {  // nothing holds a parameter without bounds where there is a scene
      require_scene(setups[k], run.setup.rho);
    } catch (const SolverError& e) {
      notice(fmt::format("The data lead to numbers that no scene may have, so that none is written: {}", e.what()));
      continue;
    }
    const std::string name = k == 0 ? "fitted.toml" : fmt::format("fitted_{}.toml", k + 1);
    const bool written = first.write_file(name, [&](const auto& path) {
      write_file_atomically(
          path, scene_text_for(setups[k].scene, files[k], first.directory, problems[k].parameters, run.setup.rho));
    });
    if (written) text += fmt::format("  fitted scene: {}\n", (first.directory / name).string());
    if (!first.files) continue;
    run.setup.scene = setups[k].scene.with_parameters(problems[k].parameters, run.setup.rho);
    run.motion = motion_for_page(run.setup, settings_json(first));
    runs.push_back(std::move(run));
  }
  const Json j = fit_json(setups, r, o, wall);
  if (!runs.empty()) text += written_page(first, "fit.html", fit_page(runs, r, j));
  report(first, common, j, text, "fit.json");
  return r.converged ? 0 : kFailed;
}

const RegisterCommand fit_command(
    CommandGroup::run, "fit", "Identify parameters from measured data, with their intervals",
    [](Command& c, CommonOptions& common) {
      auto options = std::make_shared<FitCommandOptions>();
      common.add_to(c);
      common.add_run_options(c);
      for (const char* name : {"--case", "--method", "--checkpoint-steps", "--step"}) c.remove(name);
      c.option("--with", options->others,
               "Another scene whose data are fitted at once; parameters of one name are one and the same")
          .repeatable();
      c.option("--max-iterations", options->max_iterations, "Of Levenberg and Marquardt's method (default: 50)");
      c.option("--confidence", options->confidence, "Of the intervals (default: 0.95)");
      c.flag("--sigma-from-residuals", options->sigma_from_residuals,
             "The sigmas are weights only; the residuals say how large errors are");
      c.footer(
          "The scene's cost is [[cost.samples]] alone. Writes fitted.toml, the scene with the values found, fit.json "
          "with covariance, correlation, intervals and what the data tell of each parameter, and fit.html, a page "
          "with the samples beside the fitted motion.");
      c.runs([&common, options] { return run(common, *options); });
    });

}  // namespace

}  // namespace costate::app
