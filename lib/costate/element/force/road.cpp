#include "costate/element/force/road.h"

namespace costate {

void law_with_slope(const ScalarLaw& f, const PathDual& x, const PathDual* p, PathDual& y, PathDual& y_x) {
  thread_local std::vector<DirectedPathDual> numbers;
  const auto n = static_cast<std::size_t>(f.number_count());
  if (numbers.size() < n) numbers.resize(n);
  for (std::size_t i = 0; i < n; ++i) numbers[i] = DirectedPathDual(p[i]);
  const DirectedPathDual r = f.value(DirectedPathDual::variable(x, 0), numbers.data());
  y = r.v;
  y_x = r.d[0];
}

}  // namespace costate
