// Gradients of one scene by several formulations and methods, against the differences of its whole motions.
#pragma once

#include <catch2/catch.hpp>
#include <cmath>
#include <string>
#include <vector>

#include "costate/sensitivity/method.h"
#include "property/gradient_compare.h"

namespace costate::test {

struct MethodWay {
  const char *formulation, *method;
};

/// "contact.floor: touch bounces", in order.
inline std::vector<std::string> event_names(const std::vector<RunEvent>& events) {
  std::vector<std::string> names;
  for (const RunEvent& e : events) names.push_back(e.name + " " + e.mode);
  return names;
}

/// By all ways, to `tolerance` of the largest scaled component, and `softness` more by penalty, whose constraints are
/// soft by O(1/alpha). Differences are by the problem's own formulation.
inline void check_ways(Problem p, const std::vector<std::string>& events, const std::vector<MethodWay>& ways,
                       double tolerance, double softness = 0) {
  const std::vector<double> rho = p.parameters.values();
  const GradientResult reference = gradient(p, "differences", rho);
  CHECK(event_names(reference.events) == events);
  const double size = size_of(reference.gradient, p.parameters);
  for (const MethodWay& way : ways) {
    p.formulation = way.formulation;
    const GradientResult r = gradient(p, way.method, rho);
    CAPTURE(way.formulation, way.method);
    CHECK(event_names(r.events) == events);
    const double allowed = tolerance + (p.formulation.starts_with("penalty") ? softness : 0);
    for (std::size_t j = 0; j < rho.size(); ++j) {
      CAPTURE(p.parameters.parameters[j].name, r.gradient[j], reference.gradient[j]);
      CHECK(std::abs(r.gradient[j] - reference.gradient[j]) * p.parameters.parameters[j].scale <= allowed * size);
    }
  }
}

}  // namespace costate::test
