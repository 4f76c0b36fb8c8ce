// The watch over one run (analysis/motion_watch.h), fed with the steps that an integrator accepts; its errors end the
// run, its warnings are notices (base/notice.h).
#pragma once

#include "costate/analysis/motion_watch.h"
#include "costate/analysis/own_jump_watch.h"
#include "costate/event/grazing_watch.h"
#include "costate/event/idle_contact_watch.h"
#include "costate/event/slip_offset_watch.h"
#include "costate/integrator/adjoint_growth.h"
#include "costate/integrator/adjoint_invariant.h"
#include "costate/integrator/open_costs.h"
#include "costate/integrator/segment.h"
#include "costate/integrator/stabilization_watch.h"
#include "costate/problem/problem.h"

namespace costate {

class RunWatch {
 public:
  RunWatch(const Problem& problem, const std::vector<double>& rho, System& system);

  /// The run's start, each accepted step, its end; y in the system's terms.
  void begin(double t, const double* y) {
    look(&MotionWatch::begin, t, y);
    look_at_contacts(t, y);
    look_for_own_jumps(t, y);
  }
  StepSink sink();
  /// A state between steps that the run hands out.
  void sample(double t, const double* y) {
    if (stabilization_) stabilization_->look(t, y);
  }
  /// at_event: an event ends the run, and tells on which side of it.
  void finish(double t, const double* y, bool at_event = false);
  /// Tells what was noticed, by which the result's known error grows, and refuses a psi or a gradient that is no
  /// number.
  void conclude(Simulation& result) const;
  void conclude(GradientResult& result) const;
  /// Tells what the motion met, where no result comes of it: a way back that fails behind a singular position.
  void tell_of_motion() const;
  /// The drift that is given notice of, in parts of a row's length, or 0.
  double told_drift() const { return watch_.told_drift(); }
  /// The part of its tolerances with which the run would have to be repeated for its gradient to be as good as is
  /// expected at rtol `asked`: 1 unless the largest scaled derivative is small against what errors of the size of the
  /// tolerances change psi by.
  double resolving_part(const GradientResult& result, const AdjointGrowth& growth, double asked) const;
  /// Whether psi and its gradient have digits, by what the adjoint says of errors of the size of the tolerance: a
  /// notice where they are few, SolverError where there is none. And whether the adjoint kept what it must keep: else a
  /// notice.
  void judge(GradientResult& result, const AdjointGrowth& growth, const AdjointInvariant& invariant) const;

 private:
  void look(void (MotionWatch::*what)(double, const double*, const double*), double t, const double* y);
  void look_at_contacts(double t, const double* y);
  void look_for_own_jumps(double t, const double* y);
  MotionWatch watch_;
  GrazingWatch grazing_;
  SlipOffsetWatch offsets_;
  IdleContactWatch idle_;
  FormulaJumpWatch formulas_;  // of costs on accelerations, reactions, force states
  OwnJumpWatch own_jumps_;
  System& system_;
  const Problem& problem_;
  OpenCosts open_costs_;
  long steps_ = 0;
  std::unique_ptr<StabilizationWatch> stabilization_;  // or null
};

/// The largest drift of a row in parts of its own length, or of its rate in such parts a second, of this thread's last
/// run under a watch.
double last_drift();

/// What psi may be off by as bounces that died out were not seen.
double cost_unseen(const std::vector<RunEvent>& events);
/// And its scaled derivatives: how long the bounces take goes with what each leaves to the power of their number.
double gradient_unseen(const std::vector<RunEvent>& events);

/// Gives notice of a gradient whose run would have to be repeated with this part of its tolerances.
void tell_unresolved(const Problem& problem, GradientResult& result, double part);

/// Throws SolverError naming what is not finite.
void require_finite(const Simulation& result);
void require_finite(const Problem& problem, const GradientResult& result);

}  // namespace costate
