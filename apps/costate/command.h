// What the commands of the tool share: common options, loading a scene into a problem, and ending a run.
#pragma once

#include <chrono>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "command_line.h"
#include "costate/analysis/not_finite.h"
#include "costate/base/error.h"
#include "costate/record/progress.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "json_text.h"

namespace costate::app {

/// Exit statuses besides 0.
inline constexpr int kFailed = 1;
inline constexpr int kUsage = 2;
inline constexpr int kDisagreement = 3;

struct Setup;

/// Options that every scene command takes; unset ones keep the scene's value.
struct CommonOptions {
  std::string scene;
  std::vector<std::string> parameters, overrides;
  std::string case_name;  // of a scene that lists cases, the one that is run
  std::string formulation, method, integrator, cvodes_method, sensitivity_corrector;
  std::optional<double> rtol, atol, t_end, step;
  /// The formulation's options that have a flag, by key.
  std::map<std::string, std::optional<double>> formulation_numbers;
  std::map<std::string, std::string> formulation_words;
  std::optional<long> checkpoint_steps;
  std::filesystem::path output;
  bool json = false, quiet = false, verbose = false, no_files = false;
  /// Where a command that runs inside another one (costate regress) hands its summary, instead of printing it.
  std::function<void(const Setup&, const Json&)> take;
  /// The same, of any command that has a summary, for programs that hold the tool (the Python module).
  std::function<void(const Json&)> hand_over;
  /// A scene that such a program has read already, in place of the file `scene`.
  std::shared_ptr<const Scene> ready;

  void add_to(Command& command);
  void add_run_options(Command& command);
};

/// "--jobs N": `what` at a time; `jobs` stays 0 where it is not given: as many as there are cores.
void add_jobs_option(Command& command, int& jobs, const std::string& what);

/// The scene of the command line with its overrides.
Scene load_scene(const CommonOptions& options);

/// What a command does with a scene.
enum class Purpose { simulate, differentiate, compare };

/// A scene made ready to run with the command line's choices; a mistake in these names the option or the place in the
/// scene, before anything has been computed or written.
struct Setup {
  Setup(const CommonOptions& options, Purpose purpose);

  Scene scene;
  Problem problem;
  std::string method;  // of the scene, overridden
  std::vector<double> rho;
  std::vector<std::string> noticed;  // when the scene was read; its summary tells it, whatever its runs said
  std::filesystem::path directory;   // where results go
  bool directory_chosen = false;     // by the user
  bool files = true;
  ProgressOptions progress_options;

  /// Runs f; an error of the mechanism (an unreachable start, say) is reported at its place in the scene file.
  template <class F>
  auto located(F&& f) const {
    try {
      return f();
    } catch (const ModelError& e) {
      throw scene.located(e);
    } catch (const RunNotFinite& e) {
      throw scene.located(e.cause);
    }
  }

  /// Runs f, which objects to a choice; the complaint names where that was made: the option, or a path of the scene.
  template <class F>
  void chosen_by(bool on_command_line, const char* option, const char* path, F&& f) const {
    try {
      f();
    } catch (const ModelError& e) {
      if (on_command_line) throw Error(std::string(option) + ": " + e.bare_message());
      throw scene.located(e);
    } catch (const Error& e) {
      if (on_command_line) throw Error(std::string(option) + ": " + e.what());
      throw SceneError(scene.locate(path), e.what());
    }
  }

  /// Writes a file of the run by `write`; a failure in a directory the user did not choose is a warning.
  /// Whether the file is there now.
  bool write_file(const std::string& name, const std::function<void(const std::filesystem::path&)>& write) const;

 private:
  void choose_solver(const CommonOptions& options);
  void check_combination(const CommonOptions& options, Purpose purpose);
};

/// Complains about a directory that cannot be written, without creating it.
void require_writable(const std::filesystem::path& directory);

/// Versions, scene, settings: the part of a summary that does not depend on the result.
Json settings_json(const Setup& setup);
/// The contract's keys for one run.
Json run_json(const Setup& setup, const GradientResult& result, const std::string& method, double wall_s);
Json counters_json(const Counters& c);
/// What was noticed when the scene was read, and since then (costate/base/notice.h).
Json warnings_of(const Setup& setup);
/// Gives notice of derivatives by nothing, and of what there is.
void tell_without_parameters(const Mechanism& mechanism, const ParameterSelection& chosen);
/// Adds what was noticed since to the summary's "warnings", each sentence once.
void add_notices(Json& summary);
/// The first few on standard error.
void print_warnings(const std::vector<std::string>& warnings);

/// Prints the JSON object (with --json) or the text, and writes the JSON as `file` into the directory.
void report(const Setup& setup, const CommonOptions& options, const Json& json, const std::string& text,
            const std::string& file);

/// costate check --candidate: a researcher's own adjoint (candidate.cpp).
struct CandidateOptions {
  std::string file;
  double limit_s = 300;
};
int check_candidate_file(const CommonOptions& common, const CandidateOptions& options);

double seconds_since(const std::chrono::steady_clock::time_point& begin);

}  // namespace costate::app
