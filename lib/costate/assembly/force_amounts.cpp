// How large forces are that may balance each other.
#include <cmath>

#include "costate/assembly/assembly.h"

namespace costate {

void Assembly::calc_force_amounts(const StateView& s, std::vector<double>& amounts) {
  amounts.assign(Q_constant_.size(), 0);
  for (std::size_t j = 0; j < amounts.size(); ++j) amounts[j] = std::abs(Q_constant_[j]);
  double f[kMaxLocal];
  const auto add = [&](const std::vector<int>& coordinates) {
    for (std::size_t i = 0; i < coordinates.size(); ++i)
      amounts[static_cast<std::size_t>(coordinates[i])] += std::abs(f[i]);
  };
  for (const std::size_t b : varying_force_) {
    const Body& body = *mechanism_->bodies()[b];
    std::fill(f, f + body.coordinates().size(), 0.0);
    body.calc_force(gather(bodies_[b], s), f);
    add(body.coordinates());
  }
  std::vector<double> rates(zdot.size());
  for (std::size_t k = 0; k < forces_.size(); ++k) {
    if (rests(forces_[k], s)) continue;
    const Force& force = *mechanism_->forces()[k];
    std::fill(f, f + force.coordinates().size(), 0.0);
    force.calc_force(gather(forces_[k], s), f, rates.data() + forces_[k].row_offset);
    add(force.coordinates());
  }
}

}  // namespace costate
