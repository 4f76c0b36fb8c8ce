// A curve through points of data: the natural cubic spline, or straight lines.
#pragma once

#include <cstddef>
#include <vector>

namespace costate {

class PointCurve {
 public:
  enum class Between { spline, lines };
  PointCurve() = default;
  /// x strictly increasing, as many y, 2 or more of them.
  PointCurve(std::vector<double> x, std::vector<double> y, Between between);

  const std::vector<double>& x() const { return x_; }
  const std::vector<double>& y() const { return y_; }
  /// At x: value and four derivatives; beyond the first or the last point along the end's tangent.
  void calc_derivatives(double x, double* f) const;
  /// The same of the cubic between the points k and k + 1, at any x.
  void calc_interval(std::size_t k, double x, double* f) const;

 private:
  std::vector<double> x_, y_, moment_;  // moment: second derivatives at the points; zeros of lines
};

}  // namespace costate
