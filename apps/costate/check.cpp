// costate check: every formulation x method on one scene, each beside the best available reference.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <map>

#include "command.h"
#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/record/interrupt.h"
#include "trajectory.h"

namespace costate::app {

namespace {

struct CheckOptions {
  std::vector<std::string> formulations, methods;
  bool all = false;
};

struct Row {
  std::string formulation, method, refused, failure;
  GradientResult result;
  double wall_s = 0;
  double time_ratio = 0;  // to a plain simulation on the same form
  double error = 0;       // distance to the reference, relative
  std::string worst;     // "parameter L01" or "psi": what is farthest from it
  bool agrees = true;
  std::string remark;
};

/// The largest scaled component, max_j |g_j - r_j| s_j / max_k |r_k| s_k, so that units of parameters do not matter, or
/// the distance of psi where that is larger. `worst` names it.
double distance(const GradientResult& g, const GradientResult& r, const std::vector<Parameter>& p, std::string* worst) {
  double size = 0;
  for (std::size_t j = 0; j < p.size(); ++j) size = std::max(size, std::abs(r.gradient[j]) * p[j].scale);
  double largest = 0;
  const auto compare = [&](double x, double reference, double against, const std::string& name) {
    double error = std::abs(x - reference);
    if (against > 0) error /= against;
    if (!std::isfinite(error)) error = std::numeric_limits<double>::infinity();
    if (error <= largest) return;
    largest = error;
    if (worst) *worst = name;
  };
  for (std::size_t j = 0; j < p.size(); ++j)
    compare(g.gradient[j] * p[j].scale, r.gradient[j] * p[j].scale, size, "parameter " + p[j].name);
  // psi counts against the larger of itself and the gradient: it may well be zero.
  compare(g.psi, r.psi, std::max(std::abs(r.psi), size), "psi");
  return largest;
}

/// A method's own estimate of its error (differences have one) in the measure of distance(); 0 without one.
double own_estimate(const GradientResult& g, const std::vector<Parameter>& p) {
  double size = 0, estimate = 0;
  for (std::size_t j = 0; j < g.gradient_error.size(); ++j) {
    size = std::max(size, std::abs(g.gradient[j]) * p[j].scale);
    estimate = std::max(estimate, g.gradient_error[j] * p[j].scale);
  }
  return size > 0 ? estimate / size : estimate;
}

class Check {
 public:
  Check(const CommonOptions& common, const CheckOptions& options)
      : common_(common), options_(options), setup_(common, Purpose::compare), progress_(setup_.progress_options) {
    setup_.problem.monitor = monitor(progress_, setup_.problem.solver.t_end);
  }

  int run() {
    if (setup_.problem.parameters.size() == 0)
      throw Error("There is no parameter to differentiate: name some with --parameters or in [run].");
    setup_.chosen_by(true, "--formulations", "", [&] {
      for (const auto& name : options_.formulations) find_formulation(name);
    });
    setup_.chosen_by(true, "--methods", "", [&] {
      for (const auto& name : options_.methods) find_sensitivity_method(name);
    });
    setup_.located([&] { find_redundant_rows(); });
    choose_rows();
    setup_.located([&] { find_reference(); });
    int interruption = 0;
    std::size_t done = 0;
    try {
      for (Row& row : rows_) {
        if (row.refused.empty()) {
          throw_if_interrupted();
          fill(row);
          tell(row, done + 1);
        }
        ++done;
      }
    } catch (const Interrupted& e) {  // what is done is shown
      interruption = e.signal_number();
      interrupted_ = fmt::format("{} {} of {} rows had been run; they stand.", e.what(), done, rows_.size());
      rows_.resize(done);
    }
    progress_.finish();
    if (interruption == 0 && std::all_of(rows_.begin(), rows_.end(), [](const Row& r) { return !r.refused.empty(); }))
      throw CapabilityError("No combination of formulation and method can treat this scene. " + rows_.back().refused);
    const int status = finish();
    return interruption == 0 ? status : 128 + interruption;
  }

 private:
  void tell(const Row& r, std::size_t number) {
    progress_.line(fmt::format("{:>6}/{} {:<22} {:<16} {}", number, rows_.size(), r.formulation, r.method,
                               !r.refused.empty()   ? "refused"
                               : !r.failure.empty() ? "FAILED"
                                                    : fmt::format("error {:.1e}, {:.3g} s", r.error, r.wall_s)));
  }

  void find_redundant_rows() {
    Assembly assembly(setup_.problem.mechanism, setup_.problem.parameters);
    assembly.set_parameters(setup_.rho.data());
    const double t = setup_.problem.solver.t_start;
    const Start start = find_start(assembly, t, false);
    const ConstraintRank rank = constraint_rank(assembly, t, start.q.data());
    if (rank.dependent_rows.empty()) return;
    const std::vector<std::string> rows = setup_.problem.mechanism->row_names();
    std::vector<std::string> names;
    for (const int i : rank.dependent_rows) names.push_back(rows[static_cast<std::size_t>(i)]);
    redundant_ = fmt::format("{} of {} constraint rows depend on the others ({}).", names.size(), rows.size(),
                             fmt::join(names, ", "));
  }

  void choose_rows() {
    const auto listed = [](const std::vector<std::string>& list, const std::string& name) {
      return list.empty() || std::find(list.begin(), list.end(), name) != list.end();
    };
    std::string why;
    bool any = false;
    for (const auto& f : formulations())
      for (const auto& m : sensitivity_methods()) {
        if (!listed(options_.formulations, f.name) || !listed(options_.methods, m.name)) continue;
        Row row;
        row.formulation = f.name;
        row.method = m.name;
        row.refused = refusal(m, f);
        const bool possible = row.refused.empty();  // on other scenes
        if (possible && !f.carries_redundancy && !redundant_.empty())
          row.refused = fmt::format("{} Formulation '{}' needs independent rows; the penalties, augmented-lagrangian and "
                                    "maggi carry them.", redundant_, f.name);
        any = any || row.refused.empty();
        if (!row.refused.empty()) why = row.refused;
        if (possible || options_.all || !options_.methods.empty()) rows_.push_back(row);
      }
    if (!any) throw CapabilityError("No combination of formulation and method is left. " + why);
  }

  /// The most accurate gradient at hand: an exact-constraint formulation, forward sensitivities, three digits tighter;
  /// judged itself by differences that use no derivative block. With redundant constraints the augmented Lagrangian has the part.
  void find_reference() {
    Problem tight = setup_.problem;
    tight.solver.rtol = std::max(1e-13, std::min(1e-11, setup_.problem.solver.rtol * 1e-3));
    tight.solver.atol = tight.solver.rtol * setup_.problem.solver.absolute() / setup_.problem.solver.rtol;
    tight.solver.integrator.clear();
    const auto attempt = [&](const char* formulation) {
      tight.formulation = formulation;
      reference_ = gradient(tight, "cvodes-forward", setup_.rho);
      differences_ = gradient(tight, "differences", setup_.rho);
    };
    try {
      attempt(redundant_.empty() ? "baumgarte" : "augmented-lagrangian");
    } catch (const ModelError&) {
      attempt("penalty");
    } catch (const SolverError&) {
      attempt("penalty");
    }
    reference_formulation_ = tight.formulation;
    const auto& p = setup_.problem.parameters.parameters;
    reference_apart_ = distance(reference_, differences_, p, &reference_worst_);
    reference_estimate_ = own_estimate(differences_, p);
    reference_agrees_ = reference_apart_ <= 10 * reference_estimate_ + 1e-6;
  }

  /// The time of one plain simulation on the same form, measured once for each.
  double simulation_time(const Problem& problem) {
    const std::pair key(problem.formulation, problem.solver.integrator);
    const auto known = simulation_s_.find(key);
    if (known != simulation_s_.end()) return known->second;
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 2; ++i) {
      const auto begin = std::chrono::steady_clock::now();
      simulate(problem, setup_.rho);
      best = std::min(best, seconds_since(begin));
    }
    return simulation_s_[key] = std::max(best, 1e-9);
  }

  void fill(Row& row) {
    Problem p = setup_.problem;
    p.formulation = row.formulation;
    p.solver.integrator.clear();
    progress_.start(p.solver.t_start);
    try {
      const auto begin = std::chrono::steady_clock::now();
      row.result = gradient(p, row.method, setup_.rho);
      row.wall_s = seconds_since(begin);
      judge(row, p);
      // On the integrator of the method, where a plain simulation can run on that.
      if (row.result.integrator == "idas" || row.result.integrator == "cvodes" ||
          row.result.integrator == "fixed")
        p.solver.integrator = row.result.integrator;
      row.time_ratio = row.wall_s / simulation_time(p);
    } catch (const CapabilityError& e) {  // the table allows it, but not on this scene
      row.refused = e.what();
    } catch (const SolverError& e) {
      row.failure = e.what();
    } catch (const ModelError& e) {
      row.failure = e.what();
    }
    row.agrees = row.agrees && row.failure.empty();
  }

  /// A right gradient's error is a modest multiple of rtol (20 to 400 on smooth scenes). Beyond 1000 rtol it must at
  /// least shrink with the tolerance; a wrong one does not.
  void judge(Row& row, const Problem& p) {
    const auto& parameters = p.parameters.parameters;
    row.error = distance(row.result, reference_, parameters, &row.worst);
    if (find_sensitivity_method(row.method).needs == SensitivityMethod::Needs::discrete) return judge_discrete(row, p);
    const double allowed = 1000 * p.solver.rtol + 1e-9 + 10 * own_estimate(row.result, parameters);
    if (row.error <= allowed) return;
    const Formulation& f = find_formulation(row.formulation);
    if (f.carries_redundancy && refusal(find_sensitivity_method("cvodes-forward"), f).empty()) {
      // Approximate constraints: judged against their own forward gradient, three digits tighter.
      Problem own = p;
      own.solver.rtol = std::max(1e-13, std::min(1e-11, p.solver.rtol * 1e-3));
      own.solver.atol = own.solver.rtol * p.solver.absolute() / p.solver.rtol;
      const GradientResult r = gradient(own, "cvodes-forward", setup_.rho);
      if (distance(row.result, r, parameters, nullptr) <= allowed) {
        row.remark = "differs from exact constraints by the penalty's own O(1/alpha)";
        return;
      }
    }
    // A first error may be small by luck and hardly fall; one that does not fall in the next try either is no tolerance's.
    for (const double factor : {1e-2, 1e-4}) {
      Problem tighter = p;
      tighter.solver.rtol = std::max(p.solver.rtol * factor, 1e-13);
      tighter.solver.atol = std::max(p.solver.absolute() * factor, 1e-15);
      const GradientResult r = gradient(tighter, row.method, setup_.rho);
      const double e = distance(r, reference_, parameters, nullptr);
      if (!(e <= std::max(allowed, row.error / 5) && e < row.error / 2 && is_tolerable(e, p))) continue;
      row.remark = fmt::format("limited by the tolerance: {:.1e} at rtol {:g}", e, tighter.solver.rtol);
      return;
    }
    row.agrees = false;
  }

  /// A hundredth is no tolerance any more, except where the gradient itself vanishes, as at an optimum, and what is left
  /// is below the absolute tolerance of the run's many steps.
  bool is_tolerable(double error, const Problem& p) const {
    double size = 0;
    for (std::size_t j = 0; j < p.parameters.parameters.size(); ++j)
      size = std::max(size, std::abs(reference_.gradient[j]) * p.parameters.parameters[j].scale);
    return error < 1e-2 || error * size <= 1000 * p.solver.absolute();
  }

  /// A discrete gradient is exact for its own psi: tangent and adjoint agree to rounding. To the reference it converges
  /// with the square of the step.
  void judge_discrete(Row& row, const Problem& p) {
    const auto& parameters = p.parameters.parameters;
    Problem same = p;
    const double span = p.solver.t_end - p.solver.t_start, steps = static_cast<double>(row.result.counters.steps);
    same.solver.step_s = span / steps;
    const GradientResult other =
        gradient(same, row.method == "discrete-adjoint" ? "discrete-tangent" : "discrete-adjoint", setup_.rho);
    const double apart = distance(row.result, other, parameters, &row.worst);
    // Each step adds its rounding.
    if (!(apart <= 1e-12 + steps * std::numeric_limits<double>::epsilon())) {
      row.remark = fmt::format("tangent and adjoint of the same steps are {:.1e} apart", apart);
      row.agrees = false;
      return;
    }
    if (row.error <= 1000 * p.solver.rtol + 1e-9) return;
    Problem half = p;
    half.solver.step_s = span / (2 * steps);
    const double e = distance(gradient(half, row.method, setup_.rho), reference_, parameters, &row.worst);
    row.remark = fmt::format("tangent and adjoint {:.0e} apart; of second order in the step: {:.1e} at half of it",
                             apart, e);
    row.agrees = e < row.error / 2.5;
  }

  int finish() {
    Json j = run_json(setup_, reference_, "cvodes-forward", 0);
    j["formulation"] = nullptr;
    j["method"] = nullptr;
    j["reference"] = {{"formulation", reference_formulation_},
                      {"method", "cvodes-forward"},
                      {"psi", reference_.psi},
                      {"gradient", named(setup_.problem.parameters.names(), reference_.gradient)},
                      {"distance_to_differences", reference_apart_},
                      {"differences_own_estimate", reference_estimate_}};
    j["rows"] = Json::array();
    std::string text = fmt::format("{}, rtol {:g}, {} parameter{}\n", setup_.scene.title, setup_.problem.solver.rtol,
                                   setup_.rho.size(), setup_.rho.size() == 1 ? "" : "s");
    text += fmt::format("reference: {} x cvodes-forward, tighter; {:.1e} from differences (own estimate {:.1e})\n",
                        reference_formulation_, reference_apart_, reference_estimate_);
    text += fmt::format("  {:<22} {:<16} {:>18} {:>9} {:>7} {:>8} {:>9} {:>9} {:>7}\n", "formulation", "method", "psi",
                        "error", "steps", "backward", "callbacks", "time [ms]", "ratio");
    std::vector<std::string> wrong;
    for (const Row& r : rows_) {
      Json e = row_json(r);
      j["rows"].push_back(e);
      if (!r.refused.empty()) {
        text += fmt::format("  {:<22} {:<16} -- {}\n", r.formulation, r.method, r.refused);
        continue;
      }
      if (!r.failure.empty()) {
        text += fmt::format("  {:<22} {:<16} FAILED: {}\n", r.formulation, r.method, r.failure);
        wrong.push_back(fmt::format("{} x {} failed: {}", r.formulation, r.method, r.failure));
        continue;
      }
      const Counters& c = r.result.counters;
      text += fmt::format("  {:<22} {:<16} {:>18.12g} {:>9.1e} {:>7} {:>8} {:>9} {:>9.2f} {:>7.2f}{}{}\n", r.formulation,
                          r.method, r.result.psi, r.error, c.steps, c.backward_steps,
                          c.residuals + c.backward_residuals + c.sensitivity_residuals, 1e3 * r.wall_s,
                          r.time_ratio, r.agrees ? "" : "  DISAGREES in " + r.worst,
                          r.remark.empty() ? "" : "  (" + r.remark + ")");
      if (!r.agrees)
        wrong.push_back(fmt::format("{} x {}, {}: {:.2e} relative", r.formulation, r.method, r.worst, r.error));
    }
    if (!reference_agrees_)
      wrong.push_back(fmt::format("the reference itself ({} x cvodes-forward), {}: {:.2e} from differences, whose own "
                                  "estimate is {:.2e}", reference_formulation_, reference_worst_, reference_apart_,
                                  reference_estimate_));
    j["status"] = !interrupted_.empty() ? "interrupted" : wrong.empty() ? "ok" : "disagreement";
    if (!interrupted_.empty()) j["error"] = interrupted_;
    j["disagreements"] = wrong;
    for (const auto& w : wrong) text += "DISAGREEMENT: " + w + "\n";
    if (!interrupted_.empty())
      text += interrupted_ + "\n";
    else if (wrong.empty())
      text += "all agree within what the tolerances allow\n";
    report(setup_, common_, j, text, "check.json");
    for (const auto& w : wrong) fmt::print(stderr, "costate: disagreement: {}\n", w);
    if (!interrupted_.empty()) fmt::print(stderr, "costate: {}\n", interrupted_);
    return wrong.empty() ? 0 : kDisagreement;
  }

  Json row_json(const Row& r) const {
    Json e;
    const auto names = setup_.problem.parameters.names();
    const bool ran = r.refused.empty() && r.failure.empty();
    e["formulation"] = r.formulation;
    e["method"] = r.method;
    e["psi"] = ran ? Json(r.result.psi) : Json(nullptr);
    e["parameters"] = named(names, setup_.rho);
    e["gradient"] = ran ? named(names, r.result.gradient) : Json(nullptr);
    e["gradient_error"] = nullptr;
    e["error"] = ran ? Json(r.error) : Json(nullptr);
    e["integrator"] = ran ? Json(r.result.integrator) : Json(nullptr);
    e["rtol"] = setup_.problem.solver.rtol;
    e["counters"] = counters_json(r.result.counters);
    e["wall_s"] = r.wall_s;
    e["time_ratio"] = ran ? Json(r.time_ratio) : Json(nullptr);
    e["status"] = !r.refused.empty() ? "refused" : !r.failure.empty() ? "failed" : r.agrees ? "ok" : "disagreement";
    if (!r.refused.empty()) e["refused"] = r.refused;
    if (!r.failure.empty()) e["failure"] = r.failure;
    if (!r.remark.empty()) e["remark"] = r.remark;
    return e;
  }

  const CommonOptions& common_;
  const CheckOptions& options_;
  Setup setup_;
  std::string redundant_;  // a sentence that names dependent constraint rows, or empty
  Progress progress_;
  GradientResult reference_, differences_;
  std::string reference_formulation_, reference_worst_;
  double reference_apart_ = 0, reference_estimate_ = 0;
  bool reference_agrees_ = true;
  std::map<std::pair<std::string, std::string>, double> simulation_s_;  // by formulation and integrator
  std::vector<Row> rows_;
  std::string interrupted_;  // a sentence where Ctrl-C ended the rows early
};

}  // namespace

void add_check(CLI::App& app, std::function<int()>& action, CommonOptions& common) {
  CLI::App* c = app.add_subcommand("check", "Compare every formulation and gradient method on a scene");
  auto options = std::make_shared<CheckOptions>();
  common.add_to(*c);
  common.add_run_options(*c);
  c->remove_option(c->get_option("--formulation"));
  c->remove_option(c->get_option("--method"));
  c->remove_option(c->get_option("--integrator"));  // every method runs on its own
  const auto add_list = [&](const char* names, std::vector<std::string>& list) {
    c->add_option(names, list, "Only these, separated by commas")->delimiter(',')->allow_extra_args(false);
  };
  add_list("--formulation,--formulations", options->formulations);
  add_list("--method,--methods", options->methods);
  c->add_flag("--all", options->all, "Every combination; the impossible ones are listed with their reason");
  auto candidate = std::make_shared<CandidateOptions>();
  c->add_option("--candidate", candidate->file, "Only this: your own adjoint, a library built from costate/adjoint/candidate.h");
  c->add_option("--candidate-limit", candidate->limit_s, "Longest time that the candidate may take [s]")->capture_default_str();
  c->callback([&action, &common, options, candidate] {
    action = [&common, options, candidate] {
      return candidate->file.empty() ? Check(common, *options).run() : check_candidate_file(common, *candidate);
    };
  });
}

}  // namespace costate::app
