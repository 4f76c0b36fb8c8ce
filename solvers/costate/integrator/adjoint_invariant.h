// What an adjoint must keep: where neither forces nor costs depend on time, H = mu^T f + g is the same at the start and
// at the end of a run (it is the derivative of psi by a shift of the start along the motion). An adjoint that went
// wrong on its way, whatever the cause, leaves it; the look costs some evaluations of the equations at the two ends.
// lib/README.md (16.4).
#pragma once

#include <cmath>
#include <type_traits>
#include <vector>

#include "costate/formulation/system.h"

namespace costate {

class AdjointInvariant {
 public:
  /// At the end, with the state and the adjoint there; looks, too, whether anything depends on time between the two.
  template <class SystemType>
  void end(SystemType& system, double t_start, double t, const double* y, const double* mu) {
    known_ = autonomous(system, t_start, t, y);
    if (known_) end_ = value(system, t, y, mu);
  }
  template <class SystemType>
  void start(SystemType& system, double t, const double* y, const double* mu) {
    if (known_) start_ = value(system, t, y, mu);
  }
  bool known() const { return known_; }
  double change() const { return std::abs(end_ - start_); }

 private:
  /// E y' by the equations: f of an ODE, and of a DAE what the residual at y' = 0 lacks in the differential rows.
  template <class SystemType>
  void flow(SystemType& system, double t, const double* y) {
    f_.assign(static_cast<std::size_t>(system.size()), 0);
    if constexpr (std::is_base_of_v<OdeSystem, SystemType>) {
      system.rhs(t, y, f_.data());
    } else {
      zero_.assign(f_.size(), 0);
      system.residual(t, y, zero_.data(), f_.data());
      for (std::size_t i = 0; i < f_.size(); ++i) f_[i] = system.unknowns()[i].differential ? -f_[i] : 0;
    }
  }
  /// By the terms of the equations at the motion's state, taken at other times. Not by the system's own evaluations:
  /// where positions are solved for, the ones at the end need not be near those that a system knows at another time.
  static bool autonomous(System& system, double t_start, double t, const double* y);
  template <class SystemType>
  double value(SystemType& system, double t, const double* y, const double* mu) {
    flow(system, t, y);
    double sum = system.has_running_cost() ? system.running_cost(t, y) : 0;
    for (std::size_t i = 0; i < f_.size(); ++i) sum += mu[i] * f_[i];
    return sum;
  }

  bool known_ = false;
  double start_ = 0, end_ = 0;
  std::vector<double> f_, zero_;
};

}  // namespace costate
