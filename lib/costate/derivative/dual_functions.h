// The further functions of <cmath> on differentiating types, for formulas of users: with dual.h, which includes this.
// Where a function has no derivative (abs at 0, hypot at the origin) they take that of one side, or none.
#pragma once

#include <cmath>
#include <type_traits>

#include "costate/derivative/dual.h"

namespace costate {

inline Taylor2 abs(const Taylor2& x) { return std::signbit(x.c0) ? -x : x; }
inline Taylor2 tan(const Taylor2& x) {
  const double t = std::tan(x.c0), d = 1 + t * t;
  return compose(x, t, d, 2 * t * d);
}
inline Taylor2 asin(const Taylor2& x) {
  const double d = 1 / std::sqrt(1 - x.c0 * x.c0);
  return compose(x, std::asin(x.c0), d, x.c0 * d * d * d);
}
inline Taylor2 acos(const Taylor2& x) {
  const double d = 1 / std::sqrt(1 - x.c0 * x.c0);
  return compose(x, std::acos(x.c0), -d, -x.c0 * d * d * d);
}
inline Taylor2 sinh(const Taylor2& x) {
  const double s = std::sinh(x.c0);
  return compose(x, s, std::cosh(x.c0), s);
}
inline Taylor2 cosh(const Taylor2& x) {
  const double c = std::cosh(x.c0);
  return compose(x, c, std::sinh(x.c0), c);
}
inline Taylor2 log1p(const Taylor2& x) {
  const double d = 1 / (1 + x.c0);
  return compose(x, std::log1p(x.c0), d, -d * d);
}
inline Taylor2 expm1(const Taylor2& x) {
  const double e = std::exp(x.c0);
  return compose(x, std::expm1(x.c0), e, e);
}
inline Taylor2 cbrt(const Taylor2& x) {
  const double r = std::cbrt(x.c0), d = 1 / (3 * r * r);
  return compose(x, r, d, -2 * d / (3 * x.c0));
}
/// The angle of (x, y): its rate is (x y' - y x')/(x^2 + y^2).
inline Taylor2 atan2(const Taylor2& y, const Taylor2& x) {
  const double r = x.c0 * x.c0 + y.c0 * y.c0, moment = x.c0 * y.c1 - y.c0 * x.c1, rate = moment / r;
  const double turn = x.c0 * y.c2 - y.c0 * x.c2, along = x.c0 * x.c1 + y.c0 * y.c1;
  return {std::atan2(y.c0, x.c0), rate, (turn - 2 * rate * along) / r};
}

template <int N, class T>
Dual<N, T> abs(const Dual<N, T>& x) {
  return std::signbit(value_of(x)) ? -x : x;
}
template <int N, class T>
Dual<N, T> tan(const Dual<N, T>& x) {
  using std::tan;
  const T t = tan(x.v);
  return chain(x, t, T(1.0) + t * t);
}
template <int N, class T>
Dual<N, T> asin(const Dual<N, T>& x) {
  using std::asin;
  using std::sqrt;
  return chain(x, T(asin(x.v)), T(1.0) / T(sqrt(T(1.0) - x.v * x.v)));
}
template <int N, class T>
Dual<N, T> acos(const Dual<N, T>& x) {
  using std::acos;
  using std::sqrt;
  return chain(x, T(acos(x.v)), T(-1.0) / T(sqrt(T(1.0) - x.v * x.v)));
}
template <int N, class T>
Dual<N, T> sinh(const Dual<N, T>& x) {
  using std::cosh;
  using std::sinh;
  return chain(x, T(sinh(x.v)), T(cosh(x.v)));
}
template <int N, class T>
Dual<N, T> cosh(const Dual<N, T>& x) {
  using std::cosh;
  using std::sinh;
  return chain(x, T(cosh(x.v)), T(sinh(x.v)));
}
template <int N, class T>
Dual<N, T> log1p(const Dual<N, T>& x) {
  using std::log1p;
  return chain(x, T(log1p(x.v)), T(1.0) / (T(1.0) + x.v));
}
template <int N, class T>
Dual<N, T> expm1(const Dual<N, T>& x) {
  using std::exp;
  using std::expm1;
  return chain(x, T(expm1(x.v)), T(exp(x.v)));
}
template <int N, class T>
Dual<N, T> cbrt(const Dual<N, T>& x) {
  using std::cbrt;
  const T r = cbrt(x.v);
  return chain(x, r, T(1.0) / (T(3.0) * r * r));
}
template <int N, class T>
Dual<N, T> atan2(const Dual<N, T>& y, const Dual<N, T>& x) {
  using std::atan2;
  const T r = x.v * x.v + y.v * y.v;
  Dual<N, T> angle;
  angle.v = atan2(y.v, x.v);
  for (int i = 0; i < N; ++i) angle.d[i] = (x.v * y.d[i] - y.v * x.d[i]) / r;
  return angle;
}

// The rest is the same for all of them.
template <class S>
concept Differentiating = requires(const S& x) {
  is_constant(x);
  x + x;
}
&&!std::is_arithmetic_v<S>;

template <Differentiating S>
S fabs(const S& x) {
  return abs(x);
}
template <Differentiating S>
S log10(const S& x) {
  return log(x) * S(1 / std::log(10.0));
}
template <Differentiating S>
S log2(const S& x) {
  return log(x) * S(1 / std::log(2.0));
}
/// For x >= 0, at 0 with y > 0; with a constant exponent wherever x^y is.
template <Differentiating S>
S pow(const S& x, const S& y) {
  return is_constant(y) || value_of(x) == 0 ? pow(x, value_of(y)) : exp(y * log(x));
}
template <Differentiating S>
S pow(double x, const S& y) {
  return is_constant(y) || x == 0 ? S(std::pow(x, value_of(y))) : exp(y * S(std::log(x)));
}
template <Differentiating S>
S hypot(const S& x, const S& y) {
  return sqrt(x * x + y * y);
}
template <Differentiating S>
S hypot(const S& x, double y) {
  return hypot(x, S(y));
}
template <Differentiating S>
S hypot(double x, const S& y) {
  return hypot(S(x), y);
}
template <Differentiating S>
S atan2(const S& y, double x) {
  return atan2(y, S(x));
}
template <Differentiating S>
S atan2(double y, const S& x) {
  return atan2(S(y), x);
}

}  // namespace costate
