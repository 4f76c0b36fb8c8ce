#include "costate/mechanism/element_check.h"

#include <fmt/format.h>

#include <cmath>
#include <vector>

#include "costate/base/error.h"

namespace costate {

namespace {
// [s], where a law of time may not be zero by chance.
constexpr double kTimes[] = {0.37, 1.61};

void check_indices(const Element& e, const char* what, const std::vector<int>& indices, std::size_t count) {
  for (const int i : indices)
    if (i < 0 || static_cast<std::size_t>(i) >= count)
      throw ModelError(
          e.path(), fmt::format("It has a {} of index {}, and the mechanism has {} of them so far.", what, i, count));
}
}  // namespace

void check_element(const Mechanism& mechanism, const Element& e) {
  check_indices(e, "coordinate", e.coordinates(), static_cast<std::size_t>(mechanism.coordinate_count()));
  check_indices(e, "number", e.numbers(), mechanism.numbers().size());
}

void check_element(const Mechanism& mechanism, const Constraint& c) {
  check_element(mechanism, static_cast<const Element&>(c));
  if (c.rheonomic()) return;
  std::vector<PathDual> q, p, phi(static_cast<std::size_t>(c.rows()));
  const auto& numbers = mechanism.numbers();
  for (const int i : c.coordinates())
    q.emplace_back(
        numbers[static_cast<std::size_t>(mechanism.coordinates()[static_cast<std::size_t>(i)].position_number)].value);
  for (const int k : c.numbers()) p.emplace_back(numbers[static_cast<std::size_t>(k)].value);
  for (const double t : kTimes) {
    c.phi(PathDual(Taylor2(t, 1, 0)), q.data(), p.data(), phi.data());
    for (int i = 0; i < c.rows(); ++i)
      if (const double rate = phi[static_cast<std::size_t>(i)].v.c1; std::isfinite(rate) && rate != 0)
        throw ModelError(c.path(), fmt::format("Row '{}' changes with time by itself (by {:.3g} a second at t = {} s), "
                                               "which the constraint does not say: override rheonomic() to be true.",
                                               c.row_name(i), rate, t));
  }
}

void check_element(const Mechanism& mechanism, const Force& f) {
  check_element(mechanism, static_cast<const Element&>(f));
  for (int i = 0; i < f.states(); ++i)
    if (const int local = f.initial_state_number(i); local >= static_cast<int>(f.numbers().size()))
      throw ModelError(f.path(), fmt::format("Its state {} starts with its number {}, and it has {} of them.", i, local,
                                             f.numbers().size()));
}

}  // namespace costate
