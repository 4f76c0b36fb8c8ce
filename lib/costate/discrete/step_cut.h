// Where a run by fixed steps ends one before its time: at an event, at the kink of a law, or where the run itself ends.
// The step is as long as it has to be for the guard (the distance of what ends the run) to be zero at the step's own
// end, and the scheme begins anew behind it (lib/README.md (9.9) to (9.12)). The time t* of the cut follows the
// parameters; with E the derivative of what the step hands on by its length, its end moving along, and L that of the
// next step at a fixed end (step_length.h),
//   dt* = -(h_x dx + h_rho drho)/hdot,   hdot = h_t + h_x E      dx the change at a fixed length
//   dx- = dx + E dt*,   dx+ = G_x dx- + G_t dt* + G_rho drho,    and of the next step's end - L dt*
// (of a slip in space that begins from rest G moves the direction sigma = lambda_t/|lambda_t| of the rates behind)
//   dpsi = (c - c+) dt*,   c = (g at the step's beginning + g at its end)/2, c+ that of the next one
// Cuts in one instant have no step between them, but the instant itself, whose E and L are the motion's rates.
#pragma once

#include "costate/discrete/discrete_adjoint.h"
#include "costate/discrete/discrete_tangent.h"

namespace costate {

struct StepCut {
  enum class Kind { event, kink, end };
  Kind kind = Kind::event;
  int event = -1;
  std::string name;
  long index = 0;        // of the step that ends there
  bool instant = false;  // since the cut before
  double t_after = 0;
  std::vector<double> before, after;            // records; none behind the end
  double length_before = 0, length_behind = 0;  // of the steps on either side
  // Of runs that are differentiated:
  StepColumn by_end, next_by_beginning;  // E, L
  ScalarGradient condition;              // what is zero there
  double condition_rate = 0;             // hdot
  std::vector<double> by;                // of a kink: dt*/drho; empty where it stays
  double cost_rate = 0;                  // dpsi/dt* by lengths and time alone
  int begins_from_rest = -1;             // the normal row of a contact that begins to slide in space
};

/// Derivatives across cuts; the scheme's present record is that before the cut, or behind it, as said.
class CutCrossing {
 public:
  explicit CutCrossing(DiscreteScheme& scheme) : scheme_(scheme) {}

  /// What is zero at an event, whose records are there: sets condition and its rate. Throws SolverError where it is
  /// grazed, and where there is no derivative.
  void linearize_event(StepCut& cut);
  /// condition_rate of a condition that depends on time by `by_time`. Throws SolverError where it is grazed.
  static void set_rate(StepCut& cut, double t, double by_time);

  /// dt*, before the cut.
  Eigen::RowVectorXd time_change(const StepCut& cut, const DiscreteTangent& tangent) const;
  /// The tangent before the cut becomes that behind it, where the scheme is and begins anew; behind linearize_event().
  void pass(const StepCut& cut, const Eigen::RowVectorXd& dt, DiscreteTangent& tangent);
  /// The bars behind the cut become those before it. The scheme is behind it, and comes to be before it. Returns the
  /// weight of the time.
  double pass_back(const StepCut& cut, DiscreteAdjoint& adjoint);
  /// What the time of the cut weighs is given to what it depends on, before the cut.
  static void give_time(const StepCut& cut, double weight, DiscreteAdjoint& adjoint);

 private:
  MotionEvents::Side side(const std::vector<double>& record) const;
  double guard_gradient(const StepCut& cut, ScalarGradient& out);

  DiscreteScheme& scheme_;
  ScalarGradient again_;
};

}  // namespace costate
