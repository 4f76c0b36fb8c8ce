#include "costate/formulation/segmented_system.h"

#include <fmt/format.h>

#include "costate/base/error.h"

namespace costate {

namespace {
[[noreturn]] void refuse_kink(double t, const char* what) {
  throw CapabilityError(
      fmt::format("A driver's law has a kink at t = {:.6g} s, where the velocities jump; {} cannot be carried "
                  "across. Take an IDAS or CVODES method, or a law with a continuous slope.",
                  t, what));
}
}  // namespace

// A jump at a kink is two: that of the velocities, in the mode before, and then, where they are wanted, to other
// coordinates. The state between them is not kept but made again.

void SegmentedDae::jump(double t, double* y, double* yp) {
  if (pending_event_ >= 0) return cross_event(pending_event_, t, y, yp);
  const double t_after = segment_start(t);
  if (t_after != t) {
    cross_kink(t, t_after, y, yp);
    if (!wants_other_coordinates(t_after, y)) return;
  }
  change_coordinates(t_after, y, yp);
}

Jump SegmentedDae::behind_kink(const Jump& jump) {
  Jump next = jump;
  next.t = segment_start(jump.t);
  use_mode(jump.before);
  cross_kink(jump.t, next.t, next.y.data(), next.yp.data());
  return next;
}

void SegmentedDae::jump_tangent(const Jump& jump, double* const* s, double* const* sp, int count) {
  jump_cost_tangent_.clear();
  if (jump.event >= 0) return cross_event_tangent(jump, s, sp, count);
  if (segment_start(jump.t) == jump.t) return change_coordinates_tangent(jump, s, sp, count);
  use_mode(jump.before);
  cross_kink_tangent(jump, segment_start(jump.t), s, sp, count);
  if (jump.after != jump.before) change_coordinates_tangent(behind_kink(jump), s, sp, count);
}

void SegmentedDae::jump_adjoint(const Jump& jump, double* mu, double* mup, double* gradient) {
  if (jump.event >= 0) {
    use_mode(jump.before);
    return cross_event_adjoint(jump, mu, mup, gradient);
  }
  if (segment_start(jump.t) == jump.t) return change_coordinates_adjoint(jump, mu, mup, gradient);
  if (jump.after != jump.before) change_coordinates_adjoint(behind_kink(jump), mu, mup, gradient);
  use_mode(jump.before);
  cross_kink_adjoint(jump, segment_start(jump.t), mu, mup, gradient);
}

void SegmentedDae::cross_kink(double t, double, double*, double*) { refuse_kink(segment_start(t), "this formulation"); }
void SegmentedDae::cross_kink_tangent(const Jump& before, double, double* const*, double* const*, int) {
  refuse_kink(segment_start(before.t), "the tangents of this formulation");
}
void SegmentedDae::cross_kink_adjoint(const Jump& before, double, double*, double*, double*) {
  refuse_kink(segment_start(before.t), "the adjoint of this formulation");
}

void SegmentedOde::jump(double t, double* y) {
  if (pending_event_ >= 0) return cross_event(pending_event_, t, y);
  const double t_after = segment_start(t);
  if (t_after != t) {
    cross_kink(t, t_after, y);
    if (!wants_other_coordinates(t_after, y)) return;
  }
  change_coordinates(t_after, y);
}

Jump SegmentedOde::behind_kink(const Jump& jump) {
  Jump next = jump;
  next.t = segment_start(jump.t);
  use_mode(jump.before);
  cross_kink(jump.t, next.t, next.y.data());
  return next;
}

void SegmentedOde::jump_tangent(const Jump& jump, double* const* s, int count) {
  jump_cost_tangent_.clear();
  if (jump.event >= 0) return cross_event_tangent(jump, s, count);
  if (segment_start(jump.t) == jump.t) return change_coordinates_tangent(jump, s, count);
  use_mode(jump.before);
  cross_kink_tangent(jump, segment_start(jump.t), s, count);
  if (jump.after != jump.before) change_coordinates_tangent(behind_kink(jump), s, count);
}

void SegmentedOde::jump_adjoint(const Jump& jump, double* mu, double* gradient) {
  if (jump.event >= 0) {
    use_mode(jump.before);
    return cross_event_adjoint(jump, mu, gradient);
  }
  if (segment_start(jump.t) == jump.t) return change_coordinates_adjoint(jump, mu, gradient);
  if (jump.after != jump.before) change_coordinates_adjoint(behind_kink(jump), mu, gradient);
  use_mode(jump.before);
  cross_kink_adjoint(jump, segment_start(jump.t), mu, gradient);
}

void SegmentedOde::cross_kink(double t, double, double*) { refuse_kink(segment_start(t), "this formulation"); }
void SegmentedOde::cross_kink_tangent(const Jump& before, double, double* const*, int) {
  refuse_kink(segment_start(before.t), "the tangents of this formulation");
}
void SegmentedOde::cross_kink_adjoint(const Jump& before, double, double*, double*) {
  refuse_kink(segment_start(before.t), "the adjoint of this formulation");
}

}  // namespace costate
