// Forces that are functions of where the motion is (formulas of positions, laws of a spring's length), and such
// formulas in running costs, along a run. One that acts over a short part of the way, a detent or a wall, is seen by
// integrators only where a step happens to evaluate it there. After each step the function phi is looked at along the
// step, with its arguments on the cubics through the states at both ends: where the formula's own terms pass through
// zero, in between, and wherever a cubic through four of its values misses the others by more than a tenth of its
// range. Such a step has passed over something: it ends where that begins, and steps over it are bounded by its length.
#pragma once

#include <optional>
#include <utility>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/element/law/motion_law.h"
#include "costate/element/path_function.h"
#include "costate/event/gap_trace.h"
#include "costate/objective/objective.h"

namespace costate {

/// Times over which steps are bounded.
struct TouchLook {
  double from = 0, to = 0;
  double step = std::numeric_limits<double>::infinity();
  const Element* element = nullptr;  // what touches, or acts there
  const char* does = "is closed";
};

class PathWatch {
 public:
  /// Of the mechanism's forces and the running costs, with the numbers that the assembly has.
  PathWatch(Assembly& assembly, const Objective& objective);
  ~PathWatch();

  bool empty() const { return functions_.empty(); }
  /// As TouchWatch::look.
  std::optional<TouchLook> look(double from, double to, const GapTrace::States& at);
  /// When something acted so far, for runs back along the motion; steps of a part of each.
  void add_looks(std::vector<TouchLook>& looks) const;

 private:
  class Function;
  struct State {
    double t = std::numeric_limits<double>::quiet_NaN();
    std::vector<double> q, v, z;
    void set(const StateView& s, const Assembly& assembly);
    StateView view() const;
  };
  void set_middle();

  Assembly& assembly_;
  State begin_, middle_, end_;
  double cut_from_ = std::numeric_limits<double>::quiet_NaN();
  int cuts_ = 0;  // of steps from there
  std::vector<Function> functions_;
};

}  // namespace costate
