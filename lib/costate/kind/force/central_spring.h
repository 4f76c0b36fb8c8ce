// A spring of natural length 0 and nothing but its stiffness: its force -k d has a value, and a derivative, where its
// ends meet (F / L stays k), though the line that it acts along has no direction there.
#pragma once

#include <fmt/format.h>

#include <string>
#include <utility>

#include "costate/base/error.h"
#include "costate/element/force/force_law.h"
#include "costate/kind/force/axial_line.h"

namespace costate {

/// d, but (kEndsMeet, 0, 0) more where it is shorter than any force can tell: F n = k d is then off by k kEndsMeet, and
/// its derivatives are exact.
constexpr double kEndsMeet = 2e-12;  // m

template <class Line>
class LineWithEnds : public Line {
 public:
  explicit LineWithEnds(Line d) : Line(std::move(d)) {}
  template <class S>
  void value(const S* q, const S* p, S* d) const {
    Line::value(q, p, d);
    double square = 0;
    for (int i = 0; i < Line::Vector::RowsAtCompileTime; ++i) square += value_of(d[i]) * value_of(d[i]);
    if (square < kEndsMeet * kEndsMeet) d[0] += S(kEndsMeet);
  }
};

template <class Line>
inline constexpr int kMaxNumbers<LineWithEnds<Line>> = kMaxNumbers<Line>;

/// SpringDamperLaw's numbers, k, x0, c, F0, of which only k may differ from 0 where the ends meet.
struct CentralSpringLaw {
  static constexpr int states = 0;
  std::string path;

  template <class S, class P>
  void operator()(const S& t, const S& x, const S& rate, const S* z, const P* p, S& force, S* zdot) const {
    for (int k = 1; k < 4; ++k)
      if (value_of(p[k]) != 0) require_direction(value_of(x));
    SpringDamperLaw{}(t, x, rate, z, p, force, zdot);
  }
  double number_partial(double x, double rate, const double* p, int k) const {
    if (k > 0) require_direction(x);
    return SpringDamperLaw{}.number_partial(x, rate, p, k);
  }
  double potential_energy(double x, const double* p) const { return SpringDamperLaw{}.potential_energy(x, p); }

 private:
  void require_direction(double length) const {
    if (length < 2 * kEndsMeet)
      throw ModelError(path,
                       "Its end points coincide, so that a natural length, damping or preload has no direction, nor "
                       "a derivative with respect to one. Keep these numbers zero and fixed, or check the attachment "
                       "points or the start.");
  }
};

}  // namespace costate
