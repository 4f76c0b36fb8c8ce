// Where a stored motion jumps, as hand-derived equations are carried across: at kinks of drivers, where parameters move
// the time of a jump of the accelerations, and at events of the mechanism; and stretches of it along which tangents and
// adjoints do not follow what is stored, whose map is known otherwise.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

namespace costate {

/// An event (event/motion_events.h) that the motion meets.
struct MetEvent {
  double t = 0;
  int event = -1;
  std::vector<double> qvz;  // the state before it
};

/// What a motion does from one state to a later one, behind the event that ends the stretch if one does,
/// differentiated:
///   dx+ = X (dx, drho),   dpsi = c^T (dx, drho) of psi's running part,   x = (q, v, z)
struct StretchMap {
  std::vector<double> before, after;  // x and x+
  Eigen::MatrixXd X;                  // rows of x+, columns of x, then of the parameters
  Eigen::VectorXd c;

  Eigen::Index size() const { return X.rows(); }
  /// Columns dx, one a parameter, become dx+; the gradient gains dpsi.
  void push(Eigen::MatrixXd& dx, Eigen::VectorXd& gradient) const;
  /// Weights w of dx+ become those of dx; the gradient gains theirs of drho, and psi's of both.
  void pull(double* w, double* gradient) const;
};

/// One place of a motion: `before` is the last instant before it, `after` the first one behind it.
struct MotionJump {
  double before = 0, after = 0;
  std::vector<MetEvent> events;                // of one instant, in their order; none: what a law of time does there
  std::shared_ptr<const StretchMap> map = {};  // or it is a stretch
};

/// All such places within t_start < t < t_end (events also at t_start), in order: at `times`, and the events.
std::vector<MotionJump> motion_jumps(const std::vector<double>& times, const std::vector<MetEvent>& events);

/// The grid without the points within stretches.
std::vector<double> outside_stretches(std::vector<double> grid, const std::vector<MotionJump>& jumps);

/// The grid with the instants before the jumps among its points, and those behind stretches, within which it has none;
/// a point of its own so near to one that a step between them would be lost in rounding gives way.
std::vector<double> with_jumps(const std::vector<double>& grid, const std::vector<MotionJump>& jumps);

}  // namespace costate
