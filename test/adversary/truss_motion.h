// The motion of a truss by means that share nothing with the library: dense matrices written out here, an
// orthogonal decomposition for accelerations (redundant rows do no harm), Dormand and Prince's pair with
// projection after each step, stops at every break of every law. Slow, and independent.
#pragma once

#include <vector>

#include "truss.h"

namespace costate::adversary {

struct Reference {
  bool found = false;  // a start exists and the motion could be followed
  double psi = 0;
  double psi_error = 0;  // what ten times the tolerance makes of it
  std::vector<double> gradient;
  std::vector<double> gradient_error;  // what the last extrapolation of differences changed
  /// The smallest singular value of the constraint Jacobian along the motion, against its largest: near zero
  /// the mechanism passes a position where its motion, or its gradient, is not determined.
  double regularity = 1;
  double speed = 0;  // the largest
};

/// psi alone; not found where the start cannot be assembled or the motion meets a singular position.
Reference follow(const Truss& truss, double tolerance = 1e-11);
/// With the gradient by differences of whole motions, over `part` of steps of 2e-3 of each number.
Reference reference(const Truss& truss, double part = 1);

}  // namespace costate::adversary
