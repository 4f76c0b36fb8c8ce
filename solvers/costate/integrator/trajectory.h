// A stored motion with the integrator's own dense output: for each step the polynomial that the multistep
// method interpolates with, or, where the integrator's unknowns are not those of the motion, one fitted to
// it. Evaluation costs one binary search and a short Taylor sum.
#pragma once

#include <cstddef>
#include <functional>
#include <vector>

#include "costate/assembly/assembly.h"

namespace costate {

class Trajectory {
 public:
  /// q and v of `coordinates` entries, z of `states`.
  Trajectory(int coordinates, int states) : n_(coordinates), nz_(states), width_(2 * coordinates + states) {}

  int width() const { return width_; }
  std::size_t steps() const { return steps_.size(); }
  double t_begin() const { return steps_.front().begin; }
  double t_end() const { return steps_.back().end; }
  double step_end(std::size_t i) const { return steps_[i].end; }

  /// Appends [begin, end] with derivatives d[k] = d^k (q, v, z)/dt^k at `end`, k = 0 ... order.
  void add_step(double begin, double end, const std::vector<std::vector<double>>& d, int order);
  /// Appends [begin, end] with the motion given by its states, as smooth as polynomials of this order are: by
  /// interpolation at Chebyshev's points, two orders higher, so that the error is far below that of the order
  /// itself.
  void add_step(double begin, double end, int order, const std::function<StateView(double t)>& motion);
  /// (q, v, z) at t (clamped to the stored span), `width` values.
  void evaluate(double t, double* y) const;

 private:
  struct Step {
    double begin, end;
    int order;
    std::size_t first;  // into coefficients_
  };
  int n_, nz_, width_;
  std::vector<Step> steps_;
  std::vector<double> coefficients_;  // Taylor coefficients at `end`
};

}  // namespace costate
