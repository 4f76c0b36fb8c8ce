// A scene as a problem: its mechanism, cost, formulation and settings, ready for simulate(), gradient() and optimize().
#pragma once

#include <string>
#include <vector>

#include "costate/problem/problem.h"
#include "costate/scene/scene.h"

namespace costate {

/// Throws SceneError for a scene that lists cases, which is no run of its own.
void require_single_run(const Scene& scene);

/// The problem of a scene as its [run] and [formulation] say; `parameters` by name or number path, or the scene's
/// default list. (Which method to use is scene.run.method.)
Problem make_problem(const Scene& scene, const std::vector<std::string>& parameters = {});

}  // namespace costate
