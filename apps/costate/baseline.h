// A baseline of costate regress: a scene, the command to run on it, and what its results are expected to be.
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "command.h"

namespace costate::app {

/// One expected number. A quantity is named by its path in the summary of the command: psi, gradient.L01,
/// counters.steps, terminal.P2.x; a list counts by its length (evaluations).
struct Quantity {
  std::string name;
  std::optional<double> value;               // none: --update fills it in
  std::optional<double> relative, absolute;  // it may move by their sum, absolute + relative |value|
  std::string reason;                        // why these

  bool has_tolerance() const { return relative || absolute; }
  double allowed() const { return absolute.value_or(0) + relative.value_or(0) * std::abs(value.value_or(0)); }
};

struct Baseline {
  /// Reads and checks a file; errors name it and the key.
  static Baseline load(const std::filesystem::path& file);
  /// Writes the file whole or not at all.
  void write() const;

  std::filesystem::path file;
  std::string about, scene, command;
  Json options = Json::object();  // of the command, by their names without dashes
  std::vector<Quantity> quantities;

  /// The scene, whose path counts from the file.
  std::filesystem::path scene_path() const { return file.parent_path() / scene; }
};

/// What a command measured, by the paths of numbers in its summary.
struct Measurement {
  std::vector<std::pair<std::string, double>> numbers;
  std::vector<Quantity> defaults;  // what a new baseline holds, with tolerances from rtol and their reasons

  const double* find(const std::string& name) const;
  /// The tolerances and the reason that `name` gets when its baseline gives none.
  Quantity with_default(const std::string& name) const;

 private:
  friend Measurement measure(const Baseline& baseline, bool quiet, const std::vector<std::string>& overrides);
  Quantity fallback_;
};

/// Runs the command of a baseline as the command line would, without files and without printing. `overrides`: values
/// of the scene, "path=value", which stand over those that the baseline sets.
Measurement measure(const Baseline& baseline, bool quiet, const std::vector<std::string>& overrides = {});

/// The names of the commands a baseline may run.
std::vector<std::string> baseline_commands();

}  // namespace costate::app
