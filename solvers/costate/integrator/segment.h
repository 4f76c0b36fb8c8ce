// What passes between two segments of a trajectory (Jump in formulation/system.h), forward and backward.
#pragma once

#include <functional>
#include <vector>

namespace costate {

/// The state that a segment begins with, where it is not the system's own start.
struct SegmentStart {
  double t = 0;
  std::vector<double> y, yp;               // unknowns, psi behind them when it is one; yp of DAE systems
  std::vector<std::vector<double>> s, sp;  // columns of sensitivities of y and yp, or none
  double cost = 0;                         // running part of psi so far
  std::vector<double> cost_gradient;       // and of its gradient, where that is a quadrature
};

/// Is told of each step that an integrator accepts, in order of time.
using StepSink = std::function<void(double t, const double* y)>;

/// The adjoint at one time; mup of DAE systems only.
struct AdjointState {
  std::vector<double> mu, mup;
};

}  // namespace costate
