// The whole command, the tool as a process, against the number of bodies: a chain of bars, a binary tree of bars and
// pendulums that have nothing to do with each other. Parts by what commands leave out: `dump` reads (and prints what it
// read), a run that ends at once starts, one without files runs, `gradient` does all.
#include <fmt/format.h>

#include <cmath>
#include <filesystem>
#include <fstream>

#include "benchmark.h"
#include "costate/base/error.h"
#include "fit_exponent.h"
#include "tool_run.h"

namespace costate::bench {

namespace {

constexpr double kStep = 1e-3, kEnd = 0.02, kAtOnce = 1e-6;  // s
constexpr double kTolerance = 0.05;                          // target of the exponent: as near to 1

struct Case {
  const char *formulation, *method, *integrator;
};
// Steps of one length are as many for any number of bodies; the others take more where tolerances ask for it.
constexpr Case kCases[] = {{"index3", "discrete-adjoint", "fixed"},
                           {"baumgarte", "idas-adjoint", "idas"},
                           {"maggi", "cvodes-adjoint", "cvodes"}};
constexpr const char* kKinds[] = {"chain", "tree", "fleet"};

/// Points P1 ... PN at the lower ends of bars at 45 degrees: each bar hangs on the one before, with a damped spring
/// from its end to the ground (chain), on that of half its number (tree), or on the ground (fleet).
std::string scene(const std::string& kind, int bodies) {
  constexpr double length = 0.2;
  const double side = length * std::sqrt(0.5);
  std::string text = "[gravity]\ny_m_per_s2 = -9.81\n", given;
  std::vector<double> x(static_cast<std::size_t>(bodies) + 1, 0), y = x;
  const auto point = [&](const std::string& name, double px, double py, bool ground) {
    text += fmt::format("[point.{}]\nx_m = {}\ny_m = {}\n{}", name, px, py, ground ? "ground = true\n" : "");
  };
  if (kind != "fleet") point("P0", 0, 0, true);
  for (int i = 1; i <= bodies; ++i) {
    const int below = kind == "chain" ? i - 1 : kind == "tree" ? i / 2 : 0;
    std::string from = fmt::format("P{}", below);
    const auto at = static_cast<std::size_t>(i), on = static_cast<std::size_t>(below);
    const double to_side = kind == "tree" && i % 2 == 0 ? -side : side, from_x = kind == "fleet" ? i : x[on];
    if (kind == "fleet") point(from = fmt::format("G{}", i), from_x, 0, true);
    x[at] = from_x + to_side;
    y[at] = y[on] - side;
    point(fmt::format("P{}", i), x[at], y[at], false);
    text += fmt::format("[bar.B{}]\nfrom = \"{}\"\nto = \"P{}\"\nmass_kg = 0.1\nlength_m = {}\n", i, from, i, length);
    if (kind == "chain") {
      point(fmt::format("A{}", i), x[at], y[at] - 1, true);
      text += fmt::format(
          "[spring.S{}]\nfrom = \"P{}\"\nto = \"A{}\"\nstiffness_N_per_m = 5\nnatural_length_m = 1\n"
          "damping_N_s_per_m = 0.2\n",
          i, i, i);
    }
    given += fmt::format("\"P{}.x\", ", i);
  }
  return text + fmt::format(
                    "[start]\ngiven = [{0}]\n[[cost.running]]\nkind = \"square\"\noutput = \"P{1}.y\"\n"
                    "[parameter.m]\nnumber = \"bar.B{1}.mass_kg\"\nlower = 0.01\nupper = 1\n"
                    "[run]\nt_end_s = {2}\nrtol = 1e-5\nparameters = [\"m\"]\n",
                    given, bodies, kEnd);
}

class Directory {
 public:
  Directory() {
    std::string name = (std::filesystem::temp_directory_path() / "costate_bench_XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw Error("No directory for results could be made.");
    path_ = name;
  }
  ~Directory() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  Directory(const Directory&) = delete;
  Directory& operator=(const Directory&) = delete;
  const std::string& path() const { return path_; }

 private:
  std::string path_;
};

struct Row {
  int bodies = 0;
  double read = 0, start = 0, run = 0, gradient = 0, files = 0, whole = 0, peak = 0;  // s of the processor; MiB
  long steps = 0, backward = 0;
};

Row measure(const std::string& directory, const std::string& kind, const Case& c, int bodies, int rounds) {
  const std::string file = kind + ".toml";
  std::ofstream(directory + "/" + file, std::ios::binary | std::ios::trunc) << scene(kind, bodies);
  std::vector<std::string> settings = {"--json", "--formulation", c.formulation, "--integrator", c.integrator};
  if (std::string(c.integrator) == "fixed") settings.insert(settings.end(), {"--step", fmt::format("{}", kStep)});
  const auto run = [&](const std::string& command, std::vector<std::string> more) {
    std::vector<std::string> arguments = {command, file};
    if (command != "dump") arguments.insert(arguments.end(), settings.begin(), settings.end());
    arguments.insert(arguments.end(), more.begin(), more.end());
    ToolRun best;
    for (int i = 0; i < rounds; ++i) {
      ToolRun r = run_tool(arguments, directory);
      if (i == 0 || r.user_s < best.user_s) best = std::move(r);
    }
    return best;
  };
  const std::string at_once = fmt::format("{}", std::string(c.integrator) == "fixed" ? kStep : kAtOnce);
  const ToolRun dump = run("dump", {}), start = run("simulate", {"--no-files", "--no-confirm", "--t-end", at_once}),
                simulation = run("simulate", {"--no-files", "--no-confirm"}),
                stored = run("simulate", {"--no-confirm"}),
                gradient = run("gradient", {"--no-files", "--no-confirm", "--method", c.method}),
                whole = run("gradient", {"--no-confirm", "--method", c.method});
  Row row;
  row.bodies = bodies;
  row.read = dump.user_s;
  row.start = start.user_s - dump.user_s;
  row.run = simulation.user_s - start.user_s;
  row.gradient = gradient.user_s - simulation.user_s;
  row.files = stored.user_s - simulation.user_s;
  row.whole = whole.user_s + row.files;
  row.peak = std::max(stored.peak_MiB, whole.peak_MiB);
  const nlohmann::json counters = nlohmann::json::parse(whole.out).at("counters");
  row.steps = counters.at("steps");
  row.backward = counters.at("backward_steps");
  return row;
}

}  // namespace

Report bodies(const Settings& settings) {
  const std::vector<int> counts = settings.quick ? std::vector<int>{10, 30} : std::vector<int>{100, 1000, 10000};
  const Directory directory;
  Report report;
  report.text += fmt::format(
      "The tool as a process against the number of bodies, {} s at rtol 1e-5 or by steps of {} s, one parameter: user "
      "time of the\nprocessor in ms, the least of {}; read: dump; start: a run that ends at once, less that; run, "
      "gradient: what these add; files:\nwhat simulate's add; whole: gradient, and a trajectory stored; exponent: of "
      "`whole` over all rows (target 1 +- {}), and over\nsteps\n  {:<7}{:<11}{:<18}{:>7}{:>8}{:>8}{:>8}{:>9}{:>8}{:>9}"
      "{:>7}{:>6}{:>9}{:>7}{:>11}\n",
      kEnd, kStep, settings.quick ? 1 : 2, kTolerance, "", "", "", "bodies", "read", "start", "run", "gradient",
      "files", "whole", "steps", "back", "ms/step", "MiB", "exponent");
  nlohmann::json rows = nlohmann::json::array();
  for (const char* kind : kKinds)
    for (const Case& c : kCases) {
      std::vector<double> x, y, per_step;
      for (const int count : counts) {
        const Row r = measure(directory.path(), kind, c, count, settings.quick ? 1 : 2);
        const auto steps = static_cast<double>(r.steps + r.backward);
        const double step = (r.run + r.gradient) / steps;
        x.push_back(count);
        y.push_back(r.whole);
        per_step.push_back(step);
        std::string fitted;
        if (count == counts.back())
          fitted = fmt::format("{:.2f} {:.2f}", fit_exponent(x, y), fit_exponent(x, per_step));
        report.text += fmt::format(
            "  "
            "{:<7}{:<11}{:<18}{:>7}{:>8.0f}{:>8.0f}{:>8.0f}{:>9.0f}{:>8.0f}{:>9.0f}{:>7}{:>6}{:>9.3f}{:>7.0f}{:>11}\n",
            kind, c.formulation, c.method, count, 1e3 * r.read, 1e3 * r.start, 1e3 * r.run, 1e3 * r.gradient,
            1e3 * r.files, 1e3 * r.whole, r.steps, r.backward, 1e3 * step, r.peak, fitted);
        rows.push_back({{"kind", kind},
                        {"formulation", c.formulation},
                        {"method", c.method},
                        {"bodies", count},
                        {"read_s", r.read},
                        {"start_s", r.start},
                        {"run_s", r.run},
                        {"gradient_s", r.gradient},
                        {"files_s", r.files},
                        {"whole_s", r.whole},
                        {"steps", r.steps},
                        {"backward_steps", r.backward},
                        {"peak_MiB", r.peak}});
      }
      rows.back()["exponent"] = fit_exponent(x, y);
      rows.back()["exponent_of_a_step"] = fit_exponent(x, per_step);
    }
  report.json = {{"t_end_s", kEnd}, {"step_s", kStep}, {"rows", std::move(rows)}};
  return report;
}

}  // namespace costate::bench
