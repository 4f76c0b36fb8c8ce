// What errors of the size of the tolerance do to psi, read off an adjoint on its way back: an error e in the state at t
// changes psi by mu(t)^T e, so that sum of |mu_i| (rtol |y_i| + atol s_i), s the sizes of unknowns, is what one error
// of that size there may change it by. Where a motion is chaotic, or runs for long beside an unstable one, this grows
// beyond psi itself, and no digit of psi or of its gradient is known, whatever the method.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "costate/integrator/unknown_sizes.h"

namespace costate {

class AdjointGrowth {
 public:
  /// At every so many calls, all of one system.
  void look(double t, const double* y, const double* mu, const System& system, double rtol, double atol) {
    if (calls_++ % 4 != 0) return;
    if (sizes_.empty()) sizes_ = unknown_sizes(system);
    const std::vector<Unknown>& unknowns = system.unknowns();
    double change = 0, most = 0;
    std::size_t worst = 0;
    for (std::size_t i = 0; i < unknowns.size(); ++i) {
      if (!unknowns[i].differential) continue;
      const double own = std::abs(mu[i]) * (rtol * std::abs(y[i]) + atol * sizes_[i]);
      change += own;
      if (!(own > most)) continue;
      most = own;
      worst = i;
    }
    if (!(change <= change_)) {
      change_ = change;
      t_ = t;
      worst_ = unknowns.empty() ? "" : unknowns[worst].name;
    }
  }
  /// The largest change of psi, and where the error that makes it lies.
  double change() const { return change_; }
  double time() const { return t_; }
  /// The unknown that makes the most of it.
  const std::string& worst() const { return worst_; }

 private:
  double change_ = 0, t_ = 0;
  long calls_ = 0;
  std::vector<double> sizes_;
  std::string worst_;
};

}  // namespace costate
