// The natural cubic spline through (x_k, y_k) with the ordinates as numbers, for tables of any length.
#pragma once

#include <vector>

#include "costate/element/course.h"
#include "costate/element/law/scalar_law.h"

namespace costate {

/// Continued by its end tangents (C2 everywhere); the abscissae are fixed, the numbers are the ordinates y_k. The
/// second derivatives m at the knots solve the tridiagonal system
///   h_{k-1}/6 m_{k-1} + (h_{k-1} + h_k)/3 m_k + h_k/6 m_{k+1} = s_k,  s_k = (y_{k+1} - y_k)/h_k - (y_k -
///   y_{k-1})/h_{k-1}
/// with m = 0 at both ends. With its pivots d from above and e from below, row k of the inverse is
///   G_kk = 1 / (d_k + e_k - (h_{k-1} + h_k)/3),  G_k,j-1 = -h_{j-1}/(6 d_{j-1}) G_kj (j <= k),  G_k,j+1 = -h_j/(6
///   e_{j+1}) G_kj (j >= k)
/// whose entries fall by a factor of two or more from one to the next. What is below rounding is left out, so that a
/// value takes time that does not grow with the table, and nothing is stored but the pivots.
class SplineLaw final : public ScalarLawOf<SplineLaw>, public PlacedLaw {
 public:
  /// x strictly increasing, at least 2 entries; throws ModelError otherwise.
  explicit SplineLaw(std::vector<double> x);
  int number_count() const override { return static_cast<int>(x_.size()); }
  const std::vector<double>& abscissae() const { return x_; }
  void add_places(const double* p, LawPlaces& places) const override;

  template <class S, class P>
  S physics(const S& x, const P* p) const {
    const double at = value_of(x);
    const int n = number_count();
    int k = 0;  // interval
    for (int lo = 0, hi = n - 1; hi - lo > 1;) {
      const int mid = (lo + hi) / 2;
      (x_[mid] <= at ? lo : hi) = mid;
      k = lo;
    }
    const double h = x_[k + 1] - x_[k];
    const S m0 = moment<S>(k, p), m1 = moment<S>(k + 1, p);
    const S secant = (S(p[k + 1]) - S(p[k])) / S(h);
    if (at < x_.front()) return S(p[0]) + (x - S(x_.front())) * (secant - S(h / 6) * (S(2.0) * m0 + m1));
    if (at > x_.back()) return S(p[n - 1]) + (x - S(x_.back())) * (secant + S(h / 6) * (m0 + S(2.0) * m1));
    const S b = (x - S(x_[k])) / S(h), a = S(1.0) - b;
    return a * S(p[k]) + b * S(p[k + 1]) + S(h * h / 6) * ((a * a * a - a) * m0 + (b * b * b - b) * m1);
  }

 private:
  template <class S, class P>
  S bend(int j, const P* p) const {
    return (S(p[j + 1]) - S(p[j])) / S(x_[j + 1] - x_[j]) - (S(p[j]) - S(p[j - 1])) / S(x_[j] - x_[j - 1]);
  }
  template <class S, class P>
  S moment(int k, const P* p) const {
    S sum(0.0);
    if (k == 0 || k + 1 == number_count()) return sum;
    S left(0.0), right(0.0);  // by Horner's rule, from far away
    for (int j = first_[k]; j < k; ++j) left = (left + bend<S>(j, p)) * S(down_[j]);
    for (int j = last_[k]; j > k; --j) right = (right + bend<S>(j, p)) * S(up_[j]);
    return S(diagonal_[k]) * (left + bend<S>(k, p) + right);
  }

  std::vector<double> x_;
  std::vector<double> diagonal_;   // G_kk
  std::vector<double> down_, up_;  // G_k,j / G_k,j+1 and G_k,j / G_k,j-1, which do not depend on k
  std::vector<int> first_, last_;  // the knots that matter to m_k
};

}  // namespace costate
