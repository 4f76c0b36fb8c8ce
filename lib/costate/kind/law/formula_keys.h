// What stands beside a formula in its table: numbers by their names, and laws, which it calls as functions of one
// argument: cx = { kind = "data", ... } and formula = "q*cx(wing.angle)"; maps (map_keys.h) are functions of two.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "costate/element/law/formula_law.h"
#include "costate/kind/law/law_options.h"
#include "costate/kind/law/map_keys.h"
#include "costate/scene/scene_table.h"

namespace costate {

struct FormulaKeys {
  std::vector<std::pair<std::string, double>> numbers;
  std::vector<std::pair<std::string, LawOptions>> laws;
  std::vector<std::pair<std::string, MapOptions>> maps = {};
};

/// All keys of the table but these.
FormulaKeys read_formula_keys(SceneTable& table, const std::vector<std::string>& others);

/// Parses the formulas of one element with its keys. Numbers of laws are among those of the formula, behind its own.
class FormulaReader {
 public:
  /// `path` of the element. Throws ModelError at a law that jumps or has the name of another function.
  FormulaReader(std::string path, const FormulaKeys& keys);
  /// The formula under `key`; names that are no keys are appended to `others`, as its arguments behind the numbers.
  /// Throws ModelError, also where there are more numbers and others than `most`.
  std::shared_ptr<const FormulaLaw> read(const std::string& formula, const std::string& key,
                                         std::vector<std::string>& others, std::size_t most);
  /// Throws ModelError at a key that no formula holds.
  void require_used() const;
  /// Their indices in the mechanism, in the order of the formulas' arguments.
  std::vector<int> add_numbers(MechanismBuilder& builder) const;

 private:
  void require_own_name(const std::string& function) const;
  std::string path_;
  std::vector<std::pair<std::string, double>> numbers_;
  std::size_t own_;  // of the numbers, those that are keys
  std::vector<FormulaFunction> functions_;
  std::vector<bool> used_, called_;
};

}  // namespace costate
