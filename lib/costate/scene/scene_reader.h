// Turns the tree of a scene file into a mechanism, its cost and settings. The parts of a Scene, before they
// are one.
#pragma once

#include <optional>

#include "costate/scene/cost_kind.h"
#include "costate/scene/scene.h"
#include "costate/scene/scene_kind.h"
#include "costate/scene/scene_node.h"

namespace costate {

class SceneReader {
 public:
  explicit SceneReader(const SceneNode& root) : root_(root), table_(root) {}

  void read();
  /// At the place of the error's subject, else where read() has come to.
  SceneError located(const ModelError& e, const std::string& file_name) const;

  std::string title, description;
  RunSettings run;
  FormulationOptions formulation;
  OptimizeSettings optimize;
  std::optional<CycleSettings> cycle;
  std::vector<CaseSettings> cases;
  std::shared_ptr<const Mechanism> mechanism;
  Objective objective;
  std::vector<SceneConstraint> constraints;

 private:
  struct Entry {  // a table [kind.NAME]
    const SceneKind* kind;
    std::string name;
    SceneTable table;
    ScenePhase phase;
    SourceLocation where;
  };
  void check_top_level() const;
  void read_gravity();
  void collect_entries();
  void read_entries();
  void read_start();
  void read_parameters();
  /// [run] ends_when, whose level may be a parameter: before those.
  void read_end();
  /// In cycle_reader.cpp; the level of a crossing may be a parameter, too.
  void read_cycle();
  /// In case_reader.cpp; what they name is loaded by Scene.
  void read_cases();
  void read_run();
  void read_formulation();
  void read_optimize();
  void build();
  void check_outputs();

  const SceneNode& root_;
  SceneTable table_;
  MechanismBuilder builder_;
  std::vector<Entry> entries_;
  std::optional<SourceLocation> here_;  // the table being read
  CostPlan cost_;
  struct PlannedConstraint {
    std::string name;
    double upper;
    CostPlan cost;
  };
  std::vector<PlannedConstraint> planned_constraints_;
};

/// Throws SceneError for what cannot be a name in paths.
void check_name(const SceneTable& table, const std::string& name);
/// Where a dotted path stands: its value, or the deepest table on the way to it that belongs to it alone.
std::optional<SourceLocation> locate_path(const SceneNode& root, const std::string& path);
/// Writes a number over an existing value, keeping its place, or adds it.
void set_number(SceneNode& root, const std::string& path, double value);
/// The same for the numbers of all parameters at the values rho; linear in their number, however many keys a table has.
/// Parameters of the scene that are not selected, and whose numbers no longer agree, are left out.
void set_parameters(SceneNode& root, const Mechanism& mechanism, const ParameterSelection& selection,
                    const std::vector<double>& rho);

}  // namespace costate
