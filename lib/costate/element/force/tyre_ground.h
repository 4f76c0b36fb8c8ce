// What the ground below a tyre means to runs, whatever the tyre's model: the features that come along it, the law of
// its profile, the times at which a post jumps, the gap, below zero where the tyre is pressed, and where the contact
// ends:
//   disc                 n.e_z = cos(camber) = 0: the wheel lies flat, and the loaded radius is without bound
//   source, vertical     the contact point is the centre - (d / (H^2 e_z,z)) e_z: on a slope e_z,z vanishes before
//                        n.e_z does, and below zero the point is above the centre
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "costate/element/complaint.h"
#include "costate/element/element.h"
#include "costate/element/force/tyre_wrench.h"
#include "costate/element/gap_element.h"
#include "costate/element/jumping_force.h"
#include "costate/element/law/motion_law.h"

namespace costate {

class TyreGround : public CourseElement,
                   public MotionLawElement,
                   public GapElement,
                   public ComplainingElement,
                   public JumpingForce {
 public:
  explicit TyreGround(TyreSetup setup) : setup_(std::move(setup)) {}

  void add_course(const double* p, Course& course) const override;
  int tracks() const override { return setup_.road->kind() == Road::Kind::profile ? 1 : 0; }
  void add_track(int, const double* p, Course& course) const override;
  void add_motion_laws(std::vector<MotionLaw>& laws) const override {
    setup_.road->add_motion_laws(TyreNumbers::road, laws);
  }
  void add_force_jumps(const double* p, std::vector<double>& times) const override;
  /// Of a damped tyre, which holds the rate of a post's height.
  void add_force_bends(const double* p, std::vector<double>& times) const override;
  void add_time_slopes(double t, const double* p, double* by) const override;
  /// Of the wheel's centre, whatever part of the road the contact takes.
  CourseElement::Place track_place(int, const LocalState& s) const override;

  /// What may pull has no gap.
  int gap_count() const override { return setup_.bilateral ? 0 : 1; }
  /// The deflection it lacks, as the tyre's contact has it.
  GapMotion gap_motion(int, const LocalState& s) const override;
  bool gap_presses(int, const double*) const override { return true; }
  double gap_force(int, const LocalState& s) const override { return unclipped_force(s, geometry(s)); }
  int gap_of_guard(int) const override { return -1; }
  /// The touch, the end of the damper's ramp, and where the normal force would pull.
  bool tells_bends() const override { return !setup_.bilateral; }
  void add_bends(const LocalState& s, std::vector<double>& beyond) const override;
  /// The touch, where the damper sets in at once or over a deflection that no run tells from that: measured on a
  /// quarter car that lands at 1 m/s, adjoints are right from a ramp of 1e-5 m on.
  void add_jump_places(const LocalState& s, bool fixed_steps, std::vector<JumpPlace>& places) const override;

  /// Of a tyre that is pressed: a camber beyond 60 degrees, a contact point further from the centre than three radii.
  void add_complaints(const LocalState& s, std::vector<std::string>& said) const override;

 protected:
  TyreGeometry<double> geometry(const LocalState& s) const;
  /// Towards a wheel that lies flat the loaded radius, and with it the force, grows without bound: no step leads
  /// through. `places`: whether the force depends on the contact point of "source" and "vertical".
  bool is_singular(const TyreGeometry<double>& g, bool places) const {
    if (lies_flat(g)) return true;
    return places && setup_.contact != TyreContact::disc && !setup_.road->level() && g.ez[2] <= kFlat;
  }
  [[noreturn]] void throw_singular(const std::string& tyre, double t, const TyreGeometry<double>& g) const;
  TyreSetup setup_;

 private:
  /// Of spring and damper, before it is cut off where it would pull.
  double unclipped_force(const LocalState& s, const TyreGeometry<double>& g) const;
  static constexpr double kFlat = 1e-3;    // a cosine
  static constexpr double kAtOnce = 3e-5;  // of the radius
  static bool lies_flat(const TyreGeometry<double>& g) { return std::abs(dot3(g.n, g.ez)) <= kFlat; }
};

}  // namespace costate
