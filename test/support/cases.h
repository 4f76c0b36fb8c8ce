// The scenes of test/cases as problems.
#pragma once

#include <fmt/format.h>

#include <string>
#include <vector>

#include "costate/problem/scene_problem.h"
#include "support/paths.h"

namespace costate {

/// Of test/cases/NAME.toml, with values in the place of its own.
inline Problem problem_of_case(const std::string& name, const std::vector<std::string>& overrides = {}) {
  return make_problem(Scene::load(fmt::format("{}/test/cases/{}.toml", COSTATE_SOURCE_DIR, name), overrides));
}

}  // namespace costate
