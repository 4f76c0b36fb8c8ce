#include "costate/optimize/algorithms.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <vector>

#include "costate/base/error.h"
#include "costate/optimize/optimizer.h"

namespace costate {

namespace {

struct Algorithm : OptimizerAlgorithm {
  nlopt::algorithm own;
};

const std::vector<Algorithm>& algorithms() {
  static const std::vector<Algorithm> list = {
      {{kDefaultAlgorithm, "L-BFGS: a line search along quasi-Newton directions; bounds", false}, nlopt::LD_LBFGS},
      {{"mma", "method of moving asymptotes: separable convex models; bounds and constraints", true}, nlopt::LD_MMA},
      {{kConstrainedAlgorithm, "sequential quadratic programming; bounds and constraints", true}, nlopt::LD_SLSQP}};
  return list;
}

std::vector<std::string> names_of_algorithms(bool constrained) {
  std::vector<std::string> names;
  for (const auto& a : algorithms())
    if (a.takes_constraints || !constrained) names.push_back(a.name);
  return names;
}

const RegisterSettingWords words("optimize.algorithm", names_of_algorithms(false));

}  // namespace

nlopt::algorithm algorithm_of(const std::string& name, bool constrained) {
  for (const auto& a : algorithms()) {
    if (a.name != name) continue;
    if (constrained && !a.takes_constraints)
      throw CapabilityError(fmt::format("Algorithm '{}' handles bounds but no constraints; choose '{}'.", name,
                                        fmt::join(names_of_algorithms(true), "' or '")));
    return a.own;
  }
  throw CapabilityError(
      fmt::format("There is no optimization algorithm '{}'.{}", name, suggestion(name, names_of_algorithms(false))));
}

std::string nlopt_version_text() {
  return fmt::format("{}.{}.{}", nlopt::version_major(), nlopt::version_minor(), nlopt::version_bugfix());
}

const std::vector<OptimizerAlgorithm>& optimizer_algorithms() {
  static const std::vector<OptimizerAlgorithm> list(algorithms().begin(), algorithms().end());
  return list;
}

void require_algorithm(const std::string& algorithm, bool constrained) { algorithm_of(algorithm, constrained); }

}  // namespace costate
