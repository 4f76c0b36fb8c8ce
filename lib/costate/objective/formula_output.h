// An output that the scene defines by a formula of others (element/defined_output.h), with its derivatives by the chain
// rule: those of the formula by path duals, those of the other outputs their own.
#pragma once

#include <memory>
#include <vector>

#include "costate/element/course.h"
#include "costate/element/defined_output.h"
#include "costate/objective/output.h"

namespace costate {

class FormulaOutput final : public Output {
 public:
  /// `inputs` in the order of the definition, which belongs to the mechanism and must outlive this.
  FormulaOutput(const DefinedOutput& definition, std::vector<std::unique_ptr<Output>> inputs);

  double value(const StateView& s, Assembly& assembly) const override;
  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const override;
  bool needs_accelerations() const override { return accelerations_; }
  std::optional<std::vector<int>> depends_on() const override;
  double change(const StateView& s, Assembly& assembly, const Variation& d) const override;
  void add_gradient_change(const StateView& s, Assembly& assembly, const Variation& d, double factor,
                           ScalarGradient& g) const override;

  /// What the formula itself does along time, with the mechanism's numbers; not what its inputs do.
  void add_course(const std::vector<double>& numbers, Course& course) const;
  const DefinedOutput& definition() const { return definition_; }
  /// The formula's arguments at a state, its numbers and the values of the outputs; where the state has no
  /// accelerations those that need them are one.
  void arguments(const StateView& s, Assembly& assembly, double* x) const;
  const std::vector<std::unique_ptr<Output>>& inputs() const { return inputs_; }
  /// The value if input i were larger by `shift`.
  double shifted_value(const StateView& s, Assembly& assembly, std::size_t i, double shift) const;

 private:
  struct Arguments;
  const DefinedOutput& definition_;
  std::vector<std::unique_ptr<Output>> inputs_;
  bool accelerations_ = false;
};

/// The output of a definition. Throws ModelError at its formula where it names no output of the mechanism, or itself.
std::unique_ptr<Output> make_formula_output(const Mechanism& mechanism, const DefinedOutput& definition);

class CostTerm;

/// The formulas that a term's output and target are, or are made of; or an output.
std::vector<const FormulaOutput*> formulas_of(const CostTerm& term);
std::vector<const FormulaOutput*> formulas_of(const Output& output);

}  // namespace costate
