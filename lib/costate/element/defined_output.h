// An output that a scene defines: a formula of other outputs, of numbers and of the time. As an element it has no
// coordinates and no force: it keeps the formula's numbers among those of the mechanism, so that they can be
// parameters.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "costate/element/element.h"
#include "costate/element/path_function.h"

namespace costate {

class DefinedOutput final : public Force, public FormulaElement {
 public:
  /// Most numbers and outputs of one formula.
  static constexpr int kMostNames = 32;

  /// `formula`: of the time, with the numbers first and the values of the outputs `inputs` behind them.
  DefinedOutput(const std::string& name, std::string unit, std::shared_ptr<const FormulaLaw> formula,
                const std::vector<int>& numbers, std::vector<std::string> inputs)
      : Force("output", name), unit_(std::move(unit)), formula_(std::move(formula)), inputs_(std::move(inputs)) {
    append_numbers(numbers);
  }

  const std::string& unit() const { return unit_; }
  const FormulaLaw& formula() const { return *formula_; }
  const std::vector<std::string>& inputs() const { return inputs_; }

  void add_formula_laws(std::vector<MotionLaw>& laws) const override { add_laws_of(*formula_, laws); }

  bool by_hand() const override { return true; }
  void force(const PathDual&, const PathDual*, const PathDual*, const PathDual*, const PathDual*, PathDual*,
             PathDual*) const override {}
  void calc_force(const LocalState&, double*, double*) const override {}
  void calc_partials(const LocalState&, ForcePartials) const override {}
  void calc_number_partial(const LocalState&, int, double*, double*) const override {}
  void add_number_gradient(const LocalState&, const double*, const double*, const int*, int, double*) const override {}

 private:
  std::string unit_;
  std::shared_ptr<const FormulaLaw> formula_;
  std::vector<std::string> inputs_;
};

}  // namespace costate
