#include "optimize_motions.h"

#include <fmt/format.h>

#include "costate/record/interrupt.h"
#include "trajectory.h"

namespace costate::app {

namespace {

std::string motion_name(const char* when, const std::string& of) { return of.empty() ? when : when + ("_" + of); }

}  // namespace

std::vector<RunMotion> write_motions(const DesignSetup& whole, const std::vector<double>& first,
                                     const std::vector<double>& best, const Json& settings,
                                     const std::function<void(const std::string&)>& note) {
  std::vector<RunMotion> motions;
  if (!whole.setup.files) return motions;
  const Design design = whole.design();
  for (std::size_t i = 0; i < design.cases.size(); ++i) {
    const DesignCase& c = design.cases[i];
    RunMotion m{whole.several() ? &whole.cases[i] : &whole.setup, c.name, c.own(first), c.own(best), {}, {}};
    const auto motion = [&](const std::vector<double>& rho, const char* when) -> std::optional<TrajectoryTable> {
      const std::string name = motion_name(when, c.name);
      try {
        TrajectoryTable table = shown_trajectory(*m.setup, rho, whole.several() ? settings_json(*m.setup) : settings);
        for (const auto& remark : not_finite_remarks(table)) note(fmt::format("The motion '{}': {}", name, remark));
        write_trajectory(*m.setup, table, name, true);
        return table;
      } catch (const Interrupted&) {
        throw;
      } catch (const SolverError& e) {
        note(fmt::format("The motion '{}' could not be computed: {}", name, e.what()));
        return {};
      }
    };
    m.before = motion(m.rho_before, "before");
    m.after = motion(m.rho_after, "after");
    motions.push_back(std::move(m));
  }
  return motions;
}

void remove_old_results(const DesignSetup& whole, const std::vector<SceneFile>& files) {
  namespace fs = std::filesystem;
  std::vector<std::string> names = {"optimized.toml", "optimize.json", "report.html"};
  std::vector<std::string> runs;
  for (const SceneCase& c : whole.of) runs.push_back(c.name);
  if (runs.empty()) runs.emplace_back();
  for (const std::string& run : runs)
    for (const char* when : {"before", "after"})
      for (const char* extension : {".h5", ".csv"}) names.push_back(motion_name(when, run) + extension);
  std::error_code ignored;
  for (const std::string& name : names) {
    const fs::path path = whole.setup.directory / name;
    bool read = fs::equivalent(path, whole.setup.scene.file_name(), ignored);
    for (const SceneFile& f : files) read = read || fs::equivalent(path, f.file, ignored);
    if (!read) fs::remove(path, ignored);
  }
}

}  // namespace costate::app
