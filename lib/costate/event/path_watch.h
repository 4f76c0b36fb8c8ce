// Forces that are functions of where the motion is (formulas, laws of a spring's length or of a damper's rate), and
// such formulas in running costs, along a run. One that acts over a short part of the way, a detent or a wall, is seen
// by integrators only where a step happens to evaluate it there. After each step the function is looked at along the
// step's motion (step_motion.h, path_course.h). Where no cubic is its course the step has passed over something: it
// ends where the function begins to change, and steps from there on are bounded by the length of what it does there.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/event/gap_trace.h"
#include "costate/event/path_course.h"
#include "costate/event/step_motion.h"
#include "costate/objective/objective.h"

namespace costate {

/// Times over which steps are bounded.
struct TouchLook {
  double from = 0, to = 0;
  double step = std::numeric_limits<double>::infinity();
  const Element* element = nullptr;  // what touches, or acts there
  const char* does = "is closed";
  const GapTrace* crossed = nullptr;  // the step is to end where this gap is zero, near `from`
};

class PathWatch {
 public:
  /// Of the mechanism's forces and the running costs, with the numbers that the assembly has.
  /// Bends of laws of a rate, which an oscillation passes twice a period, are left to integrators of many steps, which
  /// see them in the next; schemes of one step are shown them.
  /// `span`: of the run, over which what users wrote is looked at evenly; 0: it is not.
  PathWatch(Assembly& assembly, const Objective& objective, double rtol, double atol, LeftBends leaves, double span);

  bool empty() const { return functions_.empty(); }
  bool needs_accelerations() const { return accelerations_; }
  /// Where the motion may have jumped.
  void begin_segment() { motion_.forget(); }
  /// As TouchWatch::look.
  std::optional<TouchLook> look(double from, double to, const GapTrace::States& at);
  /// When something acted so far, for runs back along the motion; steps of a part of each.
  void add_looks(std::vector<TouchLook>& looks) const;

 private:
  /// Of the step that `motion_` holds.
  std::optional<TouchLook> passed_over(PathCourse& f);
  std::optional<TouchLook> first_passed_over();

  Assembly& assembly_;
  PathCourse::Precision precision_;
  StepMotion motion_;
  const GapTrace::States* states_ = nullptr;  // within the step that `motion_` holds
  double cut_from_ = std::numeric_limits<double>::quiet_NaN();
  int cuts_ = 0;  // of steps from there
  std::vector<PathCourse> functions_;
  bool accelerations_ = false;
};

}  // namespace costate
