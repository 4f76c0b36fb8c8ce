// Systems whose trajectories consist of segments. Two things end one: a kink in a driver's law, where the velocities
// jump (impulse_jump.h), and what a formulation asks for itself (other independent coordinates). This layer composes
// both, so that a formulation that adds jumps of its own cannot lose the kinks: it says how it crosses a kink, or that
// is refused by name.
#pragma once

#include "costate/formulation/system.h"

namespace costate {

/// Base: DaeSystem or OdeSystem.
template <class Base>
class SegmentedSystem : public Base {
 public:
  using Base::Base;

  bool may_jump() const final { return System::may_jump() || changes_coordinates(); }
  bool segment_ends(double t, const double* y) final {
    const bool other = wants_other_coordinates(t, y);
    return System::segment_ends(t, y) || other;
  }

 protected:
  /// Whether the formulation has jumps of its own, to other coordinates.
  virtual bool changes_coordinates() const { return false; }
  /// As segment_ends(), for such a jump.
  virtual bool wants_other_coordinates(double, const double*) { return false; }
};

class SegmentedDae : public SegmentedSystem<DaeSystem> {
 public:
  using SegmentedSystem::SegmentedSystem;

  /// At a kink the jump of the velocities, in the mode before, then to other coordinates where they are wanted.
  void jump(double t, double* y, double* yp) final;
  void jump_tangent(const Jump& jump, double* const* s, double* const* sp, int count) final;
  void jump_adjoint(const Jump& jump, double* mu, double* mup, double* gradient) final;

 protected:
  // The kink of a driver between the instants before.t and t_after, in the mode in force, as the jumps of DaeSystem.
  virtual void cross_kink(double t, double t_after, double* y, double* yp);
  virtual void cross_kink_tangent(const Jump& before, double t_after, double* const* s, double* const* sp, int count);
  virtual void cross_kink_adjoint(const Jump& before, double t_after, double* mu, double* mup, double* gradient);
  // An event of the mechanism's own, in the mode in force; for formulations that carry_events().
  virtual void cross_event(int, double, double*, double*) {}
  virtual void cross_event_tangent(const Jump&, double* const*, double* const*, int) {}
  virtual void cross_event_adjoint(const Jump&, double*, double*, double*) {}
  // The formulation's own jump, for those that may ask for one.
  virtual void change_coordinates(double, double*, double*) {}
  virtual void change_coordinates_tangent(const Jump&, double* const*, double* const*, int) {}
  virtual void change_coordinates_adjoint(const Jump&, double*, double*, double*) {}

 private:
  /// The jump to other coordinates that follows the kink in `jump`.
  Jump behind_kink(const Jump& jump);
};

class SegmentedOde : public SegmentedSystem<OdeSystem> {
 public:
  using SegmentedSystem::SegmentedSystem;

  void jump(double t, double* y) final;
  void jump_tangent(const Jump& jump, double* const* s, int count) final;
  void jump_adjoint(const Jump& jump, double* mu, double* gradient) final;

 protected:
  virtual void cross_kink(double t, double t_after, double* y);
  virtual void cross_kink_tangent(const Jump& before, double t_after, double* const* s, int count);
  virtual void cross_kink_adjoint(const Jump& before, double t_after, double* mu, double* gradient);
  virtual void cross_event(int, double, double*) {}
  virtual void cross_event_tangent(const Jump&, double* const*, int) {}
  virtual void cross_event_adjoint(const Jump&, double*, double*) {}
  virtual void change_coordinates(double, double*) {}
  virtual void change_coordinates_tangent(const Jump&, double* const*, int) {}
  virtual void change_coordinates_adjoint(const Jump&, double*, double*) {}

 private:
  Jump behind_kink(const Jump& jump);
};

}  // namespace costate
