// costate pareto: the front between the targets of a scene's cases, traced by exact gradients; journalled.
#include "costate/optimize/pareto.h"

#include <fmt/format.h>

#include <chrono>

#include "costate/record/atomic_file.h"
#include "costate/record/interrupt.h"
#include "costate/record/jobs.h"
#include "costate/record/print.h"
#include "costate/scene/scene_files.h"
#include "optimize_journal.h"
#include "optimize_options.h"
#include "pareto_report.h"
#include "saving.h"

namespace costate::app {

namespace {

constexpr int kMostOnEdge = 1000;  // along an edge

struct ParetoCommandOptions {
  OptimizeOptions search;
  int points = ParetoOptions().points;
};

class ParetoRun {
 public:
  ParetoRun(const CommonOptions& common, const ParetoCommandOptions& options)
      : common_(common),
        options_(options),
        files_(common.scene),
        whole_(common),
        setup_(whole_.setup),
        o_(pareto_options()),
        progress_(setup_.progress_options),
        lines_(!common.json && !common.quiet && !common.take) {}

  int run() {
    set_jobs(options_.search.jobs);
    progress_.start(setup_.problem.solver.t_start);
    whole_.watch(progress_);
    const Design design = whole_.design();
    open_journal(design);
    const auto begin = std::chrono::steady_clock::now();
    ParetoFront front;
    try {
      front = setup_.located([&] {
        return trace_front(
            design, o_, [&](int search) { return replay(search); },
            [&](int search, const OptimizerEvaluation& e) { record(search, e); },
            [&](const ParetoFront& f) {
              so_far_ = f;
              tell(design, f);
            });
      });
    } catch (const std::exception& e) {
      progress_.finish();
      if (!so_far_.points.empty()) {
        wall_ = seconds_since(begin);
        so_far_.notes.push_back(fmt::format("It did not come to its end: {}", e.what()));
        const Saving saving;
        write(design, so_far_, dynamic_cast<const Interrupted*>(&e) ? "interrupted" : "failed", e.what());
        if (setup_.files)
          print_message(fmt::format("{} points so far are in {}; --resume goes on", so_far_.points.size(),
                                    setup_.directory.string()));
      }
      throw;
    }
    wall_ = seconds_since(begin);
    progress_.finish();
    const Saving saving;
    std::string text = pareto_text(whole_, design, front, wall_);
    const Json j = write(design, front, "ok", "");
    if (setup_.files) text += fmt::format("  results in {}: pareto.html, pareto.csv\n", setup_.directory.string());
    report(setup_, common_, j, text, "pareto.json");
    return 0;
  }

 private:
  ParetoOptions pareto_options() {
    if (!whole_.several())
      throw CapabilityError("A Pareto front is one between several cases, and the scene lists none ([[case]]).");
    OptimizeOptions search = options_.search;
    // The front is found by constraints; a scene's default for optimize takes none.
    if (search.algorithm.empty()) {
      search.algorithm = kConstrainedAlgorithm;
      for (const OptimizerAlgorithm& a : optimizer_algorithms())
        if (a.name == setup_.scene.optimize.algorithm && a.takes_constraints) search.algorithm = a.name;
    }
    setup_.chosen_by(true, "--algorithm", "", [&] { require_algorithm(search.algorithm, true); });
    ParetoOptions o;
    o.points = options_.points;
    if (o.points < 2 || o.points > kMostOnEdge)
      throw Error(fmt::format("--points must lie between 2 and {}, found {}.", kMostOnEdge, o.points));
    whole_.setup.scene.optimize.gradient_tolerance = 0;
    o.search = optimizer_options(whole_, search);
    if (whole_.design().targets.size() < 2)
      throw CapabilityError("All cases have one 'objective': a Pareto front is one between two or more.");
    return o;
  }

  void open_journal(const Design& design) {
    if (!setup_.files) return;
    require_writable(setup_.directory);
    nlohmann::json header = journal_header(whole_, files_.files(), o_.search);
    header["pareto"] = {{"points", o_.points}, {"max_evaluations", o_.search.max_evaluations}};
    journal_.emplace(Journal::open(setup_.directory / "pareto.jsonl", header, options_.search.resume));
    replay_ = read_searches(*journal_, setup_.problem.parameters, design.bounds().size(), design.cases.size());
    if (!journal_->damage().empty())
      print_message(fmt::format("warning: Journal '{}': {}.", journal_->path().string(), journal_->damage()));
    for (const char* name : {"pareto.json", "pareto.csv", "pareto.html"}) {
      std::error_code ignored;
      std::filesystem::remove(setup_.directory / name, ignored);
    }
    if (lines_ && options_.search.resume)
      print_result(fmt::format("resuming in search {}\n", std::max<std::size_t>(1, replay_.size())));
  }

  std::vector<OptimizerEvaluation> replay(int search) const {
    const auto k = static_cast<std::size_t>(search);
    return k < replay_.size() ? replay_[k] : std::vector<OptimizerEvaluation>();
  }

  void record(int search, const OptimizerEvaluation& e) {
    if (!e.replayed && static_cast<std::size_t>(e.index) <= replay(search).size())
      refuse_journal(*journal_, fmt::format("Evaluation {} of search {}", e.index, search + 1));
    if (journal_ && !e.replayed) {
      nlohmann::json j = evaluation_record(e);
      j["search"] = search;
      journal_->append(j);
    }
    throw_if_interrupted();
    progress_.start(setup_.problem.solver.t_start);
  }

  /// A line for the point just found.
  void tell(const Design& design, const ParetoFront& f) {
    progress_.finish();
    if (lines_) print_result(point_line(whole_, design, f.points.back()));
    progress_.start(setup_.problem.solver.t_start);
  }

  Json write(const Design& design, const ParetoFront& front, const char* status, const std::string& error) {
    Json j = pareto_json(whole_, design, front, o_, wall_);
    j["status"] = status;
    if (!error.empty()) j["error"] = error;
    setup_.write_file("pareto.csv",
                      [&](const auto& path) { write_file_atomically(path, pareto_csv(whole_, design, front)); });
    if (!options_.search.no_report)
      setup_.write_file("pareto.html",
                        [&](const auto& path) { write_file_atomically(path, pareto_page(whole_, design, front, j)); });
    if (status != std::string("ok"))
      setup_.write_file("pareto.json", [&](const auto& path) { write_file_atomically(path, json_text(j) + "\n"); });
    return j;
  }

  const CommonOptions& common_;
  const ParetoCommandOptions& options_;
  SceneFileLog files_;  // before the setup, which reads the scene
  DesignSetup whole_;
  Setup& setup_;
  ParetoOptions o_;
  Progress progress_;
  bool lines_;
  std::optional<Journal> journal_;
  std::vector<std::vector<OptimizerEvaluation>> replay_;  // by search
  ParetoFront so_far_;
  double wall_ = 0;
};

}  // namespace

const RegisterCommand pareto_command(
    CommandGroup::run, "pareto", "The Pareto front between the cases of a scene, by exact gradients",
    [](Command& c, CommonOptions& common) {
      auto options = std::make_shared<ParetoCommandOptions>();
      common.add_to(c);
      common.add_run_options(c);
      c.remove("--case");
      c.option("--points", options->points,
               "Points along the front, its two ends included; of three objectives on each "
               "edge")
          .shows_default();
      options->search.add_search(c);
      c.flag("--resume", options->search.resume, "Continue an interrupted run from its journal");
      c.flag("--no-report", options->search.no_report, "Leave out pareto.html, the page with the picture");
      c.footer(
          "Each point is an optimization of its own (--max-evaluations is that of each), by SLSQP unless [optimize] or "
          "--algorithm names another method that takes constraints. Writes pareto.csv, pareto.json and pareto.html.");
      c.runs([&common, options] { return ParetoRun(common, *options).run(); });
    });

}  // namespace costate::app
