// Figures of a run: the mechanism at each of its sample times.
#pragma once

#include <vector>

#include "costate/command.h"
#include "costate/figure.h"
#include "costate/record/trajectory_table.h"

namespace costate::app {

/// The numbers of a scene that are none of its mechanism's, for make_figure.
SceneNumbers scene_numbers(const Scene& scene);

struct FiguresOfRun {
  std::vector<double> times;  // [s], increasing; the last one is the run's end
  std::vector<Figure> figures;
};

/// Runs the problem of `setup` and draws it every `step` seconds, or at 300 times; or at `times` alone.
FiguresOfRun figures_of_run(const Setup& setup, std::optional<double> step, std::vector<double> times = {});

/// The mechanism of `scene` at samples of a trajectory of it, at most `count` of them, evenly taken.
FiguresOfRun figures_of_table(const Scene& scene, const TrajectoryTable& table, std::size_t count);

}  // namespace costate::app
