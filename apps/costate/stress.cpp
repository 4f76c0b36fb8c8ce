// costate stress: scenes at the extremes of what can be set, every run judged against a proven reference: held, refused
// with the cause, or wrong in silence.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <chrono>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/record/interrupt.h"
#include "costate/record/jobs.h"
#include "stress_families.h"
#include "stress_page.h"
#include "stress_variants.h"
#include "trajectory.h"

namespace costate::app {

namespace {

struct StressOptions {
  std::vector<std::string> scenes, axes;
  double budget_s = 300;
  int jobs = 0;
};

const std::vector<std::string>& known_axes() {
  static const std::vector<std::string> axes = [] {
    std::vector<std::string> r = {"tolerance", "step",   "penalty weight", "stabilization", "start speed", "long time",
                                  "units",     "bounds", "mass ratio",     "stiffness",     "spin"};
    r.insert(r.end(), family_axes().begin(), family_axes().end());
    return r;
  }();
  return axes;
}

/// The shipped models, beside the tool where it is installed or built.
std::vector<std::string> shipped_scenes() {
  namespace fs = std::filesystem;
  std::error_code code;
  const fs::path tool = fs::read_symlink("/proc/self/exe", code).parent_path();
  for (const fs::path& models : {tool / "../share/costate/models", tool / "../../../models"}) {
    std::vector<std::string> scenes;
    for (const char* name :
         {"pendulum/pendulum", "damped_pendulum/damped_pendulum", "five_bar/five_bar", "slider_crank/slider_crank",
          "n_four_bar/n_four_bar_1", "andrews/andrews", "car_axis/car_axis", "flyball_governor/flyball_governor",
          "heavy_top/heavy_top", "bricard/bricard", "rigid_body/dzhanibekov", "rigid_body/euler_top",
          "bouncing_ball/bouncing_ball", "golden_car/golden_car", "walker/arc_feet", "iltis/speed_bumps",
          "iltis/double_lane_change"}) {
      const fs::path file = models / (std::string(name) + ".toml");
      if (fs::exists(file, code)) scenes.push_back(fs::weakly_canonical(file, code).string());
    }
    if (!scenes.empty()) return scenes;
  }
  throw Error("The shipped models are not beside this tool; name the scenes to be stressed.");
}

class Stress {
 public:
  Stress(const CommonOptions& common, const StressOptions& options)
      : common_(common), options_(options), progress_(told(common)) {}

  int run() {
    if (!(options_.budget_s > 0 && std::isfinite(options_.budget_s)))
      throw Error(fmt::format("--budget must be a positive number of seconds, found {}.", options_.budget_s));
    for (const auto& a : options_.axes)
      if (std::find(known_axes().begin(), known_axes().end(), a) == known_axes().end())
        throw Error(fmt::format("--axes: There is no axis '{}'.{} Known are: {}.", a, suggestion(a, known_axes()),
                                fmt::join(known_axes(), ", ")));
    set_jobs(options_.jobs);
    // Families of scenes are run where none is named, or by the names of their axes.
    std::vector<std::string> families;
    for (const auto& axis : family_axes())
      if (options_.axes.empty() ? options_.scenes.empty() : asked(axis.c_str())) families.push_back(axis);
    std::vector<std::string> scenes = options_.scenes;
    const auto of_family = [](const std::string& axis) {
      return std::find(family_axes().begin(), family_axes().end(), axis) != family_axes().end();
    };
    const bool families_alone =
        !options_.axes.empty() && std::all_of(options_.axes.begin(), options_.axes.end(), of_family);
    if (families_alone && !scenes.empty())
      throw Error(
          fmt::format("--axes {}: there scenes are made, and '{}' would not be run; leave it out, or name one of "
                      "its axes besides.",
                      fmt::join(options_.axes, ","), scenes.front()));
    if (!families_alone && scenes.empty()) scenes = shipped_scenes();
    const std::size_t all = scenes.size() + families.size();
    const std::filesystem::path directory = common_.output.empty() ? "results/stress" : common_.output;
    if (!common_.no_files) require_writable(directory);
    int interruption = 0;
    try {
      for (std::size_t i = 0; i < scenes.size(); ++i) {
        const double left = options_.budget_s - spent_s();
        one(scenes[i], std::max(0.5, left / static_cast<double>(all - i)));
      }
      for (std::size_t i = 0; i < families.size(); ++i)
        family(families[i], std::max(0.5, (options_.budget_s - spent_s()) / static_cast<double>(families.size() - i)));
    } catch (const Interrupted& e) {
      interruption = e.signal_number();
      summary_.note = std::string(e.what()) + " What had been run until then stands.";
    }
    progress_.finish();
    summary_.wall_s = spent_s();
    finish_stress(summary_, common_, directory, interruption != 0);
    return interruption != 0 ? 128 + interruption : summary_.count(StressVerdict::wrong) > 0 ? kDisagreement : 0;
  }

 private:
  static ProgressOptions told(const CommonOptions& common) {
    ProgressOptions o;
    o.quiet = common.quiet || common.json;
    o.verbose = true;
    return o;
  }
  double spent_s() const { return seconds_since(began_); }
  bool asked(const char* axis) const {
    return options_.axes.empty() || std::find(options_.axes.begin(), options_.axes.end(), axis) != options_.axes.end();
  }

  CommonOptions with(const std::string& scene, const std::vector<std::string>& overrides) const {
    CommonOptions o = common_;
    o.scene = scene;
    o.no_files = true;
    o.overrides.insert(o.overrides.end(), overrides.begin(), overrides.end());
    return o;
  }

  void one(const std::string& file, double share_s) {
    const auto begin = std::chrono::steady_clock::now();
    StressedScene& s = summary_.scenes.emplace_back();
    s.file = file;
    try {
      Setup setup(with(file, {}), Purpose::compare);
      s.title = setup.scene.title;
      for (const auto& sentence : setup.noticed) summary_.warnings.push_back(fmt::format("{}: {}", file, sentence));
      progress_.start(setup.problem.solver.t_start);
      setup.problem.monitor = monitor(progress_, setup.problem.solver.t_end);
      std::vector<std::string> outputs = setup.scene.run.outputs;
      if (outputs.empty()) outputs = setup.scene.mechanism()->coordinate_names();
      std::erase(outputs, "time");
      // The axes share what there is; none waits for another.
      const auto until = [begin, share_s](double part) {
        return [=] { return seconds_since(begin) < part * share_s; };
      };
      std::function<bool()> time_left = until(0.25);
      StressCase base(setup.problem, setup.rho, outputs, 0.05 * share_s, [&time_left] { return time_left(); });
      base.find_reference(0.2 * share_s);
      s.reference = base.reference();
      s.unjudged = base.unjudged();
      if (asked("units")) units(s, setup, file, base);
      time_left = until(0.5);
      if (asked("tolerance"))
        base.tolerances(s.entries, {1e-1, 1e-13, 1e-2, 1e-12, 1e-3, 1e-11, 1e-4, 1e-10, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9});
      time_left = until(0.6);
      if (asked("penalty weight")) base.weights(s.entries, {1e2, 1e16, 1e4, 1e14, 1e6, 1e12, 1e8, 1e10});
      time_left = until(0.65);
      if (asked("stabilization")) base.stabilizations(s.entries);
      time_left = until(0.75);
      if (asked("step")) base.steps(s.entries, {1, 4, 16, 64, 256, 1024, 4096, 16384, 65536});
      variants(s, setup, file, outputs, until(1), share_s);
    } catch (const Error& e) {
      s.failed = e.what();
    } catch (const Cut& e) {
      s.failed = std::string("cut ") + e.what();
    }
    take_notices();
    s.wall_s = seconds_since(begin);
    progress_.line(fmt::format("  {}: {}", std::filesystem::path(file).stem().string(), s.counts()));
  }

  void units(StressedScene& s, const Setup& setup, const std::string& file, StressCase& base) {
    for (const double factor : {1e3, 1e-3, 1e6, 1e-6}) {
      const std::string value = fmt::format("lengths in {} m", fmt::format("{:g}", 1 / factor));
      const RescaledScene r = rescaled(setup.scene, factor);
      if (!r.why_not.empty()) {
        s.notes.push_back("units: " + r.why_not + ".");
        return;
      }
      try {
        CommonOptions o = with(file, r.overrides);
        o.parameters.clear();
        const Setup other(o, Purpose::compare);
        Problem p = other.problem;
        p.parameters = {};
        s.entries.push_back(base.same(p, {}, "units", value, [&](TradeValues& v) {
          v.psi = base.reference().values.psi;  // what a cost weighs has no unit that could be told
          if (v.motion)
            for (auto& sample : v.motion->outputs)
              for (std::size_t k = 0; k < sample.size(); ++k)
                sample[k] /= std::pow(factor, length_power(base.unit_of_output(k)).value_or(0));
        }));
      } catch (const Error& e) {
        StressEntry entry;
        entry.axis = "units";
        entry.value = value;
        entry.what = {setup.problem.formulation, setup.problem.solver.integrator};
        entry.verdict = StressVerdict::refused;
        entry.why = e.what();
        s.entries.push_back(entry);
      }
    }
  }

  /// Motions of their own, each with its own reference.
  void variants(StressedScene& s, const Setup& setup, const std::string& file, const std::vector<std::string>& outputs,
                const std::function<bool()>& time_left, double share_s) {
    const auto judge = [&](const std::string& axis, const std::string& value, const std::vector<std::string>& overrides,
                           const std::function<void(Setup&)>& change) {
      if (time_left()) variant(s, with(file, overrides), axis, value, outputs, change, 0.05 * share_s, time_left);
    };
    const auto changed = [&](const char* axis, const std::string& value, const std::vector<std::string>& overrides) {
      if (asked(axis) && !overrides.empty()) judge(axis, value, overrides, {});
    };
    if (asked("start speed"))
      for (const double factor : {1e-6, 1e2}) {
        const auto overrides = faster(setup.scene, factor);
        if (!overrides.empty()) judge("start speed", fmt::format("{:g} times", factor), overrides, {});
      }
    if (asked("long time")) {
      judge("long time", kOneTime, {}, {});
      judge("long time", kTenTimes, {}, [](Setup& o) {
        SolverOptions& solver = o.problem.solver;
        solver.t_end = solver.t_start + 10 * (solver.t_end - solver.t_start);
      });
      if (const std::string drift = drift_exponents(s.entries); !drift.empty())
        s.notes.push_back("Drift grows with the time to the power of: " + drift + ".");
    }
    for (const double factor : {1e3, 1e6, 1e-6})
      changed("stiffness", fmt::format("springs {:g} times as stiff", factor), stiffer(setup.scene, factor, false));
    for (const double factor : {1e2, 1e4, 1e8})
      changed("stiffness", fmt::format("contacts {:g} times as stiff", factor), stiffer(setup.scene, factor, true));
    for (const double factor : {1e3, 1e6, 1e12, 1e-3, 1e-6, 1e-12, 0.0})
      changed("mass ratio", fmt::format("the last mass {:g} times as heavy", factor), heavier(setup.scene, factor));
    for (const double rate : {1e4, 1e-6}) changed("spin", fmt::format("{:g} rad/s", rate), spinning(setup.scene, rate));
    if (asked("bounds"))
      for (const bool upper : {false, true})
        for (const double beyond : {0.0, 0.5}) at_bounds(setup, upper, beyond, judge);
  }

  /// Parameters at their bounds, or beyond by so much of their range (of the bound's size, where only one is given).
  template <class Judge>
  void at_bounds(const Setup& setup, bool upper, double beyond, const Judge& judge) {
    const auto& parameters = setup.problem.parameters.parameters;
    if (std::none_of(parameters.begin(), parameters.end(),
                     [&](const Parameter& p) { return std::isfinite(upper ? p.upper : p.lower); }))
      return;
    const std::string where = upper ? "upper" : "lower";
    judge("bounds",
          beyond > 0 ? fmt::format("parameters beyond their {} bounds by {:g} of their range", where, beyond)
                     : fmt::format("parameters at their {} bounds", where),
          {}, [upper, beyond](Setup& o) {
            for (std::size_t k = 0; k < o.rho.size(); ++k) {
              const Parameter& p = o.problem.parameters.parameters[k];
              const double bound = upper ? p.upper : p.lower, other = upper ? p.lower : p.upper;
              if (!std::isfinite(bound)) continue;
              const double range = std::isfinite(other) ? std::abs(bound - other) : std::abs(bound);
              o.rho[k] = bound + (upper ? beyond : -beyond) * range;
            }
          });
  }

  /// A motion of its own, with its own reference, by every combination.
  void variant(StressedScene& s, const CommonOptions& given, const std::string& axis, const std::string& value,
               const std::vector<std::string>& outputs, const std::function<void(Setup&)>& change, double seconds,
               const std::function<bool()>& time_left) {
    StressEntry none;
    none.axis = axis;
    none.value = value;
    constexpr const char* spent = "the budget of time was spent before";
    try {
      if (!time_left()) throw Cut(spent);
      Setup other(given, Purpose::compare);
      none.what = {other.problem.formulation, other.problem.solver.integrator};
      if (change) change(other);
      other.problem.monitor = monitor(progress_, other.problem.solver.t_end);
      StressCase own(other.problem, other.rho, outputs, 0.6 * seconds, time_left);
      const bool chaos = axis == kChaoticHorizon;
      own.find_reference(seconds, chaos);
      const std::size_t before = s.entries.size();
      if (chaos) own.gradients(s.entries, axis, value);
      own.every_combination(s.entries, axis, value);
      if (s.entries.size() > before) return;
      throw Cut(spent);
    } catch (const Cut& e) {
      none.verdict = StressVerdict::cut;
      none.why = e.what();
    } catch (const Error& e) {
      none.verdict = StressVerdict::refused;
      none.why = e.what();
    }
    s.entries.push_back(none);
  }

  /// Scenes made for an axis, the mildest first.
  void family(const std::string& axis, double share_s) {
    const auto begin = std::chrono::steady_clock::now();
    StressedScene& s = summary_.scenes.emplace_back();
    s.file = s.title = axis;
    const std::vector<StressFamily> members = family_of(axis);
    for (std::size_t i = 0; i < members.size(); ++i) {
      const double now = seconds_since(begin), left = std::max(0.0, share_s - now);
      const double until = now + left / static_cast<double>(members.size() - i);
      CommonOptions o = with(members[i].value, {});
      const Scene scene = Scene::parse(members[i].text, members[i].value);
      o.ready = std::make_shared<const Scene>(scene);
      progress_.start(scene.run.t_start_s);
      variant(s, o, axis, members[i].value, scene.run.outputs, {}, 0.3 * (until - now),
              [=] { return seconds_since(begin) < until; });
    }
    take_notices();
    if (axis == kChaoticHorizon)
      for (const auto& sentence : gradient_horizons(s.entries)) s.notes.push_back(sentence);
    s.wall_s = seconds_since(begin);
    progress_.line(fmt::format("  {}: {}", axis, s.counts()));
  }

  const CommonOptions& common_;
  const StressOptions& options_;
  Progress progress_;
  StressSummary summary_;
  std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();
};

}  // namespace

const RegisterCommand stress_command(
    CommandGroup::judge, "stress", "Scenes at the extremes of tolerances, steps, weights, speeds, units: what holds",
    [](Command& c, CommonOptions& common) {
      auto options = std::make_shared<StressOptions>();
      c.option("scenes", options->scenes, "Scene files (TOML; default: the shipped models)");
      c.option("--set", common.overrides, "Replace a value of the scenes: path=value (repeatable)")
          .value_name("PATH=VALUE")
          .repeatable();
      c.option("--axes", options->axes,
               "These only, separated by commas: " + fmt::format("{}", fmt::join(known_axes(), ", ")))
          .separated();
      c.option("--budget", options->budget_s, "Seconds that it may take, shared by the scenes").shows_default();
      add_jobs_option(c, options->jobs, "Runs");
      c.option("--output", common.output, "Directory for stress.html and stress.json (default: results/stress)");
      c.flag("--no-files", common.no_files, "Write no files");
      c.flag("--json", common.json, "Print one JSON object and nothing else");
      c.flag("--quiet", common.quiet, "Print errors only");
      c.runs([&common, options] { return Stress(common, *options).run(); });
    });

}  // namespace costate::app
