#include "model.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>

#include "costate/base/error.h"
#include "costate/problem/scene_problem.h"
#include "support/paths.h"

namespace costate::bench {

double Model::psi_error(double x) const { return std::abs(x / psi - 1); }

double Model::gradient_error(const std::vector<double>& x) const {
  double error = 0, size = 0;
  for (std::size_t j = 0; j < gradient.size(); ++j) {
    const double scale = problem.parameters.parameters[j].scale;
    error = std::max(error, std::abs(x[j] - gradient[j]) * scale);
    size = std::max(size, std::abs(gradient[j]) * scale);
  }
  return error / size;
}

Model load_model(const std::string& scene) {
  const std::filesystem::path path = std::filesystem::path(COSTATE_MODELS_DIR) / scene;
  std::ifstream in(path.parent_path() / "reference.json");
  if (!in) throw Error("There is no reference.json beside " + path.string() + ".");
  const nlohmann::json reference = nlohmann::json::parse(in);
  for (const auto& e : reference.at("functionals")) {
    if (e.at("scene") != path.filename().string() || !e.at("set").empty()) continue;
    Model m;
    m.name = path.stem().string();
    std::vector<std::string> parameters;
    for (const auto& [name, value] : e.at("gradient").items()) {
      parameters.push_back(name);
      m.gradient.push_back(value);
    }
    m.problem = make_problem(Scene::load(path.string()), parameters);
    m.problem.solver.t_end = e.at("t_end_s");
    m.psi = e.at("psi");
    return m;
  }
  throw Error("The reference.json beside " + path.string() + " has no functional of this scene as it is.");
}

}  // namespace costate::bench
