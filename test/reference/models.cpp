// Every model against its reference.json: states and functionals with their gradients, by one formulation with exact
// constraints on CVODES. (What each formulation reaches is in the models' READMEs.)
#include <catch2/catch.hpp>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "costate/integrator/simulate.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;
using Json = nlohmann::json;

namespace {

// Errors of these runs are 10 to 1e4 times rtol, the more the longer and the livelier the motion.
constexpr double kRtol = 1e-12;
constexpr double kStates = 1e-6, kPsi = 1e-7, kGradient = 1e-5;

struct Entry {
  std::filesystem::path folder;
  Json json;
};

/// An entry may name another formulation, since redundant rows are not for all, and a tolerance, where motion magnifies
/// errors.
Problem problem_of(const Scene& scene, const Json& entry, const std::vector<std::string>& parameters, double t_end) {
  Problem p;
  p.mechanism = scene.mechanism();
  p.objective = scene.objective();
  p.parameters = p.mechanism->select(parameters);
  p.formulation = entry.value("formulation", "baumgarte");
  p.formulation_options = scene.formulation;
  p.solver.integrator = "cvodes";
  p.solver.rtol = entry.value("rtol", kRtol);
  p.solver.t_end = t_end;
  return p;
}

/// The entries of all models' reference.json under a key.
std::vector<Entry> entries(const char* key) {
  std::vector<Entry> result;
  for (const auto& folder : std::filesystem::directory_iterator(COSTATE_MODELS_DIR)) {
    std::ifstream in(folder.path() / "reference.json");
    if (!in) continue;
    const Json reference = Json::parse(in);
    for (const Json& e : reference.at(key)) result.push_back({folder.path(), e});
  }
  return result;
}

}  // namespace

TEST_CASE("models: the states of every reference.json") {
  int count = 0;
  for (const auto& [folder, e] : entries("states")) {
    const double t = e.at("t_s");
    if (t > 20) continue;  // some hundred swings: left to those with time
    const std::string name = e.at("scene");
    INFO(name << " at " << t << " s");
    const Scene scene = Scene::load((folder / name).string());
    std::vector<std::pair<std::string, std::unique_ptr<Output>>> outputs;
    for (const auto& [output, value] : e.at("values").items())
      outputs.emplace_back(output, make_output(*scene.mechanism(), output));
    const Problem p = problem_of(scene, e, {}, std::max(t, 1e-3));
    simulate(p, p.parameters.values(), {t}, [&](const MechanismState& s, System& system) {
      for (const auto& [output, o] : outputs) {
        const double value = e.at("values").at(output), x = o->value(s, system.assembly());
        INFO(output << " = " << x << ", reference " << value);
        // Velocities and accelerations of moderate motions and zeros count absolutely.
        CHECK(std::abs(x - value) < kStates * std::max(1e-2, std::abs(value)));
        ++count;
      }
    });
  }
  CHECK(count > 100);
}

TEST_CASE("models: the functionals of every reference.json and their gradients") {
  int count = 0;
  for (const auto& [folder, e] : entries("functionals")) {
    const std::string name = e.at("scene");
    const Scene scene = Scene::load((folder / name).string(), e.at("set").get<std::vector<std::string>>());
    std::vector<std::string> parameters;
    for (const auto& [parameter, value] : e.at("gradient").items()) parameters.push_back(parameter);
    const Problem p = problem_of(scene, e, parameters, e.at("t_end_s"));
    for (const std::string method : {"cvodes-forward", "cvodes-adjoint"}) {
      if (parameters.empty() && method == "cvodes-adjoint") continue;  // the same motion, and nothing to go back for
      INFO(name << " to " << p.solver.t_end << " s, " << e.at("set") << ", " << method);
      const GradientResult r = gradient(p, method, p.parameters.values());
      CHECK(r.psi == Approx(e.at("psi").get<double>()).epsilon(kPsi));
      double size = 0, error = 0;
      for (std::size_t j = 0; j < parameters.size(); ++j) {
        const double value = e.at("gradient").at(parameters[j]), scale = p.parameters.parameters[j].scale;
        size = std::max(size, std::abs(value) * scale);
        error = std::max(error, std::abs(r.gradient[j] - value) * scale);
      }
      CHECK(error <= kGradient * size);  // none of both where the entry holds psi only
      ++count;
    }
  }
  CHECK(count > 20);
}
