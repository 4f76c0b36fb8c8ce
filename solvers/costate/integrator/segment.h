// What passes between two segments of a trajectory (Jump in formulation/system.h), forward and backward.
#pragma once

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <vector>

#include "costate/analysis/start.h"
#include "costate/event/touch_watch.h"

namespace costate {

/// But for rounding.
inline bool same_time(double a, double b) {
  return std::abs(a - b) <= 8 * std::numeric_limits<double>::epsilon() * std::max(std::abs(a), std::abs(b));
}

/// An integrator starts anew where a step ends that is longer by this than what the plan of steps asks for next. Its
/// formulas hold on to what lies some steps behind: the error of a step of h between points that are H apart is
/// estimated for a motion that was as smooth over H, smaller by (h/H)^k than that of one which begins where the step
/// does.
inline constexpr double kLongAgainstNext = 20;

/// The state that a segment begins with, where it is not the system's own start.
struct SegmentStart {
  double t = 0;
  bool restart = false;                    // nothing jumps
  bool led = false;                        // a clock leads the order (IdaSession)
  TouchLook look;                          // a touch that a step before has passed over
  long steps = 0;                          // taken before
  std::vector<double> y, yp;               // unknowns, psi behind them when it is one; yp of DAE systems
  std::vector<std::vector<double>> s, sp;  // columns of sensitivities of y and yp, or none
  double cost = 0;                         // running part of psi so far
  std::vector<double> cost_gradient;       // and of its gradient, where that is a quadrature
};

/// Of what has just left a gap and comes back after `hop`: by some steps, as integrators that begin anew go straight.
inline void look_at_hop(SegmentStart& start, double t, double hop) {
  if (std::isfinite(hop)) start.look = TouchLook{.from = t, .to = t + hop, .step = hop / 8};
}

/// Is told of each step that an integrator accepts, in order of time.
using StepSink = std::function<void(double t, const double* y)>;

/// The adjoint at one time; mup of DAE systems only.
struct AdjointState {
  std::vector<double> mu, mup;
};

/// A time within a segment at which the adjoint jumps, as psi has a term of the state there; or a stretch, from `t`
/// back to `to`, that is crossed at once (slow_slip.h).
struct AdjointStop {
  double t = 0, to = t;
  // The forward state at `to`, yp of DAE systems; null where nothing jumps but the adjoint's rate: there the way back
  // ends a step and begins anew.
  const double *y = nullptr, *yp = nullptr;
  /// mu behind it becomes mu before it; the gradient gains the term's own dependence on rho.
  std::function<void(AdjointState& mu, std::vector<double>& gradient)> cross;
};

}  // namespace costate
