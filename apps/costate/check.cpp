// costate check: every formulation x method on one scene, each beside the best available reference.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <chrono>
#include <cmath>
#include <limits>
#include <map>
#include <mutex>
#include <optional>

#include "check_cycles.h"
#include "check_findings.h"
#include "check_motions.h"
#include "check_reference.h"
#include "check_row.h"
#include "check_rows.h"
#include "command.h"
#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/cycle/cycle_values.h"
#include "costate/integrator/integrators.h"
#include "costate/integrator/run_end.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/redundant_rows.h"
#include "costate/record/interrupt.h"
#include "costate/record/jobs.h"
#include "costate/record/print.h"
#include "digits.h"
#include "guide.h"
#include "page/command_pages.h"
#include "page_parts.h"
#include "run_pages.h"
#include "trajectory.h"

namespace costate::app {

namespace {

class Check {
 public:
  Check(const CommonOptions& common, const CheckOptions& options)
      : common_(common), options_(options), setup_(common, Purpose::compare), progress_(row_by_row(setup_)) {
    setup_.problem.monitor = watched(budget_);
  }

  int run() {
    if (setup_.problem.parameters.size() == 0)
      throw Error("There is no parameter to differentiate: name some with --parameters or in [run].");
    if (!(options_.patience > 0 && std::isfinite(options_.patience)))
      throw Error(fmt::format("--patience must be a positive number, found {}.", options_.patience));
    setup_.chosen_by(true, "--formulations", "", [&] {
      for (const auto& name : options_.formulations) find_formulation(name);
    });
    setup_.chosen_by(true, "--methods", "", [&] {
      for (const auto& name : options_.methods) find_sensitivity_method(name);
    });
    setup_.chosen_by(true, "--integrators", "", [&] {
      for (const auto& name : options_.integrators) find_integrator(name);
    });
    setup_.located([&] { redundant_ = redundant_joints(setup_.problem, setup_.rho); });
    rows_ = check_rows(setup_.problem, options_, redundant_);
    reference_ = setup_.located([&] {
      return find_reference(setup_.problem, setup_.rho, !redundant_.empty(), options_.patience, budget_, options_.jobs);
    });
    if (reference_.tolerances) setup_.problem.solver.set_absolute(*reference_.tolerances);
    int interruption = 0;
    std::vector<char> ended(rows_.size(), 0);
    try {
      for_each_job(rows_.size(), options_.jobs > 0 ? options_.jobs : cores(), [&](std::size_t i) {
        if (!rows_[i].refused()) {
          throw_if_interrupted();
          fill(rows_[i]);
          tell(rows_[i], i + 1);
        }
        ended[i] = 1;
      });
      if (!options_.no_motions) compare_motions();
      if (!options_.no_motions && setup_.scene.cycle) {
        budget_.unlimited();
        cycles_.emplace(setup_, options_.patience).run(reference_.yardstick, rows_);
      }
    } catch (const Interrupted& e) {  // what is done is shown
      interruption = e.signal_number();
      std::vector<CheckRow> done;
      for (std::size_t i = 0; i < rows_.size(); ++i)
        if (ended[i]) done.push_back(std::move(rows_[i]));
      const bool all = done.size() == rows_.size() && !options_.no_motions;
      interrupted_ = fmt::format("{}: {} of {} rows had been run{}; they stand.", e.what(), done.size(), rows_.size(),
                                 all ? fmt::format(", and {} motions compared", motions_.size()) : "");
      rows_ = std::move(done);
    }
    progress_.finish();
    if (interruption == 0 && std::all_of(rows_.begin(), rows_.end(), [](const CheckRow& r) { return r.refused(); }))
      throw CapabilityError("No combination of formulation and method can treat this scene. " + rows_.back().why);
    const auto none_ended = [](const CheckRow& r) { return r.refused() || r.verdict() == Verdict::cut; };
    if (interruption == 0 && std::all_of(rows_.begin(), rows_.end(), none_ended))
      throw Error(
          fmt::format("No row ended within {:g} times what the reference took; raise --patience.", options_.patience));
    const int status = finish();
    return interruption == 0 ? status : 128 + interruption;
  }

 private:
  /// Rows are told as they end also where stderr is no terminal.
  static ProgressOptions row_by_row(const Setup& setup) {
    ProgressOptions o = setup.progress_options;
    o.verbose = true;
    return o;
  }

  void tell(const CheckRow& r, std::size_t number) {
    const std::string how =
        r.ended() ? fmt::format("{}, error {:.1e}, {:.3g} s", name_of(r.verdict()), r.judged.error, r.wall_s)
        : r.verdict() == Verdict::failed ? "FAILED"
                                         : name_of(r.verdict());
    progress_.line(
        fmt::format("{:>6}/{} {:<22} {:<{}} {}", number, rows_.size(), r.formulation, r.label(), label_width(), how));
  }

  std::size_t label_width() const {
    std::size_t width = 16;
    for (const CheckRow& r : rows_) width = std::max(width, r.label().size());
    return width;
  }

  /// Shows the progress, and cuts what takes more than the budget.
  Monitor watched(const RunBudget& budget) {
    return [&budget, show = monitor(progress_, setup_.problem.solver.t_end)](double t, long steps, bool back) {
      show(t, steps, back);
      budget.look(t, steps, back);
    };
  }

  void allow(RunBudget& budget, const std::string& method) const {
    const bool perturbs = !method.empty() && find_sensitivity_method(method).perturbs;  // none: a simulation
    // Where the reference itself has no digit by differences those of others tell nothing more.
    const double share = !reference_.yardstick.has_digits          ? kNoDigitShare
                         : perturbs && reference_.apart < kNoDigit ? kDifferencesShare
                                                                   : 1;
    budget.begin(options_.patience * share * reference_.seconds, options_.patience * reference_.steps);
  }

  GradientResult run_row(RunBudget& budget, const Problem& p, const std::string& method) const {
    allow(budget, method);
    Problem bounded = p;
    bounded.solver.confirm = false;  // the rows are compared with each other
    if (!find_sensitivity_method(method).perturbs) return gradient(bounded, method, setup_.rho);
    // They answer the limit of steps by a looser tolerance, and an estimate that says so.
    bounded.solver.max_steps =
        std::min(p.solver.max_steps, static_cast<long>(0.9 * options_.patience * reference_.steps));
    return gradient(bounded, method, setup_.rho);
  }

  /// The processor time of one plain simulation on the same form, measured once for each.
  double simulation_time(const Problem& problem) {
    const std::pair key(problem.formulation, problem.solver.integrator);
    {
      const std::lock_guard lock(simulations_);
      const auto known = simulation_s_.find(key);
      if (known != simulation_s_.end()) return known->second;
    }
    double best = std::numeric_limits<double>::infinity();
    for (int i = 0; i < 2; ++i) {
      const double begin = RunBudget::processor_s();
      simulate(without_cycle_cost(problem), setup_.rho);
      best = std::min(best, RunBudget::processor_s() - begin);
    }
    const std::lock_guard lock(simulations_);
    return simulation_s_[key] = std::max(best, 1e-9);
  }

  void fill(CheckRow& row) {
    RunBudget budget;  // its own: rows run beside each other
    Problem p = setup_.problem;
    p.monitor = watched(budget);
    p.formulation = row.formulation;
    p.solver.integrator = row.integrator;
    progress_.start(p.solver.t_start);
    take_notices();
    double took = 0;
    try {
      const auto begin = std::chrono::steady_clock::now();
      const double processor = RunBudget::processor_s();
      row.result = run_row(budget, p, row.method);
      row.wall_s = seconds_since(begin);
      took = RunBudget::processor_s() - processor;
      row.warnings = take_notices();
    } catch (const Cut& e) {
      return row.end(Verdict::cut, e.what());
    } catch (const TooMuchWork& e) {
      return row.end(Verdict::cut, fmt::format("for its steps: {}", e.what()));
    } catch (const CapabilityError& e) {  // the table allows it, but not on this scene
      return row.end(Verdict::refused, e.what());
    } catch (const SolverError& e) {
      return row.end(Verdict::failed, e.what());
    } catch (const ModelError& e) {
      return row.end(Verdict::failed, e.what());
    }
    try {
      row.judged = judge(reference_.yardstick, p, row.method, row.result,
                         [&](const Problem& q, const std::string& method) { return run_row(budget, q, method); });
    } catch (const Cut& e) {
      return row.end(Verdict::cut,
                     fmt::format("it is not as close to the reference as expected, and the run that would tell why "
                                 "was cut {}",
                                 e.what()));
    } catch (const SolverError& e) {
      return row.end(Verdict::failed, fmt::format("the run that judges it: {}", e.what()));
    }
    // On the integrator of the method, where a plain simulation can run on that.
    const std::string& own = row.result.integrator;
    if (is_integrator(own)) p.solver.integrator = own;
    try {
      allow(budget, row.method);
      row.time_ratio = took / simulation_time(p);
    } catch (const Cut&) {  // there is none
    } catch (const SolverError&) {
    }
  }

  /// Each formulation on each of its integrators.
  void compare_motions() {
    Problem p = setup_.problem;
    p.solver.step_s = 0;
    p = until_its_end(p, setup_.rho);
    MotionCheck check(p, setup_.rho, [this] { allow(budget_, ""); });
    try {
      check.find_reference(reference_.yardstick.formulation, reference_.yardstick.rtol);
    } catch (const Cut& e) {
      motions_note_ = fmt::format("No motions were compared: the reference was cut {}.", e.what());
      return;
    } catch (const SolverError& e) {
      motions_note_ = fmt::format("No motions were compared: the reference failed: {}", e.what());
      return;
    }
    motions_note_ = check.note();
    motions_of_ = fmt::format("{} quantities at {} times", check.quantities(), check.samples());
    for (const auto& f : formulations()) {
      const bool listed = std::any_of(rows_.begin(), rows_.end(),
                                      [&](const CheckRow& r) { return r.formulation == f.name && !r.refused(); });
      if (!listed) continue;
      for (const Integrator* integrator : integrators_of(f)) {
        throw_if_interrupted();
        motions_.push_back(check.run(f.name, integrator->name));
        const MotionRow& m = motions_.back();
        progress_.line(fmt::format("  motion {:<22} {:<16} {}", m.formulation, m.integrator, name_of(m.verdict)));
      }
    }
  }

  int finish() {
    const Yardstick& y = reference_.yardstick;
    take_notices();
    Json j = run_json(setup_, y.result, y.method, 0);
    j["formulation"] = nullptr;
    j["method"] = nullptr;
    j["reference"] = {{"formulation", y.formulation},
                      {"method", y.method},
                      {"rtol", y.rtol},
                      {"psi", y.result.psi},
                      {"gradient", named(setup_.problem.parameters.names(), y.result.gradient)},
                      {"error_unit", y.unit()},
                      {"distance_to_differences", reference_.proven ? Json(reference_.apart) : Json(nullptr)},
                      {"differences_own_estimate", reference_.proven ? Json(reference_.estimate) : Json(nullptr)}};
    if (!reference_.note.empty()) j["reference"]["note"] = reference_.note;
    j["rows"] = Json::array();
    std::string text = fmt::format("{}, rtol {:g}, {} parameter{}\n", title_of(setup_), setup_.problem.solver.rtol,
                                   setup_.rho.size(), setup_.rho.size() == 1 ? "" : "s");
    text += fmt::format(
        "reference: {} x {}, {}{}\n", y.formulation, y.method, y.rtol < setup_.problem.solver.rtol ? "tighter; " : "",
        reference_.proven
            ? fmt::format("{:.1e} from differences (own estimate {:.1e})", reference_.apart, reference_.estimate)
            : "not proven by differences");
    text += fmt::format("  {:<22} {:<{}} {:>18} {:>9} {:>7} {:>8} {:>9} {:>9} {:>7}\n", "formulation", "method",
                        label_width(), "psi", "error", "steps", "backward", "callbacks", "time [ms]", "ratio");
    CheckFindings found;
    for (const CheckRow& r : rows_) {
      j["rows"].push_back(row_json(setup_, r));
      text += row_text(setup_, r, label_width());
      for (const auto& w : r.warnings) {
        const Json sentence = fmt::format("{} x {}: {}", r.formulation, r.label(), w);
        j["warnings"].push_back(sentence);
      }
      found.add(r.verdict(), row_sentence(r));
    }
    j["motions"] = Json::array();
    if (!motions_.empty()) text += fmt::format("motions: {}\n", motions_of_) + MotionRow::heading();
    for (const MotionRow& m : motions_) {
      j["motions"].push_back(m.json());
      text += m.text();
      found.add(m.verdict, m.sentence());
    }
    if (!motions_note_.empty()) j["motions_note"] = motions_note_;
    if (cycles_) cycles_->tell(j, text, found);
    if (!reference_.agrees)
      found.wrong.push_back(
          fmt::format("the reference itself ({} x {}), {}: {:.2e} from differences, whose own "
                      "estimate is {:.2e}",
                      y.formulation, y.method, reference_.worst, reference_.apart, reference_.estimate));
    j["status"] = !interrupted_.empty()   ? "interrupted"
                  : !found.wrong.empty()  ? "disagreement"
                  : !found.failed.empty() ? "failed"
                                          : "ok";
    if (!interrupted_.empty()) j["error"] = interrupted_;
    found.write(j);
    text += found.text();
    for (const auto& note : {reference_.note, motions_note_})
      if (!note.empty()) text += note + "\n";
    const std::string verdict = !interrupted_.empty() ? interrupted_ + "\n"
                                : found.wrong.empty() ? found.agreement(options_.patience)
                                                      : "";
    text += verdict + written_page(setup_, "check.html", check_page(setup_, j, verdict));
    report(setup_, common_, j, text, "check.json");
    found.print();
    if (!interrupted_.empty()) print_message(interrupted_);
    return !found.wrong.empty() ? kDisagreement : found.failed.empty() ? 0 : kFailed;
  }

  const CommonOptions& common_;
  const CheckOptions& options_;
  Setup setup_;
  std::string redundant_;  // a sentence that names dependent constraint rows, or empty
  Progress progress_;
  RunBudget budget_;
  CheckReference reference_;
  std::mutex simulations_;
  std::map<std::pair<std::string, std::string>, double> simulation_s_;  // by formulation and integrator
  std::vector<CheckRow> rows_;
  std::vector<MotionRow> motions_;
  std::optional<CycleCheck> cycles_;
  std::string motions_of_, motions_note_;
  std::string interrupted_;  // a sentence where Ctrl-C ended the rows early
};

}  // namespace

const RegisterCommand check_command(
    CommandGroup::judge, "check", "Compare every formulation and gradient method on a scene",
    [](Command& c, CommonOptions& common) {
      auto options = std::make_shared<CheckOptions>();
      common.add_to(c);
      common.add_run_options(c);
      c.remove("--formulation");
      c.remove("--method");
      c.remove("--integrator");  // every method runs on its own
      const auto add_list = [&](const char* names, std::vector<std::string>& list, const auto& all) {
        std::vector<std::string> words;
        for (const auto& entry : all) words.push_back(entry.name);
        c.option(names, list, "Only these, separated by commas").separated().suggests(words);
      };
      add_list("--formulation,--formulations", options->formulations, formulations());
      add_list("--method,--methods", options->methods, sensitivity_methods());
      std::vector<std::string> schemes;
      for (const Integrator& i : integrators())
        if (i.discrete) schemes.push_back(i.name);
      c.option("--integrators", options->integrators,
               "Discrete methods on these, too, beside the one that they take by themselves")
          .separated()
          .suggests(schemes);
      c.flag("--all", options->all, "Every combination; the impossible ones are listed with their reason");
      c.flag("--no-motions", options->no_motions, "Gradients only, no comparison of motions");
      c.option("--patience", options->patience,
               "A row that takes more than this many times the steps or processor time of the reference is cut")
          .shows_default();
      add_jobs_option(c, options->jobs, "Rows");
      auto candidate = std::make_shared<CandidateOptions>();
      c.option("--candidate", candidate->file,
               "Only this: your own adjoint, a library built from costate/candidate/candidate.h");
      c.option("--candidate-limit", candidate->limit_s, "Longest time that the candidate may take [s]").shows_default();
      c.runs([&common, options, candidate] {
        return candidate->file.empty() ? Check(common, *options).run() : check_candidate_file(common, *candidate);
      });
    });

}  // namespace costate::app
