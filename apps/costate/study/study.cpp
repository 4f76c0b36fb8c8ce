// costate study: the runs of one file, in parallel as processes of their own, here or on the ranks of an
// MPI job, resumable, and a table of what they achieved.
#include <fcntl.h>
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <thread>

#include "costate/command.h"
#include "costate/record/atomic_file.h"
#include "costate/record/interrupt.h"
#include "costate/record/jobs.h"
#include "costate/record/journal.h"
#include "costate/record/print.h"
#include "costate/study/study_hdf5.h"
#include "costate/study/study_page.h"
#include "costate/study/study_row.h"
#include "costate/study/study_table.h"
#include "ranks.h"
#include "study_job.h"
#include "task_options.h"

namespace costate::app {

namespace {

namespace fs = std::filesystem;

struct StudyOptions {
  std::string file;
  std::vector<std::string> only;
  std::string shard;  // "2/8": the second of eight
  int jobs = 0;
  bool fresh = false, merge = false;
};

/// A part of a study's runs: every count-th, beginning with the number-th.
struct Shard {
  std::size_t number = 1, count = 1;
};

Shard read_shard(const std::string& text) {
  Shard s;
  if (text.empty()) return s;
  char end = 0;
  if (text[0] == '-' || std::sscanf(text.c_str(), "%zu/%zu%c", &s.number, &s.count, &end) != 2 || s.number < 1 ||
      s.number > s.count || s.count > 1000000)
    throw UsageError(fmt::format("--shard: '{}' is no part such as 2/8, the second of eight.", text));
  return s;
}

/// A folder that goes with this object.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::string name = (fs::temp_directory_path() / "costate-study-XXXXXX").string();
    if (!::mkdtemp(name.data()))
      throw Error(fmt::format("No folder can be made in '{}', where a study with --no-files keeps its runs: {}.",
                              fs::temp_directory_path().string(), std::strerror(errno)));
    path_ = name;
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

class StudyCommand {
 public:
  StudyCommand(const CommonOptions& common, const StudyOptions& options)
      : common_(common), options_(options), shard_(read_shard(options.shard)) {}

  int run() {
    if (sharded() && started_as_ranks())
      throw UsageError(
          "--shard is for processes that know nothing of each other; ranks of MPI share a study without it.");
    if (common_.no_files) require_alone();
    ranks_ = Ranks::of_this_job();
    if (ranks_ && ranks_->rank() > 0) return serve();
    const Study study = read_study(options_.file, options_.only, common_.overrides);
    title_ = study.title.empty() ? options_.file : study.title;
    if (common_.no_files) temporary_ = std::make_unique<TemporaryFolder>();
    directory_ = temporary_               ? temporary_->path()
                 : common_.output.empty() ? fs::path("results") / fs::path(options_.file).stem()
                                          : common_.output;
    require_writable(directory_);
    take_directory();
    for (std::size_t i = 0; i < study.runs.size(); ++i) {
      if (i % shard_.count != shard_.number - 1) continue;
      const StudyRun& r = study.runs[i];
      jobs_.push_back({r, directory_ / r.name, {}, false, {}, {}});
    }
    if (options_.merge) return merge();
    for (StudyJob& j : jobs_) prepare(j);
    try {
      run_all();
    } catch (...) {
      report(false);
      throw;
    }
    report(true);
    return std::all_of(jobs_.begin(), jobs_.end(), [](const StudyJob& j) { return j.ok(); }) ? 0 : kFailed;
  }

 private:
  /// Of the ranks that have no study of their own.
  int serve() {
    try {
      serve_runs(*ranks_, at_once());
    } catch (const Error& e) {
      print_text(stderr, printable(fmt::format("costate: rank {}: {}\n", ranks_->rank(), e.what())));
      ranks_->abort();
    }
    return 0;
  }

  /// Runs are processes that hand over files, which without files are in a temporary folder of this machine.
  void require_alone() const {
    if (sharded() || options_.merge)
      throw UsageError("--shard and --merge are for the files of a study's parts, so they exclude --no-files.");
    if (started_as_ranks()) throw UsageError("--no-files: ranks of MPI hand over their runs by files; leave it out.");
  }

  bool sharded() const { return !options_.shard.empty(); }

  /// One study at a time works in a directory, or shards of one, each once; the locks end with this process, however it
  /// ends.
  void take_directory() {
    fs::create_directories(directory_);
    lock_ = record_detail::FileDescriptor(::open(directory_.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC));
    if (lock_.valid() && ::flock(lock_.get(), (sharded() ? LOCK_SH : LOCK_EX) | LOCK_NB) != 0 && errno == EWOULDBLOCK)
      throw Error(
          fmt::format("Another study is at work in '{}'; wait for it to end, or choose another directory with "
                      "--output.",
                      directory_.string()));
    if (!sharded()) return;
    const fs::path own = directory_ / fmt::format(".shard-{}-of-{}", shard_.number, shard_.count);
    shard_lock_ = record_detail::FileDescriptor(::open(own.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666));
    if (shard_lock_.valid() && ::flock(shard_lock_.get(), LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK)
      throw Error(fmt::format("Shard {} is at work in '{}' already.", options_.shard, directory_.string()));
  }

  /// The tables of what shards have left; nothing is run.
  int merge() {
    std::vector<std::string> missing;
    bool failed = false;
    for (StudyJob& j : jobs_) {
      j.require_files();
      const StudyJob::Left left = j.find_earlier();
      if (left == StudyJob::Left::finished) {
        j.state = StudyJob::State::kept;
      } else if (left == StudyJob::Left::failed) {
        j.state = StudyJob::State::failed;
        failed = true;
      } else {
        missing.push_back(j.run.name);
      }
    }
    report(true);
    if (missing.empty()) return failed ? kFailed : 0;
    throw Error(fmt::format("{} of {} runs are not finished: {}. Run their shards again, or the study without --merge.",
                            missing.size(), jobs_.size(), fmt::join(missing, ", ")));
  }

  /// A run of a study that was killed ends by itself, but not at once. Until then its results are its own.
  void wait_for_earlier(const StudyJob& j) {
    const fs::path journal = j.directory / "evaluations.jsonl";
    for (int i = 0; Journal::in_use(journal); ++i) {
      throw_if_interrupted();
      if (i == 0 && !common_.json && !common_.quiet)
        print_text(stderr, printable(fmt::format("waiting for an earlier run of '{}' to end\n", j.run.name)));
      if (i >= 600)
        throw Error(
            fmt::format("The journal '{}' is in use by another run, which does not end; end it, or choose another "
                        "directory with --output.",
                        journal.string()));
      std::this_thread::sleep_for(std::chrono::milliseconds(100));
    }
  }

  /// Finished runs of the same definition are kept, interrupted ones resume, others begin anew.
  void prepare(StudyJob& j) {
    j.require_files();
    wait_for_earlier(j);
    const StudyJob::Left left = options_.fresh ? StudyJob::Left::nothing : j.find_earlier();
    if (left == StudyJob::Left::finished) {
      j.state = StudyJob::State::kept;
      return;
    }
    j.resume = left != StudyJob::Left::nothing && j.run.task == "optimize";
    j.error.clear();
    fs::create_directories(j.directory);
    fs::remove(j.summary());
    if (!j.resume) fs::remove(j.directory / "evaluations.jsonl");
    j.note(false);
  }

  std::vector<std::string> arguments(const StudyJob& j) const {
    std::vector<std::string> a = {"costate", j.run.task, j.run.scene.string(), "--output", j.directory.string()};
    if (j.resume) a.push_back("--resume");
    if (!j.run.parameters.empty()) {
      a.push_back("--parameters");
      a.push_back(fmt::format("{}", fmt::join(j.run.parameters, ",")));
    }
    for (const auto& o : j.run.overrides) {
      a.push_back("--set");
      a.push_back(o);
    }
    if ((at_once() > 1 || ranks_) && task_takes(j.run.task, "jobs"))
      a.insert(a.end(), {"--jobs", "1"});  // the cores are the runs'
    a.insert(a.end(), j.run.options.begin(), j.run.options.end());
    return a;
  }

  void finish(StudyJob& j, int wait_status) {
    j.result = json_of_file(j.summary());
    const bool good = WIFEXITED(wait_status) && WEXITSTATUS(wait_status) == 0 && j.result.is_object() &&
                      j.result.value("status", "") == "ok";
    j.state = good ? StudyJob::State::done : StudyJob::State::failed;
    if (!good) j.error = complaint(j, wait_status);
    // What a signal has ended is not finished, nor what a key has.
    if (good || (WIFEXITED(wait_status) && WEXITSTATUS(wait_status) < 128)) try {
        j.note(good);
      } catch (const Error&) {  // its result stands; the next study repeats it from its journal
      }
    ++finished_;
    clear_line();
    if (common_.json || common_.quiet) return;
    if (good)
      print_text(stderr, printable(fmt::format("[{}/{}] {}: {}\n", finished_, total_, j.run.name, study_sentence(j))));
    else
      print_text(stderr, printable(fmt::format("[{}/{}] {} failed: {}\n", finished_, total_, j.run.name, j.error)));
  }

  /// The last line of what the run said, how it ended without an optimum, or the signal that ended it.
  std::string complaint(const StudyJob& j, int wait_status) const {
    if (WIFSIGNALED(wait_status)) return fmt::format("ended by signal {}", WTERMSIG(wait_status));
    std::istringstream log(text_of_file(j.directory / "log.txt"));
    std::string line, last;
    while (std::getline(log, line))
      if (line.rfind("costate: ", 0) == 0) last = line.substr(9);
    if (last.empty() && j.result.is_object() && j.result.contains("termination"))
      return j.result["termination"].get<std::string>();
    return last.empty() ? fmt::format("exit status {}{}", WEXITSTATUS(wait_status),
                                      temporary_ ? "" : "; see " + (j.directory / "log.txt").string())
                        : last;
  }

  /// Of this process; ranks are as many as whoever started them thought right.
  std::size_t at_once() const {
    return static_cast<std::size_t>(options_.jobs > 0 ? options_.jobs : ranks_ ? 1 : cores());
  }

  void run_all() {
    total_ =
        static_cast<std::size_t>(std::count_if(jobs_.begin(), jobs_.end(), [](const StudyJob& j) { return !j.ok(); }));
    if (total_ < jobs_.size() && !common_.json && !common_.quiet)
      print_text(stderr,
                 printable(fmt::format("{} of {} runs are finished already\n", jobs_.size() - total_, jobs_.size())));
    RunPlaces places(at_once(), ranks_.get());
    try {
      for (std::size_t next = 0;;) {
        throw_if_interrupted();
        for (const auto& [run, status] : places.take_ended()) finish(jobs_[run], status);
        for (; next < jobs_.size() && places.has_room(); ++next) {
          StudyJob& j = jobs_[next];
          if (j.state != StudyJob::State::waiting) continue;
          places.start(next, arguments(j), (j.directory / "log.txt").string());
          j.state = StudyJob::State::running;
        }
        if (places.running() == 0) return;
        show_progress();
        std::this_thread::sleep_for(kLook);
      }
    } catch (...) {
      places.stop_all();
      clear_line();
      throw;
    }
  }

  void show_progress() {
    if (common_.json || common_.quiet || ::isatty(2) == 0) return;
    const auto now = std::chrono::steady_clock::now();
    if (now - shown_ < std::chrono::milliseconds(500)) return;
    shown_ = now;
    std::vector<std::string> names;
    for (const StudyJob& j : jobs_)
      if (j.state == StudyJob::State::running) names.push_back(fmt::format("{} ({})", j.run.name, j.evaluations()));
    print_text(stderr, fmt::format("\r\033[K[{}/{}] evaluations: {}", finished_, total_,
                                   printable(fmt::format("{}", fmt::join(names, ", ")))));
    line_ = true;
  }
  void clear_line() {
    if (line_) print_text(stderr, "\r\033[K");
    line_ = false;
  }

  void report(bool complete) {
    Json j;
    const bool good = std::all_of(jobs_.begin(), jobs_.end(), [](const StudyJob& x) { return x.ok(); });
    j["status"] = good ? "ok" : complete ? "failed" : "interrupted";
    j["title"] = title_;
    j["runs"] = Json::array();
    for (const StudyJob& x : jobs_) j["runs"].push_back(study_row(x));
    for (Json& row : j["runs"])
      if (temporary_) row["directory"] = nullptr;
    if (Json sensitivity = study_sensitivity(j["runs"]); !sensitivity.empty()) j["sensitivity"] = sensitivity;
    if (Json pareto = pareto_of_designs(j["runs"]); !pareto.empty()) j["pareto"] = pareto;
    const std::string text = study_table(title_, j["runs"]);
    if (sharded()) {  // the tables are those of the whole
      if (complete && common_.json) fmt::print("{}\n", json_text(j));
      if (complete && !common_.json && !common_.quiet)
        print_result(fmt::format("{}  shard {}; 'costate study {} --merge' makes the tables of all\n", text,
                                 options_.shard, options_.file));
      return;
    }
    if (!temporary_) write_tables(j, text);
    if (!complete) return;
    if (common_.json)
      fmt::print("{}\n", json_text(j));
    else if (!common_.quiet)
      print_result(temporary_
                       ? text
                       : fmt::format("{}  results in {}: study.txt, study.csv, study.h5, study.json, report.html\n",
                                     text, directory_.string()));
  }

  void write_tables(const Json& j, const std::string& text) const {
    write_file_atomically(directory_ / "study.json", json_text(j) + "\n");
    write_file_atomically(directory_ / "study.csv", study_csv(j["runs"]));
    for (const auto& [design, table] : design_csvs(j["runs"]))
      write_file_atomically(directory_ / (design + ".csv"), table);
    write_study_hdf5(directory_ / "study.h5", title_, j["runs"]);
    write_file_atomically(directory_ / "study.txt", text);
    write_file_atomically(directory_ / "report.html",
                          study_page(title_, j["runs"], j.contains("pareto") ? j["pareto"] : Json::object(), text));
  }

  const CommonOptions& common_;
  const StudyOptions& options_;
  std::string title_;
  std::unique_ptr<TemporaryFolder> temporary_;  // or null: the files are to stay
  fs::path directory_;
  std::vector<StudyJob> jobs_;
  const Shard shard_;
  std::unique_ptr<Ranks> ranks_;  // or null: this process is alone
  record_detail::FileDescriptor lock_, shard_lock_;
  std::size_t finished_ = 0, total_ = 0;
  bool line_ = false;
  std::chrono::steady_clock::time_point shown_;
};

}  // namespace

const RegisterCommand study_command(
    CommandGroup::run, "study", "Run what a file lists, one by one or as designs, in parallel, and tabulate it",
    [](Command& c, CommonOptions& common) {
      auto options = std::make_shared<StudyOptions>();
      c.option("file", options->file, "Study file (TOML)").required();
      c.option("--only", options->only, "Runs by name or pattern, such as 'ride*' (repeatable)").separated();
      c.option("--jobs", options->jobs, "Runs at a time (default: the number of cores)").between(0, 1e6);
      c.option("--shard", options->shard,
               "Only every N-th run, beginning with the I-th, for job arrays; --merge collects")
          .value_name("I/N");
      c.flag("--merge", options->merge, "Run nothing: the tables of what shards have finished");
      c.option("--set", common.overrides,
               "Replace a value of every scene, whatever the study says: path=value (repeatable)")
          .value_name("PATH=VALUE")
          .repeatable();
      c.flag("--fresh", options->fresh, "Begin all runs anew, finished ones too");
      c.option("--output", common.output, "Directory for results (default: results/STUDY)");
      c.flag("--no-files", common.no_files,
             "Leave no files: the table goes to standard output, nothing can be resumed");
      c.flag("--json", common.json, "Print one JSON object and nothing else");
      c.flag("--quiet", common.quiet, "Print errors only");
      c.runs([&common, options] { return StudyCommand(common, *options).run(); });
    });

}  // namespace costate::app
