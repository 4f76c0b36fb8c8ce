// Whether a formula of the motion jumps along it: abs(u)/u, atan(1/u). A law that jumps is known by its places and
// refused before a run; what a formula makes of u as u passes zero is not. So the terms that decide are followed from
// look to look: where one changes its sign, the formula is taken on both sides of that, on the straight way between the
// looks. What the instant depends on is in no derivative.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/element/law/formula_law.h"
#include "costate/objective/objective.h"

namespace costate {

class FormulaJumpWatch {
 public:
  /// What looks tell: positions and velocities, or all of the state.
  enum class Looks { motion, whole };
  /// Of forces and of running costs that positions and velocities tell; by whole looks of the other running costs
  /// (accelerations, reactions, force states).
  FormulaJumpWatch(const Mechanism& mechanism, const Objective& objective, Looks looks = Looks::motion);
  bool empty() const { return formulas_.empty(); }

  /// At states of the motion in order of time, with the numbers of the assembly.
  void look(const StateView& s, Assembly& assembly);
  /// Of the first jump that was passed: why no gradient is given, and what to do.
  std::optional<std::string> met() const;

 private:
  struct Formula {
    const FormulaLaw* law;
    std::string owner;
    std::vector<int> numbers;  // in the mechanism, which arguments begin with
    std::function<void(const StateView&, Assembly&, double* x)> arguments;
    double t = 0;
    std::vector<double> x = {}, terms = {};  // at the last look
  };
  struct Jump {
    double t, from, to;
    std::string owner;
  };
  /// Between the last look of the formula and (t, x), where term i has changed its sign.
  void judge(const Formula& formula, std::size_t i, double t, const std::vector<double>& x, const Assembly& assembly);
  std::vector<Formula> formulas_;
  std::optional<Jump> first_;
  /// Looks that are too near the last one to tell the way between them from rounding, as steps across places are.
  bool is_near(double t) const;
  std::vector<double> now_;
  double begin_ = 0, last_ = 0;
  long looks_ = 0;
  FormulaTerms terms_;
};

}  // namespace costate
