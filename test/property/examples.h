// The example scenes of all registered kinds, at random states.
#pragma once

#include <support/compare.h>
#include <support/random.h>

#include <catch2/catch.hpp>

#include "costate/analysis/start.h"
#include "costate/scene/scene.h"
#include "costate/scene/scene_kind.h"
#include "element_checks.h"

namespace costate::test {

constexpr int kStates = 5;  // random states for each example

struct State {
  double t = 0;
  Vector q, v, a, lambda, z;
  StateView view() const { return {t, q.data(), v.data(), a.data(), lambda.data(), z.data()}; }
};

/// Near the start, so that no bar collapses, but off the constraints.
inline State random_state(const Mechanism& m, const Vector& q, const Vector& z, Random& random) {
  State s;
  s.t = 0.37;
  s.q = q + 0.1 * random.vector(m.coordinate_count());
  s.v = 2 * random.vector(m.coordinate_count());
  s.a = 3 * random.vector(m.coordinate_count());
  s.lambda = 5 * random.vector(m.row_count());
  s.z = z + 0.3 * random.vector(m.state_count());
  return s;
}

inline Vector copy(const std::vector<double>& x) {
  return Eigen::Map<const Vector>(x.data(), static_cast<Eigen::Index>(x.size()));
}

/// All numbers that may vary, as parameters.
inline std::vector<std::string> free_numbers(const Mechanism& m) {
  std::vector<std::string> r;
  for (const auto& n : m.numbers())
    if (n.fixed_because.empty()) r.push_back(n.path);
  return r;
}

template <class Check>
void for_each_example(const Check& check_example) {
  for (const SceneKind& kind : scene_kinds()) {
    INFO("example of [" << kind.name << ".NAME]");
    REQUIRE_FALSE(kind.summary.empty());
    REQUIRE(kind.example.find("[" + kind.name + ".") != std::string::npos);
    const Scene scene = Scene::parse(kind.example, "example of " + kind.name);
    Assembly assembly(scene.mechanism(), scene.mechanism()->select(free_numbers(*scene.mechanism())));
    const Start start = find_start(assembly, 0, true);
    Random random(2024);
    for (int k = 0; k < kStates; ++k) {
      INFO("random state " << k);
      check_example(scene, assembly, random_state(*scene.mechanism(), start.q, start.z, random));
    }
  }
}

}  // namespace costate::test
