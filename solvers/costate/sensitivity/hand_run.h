// Runs hand-derived equations: a forward simulation with dense output, then their own Radau pass along it, with steps
// of its own.
#pragma once

#include "costate/adjoint/hand_equations.h"
#include "costate/formulation/step_plan.h"
#include "costate/integrator/slow_stretches.h"
#include "costate/integrator/trajectory.h"
#include "costate/problem/problem.h"

namespace costate {

struct ForwardMotion {
  Trajectory trajectory;
  double psi = 0;
  Counters counters;
  std::string integrator;
  std::shared_ptr<const StepPlan> plan = {};      // of the run's steps
  int states = 0;                                 // of forces, z
  std::vector<MetEvent> met = {};                 // the events of the mechanism
  MotionEvents::History history = {};             // what decided at them
  std::vector<RunEvent> events = {};              // the same, as they are told
  double told_drift = 0;                          // of its rows, RunWatch::told_drift()
  double stays = 0;                               // of its slips, KnownError::stays
  std::vector<SlowStretches::Stretch> slow = {};  // where it is crossed by maps
};

/// Simulates on the formulation's default (or the chosen) integrator and keeps the motion (q, v, z).
ForwardMotion record_motion(const Problem& problem, const std::vector<double>& rho);

/// Where the motion jumps, at `times` and by itself, and its slow stretches.
std::vector<MotionJump> jumps_of(const ForwardMotion& motion, const std::vector<double>& times);

/// Grid times for a pass along the motion: about one point for every `stride` integrator steps.
std::vector<double> grid_of(const Trajectory& trajectory, std::size_t stride);
/// The grid with further times (within its span) among its points.
std::vector<double> with_times(const std::vector<double>& grid, const std::vector<double>& times);
/// The grid, divided where the motion's laws do something that a pass must not step over.
std::vector<double> with_looks(const std::vector<double>& grid, const ForwardMotion& motion);
/// The grid with its midpoints.
std::vector<double> refined(const std::vector<double>& grid);

/// psi and gradient; of index 3 also the gradient's change in the last refinement (gradient_error).
GradientResult run_hand_equations(const Problem& problem, const std::vector<double>& rho, HandEquations& equations);

}  // namespace costate
