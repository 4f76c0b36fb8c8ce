#include "costate/optimize/design.h"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <numeric>

#include "costate/base/error.h"

namespace costate {

std::vector<double> DesignCase::own(const std::vector<double>& rho) const {
  std::vector<double> values;
  for (const std::size_t place : places) values.push_back(rho[place]);
  return values;
}

std::vector<double> DesignCase::spread(const std::vector<double>& gradient, std::size_t parameters) const {
  std::vector<double> g(parameters, 0.0);
  for (std::size_t j = 0; j < places.size(); ++j) g[places[j]] = gradient[j];
  return g;
}

std::vector<DesignBound> Design::bounds() const {
  std::vector<DesignBound> all;
  for (std::size_t i = 0; i < cases.size(); ++i) {
    const DesignCase& c = cases[i];
    if (c.upper) all.push_back({c.name, *c.upper, i, nullptr});
    for (const OptimizerConstraint& k : c.constraints)
      all.push_back({c.name.empty() ? k.name : c.name + "." + k.name, k.upper, i, &k});
  }
  return all;
}

double Design::target(std::size_t g, const std::vector<double>& cases_psi) const {
  double f = 0;
  for (const std::size_t i : targets[g].cases) f += cases[i].factor * cases_psi[i];
  return (f - targets[g].offset) / targets[g].range;
}

std::vector<double> Design::target_gradient(std::size_t g,
                                            const std::vector<std::vector<double>>& case_gradients) const {
  std::vector<double> gradient(static_cast<std::size_t>(parameters.size()), 0.0);
  for (const std::size_t i : targets[g].cases)
    for (std::size_t j = 0; j < gradient.size(); ++j)
      gradient[j] += cases[i].factor / targets[g].range * case_gradients[i][j];
  return gradient;
}

double Design::weight(std::size_t i) const {
  for (const DesignTarget& t : targets)
    if (std::find(t.cases.begin(), t.cases.end(), i) != t.cases.end()) return cases[i].factor / t.range;
  return 1;
}

std::size_t Design::worst(const std::vector<double>& cases_psi) const {
  std::size_t worst = 0;
  for (std::size_t g = 1; g < targets.size(); ++g)
    if (target(g, cases_psi) > target(worst, cases_psi)) worst = g;
  return worst;
}

void Design::combine(const std::vector<double>& cases_psi, const std::vector<std::vector<double>>& case_gradients,
                     double& psi, std::vector<double>& gradient) const {
  if (goal == Goal::worst) {
    const std::size_t w = worst(cases_psi);
    psi = target(w, cases_psi);
    gradient = target_gradient(w, case_gradients);
    return;
  }
  psi = 0;
  gradient.assign(static_cast<std::size_t>(parameters.size()), 0.0);
  for (std::size_t g = 0; g < targets.size(); ++g) {
    psi += target(g, cases_psi);
    const std::vector<double> of = target_gradient(g, case_gradients);
    for (std::size_t j = 0; j < gradient.size(); ++j) gradient[j] += of[j];
  }
}

double Design::rtol() const {
  double least = std::numeric_limits<double>::infinity();
  for (const DesignCase& c : cases) least = std::min(least, c.problem.solver.rtol);
  return least;
}

Design single_design(const Problem& problem, const std::string& method,
                     const std::vector<OptimizerConstraint>& constraints) {
  Design d;
  d.parameters = problem.parameters;
  DesignCase c;
  c.problem = problem;
  c.method = method;
  c.constraints = constraints;
  c.places.resize(static_cast<std::size_t>(problem.parameters.size()));
  std::iota(c.places.begin(), c.places.end(), std::size_t{0});
  d.cases.push_back(std::move(c));
  d.targets.push_back({"psi", {0}});
  return d;
}

void scaled_start(const ParameterSelection& parameters, std::vector<double>& x, std::vector<double>& lower,
                  std::vector<double>& upper) {
  for (const Parameter& p : parameters.parameters) {
    if (!(p.value >= p.lower && p.value <= p.upper))
      throw ModelError(
          "parameter." + p.name,
          fmt::format("The optimization would start at {}, outside the bounds {} .. {}.", p.value, p.lower, p.upper));
    x.push_back(p.value / p.scale);
    lower.push_back(p.lower / p.scale);
    upper.push_back(p.upper / p.scale);
  }
}

}  // namespace costate
