// What the ground below a tyre means to runs, whatever the tyre's model: the features that come along it, the law of
// its profile, the times at which a post jumps, and the gap, below zero where the tyre is pressed.
#pragma once

#include <utility>
#include <vector>

#include "costate/element/element.h"
#include "costate/element/force/tyre_wrench.h"
#include "costate/element/gap_element.h"
#include "costate/element/law/motion_law.h"

namespace costate {

class TyreGround : public CourseElement, public MotionLawElement, public GapElement {
 public:
  explicit TyreGround(TyreSetup setup) : setup_(std::move(setup)) {}

  void add_course(const double* p, Course& course) const override;
  int tracks() const override { return setup_.road->kind() == Road::Kind::profile ? 1 : 0; }
  void add_track(int, const double* p, Course& course) const override;
  void add_motion_laws(std::vector<MotionLaw>& laws) const override {
    setup_.road->add_motion_laws(TyreNumbers::road, laws);
  }
  void add_force_jumps(const double* p, std::vector<double>& times) const override;
  void add_time_slopes(double t, const double* p, double* by) const override;
  /// Of the wheel's centre, whatever part of the road the contact takes.
  CourseElement::Place track_place(int, const LocalState& s) const override;

  /// What may pull has no gap.
  int gap_count() const override { return setup_.bilateral ? 0 : 1; }
  /// The deflection it lacks, as the tyre's contact has it.
  GapMotion gap_motion(int, const LocalState& s) const override;
  bool gap_presses(int, const double*) const override { return true; }
  int gap_of_guard(int) const override { return -1; }
  /// The touch, the end of the damper's ramp, and where the normal force would pull.
  bool tells_bends() const override { return !setup_.bilateral; }
  void add_bends(const LocalState& s, std::vector<double>& beyond) const override;

 protected:
  TyreSetup setup_;
};

}  // namespace costate
