// A law by polynomials on intervals: { kind = "piecewise", breaks = [-0.2, 0.21], coefficients = [[...],
// [...],
// [...]] }. Left of the first break the first polynomial in x holds, right of the last one the last. The
// branch is exact: no smoothing, so that derivatives are those of the piece and the law is as smooth at its
// breaks as it is given. Where pieces meet in value, gradients of integrals along the motion are exact
// although the slope jumps; what a jump of the slope costs the integrator is a few steps. Coefficients and
// breaks are numbers. A break that moves parts pieces of unlike slope, unless it binds the coefficients or the
// law is continued: then each piece begins where the one before has come to,
//   f(x) = f(b) + c1 (x - b) + c2 (x - b)^2 + ...  behind the break b,
// whatever the numbers are.
#pragma once

#include <vector>

#include "costate/element/course.h"
#include "costate/kind/law/law_options.h"

namespace costate {

/// Numbers: the coefficients, piece by piece, then the breaks.
class PiecewiseLaw final : public ScalarLawOf<PiecewiseLaw>, public PlacedLaw {
 public:
  /// breaks >= 1; sizes: the numbers of coefficients of the breaks + 1 pieces, each at least 1. continued: every piece
  /// but the first has the coefficients c1, c2, ... alone. Throws ModelError otherwise.
  PiecewiseLaw(int breaks, const std::vector<std::size_t>& sizes, bool continued);
  int number_count() const override { return offsets_.back() + breaks_; }

  template <class S, class P>
  S physics(const S& x, const P* p) const {
    return value_of_piece<S>(piece(value_of(x), p), x, p);
  }
  void add_kinks(const double* p, std::vector<double>& x) const override;
  void add_curvature_jumps(const double* p, std::vector<double>& x) const override;
  void add_third_jumps(const double* p, std::vector<double>& x) const override;
  void add_place_slopes(double x, const double* p, double* slopes) const override;
  /// Throws ModelError where the breaks do not increase (any more).
  void add_places(const double* p, LawPlaces& places) const override;
  /// Exact: piece by piece.
  double integral(double x, const double* p) const override;
  /// What a piece says, wherever x is.
  template <class S, class P>
  S value_of_piece(int piece, const S& x, const P* p) const {
    if (!continued_ || piece == 0) return polynomial<S>(piece, x, p);
    S sum = polynomial<S>(0, S(first_break(p)[0]), p);
    for (int k = 1; k <= piece; ++k) {
      const S behind = (k == piece ? x : S(first_break(p)[k])) - S(first_break(p)[k - 1]);
      sum += behind * polynomial<S>(k, behind, p);
    }
    return sum;
  }

 private:
  template <class P>
  const P* first_break(const P* p) const {
    return p + offsets_.back();
  }
  template <class S, class P>
  S polynomial(int piece, const S& x, const P* p) const {
    S sum(0.0);
    for (int i = offsets_[static_cast<std::size_t>(piece) + 1] - 1; i >= offsets_[static_cast<std::size_t>(piece)]; --i)
      sum = sum * x + S(p[i]);
    return sum;
  }
  template <class P>
  int piece(double x, const P* p) const {
    int k = 0;
    while (k < breaks_ && x >= value_of(first_break(p)[k])) ++k;
    return k;
  }
  /// Of the piece over from ... to, on which it holds.
  double integral_of_piece(int piece, double from, double to, const double* p) const;

  int breaks_;
  bool continued_;
  std::vector<int> offsets_;  // of each piece's coefficients, and their end
};

/// How pieces have to meet at the breaks.
enum class Joins { none, value, slope };

/// coefficients: one polynomial c0 + c1 x + ... an interval, one more than breaks. Pieces must meet as
/// `joins` says, to 1e-3 of the largest terms at the breaks (printed data has few digits); throws ModelError
/// otherwise.
LawOptions piecewise_law(const std::vector<double>& breaks, const std::vector<std::vector<double>>& coefficients,
                         Joins joins = Joins::value);
/// The same with pieces that begin where the one before ends: behind the first break rows [c1, c2, ...] in powers of
/// the distance from the break before.
LawOptions continued_law(const std::vector<double>& breaks, const std::vector<std::vector<double>>& coefficients);

}  // namespace costate
