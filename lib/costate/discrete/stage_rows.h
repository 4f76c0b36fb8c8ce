// The constraint rows of a discrete step's own equations at its stage, and their derivatives:
//   Phi(q)/B of a row that keeps places,   Phid(q, v*)/G of one that keeps rates alone, as what sticks wherever it is
// does,   -(lambda_t + s mu lambda_n) of one along which a contact slides, in space step_slips.h's,   -lambda of one
// that is not there; by a* all of them are Phi_q, but for the turning of what keeps rates, B/G Phid_q
// (step_matrices.h).
#pragma once

#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/discrete/alpha_coefficients.h"
#include "costate/discrete/step_slips.h"
#include "costate/level/acceleration_level.h"

namespace costate {

class StageRows {
 public:
  explicit StageRows(const Assembly& assembly);

  /// Whose rows give where contacts hold one body twice (level/acceleration_level.h): the rows lose lambda/alpha.
  void give_as(const AccelerationLevel& level) { level_ = &level; }
  double inverse_alpha(const Assembly& assembly, int row) const {
    return level_ ? level_->inverse_alpha(row) : assembly.is_there(row) ? 0 : 1;
  }
  /// Derivative blocks at the stage s, those that the rows need among them. Leaves all of these in the assembly.
  void calc(Assembly& assembly, const StateView& s, const StepCoefficients& c);
  /// Whether there may be others than those of places.
  bool keep_rates() const { return any_; }
  /// By q and, of what keeps rates, by v*, on the pattern of the Jacobian.
  const std::vector<double>& by_q() const { return by_q_; }
  const std::vector<double>& by_v() const { return by_v_; }
  /// out (m) := minus the rows, of what calc_dynamics() left at the stage s.
  void subtract(const Assembly& assembly, const StepCoefficients& c, const StateView& s, double* out);
  /// out (m) -= the rows' derivative by parameter j, of the columns at the stage.
  void subtract_columns(const Assembly& assembly, const StepCoefficients& c, const Assembly::ParameterColumns& columns,
                        int j, double* out) const;
  /// Weights s2 (m) of the rows as add_parameter_gradient() has them, within `w`; valid until the next call.
  void weigh(const Assembly& assembly, const StepCoefficients& c, const double* s2, Assembly::ParameterWeights& w);
  /// Those of what slides in space, at the stage of the last calc(), and at the state s where no step leads.
  StepSlips& slips() { return slips_; }
  const StepSlips& slips() const { return slips_; }

 private:
  static bool keeps_rate(const Assembly& assembly, int row) {
    return assembly.is_there(row) && !assembly.holds_position(row);
  }
  bool any_;
  const AccelerationLevel* level_ = nullptr;
  StepSlips slips_;
  std::vector<double> by_q_, by_v_, phi_, phid_, slides_;
};

}  // namespace costate
