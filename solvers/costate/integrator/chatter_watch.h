// Notices a motion that goes from event to event evenly and gets on by next to nothing: rigid contacts of which none
// can stay closed or open. Bounces that die out become ever shorter.
#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate {

/// "'contact.a: touch closed' and ...": which the last few of these are.
std::string last_events(const std::vector<RunEvent>& events);

class ChatterWatch {
 public:
  /// After each event of a run to `end`, the last of these. Throws SolverError where the way there would take more
  /// events than anyone waits for at the pace of the last ones, and these were even.
  void look(const std::vector<RunEvent>& events, double end);

 private:
  static constexpr std::size_t kWindow = 400;
  double before(std::size_t back) const { return times_[(count_ - 1 - back) % times_.size()]; }

  std::array<double, kWindow + 1> times_{};
  std::size_t count_ = 0;
};

}  // namespace costate
