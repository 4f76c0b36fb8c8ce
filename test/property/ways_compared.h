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
/// soft by O(1/alpha); also(result, what is allowed).
template <class Also>
void check_gradients(Problem p, const std::vector<double>& right, const std::vector<MethodWay>& ways, double tolerance,
                     double softness, const Also& also) {
  const double size = size_of(right, p.parameters);
  for (const MethodWay& way : ways) {
    p.formulation = way.formulation;
    CAPTURE(way.formulation, way.method);
    const GradientResult r = gradient(p, way.method, p.parameters.values());
    const double allowed = tolerance + (p.formulation.starts_with("penalty") ? softness : 0);
    also(r, allowed);
    for (std::size_t j = 0; j < right.size(); ++j) {
      CAPTURE(p.parameters.parameters[j].name, r.gradient[j], right[j]);
      CHECK(std::abs(r.gradient[j] - right[j]) * p.parameters.parameters[j].scale <= allowed * size);
    }
  }
}

/// The same against differences by the problem's own formulation.
inline void check_ways(const Problem& p, const std::vector<std::string>& events, const std::vector<MethodWay>& ways,
                       double tolerance, double softness = 0) {
  const GradientResult reference = gradient(p, "differences", p.parameters.values());
  CHECK(event_names(reference.events) == events);
  check_gradients(p, reference.gradient, ways, tolerance, softness,
                  [&](const GradientResult& r, double) { CHECK(event_names(r.events) == events); });
}

}  // namespace costate::test
