// A scene file: a mechanism, its cost and how to run it, in TOML. Every mistake in it is a SceneError with
// file:line:column; loading, dumping and loading again gives the same scene bit for bit.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "costate/base/error.h"
#include "costate/mechanism/mechanism.h"
#include "costate/objective/objective.h"
#include "costate/scene/cycle_settings.h"
#include "costate/scene/scene_case.h"
#include "costate/scene/scene_settings.h"

namespace costate {

struct SceneNode;

/// A bound on a second cost: [[optimize.constraint]].
struct SceneConstraint {
  std::string name;
  double upper = 0;
  Objective objective;
};

class Scene {
 public:
  /// Overrides are "path=value", applied in order before anything is checked: "run.rtol=1e-10",
  /// "start.given=['P2.x', 'P2.y']"; a bare word is a string.
  static Scene load(const std::string& path, const std::vector<std::string>& overrides = {});
  static Scene parse(const std::string& text, const std::string& file_name,
                     const std::vector<std::string>& overrides = {});

  std::string title, description;
  RunSettings run;
  FormulationOptions formulation;
  OptimizeSettings optimize;
  std::optional<CycleSettings> cycle;
  /// Of [[case]], each with its scene; such a scene is a design, which runs of one scene alone refuse.
  std::vector<SceneCase> cases;

  /// Throws Error where there is no case of that name, or none at all.
  const SceneCase& find_case(const std::string& name) const;

  const std::string& file_name() const { return file_name_; }
  std::shared_ptr<const Mechanism> mechanism() const { return mechanism_; }
  const Objective& objective() const { return objective_; }
  const std::vector<SceneConstraint>& constraints() const { return constraints_; }

  /// The scene as TOML text, in the order of the file and without its comments.
  std::string dump() const;

  /// Where a dotted path ("spring.S1.preload_N", "start") stands in the file: that value, else its table.
  SourceLocation locate(const std::string& path) const;
  /// An error of the mechanism, such as an unreachable start, at its place in the file.
  SceneError located(const ModelError& error) const;

  /// The same scene with one value replaced or added, read again.
  Scene with_override(const std::string& path, const std::string& value) const;
  /// The same of several, of which nothing is checked before all are there; of none: the scene as it is.
  Scene with_overrides(const std::vector<std::pair<std::string, std::string>>& values) const;
  Scene with_number(const std::string& path, double value) const;
  /// The same scene with the values rho written to all numbers that the parameters are bound to.
  Scene with_parameters(const ParameterSelection& selection, const std::vector<double>& rho) const;

 private:
  Scene() = default;
  static Scene read(std::shared_ptr<const SceneNode> root, const std::string& file_name);
  void load_cases(std::vector<CaseSettings> settings);

  std::string file_name_;
  std::shared_ptr<const SceneNode> root_;
  std::shared_ptr<const Mechanism> mechanism_;
  Objective objective_;
  std::vector<SceneConstraint> constraints_;
};

}  // namespace costate
