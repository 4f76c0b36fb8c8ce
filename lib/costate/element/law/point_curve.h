// A curve through points of data: the natural cubic spline, or straight lines; or the periodic spline.
#pragma once

#include <cstddef>
#include <vector>

namespace costate {

class PointCurve {
 public:
  enum class Between { spline, lines };
  PointCurve() = default;
  /// x strictly increasing, as many y, 2 or more of them. A spline that `repeats` begins with the slope and the
  /// curvature that it ends with; the last y should be the first.
  PointCurve(std::vector<double> x, std::vector<double> y, Between between, bool repeats = false);

  const std::vector<double>& x() const { return x_; }
  const std::vector<double>& y() const { return y_; }
  /// At x: value and four derivatives; beyond the first or the last point along the end's tangent.
  void calc_derivatives(double x, double* f) const;
  /// The same of the cubic between the points k and k + 1, at any x.
  void calc_interval(std::size_t k, double x, double* f) const;

 private:
  void solve_repeated();
  std::vector<double> x_, y_, moment_;  // moment: second derivatives at the points; zeros of lines
};

}  // namespace costate
