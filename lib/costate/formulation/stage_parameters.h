// Systems with terms that vanish on the solution, and in whose derivative by parameters they are left out: the stages
// of a discrete scheme are not on the solution, and the exact derivative of its steps needs them.
#pragma once

namespace costate {

class StageParameters {
 public:
  virtual ~StageParameters() = default;
  /// parameter_columns() and add_parameter_gradient() hold them from here on.
  virtual void take_stage_parameters() = 0;
};

}  // namespace costate
