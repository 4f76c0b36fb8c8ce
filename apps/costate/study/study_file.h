// The file of a study: a list of runs, each a scene with its parameters, overrides and options, and
// designs (grids, samples), each many runs of one scene with numbers that vary.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "costate/scene/scene_file.h"

namespace costate::app {

struct StudyRun {
  std::string name;
  std::filesystem::path scene;                         // as it can be opened from here
  std::vector<std::string> parameters;                 // empty: the scene's
  std::vector<std::string> overrides;                  // "path=value", those of the whole study first
  std::vector<std::string> options;                    // of the task's command: "--method", "idas-adjoint", ...
  std::string scene_text;                              // the scene as it is understood with the overrides
  std::vector<SceneFile> files;                        // that it names, with fingerprints
  std::string task = "optimize";                       // the command, of task_options.h
  bool costs = true;                                   // the scene has some: psi means something
  std::string design;                                  // that it is a point of, or empty
  std::vector<std::pair<std::string, double>> varied;  // there: what was varied; it is among the overrides, too
  std::vector<std::string> outputs;                    // there: whose values at the end are wanted
  std::vector<std::string> pareto;                     // there: quantities that are to be small, of a front
  bool blocks = false;                                 // there: of Saltelli's kind
  std::vector<std::string> slope_parameters;           // there, of gradients: that are what was varied, or none,
  std::vector<double> slope_factors;                   // and by what theirs are the slopes of indices.h
};

struct Study {
  std::string title;
  std::vector<StudyRun> runs;
};

/// Reads a study and all of its scenes; a mistake names file, line and column, or the run. `selected` (names
/// or patterns such as "ride*") keeps only those runs; one that fits none is a mistake.
Study read_study(const std::string& path, const std::vector<std::string>& selected,
                 const std::vector<std::string>& overrides = {});

}  // namespace costate::app
