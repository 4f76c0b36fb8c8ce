// A driver who follows a path: looks ahead from a point P of the vehicle, steers against the lateral error seen there
// and against the yaw rate, and moves the steering (a coordinate s, such as a rack's displacement) with the lags of
// decision and arm through a spring and damper, the arm's and column's compliance:
//   h = A x^,  e = path(x_P + L h_x) - (y_P + L h_y),  r = yaw rate,
//   z1' = (-(K e) + D r - z1) / tau1,  z2' = (z1 - z2) / tau2,  F_s = k (z2 - s) + c (z2' - sd).
// A positive s steers to the right. The steering follows states, so that no constraint depends on velocities, and
// everything is as smooth as the path.
// Coordinates: those of P (a rigid body's), s. Numbers: K, D, L, tau1, tau2, k, c, z1(0), z2(0), the point's, the
// path's.
#pragma once

#include <memory>

#include "costate/element/course.h"
#include "costate/element/element.h"
#include "costate/element/jumping_force.h"
#include "costate/element/law/motion_law.h"
#include "costate/element/point/spatial_point.h"

namespace costate {

class PathDriver final : public ForceOf<PathDriver>,
                         public CourseElement,
                         public MotionLawElement,
                         public JumpingForce {
 public:
  enum Number { gain, yaw_gain, preview, decision_lag, arm_lag, stiffness, damping, command, steering, own_numbers };

  PathDriver(std::string name, SpatialPoint point, int coordinate, std::shared_ptr<const ScalarLaw> path,
             const std::vector<int>& own, const std::vector<int>& path_numbers);

  int states() const override { return 2; }
  std::string state_name(int i) const override { return i == 0 ? "command" : "steering"; }
  std::string state_unit(int) const override { return "m"; }
  int initial_state_number(int i) const override { return i == 0 ? command : steering; }

  template <class S>
  void physics(const S&, const S* q, const S* v, const S* z, const S* p, S* Q, S* zdot) const {
    const int s = point_.size();
    zdot[0] = (p[yaw_gain] * yaw_rate(q, v) - p[gain] * error(q, p) - z[0]) / p[decision_lag];
    zdot[1] = (z[0] - z[1]) / p[arm_lag];
    Q[s] = p[stiffness] * (z[1] - q[s]) + p[damping] * (zdot[1] - v[s]);
  }

  int tracks() const override { return 1; }
  void add_track(int, const double* p, Course& course) const override { course.add(*path_, p + own_numbers + 3); }
  Place track_place(int, const LocalState& s) const override;
  void add_motion_laws(std::vector<MotionLaw>& laws) const override {
    laws.push_back({path_.get(), own_numbers + 3, "path"});
  }
  /// Where it steers away from the path.
  void add_jump_places(const LocalState& s, bool fixed_steps, std::vector<JumpPlace>& places) const override;
  bool by_hand() const override { return true; }
  void calc_partials(const LocalState& s, ForcePartials out) const override;

  std::vector<Measure> measures() const override {
    return {{"lateral_error", "m", false}, {"force", "N", false}, {"path_offset", "m", false}};
  }
  PathDual measure(int i, const MeasureArguments& x) const override;

  double potential_energy(const LocalState&) const override { return 0; }

 private:
  /// Of the path from the point seen ahead, to the left.
  template <class S>
  S error(const S* q, const S* p) const {
    S r[3], h[3];
    const S forward[3] = {S(1.0), S(0.0), S(0.0)};
    point_.position(q, p + own_numbers, r);
    rotated(q + SpatialPoint::curvature_index, forward, h);
    return path_->value(r[0] + p[preview] * h[0], p + own_numbers + 3) - r[1] - p[preview] * h[1];
  }
  template <class S>
  static S yaw_rate(const S* q, const S* v) {
    S w[3];
    global_rate(q + SpatialPoint::curvature_index, v + SpatialPoint::curvature_index, w);
    return S(2.0) * w[2];
  }

  SpatialPoint point_;
  std::shared_ptr<const ScalarLaw> path_;
};

}  // namespace costate
