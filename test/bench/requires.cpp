// What a scene requires against everything: gradients of the part that the cost needs, and the five-bar in the plane
// against the same one written in space. Targets: equal results; the plane at least 3 times cheaper.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

#include "benchmark.h"
#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/wanted_part.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/stopwatch.h"
#include "fleet.h"
#include "support/paths.h"

namespace costate::bench {

namespace {

constexpr double kPlane = 3;  // target
const std::vector<std::string> kParameters = {"L01", "L02", "k1", "k2"};

/// The part that the cost needs, or null: all of it.
std::optional<Scene> part_of(const Scene& scene) {
  auto wanted = coordinates_of(*scene.mechanism(), scene.objective());
  if (wanted && scene.run.ends_when) {
    const auto end = coordinates_of(*scene.mechanism(), scene.run.ends_when->output);
    if (!end) return std::nullopt;
    wanted->insert(wanted->end(), end->begin(), end->end());
  }
  return wanted ? read_part(scene, *wanted) : std::nullopt;
}

double largest_difference(const GradientResult& a, const GradientResult& b) {
  double difference = 0, size = 0;
  for (std::size_t i = 0; i < a.gradient.size(); ++i) {
    difference = std::max(difference, std::abs(a.gradient[i] - b.gradient[i]));
    size = std::max(size, std::abs(b.gradient[i]));
  }
  return size > 0 ? difference / size : difference;
}

/// Both gradients in turns; a line and a row of the report.
double compare(Report& report, const std::string& name, const Problem& cheap, const Problem& dear,
               const std::string& method, const Settings& settings) {
  const std::vector<double> rho = cheap.parameters.values();
  GradientResult a, b;
  Race race;
  const int first = race.add([&] { a = gradient(cheap, method, rho); });
  const int second = race.add([&] { b = gradient(dear, method, dear.parameters.values()); });
  race.run(settings.rounds);
  take_notices();
  const double ratio = race.median_ratio(second, first), psi = std::abs(a.psi / b.psi - 1),
               of_gradient = largest_difference(a, b);
  report.text += fmt::format("  {:<34}{:>5} of {:<5}{:>10.1e}{:>10.1e}{:>9}{:>9}{:>9.2f}\n", name,
                             cheap.mechanism->coordinate_count(), dear.mechanism->coordinate_count(), psi, of_gradient,
                             a.counters.steps, b.counters.steps, ratio);
  report.json["rows"].push_back({{"scene", name},
                                 {"coordinates", cheap.mechanism->coordinate_count()},
                                 {"of", dear.mechanism->coordinate_count()},
                                 {"psi_difference", psi},
                                 {"gradient_difference", of_gradient},
                                 {"counters", counters_json(a.counters)},
                                 {"counters_of_everything", counters_json(b.counters)},
                                 {"ratio", ratio}});
  return ratio;
}

/// `count` five-bars, the cost that of the first.
Scene fleet_of(int count) {
  const Scene one = Scene::load(COSTATE_MODELS_DIR "/five_bar/five_bar.toml", {"run.outputs=[]", "run.parameters=[]"});
  return make_fleet(one, count)
      .with_override("cost",
                     "{ running = [{ kind = \"square\", output = \"v0_P2.x\", target = 0.5 }, { kind = "
                     "\"square\", output = \"v0_P2.y\", target = -2 }] }");
}

}  // namespace

Report requires_of_scenes(const Settings& settings) {
  Report report;
  report.json["target"] = kPlane;
  report.json["rows"] = nlohmann::json::array();
  report.text = fmt::format(
      "What is required against everything: relative differences of psi and gradient, steps of both, ratio of the "
      "medians of {} interleaved rounds.\n  {:<34}{:>14}{:>10}{:>10}{:>9}{:>9}{:>9}\n",
      settings.rounds, "", "coordinates", "psi", "gradient", "steps", "of all", "ratio");
  const Problem flat = make_problem(Scene::load(COSTATE_MODELS_DIR "/five_bar/five_bar.toml"), kParameters),
                space = make_problem(Scene::load(COSTATE_MODELS_DIR "/five_bar/five_bar_in_space.toml"), kParameters);
  const double ratio = compare(report, "five_bar, in space", flat, space, "idas-adjoint", settings);
  report.text +=
      fmt::format("  (target: the plane at least {:g} times cheaper{})\n", kPlane, ratio >= kPlane ? "" : " !");
  for (const int count : settings.quick ? std::vector<int>{2} : std::vector<int>{2, 10, 40}) {
    const Scene fleet = fleet_of(count);
    const std::optional<Scene> part = part_of(fleet);
    if (!part) throw Error("Nothing is left out of several five-bars whose cost is of one.");
    const std::vector<std::string> parameters = {"spring.v0_S1.natural_length_m", "spring.v0_S2.natural_length_m"};
    compare(report, fmt::format("{} five-bars, the cost of one", count), make_problem(*part, parameters),
            make_problem(fleet, parameters), "idas-adjoint", settings);
  }
  // The shipped scenes: most are one part.
  int whole = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(COSTATE_MODELS_DIR)) {
    if (entry.path().extension() != ".toml") continue;
    std::optional<Scene> scene;
    try {
      scene = Scene::load(entry.path().string());
    } catch (const Error&) {
      continue;  // a part of others, or a study
    }
    take_notices();
    if (!scene->cases.empty() || scene->run.cycle || scene->run.parameters.empty()) continue;
    if (const std::optional<Scene> part = part_of(*scene))
      compare(report, entry.path().stem().string(), make_problem(*part), make_problem(*scene), scene->run.method,
              settings);
    else
      ++whole;
  }
  report.text += fmt::format("  {} other scenes of models/ are one part, or their costs are of all: ratio 1\n", whole);
  report.json["whole"] = whole;
  return report;
}

}  // namespace costate::bench
