// Whether a force, a running cost or a constraint's second derivative that a user wrote in C++ jumps along a motion.
// Its derivatives by dual numbers are right on either side, and of what the instant depends on they know nothing: every
// formulation and method agrees on the same wrong gradient. So its values are followed from look to look: where the
// middle of the straight way between two looks does not fit to its ends, the half that changes most is halved on, until
// what is left is a jump or nothing. What lies between two looks and is gone at both is not seen.
#pragma once

#include <functional>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "costate/assembly/own_state.h"
#include "costate/objective/objective.h"

namespace costate {

class OwnJumpWatch {
 public:
  /// Of forces and running costs whose class, or whose law's, is not of namespace costate; forces that declare their
  /// jumps (element/guarded_force.h, jumping_force.h), and constraints that declare times, need no watch.
  OwnJumpWatch(const Mechanism& mechanism, const Objective& objective);
  bool empty() const { return watched_.empty(); }

  /// At states of the motion in order of time, all of them (t, q, v, a, lambda, z), with the numbers of the assembly.
  void look(const StateView& s, Assembly& assembly);
  /// Of the first jump that was passed: why no gradient is given, and what to do.
  const std::optional<std::string>& met() const { return met_; }
  /// Whether that is a velocity that a constraint asks for: the motion itself has no impulse for it.
  bool needs_impulse() const { return needs_impulse_; }

 private:
  struct Watched {
    std::string name, advice;
    std::function<void(const StateView&, Assembly&, std::vector<double>& values)> add;
    std::vector<int> coordinates;
    /// From here on values are those of rates that constraints ask for: where they jump velocities do.
    std::size_t rates_from = std::numeric_limits<std::size_t>::max();
    std::vector<double> last = {}, largest = {};  // by values: at the last look, and of all
    std::vector<double> rounding = {};            // what that makes of them where it has been looked for
  };
  /// The state at part w of the way from the last look to s.
  StateView between(const StateView& s, double w, const Assembly& assembly);
  /// What rounding of positions, velocities and states makes of value i where the way is at w: terms that cancel leave
  /// of a spring at its natural length nothing else.
  double rounding(const Watched& of, const StateView& s, double w, std::size_t i, Assembly& assembly);
  void judge(Watched& of, const StateView& s, const std::vector<double>& now, Assembly& assembly);

  std::vector<Watched> watched_;
  OwnState last_, between_;
  double begin_ = 0;
  long looks_ = 0;
  std::optional<std::string> met_;
  bool needs_impulse_ = false;
};

}  // namespace costate
