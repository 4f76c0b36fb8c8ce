// How far an integrator's steps may go, whatever its error estimates say: what the laws of a mechanism and its cost do
// late, briefly or over and over (element/course.h) is met by some steps at least. Laws of time are known before the
// run; those along a track (a road under a wheel) are looked at from where the motion is, at the speed it has.
#pragma once

#include <functional>
#include <limits>
#include <vector>

#include "costate/element/course.h"
#include "costate/event/touch_watch.h"
#include "costate/formulation/system.h"

namespace costate {

class StepPlan {
 public:
  /// For a run over t_start .. t_end that begins with y at t_start. The objective is that of the run.
  StepPlan(System& system, const Objective& objective, double t_start, double t_end, const double* y);
  StepPlan(const Assembly& assembly, const Objective& objective, double t_start, double t_end, const StateView& start);

  bool empty() const { return time_.empty() && tracks_.empty(); }
  /// Where a step from the state at t (s.q and s.v where there are tracks) ends at the latest, infinite where nothing
  /// bounds it; backward: the same for runs from the end to the start.
  Course::Bound bound(double t, const StateView& s, bool backward) const;
  /// The next time behind t at which a law of time begins, ends or becomes another: schemes of high order see little of
  /// a jump of a derivative within a step.
  double next_time(double t) const { return time_.next_place(t); }
  /// Whether nothing is there until t_end but what repeats itself all the time.
  bool even(double t_end) const { return tracks_.empty() && !(time_.next_place(time_.from()) < t_end); }
  bool needs_state() const { return !tracks_.empty(); }
  /// The same for a system's unknowns.
  double limit(System& system, double t, const double* y, bool backward) const;

  /// The same bounds for a system that runs back from t_end in the time that is left, and whose states are those of the
  /// motion at the time that they stand for.
  StepPlan reversed(double t_end) const;

  /// The same with further bounds, of a motion that is known.
  StepPlan with_looks(const std::vector<TouchLook>& looks) const;

  /// Throws SolverError where a fixed step from t over h passes over what it should meet.
  void require(double t, const StateView& s, double h) const;
  /// The grid of times, divided so that no interval passes over anything; `state` gives s at a time.
  template <class State>
  std::vector<double> divided(const std::vector<double>& grid, const State& state) const {
    std::vector<double> r;
    for (std::size_t i = 0; i + 1 < grid.size(); ++i) {
      double t = grid[i];
      r.push_back(t);
      for (;;) {
        const double end = bound(t, state(t), false).end;
        if (!(end < grid[i + 1] - 1e-3 * (end - t))) break;
        r.push_back(t = end);
      }
    }
    r.push_back(grid.back());
    return r;
  }

 private:
  struct Track {
    const Element* element;
    const CourseElement* course_of;
    int index;
    std::vector<double> numbers;
    Course course;
  };
  void read(const Assembly& assembly, const Objective& objective, const std::function<StateView()>& start);

  Course time_;
  double reversed_from_ = std::numeric_limits<double>::quiet_NaN();
  std::vector<Track> tracks_;
};

}  // namespace costate
