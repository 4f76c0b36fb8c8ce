// A point that equations are evaluated at, and its identity: a number that stands for the values of the time, the state
// and the mechanism's numbers. What is computed at a point is kept together with that number (Assembly::has_dynamics(),
// has_partials(), an own `long`), and is still there while the numbers are the same: nothing has to be told that
// something else was evaluated in between.
#pragma once

#include <initializer_list>
#include <span>
#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

class EvaluationPoint {
 public:
  explicit EvaluationPoint(Assembly& assembly) : assembly_(assembly) {}

  /// Becomes (t, parts), which are copied, and returns the identity: the same as before where all values are, to the
  /// bit; else a new one. The number of entries is that of the first call.
  long move_to(double t, std::initializer_list<std::span<const double>> parts);
  /// The next point is a new one whatever its values.
  void forget() { id_ = 0; }

  /// 0 before the first point and after forget().
  long id() const { return id_; }
  double t() const { return t_; }
  /// The parts, one behind the other; until the point moves.
  const double* values() const { return values_.data(); }

 private:
  Assembly& assembly_;
  long id_ = 0;
  double t_ = 0;
  std::vector<double> values_;
};

}  // namespace costate
