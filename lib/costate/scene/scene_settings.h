// What a scene says about running it: [run] and [optimize]. Everything can be overridden on the command line.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "costate/formulation/defaults.h"
#include "costate/formulation/formulation.h"

namespace costate {

/// [run] ends_when: the run ends where an output crosses a level, from below (above) or from above (below).
struct EndSettings {
  std::string output;
  bool above = true;
  int level_number = -1;  // of the mechanism
};

/// [run]
struct RunSettings {
  double t_start_s = 0;
  double t_end_s = 1;
  std::optional<EndSettings> ends_when;
  std::string formulation = kDefaultFormulation;
  std::string method = kDefaultMethod;
  bool method_given = false;            // else that one is of its kind that goes with the formulation
  std::string integrator;               // empty: the formulation's default
  std::string cvodes_method;            // "adams" or "bdf"; empty: the solver's default
  std::string sensitivity_corrector;    // "staggered" or "simultaneous" (forward methods); empty: the solver's default
  std::vector<std::string> parameters;  // default list of what to differentiate
  double rtol = kDefaultTolerance;
  std::optional<double> accuracy;       // of the result, in the place of tolerances
  std::optional<double> atol;           // none: the method's own choice
  std::optional<double> step_s;         // of fixed-step runs; none: chosen from rtol
  std::optional<double> max_step_s;     // of integrators; none: unlimited
  std::optional<double> output_step_s;  // none: the integrator's steps
  std::vector<std::string> outputs;     // extra named outputs in files
  bool cycle = false;                   // gradients and optimizations follow the cycle of [cycle]
  bool events = true;                   // whether files list them and plots mark them
};

/// [optimize]
struct OptimizeSettings {
  std::string goal = "sum";  // of several cases: their weighted sum, or the "worst" of them
  std::string algorithm = kDefaultAlgorithm;
  bool algorithm_chosen = false;  // by the scene
  int max_evaluations = 100;
  std::optional<double> stop_value;   // ends when the cost falls below
  double relative_tolerance = 1e-10;  // of the cost, between iterations
  double gradient_tolerance = 0;      // of the scaled, projected gradient; 0: off
};

/// The words that a setting may be, where a floor above this one knows them ("optimize.algorithm"); empty: any.
const std::vector<std::string>& setting_words(const std::string& path);
struct RegisterSettingWords {
  RegisterSettingWords(const std::string& path, std::vector<std::string> words);
};

}  // namespace costate
