// Notices that Adams' method is the wrong one: where the fastest rate of the system, |lambda| of its Jacobian, keeps
// steps at the border of stability although the motion would allow larger ones. |lambda| is found by power iteration
// with the system's own tangent.
#pragma once

#include <algorithm>
#include <cmath>
#include <vector>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/problem/problem.h"

namespace costate {

/// The run is stiff. What it says stands for itself where nobody takes BDF instead.
class StiffError : public SolverError {
 public:
  using SolverError::SolverError;
};

/// run(problem), and once more with BDF where Adams' method is found to be the wrong one.
template <class Run>
auto with_bdf_where_stiff(const Problem& problem, const Run& run) {
  try {
    return run(problem);
  } catch (const StiffError&) {
    Problem stiff = problem;
    stiff.solver.cvodes_method = "bdf";
    auto result = run(stiff);
    notice(
        "The motion is stiff: Adams' method would have gone on by steps as small as its stability asks for, and CVODES "
        "took BDF "
        "instead. --cvodes-method bdf begins with it.");
    return result;
  }
}

class StiffnessWatch {
 public:
  static constexpr long kInterval = 50;  // steps between looks
  /// Whether a look is due after so many steps.
  bool due(long steps) {
    if (steps < next_ && steps + kInterval >= next_) return false;
    next_ = steps + kInterval;
    return !off_;
  }
  /// After a step of h by order q at (t, y): the fastest rate [1/s] once kLooks in a row found steps bound by it, else
  /// 0.
  double bound_by(OdeSystem& system, double t, const double* y, double h, int q) {
    const double rate = fastest_rate(system, t, y);
    in_a_row_ = std::abs(h) * rate > 0.4 * border(q) ? in_a_row_ + 1 : 0;
    return in_a_row_ >= kLooks ? rate : 0;
  }

 private:
  static constexpr int kLooks = 4, kIterations = 12, kTaken = 6;

  /// |h lambda| on the real axis up to which the Adams-Moulton method of order q is stable; those of order 1 and 2 are
  /// always, but to be at these orders with such steps is to have been driven there.
  static double border(int q) {
    constexpr double borders[] = {6, 6, 6, 6, 3, 1.84, 1.18, 0.77, 0.5, 0.33, 0.22, 0.14, 0.09};
    return borders[std::clamp(q, 0, 12)];
  }
  /// The geometric mean of the last ratios: right for a pair of complex values, too.
  double fastest_rate(OdeSystem& system, double t, const double* y) {
    const auto n = static_cast<std::size_t>(system.size());
    std::vector<double> s(n), out(n);
    for (std::size_t i = 0; i < n; ++i) s[i] = 1 + 0.5 * std::sin(1.0 + 2.3 * static_cast<double>(i));
    double logarithms = 0;
    for (int k = 0; k < kIterations; ++k) {
      double size = 0, next = 0;
      for (const double x : s) size = std::hypot(size, x);
      for (double& x : s) x /= size;
      const double* in[1] = {s.data()};
      double* to[1] = {out.data()};
      try {
        system.tangent(t, y, in, to, 1, false);
      } catch (const CapabilityError&) {
        off_ = true;
        return 0;
      }
      for (const double x : out) next = std::hypot(next, x);
      if (!(next > 0) || !std::isfinite(next)) return 0;
      if (k >= kIterations - kTaken) logarithms += std::log(next);
      s.swap(out);
    }
    return std::exp(logarithms / kTaken);
  }

  long next_ = kInterval;
  int in_a_row_ = 0;
  bool off_ = false;
};

}  // namespace costate
