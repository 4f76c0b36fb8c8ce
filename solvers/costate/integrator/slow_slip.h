// The derivative of a stretch of a motion along which a slip in space is slow. Its direction is known to e/|w| there,
// with e the error of what is stored, and an adjoint that lies along it loses (e/|w|)^2 with each step: tangents of all
// states, integrated with the motion, belong to one direction throughout. The stretch is run once more, with them, by
// an explicit scheme whose steps follow |w|, through the stop that ends it if one does (lib/README.md (19.12)); from
// where a slip begins from rest, which is stiff, by slip_steps.h.
#pragma once

#include "costate/adjoint/motion_jump.h"
#include "costate/event/motion_events.h"
#include "costate/integrator/slip_steps.h"
#include "costate/level/velocity_jump.h"
#include "costate/objective/objective.h"

namespace costate {

/// A stretch, and the state (q, v, z) on either side.
struct SlowStretch {
  double begin = 0, end = 0;
  int stop = -1;          // the event at its end, behind which `after` is; or none
  double last_speed = 0;  // |w| before that
  bool from_rest = false;
  std::vector<double> before, after;
};

class SlowSlip : private SlipSystem {
 public:
  /// With the numbers that the assembly of the run has, and what decides at its events.
  /// `redundant`: constraints are those of the augmented Lagrangian, which may depend on each other.
  SlowSlip(const Assembly& of_run, const Objective& objective, const MotionEvents::History& history, bool redundant);

  /// Throws CapabilityError where the motion does not stop as the run's did.
  StretchMap map(const SlowStretch& stretch, double rtol);

 private:
  /// (x, psi), then their tangents by x and by the parameters.
  using Columns = Eigen::MatrixXd;
  /// At a stretch's beginning, where S = 1.
  Columns start(const double* x) const;
  Columns column_rates(double t, const Columns& Y);
  /// Of the step of h from (t, Y), in units of the tolerance; `next` behind it, `ks` its stages.
  double step(double t, double h, const Columns& Y, double speed, double rtol, Columns& next, std::vector<Columns>& ks);
  /// Until |w| falls to `slowest`, or, with none, the stretch ends: false where |w| grows again before.
  bool run(const SlowStretch& stretch, double slowest, double rtol, double& t, Columns& Y);
  void cross(int event, double t, Columns& Y);
  StretchMap map_from_rest(const SlowStretch& stretch, double rtol);
  const Assembly& assembly() const override { return assembly_; }
  int state_size() const override { return size_; }
  void rates(double t, const double* x, Eigen::VectorXd& f, Eigen::MatrixXd& A) override;
  void changes(double t, const double* x, const Eigen::MatrixXd& S, std::vector<Eigen::MatrixXd>& all) override;
  double slip(double t, const double* x) override;
  double parts_of_slips(const double* x) const override;
  MotionEvents::Side side(const StateView& s);

  Assembly assembly_;
  const Objective& objective_;
  AccelerationLevel level_;
  VelocityJump velocity_jump_;
  MotionEvents events_;
  Assembly::ParameterColumns columns_;
  ScalarGradient cost_;
  double span_ = 0;
  /// Where they were evaluated last: what the rates of psi's columns are the sums of, and psi' by reactions.
  Eigen::RowVectorXd psi_parts_;
  double psi_by_reactions_ = 0;
  int n_, m_, nz_, np_, size_;  // size_ of x
};

}  // namespace costate
