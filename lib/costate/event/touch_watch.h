// Touches without an event, along a run. A force that begins where a gap closes is in the equations that integrators
// solve, but seen only where a step happens to end within the touch. Each step is followed along its gaps
// (gap_trace.h): of a dip below zero from t1 to t2 that a step passes over, as it is far deeper than where the step
// begins and ends, the step is right until t1 alone. It ends there, and over the dip steps are bounded by a part of t2
// - t1, from when on the integrator's own error estimates see the force. Likewise where damping has cut a force off and
// it comes back, or where it is cut off, within one step alone. Forces that are functions of where the motion
// is are watched likewise (path_watch.h).
#pragma once

#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/assembly/gathered_state.h"
#include "costate/event/bend_record.h"
#include "costate/event/gap_trace.h"
#include "costate/event/path_watch.h"

namespace costate {

class TouchWatch {
 public:
  /// Of the mechanism's forces and the running costs, with the numbers that the assembly has; dips count that are
  /// deeper than the part of the coordinates, or the length, that the integrator is asked for. `span`: of the run.
  TouchWatch(Assembly& assembly, const Objective& objective, double rtol, double atol, double span,
             LeftBends leaves = LeftBends::of_rates);

  /// From here on a step that leads into a touch, or out of one, is to end there.
  void end_steps_at_touches() { ends_steps_ = true; }

  /// From here on passages of places where forces and running costs bend are kept.
  void record_bends(BendRecord bends) {
    if (!bends.empty()) bends_ = std::move(bends);
  }

  bool empty() const { return gaps_.empty() && paths_.empty() && !bends_; }
  /// Whether looks ask for accelerations and multipliers, which the states between a step's ends are to have then.
  bool needs_accelerations() const { return paths_.needs_accelerations(); }
  /// The motion may have jumped since the last look.
  void begin_segment() { paths_.begin_segment(); }
  /// Whether something touches, or might within a step that is not yet accepted.
  bool may_touch(double from, double to, const GapTrace::States& at) const;
  /// After each step of the run, once and in order of time; `at` gives the state at times between its ends, valid until
  /// it is called again. Where the step has passed over a dip: its end is to be look.from, perhaps its own beginning,
  /// and steps from there on until look.to no longer than look.step.
  std::optional<TouchLook> look(double from, double to, const GapTrace::States& at);

  /// When something touched so far, for runs back along the motion; steps of a part of each.
  std::vector<TouchLook> touches(double t_end) const;
  /// When places were passed.
  std::vector<double> passages() const { return bends_ ? bends_->passages() : std::vector<double>(); }
  /// How many steps were cut.
  long cuts() const { return cuts_; }

 private:
  /// Within a force's region of rest: when, how far from its centre, how fast.
  struct AtRest {
    double t = std::numeric_limits<double>::quiet_NaN(), way = 0, speed = 0;
  };
  struct Gap {
    GapTrace trace;
    int first_state;  // of the force, among all
    GapTrace::Look seen = {std::numeric_limits<double>::quiet_NaN(), {}};
    double touches_from = std::numeric_limits<double>::quiet_NaN();
    std::optional<RestRegion> rest;  // of a force that may
    AtRest at_rest = {};
    bool rested = false;  // over the step that is looked at
    bool is_event = false;
    // What presses at the last look, 0 of what is open, and at the step's end; and the largest so far.
    double force = std::numeric_limits<double>::quiet_NaN(), force_at_end = force, largest = 0;
    /// What presses where it is below zero.
    double force_at(StateView s, const Assembly& assembly) const {
      s.z += first_state;
      return trace.force(s, assembly);
    }
    void see(const GapTrace::Look& end) {
      seen = end;
      force = force_at_end;
    }
  };
  using Looks = std::vector<GapTrace::Look>;
  std::optional<TouchLook> look_for_touches(double from, double to, const GapTrace::States& at);
  void add(const Force& force, int first_state, GapTrace trace, bool is_event = false);
  /// Whether the gap stays above zero over a step that ends at `last`, as its force's region of rest tells; `end` is
  /// what it tells of the end.
  static bool rests(const Gap& g, double from, const StateView& last, AtRest& end);
  void look_for_rest(Gap& g, const StateView& last);
  /// Where springs' laws begin to act.
  void add_stops(const Force& force, int first_state);
  std::optional<TouchLook> dip_passed_over(const Gap& gap, const Looks& trace, const GapTrace::States& at) const;
  /// Of a gap that is below zero at one end, or both: where its force comes, or is cut off, within the step alone.
  std::optional<TouchLook> force_passed_over(Gap& gap, double from, const GapTrace::Look& end,
                                             const GapTrace::States& at);
  /// Where the step first crosses the zero of a gap that is no event's.
  std::optional<TouchLook> first_crossed(double from, double to, const GapTrace::States& at) const;
  void record(Gap& gap, const Looks& trace, double until, const GapTrace::States& at);

  const Assembly& assembly_;
  double rtol_, atol_, size_ = 0;
  std::vector<Gap> gaps_;
  PathWatch paths_;
  std::optional<BendRecord> bends_;
  GatheredState gathered_;
  Looks ends_;
  std::vector<Looks> traces_;  // of this step; empty where the gap stays away from zero
  std::vector<std::pair<double, double>> touched_;
  long cuts_ = 0;
  bool ends_steps_ = false;
};

}  // namespace costate
