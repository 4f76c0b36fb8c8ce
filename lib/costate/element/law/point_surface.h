// A surface through points of data over a grid, f(x, y): the natural cubic splines along x, and of these along y (twice
// continuously differentiable; the order does not matter), or straight lines (bilinear between four points).
#pragma once

#include <string>
#include <vector>

#include "costate/derivative/dual.h"
#include "costate/element/law/point_curve.h"

namespace costate {

class PointSurface {
 public:
  using Between = PointCurve::Between;
  /// What is said beyond the grid: nothing (a StepError), the value at its edge, or the edge's tangent.
  enum class Beyond { refuse, hold, tangent };
  static constexpr std::size_t kMostPoints = 1'000'000;
  /// x and y strictly increasing, 2 or more of each, z[j * nx + i] at (x_i, y_j), all finite; throws ModelError
  /// otherwise. `source` is for messages.
  PointSurface(std::vector<double> x, std::vector<double> y, const std::vector<double>& z, Between between,
               Beyond beyond, std::string source);

  const std::vector<double>& x() const { return x_.knots; }
  const std::vector<double>& y() const { return y_.knots; }
  Between between() const { return between_; }

  template <class S>
  S value(const S& x, const S& y) const {
    const Place at = place(x_, value_of(x)), up = place(y_, value_of(y));
    const double* c = &cubics_[16 * (at.interval * (y_.knots.size() - 1) + up.interval)];
    S along_y[4];
    for (int a = 0; a < 4; ++a) along_y[a] = follow(c + 4 * a, y, up);
    return follow(along_y, x, at);
  }
  /// Appends by how much (x, y) is beyond each place where the slope jumps along x, then those along y.
  void add_bends(double x, double y, std::vector<double>& bends) const;

 private:
  struct Axis {
    std::vector<double> knots;
    const char* name;
  };
  struct Place {
    std::size_t interval;
    double origin, end;  // of the interval; of what is beyond the grid the edge, from there
    bool inside, holds;
  };
  Place place(const Axis& axis, double x) const;
  void require(const Axis& axis) const;

  /// c0 + c1 u + c2 u^2 + c3 u^3 with u = x - origin, or what stands for it beyond the grid.
  template <class C, class S>
  static S follow(const C* c, const S& x, const Place& at) {
    if (at.inside) {
      const S u = x - S(at.origin);
      return S(c[0]) + u * (S(c[1]) + u * (S(c[2]) + u * S(c[3])));
    }
    const S e(at.end);
    const S value = S(c[0]) + e * (S(c[1]) + e * (S(c[2]) + e * S(c[3])));
    if (at.holds) return value;
    const S slope = S(c[1]) + e * (S(2.0) * S(c[2]) + S(3.0) * e * S(c[3]));
    return value + slope * (x - S(at.origin + at.end));
  }

  Axis x_, y_;
  std::vector<double> cubics_;  // of each cell 16, of u_x^a u_y^b at 4 a + b; cells along y first
  Between between_;
  Beyond beyond_;
  std::string source_;
};

}  // namespace costate
