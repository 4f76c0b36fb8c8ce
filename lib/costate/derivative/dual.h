// Forward-mode automatic differentiation for small functions: Dual<N> carries N first derivatives,
// Taylor2 carries the first two time derivatives along a path. Dual<N, Taylor2> gives all derivative
// blocks of a mechanism's element (third order mixed: one partial derivative of a second time derivative).
#pragma once

#include <array>
#include <cmath>
#include <cstddef>

namespace costate {

/// The value of an arithmetic type without its derivative parts.
inline double value_of(double x) { return x; }
/// Whether x has no derivatives.
inline bool is_constant(double) { return true; }

/// A truncated Taylor expansion x(s) = c0 + c1 s + c2 s^2 / 2 (c1, c2 are the first and second derivative).
struct Taylor2 {
  double c0 = 0, c1 = 0, c2 = 0;
  constexpr Taylor2() = default;
  constexpr Taylor2(double v) : c0(v) {}  // NOLINT: implicit by design, a constant is a number
  constexpr Taylor2(double v, double d, double dd) : c0(v), c1(d), c2(dd) {}

  Taylor2& operator+=(const Taylor2& o) { return *this = Taylor2(c0 + o.c0, c1 + o.c1, c2 + o.c2); }
  Taylor2& operator-=(const Taylor2& o) { return *this = Taylor2(c0 - o.c0, c1 - o.c1, c2 - o.c2); }
  Taylor2& operator*=(const Taylor2& o) {
    return *this = Taylor2(c0 * o.c0, c1 * o.c0 + c0 * o.c1, c2 * o.c0 + 2 * c1 * o.c1 + c0 * o.c2);
  }
  Taylor2& operator/=(const Taylor2& o) {
    const double q0 = c0 / o.c0;
    const double q1 = (c1 - q0 * o.c1) / o.c0;
    return *this = Taylor2(q0, q1, (c2 - 2 * q1 * o.c1 - q0 * o.c2) / o.c0);
  }
  friend Taylor2 operator+(Taylor2 a, const Taylor2& b) { return a += b; }
  friend Taylor2 operator-(Taylor2 a, const Taylor2& b) { return a -= b; }
  friend Taylor2 operator*(Taylor2 a, const Taylor2& b) { return a *= b; }
  friend Taylor2 operator/(Taylor2 a, const Taylor2& b) { return a /= b; }
  friend Taylor2 operator-(const Taylor2& a) { return {-a.c0, -a.c1, -a.c2}; }
};

inline double value_of(const Taylor2& x) { return x.c0; }
inline bool is_constant(const Taylor2& x) { return x.c1 == 0 && x.c2 == 0; }

/// f(x) for a scalar function with value f0, slope f1 and curvature f2 at x.c0.
inline Taylor2 compose(const Taylor2& x, double f0, double f1, double f2) {
  return {f0, f1 * x.c1, f2 * x.c1 * x.c1 + f1 * x.c2};
}
inline Taylor2 sqrt(const Taylor2& x) {
  const double r = std::sqrt(x.c0);
  return compose(x, r, 0.5 / r, -0.25 / (r * x.c0));
}
inline Taylor2 sin(const Taylor2& x) {
  const double s = std::sin(x.c0), c = std::cos(x.c0);
  return compose(x, s, c, -s);
}
inline Taylor2 cos(const Taylor2& x) {
  const double s = std::sin(x.c0), c = std::cos(x.c0);
  return compose(x, c, -s, -c);
}
inline Taylor2 exp(const Taylor2& x) {
  const double e = std::exp(x.c0);
  return compose(x, e, e, e);
}
inline Taylor2 log(const Taylor2& x) { return compose(x, std::log(x.c0), 1 / x.c0, -1 / (x.c0 * x.c0)); }
inline Taylor2 tanh(const Taylor2& x) {
  const double t = std::tanh(x.c0), d = 1 - t * t;
  return compose(x, t, d, -2 * t * d);
}
inline Taylor2 atan(const Taylor2& x) {
  const double d = 1 / (1 + x.c0 * x.c0);
  return compose(x, std::atan(x.c0), d, -2 * x.c0 * d * d);
}
/// factor x^n, zero where the factor is, whatever x^n may be: a derivative of x, x^2, ... at 0.
inline double power_term(double factor, double x, double n) { return factor == 0 ? 0 : factor * std::pow(x, n); }
/// x to a constant real power.
inline Taylor2 pow(const Taylor2& x, double n) {
  return compose(x, std::pow(x.c0, n), power_term(n, x.c0, n - 1), power_term(n * (n - 1), x.c0, n - 2));
}

/// A value with N first derivatives; T is double or another differentiating type (nesting gives mixed ones).
template <int N, class T = double>
struct Dual {
  T v{};
  std::array<T, N> d{};

  constexpr Dual() = default;
  constexpr Dual(double value) : v(value) {}  // NOLINT: implicit by design
  template <class U = T, std::enable_if_t<!std::is_same_v<U, double>, int> = 0>
  constexpr Dual(const T& value) : v(value) {}  // NOLINT
  /// An independent variable: derivative 1 with respect to direction i.
  static Dual variable(const T& value, int i) {
    Dual x;
    x.v = value;
    x.d[static_cast<std::size_t>(i)] = T(1.0);
    return x;
  }

  Dual& operator+=(const Dual& o) {
    v += o.v;
    for (int i = 0; i < N; ++i) d[i] += o.d[i];
    return *this;
  }
  Dual& operator-=(const Dual& o) {
    v -= o.v;
    for (int i = 0; i < N; ++i) d[i] -= o.d[i];
    return *this;
  }
  Dual& operator*=(const Dual& o) {
    for (int i = 0; i < N; ++i) d[i] = d[i] * o.v + v * o.d[i];
    v *= o.v;
    return *this;
  }
  Dual& operator/=(const Dual& o) {
    v /= o.v;
    for (int i = 0; i < N; ++i) d[i] = (d[i] - v * o.d[i]) / o.v;
    return *this;
  }
  friend Dual operator+(Dual a, const Dual& b) { return a += b; }
  friend Dual operator-(Dual a, const Dual& b) { return a -= b; }
  friend Dual operator*(Dual a, const Dual& b) { return a *= b; }
  friend Dual operator/(Dual a, const Dual& b) { return a /= b; }
  friend Dual operator-(Dual a) {
    a.v = -a.v;
    for (int i = 0; i < N; ++i) a.d[i] = -a.d[i];
    return a;
  }
};

template <int N, class T>
double value_of(const Dual<N, T>& x) {
  return value_of(x.v);
}
template <int N, class T>
bool is_constant(const Dual<N, T>& x) {
  bool all = is_constant(x.v);
  for (const T& d : x.d) all = all && value_of(d) == 0 && is_constant(d);
  return all;
}

/// f(x) where f has value f0 and slope f1 at x.v (both of type T).
template <int N, class T>
Dual<N, T> chain(const Dual<N, T>& x, const T& f0, const T& f1) {
  Dual<N, T> r;
  r.v = f0;
  for (int i = 0; i < N; ++i) r.d[i] = f1 * x.d[i];
  return r;
}
template <int N, class T>
Dual<N, T> sqrt(const Dual<N, T>& x) {
  using std::sqrt;
  const T r = sqrt(x.v);
  return chain(x, r, T(0.5) / r);
}
template <int N, class T>
Dual<N, T> sin(const Dual<N, T>& x) {
  using std::cos;
  using std::sin;
  return chain(x, T(sin(x.v)), T(cos(x.v)));
}
template <int N, class T>
Dual<N, T> cos(const Dual<N, T>& x) {
  using std::cos;
  using std::sin;
  return chain(x, T(cos(x.v)), T(-sin(x.v)));
}
template <int N, class T>
Dual<N, T> exp(const Dual<N, T>& x) {
  using std::exp;
  const T e = exp(x.v);
  return chain(x, e, e);
}
template <int N, class T>
Dual<N, T> log(const Dual<N, T>& x) {
  using std::log;
  return chain(x, T(log(x.v)), T(1.0) / x.v);
}
template <int N, class T>
Dual<N, T> tanh(const Dual<N, T>& x) {
  using std::tanh;
  const T t = tanh(x.v);
  return chain(x, t, T(1.0) - t * t);
}
template <int N, class T>
Dual<N, T> atan(const Dual<N, T>& x) {
  using std::atan;
  return chain(x, T(atan(x.v)), T(1.0) / (T(1.0) + x.v * x.v));
}
template <int N, class T>
Dual<N, T> pow(const Dual<N, T>& x, double n) {
  using std::pow;
  return chain(x, T(pow(x.v, n)), n == 0 ? T(0.0) : T(n) * T(pow(x.v, n - 1)));
}

/// The scalar that every element's physics is also compiled for: one partial derivative of a path's
/// value, first and second time derivative.
using PathDual = Dual<1, Taylor2>;

/// A path dual whose every part carries its change along a direction as well: a constraint's second derivatives.
using DirectedPathDual = Dual<1, PathDual>;

}  // namespace costate

#include "costate/derivative/dual_functions.h"
