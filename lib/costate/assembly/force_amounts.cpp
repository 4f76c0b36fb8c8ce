// How large forces are that may balance each other.
#include <cmath>

#include "costate/assembly/applied_forces.h"

namespace costate {

void Assembly::calc_force_amounts(const StateView& s, std::vector<double>& amounts) {
  amounts.assign(Q_constant_.size(), 0);
  for (std::size_t j = 0; j < amounts.size(); ++j) amounts[j] = std::abs(Q_constant_[j]);
  std::vector<double> rates(zdot.size());  // nobody's
  for_each_varying_force(s, rates.data(), [&](const std::vector<int>& c, const double* f) {
    for (std::size_t i = 0; i < c.size(); ++i) amounts[static_cast<std::size_t>(c[i])] += std::abs(f[i]);
  });
}

}  // namespace costate
