// A scalar function f(x) of one variable with numbers as arguments: spring and damper characteristics,
// drivers in time, cost targets. A law is one templated formula; derivatives come from dual numbers.
#pragma once

#include <cmath>
#include <memory>
#include <string>
#include <vector>

#include "costate/derivative/dual.h"

namespace costate {

class ScalarLaw {
 public:
  virtual ~ScalarLaw() = default;
  virtual int number_count() const = 0;
  /// f(x) with the law's numbers p; PathDual carries time derivatives and one partial.
  virtual double value(double x, const double* p) const = 0;
  virtual PathDual value(const PathDual& x, const PathDual* p) const = 0;
  virtual DirectedPathDual value(const DirectedPathDual& x, const DirectedPathDual* p) const = 0;
  /// f and df/dx.
  virtual Dual<1> slope(double x, const double* p) const = 0;
  /// f, f', f''.
  virtual Taylor2 curve(double x, const double* p) const = 0;
  /// Appends the x at which the slope jumps. A driver with such a law gives its mechanism a blow there.
  virtual void add_kinks(const double*, std::vector<double>&) const {}
  /// Appends the x at which the curvature jumps and the numbers decide where: a driver's acceleration jumps there.
  virtual void add_curvature_jumps(const double*, std::vector<double>&) const {}
  /// The same where the third derivative is the first that jumps: the derivative of a driver's acceleration by a number
  /// that moves the place jumps there.
  virtual void add_third_jumps(const double*, std::vector<double>&) const {}
  /// slopes[k] += dx/dp_k of such a place x, NaN where the place would part. A law whose places depend on its numbers
  /// otherwise than it says here has no gradients by those numbers.
  virtual void add_place_slopes(double, const double*, double*) const {}
  /// Integral of f from 0 to x (the stored energy of a spring law).
  virtual double integral(double x, const double* p) const = 0;
};

/// Derived provides: template <class S> S physics(const S& x, const S* p) const, where p may be S or double.
template <class Derived>
class ScalarLawOf : public ScalarLaw {
 public:
  double value(double x, const double* p) const override { return self().template physics<double>(x, p); }
  PathDual value(const PathDual& x, const PathDual* p) const override {
    return self().template physics<PathDual>(x, p);
  }
  DirectedPathDual value(const DirectedPathDual& x, const DirectedPathDual* p) const override {
    return self().template physics<DirectedPathDual>(x, p);
  }
  Dual<1> slope(double x, const double* p) const override {
    return self().template physics<Dual<1>>(Dual<1>::variable(x, 0), p);
  }
  Taylor2 curve(double x, const double* p) const override {
    return self().template physics<Taylor2>(Taylor2(x, 1, 0), p);
  }
  double integral(double x, const double* p) const override {
    // 10-point Gauss-Legendre on pieces: used for energies in reports only, not in any derivative.
    static constexpr double node[5] = {0.1488743389816312, 0.4333953941292472, 0.6794095682990244, 0.8650633666889845,
                                       0.9739065285171717};
    static constexpr double weight[5] = {0.2955242247147529, 0.2692667193099963, 0.2190863625159820, 0.1494513491505806,
                                         0.0666713443086881};
    constexpr int pieces = 16;
    double sum = 0;
    const double h = x / pieces;
    for (int k = 0; k < pieces; ++k)
      for (int i = 0; i < 5; ++i)
        for (int sign = -1; sign <= 1; sign += 2) sum += weight[i] * value(h * (k + 0.5 + 0.5 * sign * node[i]), p);
    return 0.5 * h * sum;
  }

 private:
  const Derived& self() const { return static_cast<const Derived&>(*this); }
};

/// c0 + c1 x + c2 x^2 + ...; numbers: the coefficients.
class PolynomialLaw final : public ScalarLawOf<PolynomialLaw> {
 public:
  explicit PolynomialLaw(int coefficients) : n_(coefficients) {}
  int number_count() const override { return n_; }
  template <class S, class P>
  S physics(const S& x, const P* p) const {
    S sum(0.0);
    for (int i = n_ - 1; i >= 0; --i) sum = sum * x + S(p[i]);
    return sum;
  }

 private:
  int n_;
};

/// mean + amplitude sin(angular_frequency x + phase); numbers in that order: mean, amplitude, omega, phase.
class SineLaw final : public ScalarLawOf<SineLaw> {
 public:
  int number_count() const override { return 4; }
  template <class S, class P>
  S physics(const S& x, const P* p) const {
    using std::sin;
    return S(p[0]) + S(p[1]) * sin(S(p[2]) * x + S(p[3]));
  }
};

/// A smooth step from y0 to y1 between x0 and x1 by the quintic 10 s^3 - 15 s^4 + 6 s^5 (C2 everywhere);
/// numbers: x0, x1, y0, y1.
class SmoothStepLaw final : public ScalarLawOf<SmoothStepLaw> {
 public:
  int number_count() const override { return 4; }
  void add_third_jumps(const double* p, std::vector<double>& x) const override { x.insert(x.end(), {p[0], p[1]}); }
  void add_place_slopes(double x, const double* p, double* slopes) const override {
    for (const int k : {0, 1}) slopes[k] += p[0] == p[1] ? std::nan("") : x == p[k] ? 1 : 0;
  }
  template <class S, class P>
  S physics(const S& x, const P* p) const {
    const double at = value_of(x);
    if (at >= value_of(p[1])) return S(p[3]);
    if (at < value_of(p[0])) return S(p[2]);
    const S s = (x - S(p[0])) / (S(p[1]) - S(p[0]));
    return S(p[2]) + (S(p[3]) - S(p[2])) * s * s * s * (S(10.0) - S(15.0) * s + S(6.0) * s * s);
  }
};

/// The natural cubic spline through (x_k, y_k), continued by its end tangents (C2 everywhere);
/// the abscissae are fixed, the numbers are the ordinates y_k.
class TableLaw final : public ScalarLawOf<TableLaw> {
 public:
  /// x strictly increasing, at least 2 entries; throws ModelError otherwise.
  explicit TableLaw(std::vector<double> x);
  int number_count() const override { return static_cast<int>(x_.size()); }
  const std::vector<double>& abscissae() const { return x_; }

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
  S moment(int k, const P* p) const {
    S sum(0.0);
    const double* row = &moments_[static_cast<std::size_t>(k) * x_.size()];
    for (std::size_t j = 0; j < x_.size(); ++j) sum += S(row[j]) * S(p[j]);
    return sum;
  }
  std::vector<double> x_;
  std::vector<double> moments_;  // second derivatives at the knots = moments_ * y, row-major
};

}  // namespace costate
