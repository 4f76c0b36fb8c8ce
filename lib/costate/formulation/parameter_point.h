// Systems that need less for products with F_rho than for those with F_y.
#pragma once

namespace costate {

class ParameterPoint {
 public:
  virtual ~ParameterPoint() = default;
  /// Prepares add_parameter_gradient() alone, at a point as linearize() has it.
  virtual void go_to_parameters(double t, const double* y, const double* yp) = 0;
};

}  // namespace costate
