// Where along a run slips in space are slow (slow_slip.h): from the last step with |w| above a part of the largest that
// the slip has had, until it stops, the session ends, or it is faster again; and from where a slip begins from rest
// until it is above such a part of the largest that follows, and well above errors. A stretch does not go beyond its
// session, nor over a sample.
#pragma once

#include <memory>
#include <vector>

#include "costate/formulation/system.h"
#include "costate/integrator/slow_slip.h"

namespace costate {

class SlowStretches {
 public:
  struct Stretch : SlowStretch {
    std::size_t session = 0;
    int mode = 0, mode_after = 0;  // the system's, on either side
    std::vector<double> y, yp;     // at the beginning
    std::vector<double> y_after;   // at the end, behind the stop
    std::shared_ptr<const StretchMap> map;
  };

  /// Of a run with these tolerances.
  SlowStretches(System& system, double rtol, double atol)
      : system_(system), rtol_(rtol), atol_(atol), possible_(system.may_slip_in_space()) {}

  /// Whether there can be any.
  bool possible() const { return possible_; }
  /// A session begins, or its state is the run's: as `step`.
  void begin(std::size_t session, double t, const double* y, const double* yp);
  /// A step has ended; at an event with the state before it.
  void step(double t, const double* y, const double* yp);
  /// A stretch that goes on ends at t, and another one begins.
  void part(double t, const double* y, const double* yp);
  /// The session ends by the jump, in the mode before it; another one begins with y_after in the mode in force.
  void jump(const Jump& jump, double t_after, const double* y_after, const double* yp_after);
  /// The run ends.
  void end(double t, const double* y);

  const std::vector<Stretch>& all() const { return all_; }
  /// Stretches from rest whose map takes too long are left out: an adjoint crosses them as the rest of the motion, by
  /// many steps.
  void leave_out_long_ones(double rtol);
  /// Of a stretch of all(), by a run of its own the first time.
  const StretchMap& map(std::size_t i, double rtol);

 private:
  struct Point {
    double t = 0;
    int mode = 0;
    std::vector<double> y, yp, qvz, z;
    MotionEvents::Slowest slowest;
    double error = 0;  // of velocities
  };
  void look(double t, const double* y, const double* yp, Point& at);
  void open(const Point& at);
  void close(double t, const double* y_after, const Point& after);
  void open_from_rest(const Point& at);
  /// Whether a stretch from rest goes on.
  bool from_rest() const { return goes_on_ && all_.back().from_rest; }
  /// Closes the stretch from rest that goes on where it has been fast enough, at t at the latest; whether it has.
  bool finish_from_rest(double t, const double* y, const Point& here);

  System& system_;
  double rtol_, atol_;
  bool possible_, goes_on_ = false;
  std::size_t session_ = 0;
  std::vector<Point> faster_;  // along the stretch from rest that goes on, each twice as fast as the one before
  double fastest_ = 0;
  Point now_, last_, previous_;  // of this session: the last points at which nothing was slow
  std::vector<Stretch> all_;
  std::unique_ptr<SlowSlip> slip_;
};

}  // namespace costate
