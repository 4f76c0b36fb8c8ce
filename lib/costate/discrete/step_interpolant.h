// The motion between the ends of discrete steps: positions by the quintic through q, v, a at both ends, velocities by
// its derivative, force states by the cubic through z and z'; accelerations and multipliers are solved for.
#pragma once

#include "costate/discrete/discrete_scheme.h"

namespace costate {

class StepInterpolant {
 public:
  explicit StepInterpolant(DiscreteScheme& scheme);

  /// To be called at the start and after each step.
  void advance();
  /// The scheme has begun anew behind a cut.
  void begin_anew() { copy(now_); }
  /// At t within the last step. Valid until the scheme or the interpolant is used again.
  MechanismState at(double t);

  /// In the place of advance(), of a scheme that keeps beginnings: the step just taken, from its beginning.
  void take_step();
  /// (q, v, z) alone, a little behind the step's end as well.
  const double* motion(double t);

 private:
  struct End {
    double t = 0;
    std::vector<double> q, v, a, z, f;
  };
  void copy(End& end) const { copy(scheme_.record(), end); }
  void copy(const StepRecord& r, End& end) const;

  DiscreteScheme& scheme_;
  End before_, now_;
  std::vector<double> y_;  // (q, v, z)
};

}  // namespace costate
