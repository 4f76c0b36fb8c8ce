// costate optimize: L-BFGS (MMA, SLSQP) on a scene's cost; journalled so that an interrupted run resumes exactly.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "certificate_report.h"
#include "costate/base/error.h"
#include "costate/optimize/bound_size.h"
#include "costate/optimize/certificate.h"
#include "costate/optimize/on_bound.h"
#include "costate/record/atomic_file.h"
#include "costate/record/interrupt.h"
#include "costate/record/jobs.h"
#include "costate/record/print.h"
#include "costate/scene/scene_files.h"
#include "costate/sensitivity/error_estimate.h"
#include "digits.h"
#include "evaluation_text.h"
#include "optimize_journal.h"
#include "optimize_motions.h"
#include "optimize_options.h"
#include "report_page.h"
#include "saving.h"

namespace costate::app {

namespace {

/// One run of costate optimize.
class OptimizeRun {
 public:
  OptimizeRun(const CommonOptions& common, const OptimizeOptions& options)
      : common_(common),
        options_(options),
        files_(common.scene),
        whole_(common, options.goal),
        setup_(whole_.setup),
        names_(setup_.problem.parameters.names()),
        o_(optimizer_options(whole_, options)),
        bounds_(whole_.design().bounds()),
        progress_(setup_.progress_options),
        lines_(!common.json && !common.quiet && !common.take) {}

  int run() {
    set_jobs(options_.jobs);
    progress_.start(setup_.problem.solver.t_start);
    whole_.watch(progress_);
    choose_by_accuracy();
    open_journal();
    const auto begin = std::chrono::steady_clock::now();
    const OptimizerResult result = setup_.located(
        [&] { return optimize(whole_.design(), o_, replay_, [&](const OptimizerEvaluation& e) { record(e); }); });
    wall_ = seconds_since(begin);
    // The best point is safe before anything else is done with it.
    const OptimizerEvaluation& best = result.evaluations[result.best];
    summarize(result);
    try {
      const Saving saving;
      setup_.write_file("optimized.toml", [&](const auto& path) {
        write_file_atomically(
            path, scene_text_for(setup_.scene, files_.files(), setup_.directory, setup_.problem.parameters, best.rho));
      });
    } catch (const Error&) {
      if (result.error) std::rethrow_exception(result.error);  // a full disk has been told already
      throw;
    }
    warn_of_changed_files();
    try {
      if (result.error) std::rethrow_exception(result.error);
      // Behind the last evaluation: an interruption here leaves the journal complete, and --resume comes straight back.
      add_certificate(start_of(result), best);
      estimate_accuracy(best);
      motions_ = write_motions(whole_, result.evaluations.front().rho, best.rho, j_["settings"],
                               [&](const std::string& text) { note(text); });
      j_["notes"] = notes_;
    } catch (const Interrupted& e) {
      end_early("interrupted", e.what());
      throw;
    } catch (const std::exception& e) {
      end_early("failed", e.what());
      throw;
    }
    write_page();
    progress_.finish();
    report(setup_, common_, j_, text(result), "optimize.json");
    return 0;
  }

 private:
  /// Formulation, method and tolerance that meet the accuracy asked for where the optimization begins.
  void choose_by_accuracy() {
    if (!whole_.several()) accuracy_ = options_.accuracy.asked(setup_, common_);
    if (!accuracy_) return;
    if (options_.resume)
      throw Error(fmt::format(
          "--resume goes on with the settings that the journal was written with, which --accuracy chose: give "
          "{} in its place.",
          settings_in_words(setup_.directory / "evaluations.jsonl")));
    begun_ = run_accurately(setup_, common_, *accuracy_, true);
    progress_.finish();
    if (lines_) print_result(accuracy_text(*begun_, *accuracy_));
    o_.adapt_accuracy = cannot_adapt(whole_.design()).empty();
    progress_.start(setup_.problem.solver.t_start);
  }

  /// The same estimate where it ends: errors are those of other motions there.
  void estimate_accuracy(const OptimizerEvaluation& best) {
    if (!begun_) return;
    GradientResult there;
    there.psi = best.psi;
    there.gradient = best.gradient;
    there.counters = best.counters;
    const std::optional<ErrorEstimate> e = estimate_or_tell(
        [&] { return setup_.located([&] { return estimate_error(setup_.problem, setup_.method, best.rho, there); }); });
    j_["accuracy"] = accuracy_json(*begun_, *accuracy_);
    j_["psi_error"] = e ? Json(e->psi) : Json();
    j_["gradient_error"] = e ? named(names_, e->gradient) : Json();
    const double size = std::max(std::abs(begun_->result.psi), std::abs(best.psi));
    if (e && e->psi > *accuracy_ * size)
      note(
          fmt::format("At the end psi's error is estimated as {:.1e}, more than the accuracy {:.1g} of its value at "
                      "the beginning. Start again from optimized.toml.",
                      e->psi, *accuracy_));
    j_["notes"] = notes_;
  }

  void open_journal() {
    if (!setup_.files) return;
    require_writable(setup_.directory);
    journal_.emplace(Journal::open(setup_.directory / "evaluations.jsonl", journal_header(whole_, files_.files(), o_),
                                   options_.resume));
    replay_ = read_evaluations(*journal_, setup_.problem.parameters, bounds_.size(), whole_.cases.size());
    if (!journal_->damage().empty())
      note(fmt::format("Journal '{}': {}. The run goes on after evaluation {}.", journal_->path().string(),
                       journal_->damage(), replay_.size()));
    remove_old_results(whole_, files_.files());
    if (lines_ && options_.resume)
      print_result(fmt::format("resuming after {} evaluation{}\n", replay_.size(), replay_.size() == 1 ? "" : "s"));
  }

  /// A remark that belongs to the result: on standard error, in the summary and on the page.
  void note(const std::string& text) {
    notes_.push_back(text);
    progress_.finish();
    print_message("warning: " + text);
  }

  /// Of an evaluation that was computed now: the journal gains it.
  void keep(const OptimizerEvaluation& e) {
    const auto before = static_cast<std::size_t>(e.index) - 1;
    if (before < replay_.size()) {
      if (e.ending) return;  // this run ends before the journal does: what follows there stays
      if (!replay_[before].ending) refuse_journal(*journal_, fmt::format("Evaluation {}", e.index));
      // The run ended there, by a limit that this one has not; nothing of it is asked for again.
      journal_->keep(before, "the run goes on");
      replay_.resize(before);
    }
    if (journal_) journal_->append(evaluation_record(e));
  }

  void record(const OptimizerEvaluation& e) {
    if (!e.replayed) keep(e);
    progress_.finish();
    if (lines_) print_result(evaluation_line(e, names_, whole_.psi_tolerance(), common_.verbose) + "\n");
    throw_if_interrupted();
    progress_.start(setup_.problem.solver.t_start);
  }

  /// Of the evaluations where it began, the one of the tightest tolerance.
  static const OptimizerEvaluation& start_of(const OptimizerResult& result) {
    const OptimizerEvaluation* start = &result.evaluations.front();
    for (const OptimizerEvaluation& e : result.evaluations)
      if (e.rho == start->rho && e.rtol < start->rtol && !e.failed()) start = &e;
    return *start;
  }

  /// Everything of the summary that the evaluations tell.
  void summarize(const OptimizerResult& result) {
    const OptimizerEvaluation &first = start_of(result), &best = result.evaluations[result.best];
    setup_.rho = best.rho;
    GradientResult final;
    final.psi = best.psi;
    final.gradient = best.gradient;
    final.counters = best.counters;
    final.integrator = integrator_of(setup_.problem, find_sensitivity_method(setup_.method));
    j_ = run_json(setup_, final, setup_.method, wall_);
    j_["initial"] = {
        {"psi", first.psi}, {"parameters", named(names_, first.rho)}, {"gradient", named(names_, first.gradient)}};
    if (first.rtol > 0) j_["initial"]["rtol"] = first.rtol;
    whole_.correct(j_);
    if (best.psi_error > 0) j_["psi_error"] = best.psi_error;
    if (whole_.several()) j_["cases"] = whole_.cases_json(best.cases, best.case_gradients);
    j_["algorithm"] = o_.algorithm;
    j_["stop_reason"] = result.stop_reason;
    j_["converged"] = result.converged;
    j_["best_evaluation"] = best.index;
    j_["failed_evaluations"] = result.failures();
    j_["bounds_active"] = Json::array();
    for (std::size_t i = 0; i < names_.size(); ++i) {
      const Parameter& p = setup_.problem.parameters.parameters[i];
      if (on_lower(p, best.rho[i]) || on_upper(p, best.rho[i])) j_["bounds_active"].push_back(names_[i]);
    }
    for (std::size_t k = 0; k < bounds_.size(); ++k)
      j_["constraints"].push_back({{"name", bounds_[k].name},
                                   {"upper", bounds_[k].upper},
                                   {"initial", first.constraints[k] + bounds_[k].upper},
                                   {"psi", best.constraints[k] + bounds_[k].upper}});
    tell_of_violations(first, best);
    tell_of_far_parameters(best);
    j_["evaluations"] = Json::array();
    for (const auto& e : result.evaluations) j_["evaluations"].push_back(evaluation_json(e, names_, bounds_));
    if (o_.adapt_accuracy)
      j_["adaptation"] = adaptation_json(adaptation_of(result.evaluations, setup_.problem.solver.rtol));
    j_["notes"] = notes_;
  }

  /// Where psi falls for ever a search ends as far as its steps lead.
  void tell_of_far_parameters(const OptimizerEvaluation& best) {
    constexpr double kFar = 1e5;  // scales
    for (std::size_t i = 0; i < names_.size(); ++i) {
      const Parameter& p = setup_.problem.parameters.parameters[i];
      const double moved = (best.rho[i] - p.value) / p.scale;
      if (std::abs(moved) > kFar && !std::isfinite(moved > 0 ? p.upper : p.lower))
        note(
            fmt::format("'{}' went {:.1g} of its scales away from where it began, and has no bound there: psi may fall "
                        "for ever along it. Give it {}, or a larger scale.",
                        names_[i], std::abs(moved), moved > 0 ? "an 'upper'" : "a 'lower'"));
    }
  }

  /// The best point is the least psi of those that keep the constraints; of none where none does.
  void tell_of_violations(const OptimizerEvaluation& first, const OptimizerEvaluation& best) {
    constexpr double kKept = 1e-6;  // of what the bound is measured by
    const std::vector<double> sizes = bound_sizes(setup_.problem.parameters, first, bounds_);
    std::vector<std::string> broken;
    for (std::size_t k = 0; k < bounds_.size(); ++k)
      if (const double upper = bounds_[k].upper, by = best.constraints[k]; by > kKept * sizes[k])
        broken.push_back(
            fmt::format("'{}' is {:.6g}, {:.3g} above its bound {:.6g}", bounds_[k].name, upper + by, by, upper));
    if (broken.empty()) return;
    j_["converged"] = false;
    note(fmt::format(
        "No evaluation kept all constraints, so that psi is no optimum: at the best point {}. Begin where they "
        "are kept, or widen what cannot be met.",
        fmt::join(broken, ", ")));
  }

  /// optimized.toml names files; they should still be those that were optimized with.
  void warn_of_changed_files() {
    for (const SceneFile& f : files_.files())
      if (!f.path.empty() && file_digest(f.file) != f.digest)
        note(fmt::format(
            "The file '{}' ({}) changed while this ran; the results belong to what it was at the beginning.", f.file,
            f.path));
    j_["notes"] = notes_;
  }

  void add_certificate(const OptimizerEvaluation& first, const OptimizerEvaluation& best) {
    if (options_.no_certificate) return;
    const auto begin = std::chrono::steady_clock::now();
    try {
      const Certificate c = setup_.located([&] { return certify(whole_.design(), first, best); });
      j_["certificate"] = certificate_json(c, seconds_since(begin));
      certificate_ = certificate_text(c);
    } catch (const Interrupted&) {
      throw;
    } catch (const Error& e) {
      note(fmt::format("There is no certificate, whether this is a minimum is not known: {}", e.what()));
      j_["notes"] = notes_;
    }
  }

  void write_page() {
    page_ = setup_.files && !options_.no_report && setup_.write_file("report.html", [&](const auto& path) {
      write_file_atomically(path, optimize_page(setup_, j_, motions_));
    });
  }

  /// After an interruption or an error: the best point so far, and a page and a summary that say what they are.
  void end_early(const char* status, const std::string& why) {
    progress_.finish();
    j_["status"] = status;
    j_["error"] = why;
    j_["converged"] = false;
    j_["stop_reason"] = fmt::format("{}: {}", status == std::string("failed") ? "an error" : "an interruption", why);
    try {
      const Saving saving;
      write_page();
      setup_.write_file("optimize.json", [&](const auto& path) { write_file_atomically(path, json_text(j_) + "\n"); });
      if (setup_.files)
        print_message(fmt::format("the best so far, psi = {} of evaluation {}, is in {}; --resume goes on",
                                  best_digits(), j_["best_evaluation"].get<int>(),
                                  (setup_.directory / "optimized.toml").string()));
    } catch (const std::exception& e) {
      print_message(e.what());  // what ended the run is told by the caller
    }
  }

  /// Of the best psi, as far as the summary has it; 0 where it has not.
  double psi_error() const {
    const auto error = j_.find("psi_error");
    return error != j_.end() && error->is_number() ? error->get<double>() : 0;
  }

  std::string best_digits() const {
    const double psi = j_.at("psi").get<double>();
    return known_digits(psi, std::max(uncertainty_of(psi, whole_.psi_tolerance()), psi_error()));
  }

  std::string text(const OptimizerResult& result) const {
    const OptimizerEvaluation &first = start_of(result), &best = result.evaluations[result.best];
    // Six digits, or fewer: as many as its tolerance holds, and as are known.
    const auto shown_psi = [&](const OptimizerEvaluation& e, double error) {
      const double six = uncertainty_of(e.psi, 5e-6),
                   unknown = std::max(
                       {uncertainty_of(e.psi, std::max({5e-6, e.rtol, whole_.psi_tolerance()})), e.psi_error, error});
      return unknown > six || e.rtol > 0 ? known_digits(e.psi, unknown) : fmt::format("{:.6g}", e.psi);
    };
    std::string text =
        fmt::format("{}: {}psi {} -> {} in {} evaluation{}, {:.3g} s\n",
                    setup_.scene.title.empty() ? common_.scene : setup_.scene.title,
                    whole_.several() ? whole_.what() + ", " : "", shown_psi(first, 0), shown_psi(best, psi_error()),
                    result.evaluations.size(), result.evaluations.size() == 1 ? "" : "s", wall_);
    text += fmt::format("  stopped by {}\n", result.stop_reason);
    if (const std::size_t failed = result.failures())
      text += fmt::format("  {} evaluation{} failed and {} rejected\n", failed, failed == 1 ? "" : "s",
                          failed == 1 ? "was" : "were");
    if (o_.adapt_accuracy) text += "  evaluations: " + adaptation_text(j_["adaptation"]) + "\n";
    if (whole_.several()) text += whole_.cases_text(first.cases, best.cases);
    for (std::size_t i = 0; i < names_.size(); ++i)
      text += fmt::format("  {:<16} {:>18.12g} -> {:.12g}\n", names_[i], shown(first.rho[i]), shown(best.rho[i]));
    text += certificate_;
    if (setup_.files)
      text += fmt::format("  results in {}: evaluations.jsonl, optimized.toml, before{}.h5, after{}.h5 (and .csv)\n",
                          setup_.directory.string(), whole_.several() ? "_CASE" : "", whole_.several() ? "_CASE" : "");
    if (page_) text += fmt::format("  report: {}\n", (setup_.directory / "report.html").string());
    return text;
  }

  const CommonOptions& common_;
  const OptimizeOptions& options_;
  SceneFileLog files_;  // before the setup, which reads the scene
  DesignSetup whole_;
  Setup& setup_;
  std::vector<std::string> names_;
  OptimizerOptions o_;
  std::vector<DesignBound> bounds_;
  std::optional<Journal> journal_;
  std::vector<OptimizerEvaluation> replay_;
  std::optional<double> accuracy_;
  std::optional<AccurateRun> begun_;
  Progress progress_;
  bool lines_;
  double wall_ = 0;
  Json j_;
  std::vector<std::string> notes_;
  std::string certificate_;
  std::vector<RunMotion> motions_;
  bool page_ = false;
};

}  // namespace

const RegisterCommand optimize_command(CommandGroup::run, "optimize", "Minimise the scene's cost over its parameters",
                                       [](Command& c, CommonOptions& common) {
                                         auto options = std::make_shared<OptimizeOptions>();
                                         common.add_to(c);
                                         common.add_run_options(c);
                                         c.remove("--case");
                                         options->add_to(c);
                                         c.runs([&common, options] { return OptimizeRun(common, *options).run(); });
                                       });

}  // namespace costate::app
