// A law by polynomials on intervals: { kind = "piecewise", breaks = [-0.2, 0.21], coefficients = [[...],
// [...],
// [...]] }. Left of the first break the first polynomial in x holds, right of the last one the last. The
// branch is exact: no smoothing, so that derivatives are those of the piece and the law is as smooth at its
// breaks as it is given. Where pieces meet in value, gradients of integrals along the motion are exact
// although the slope jumps; what a jump of the slope costs the integrator is a few steps. The breaks are
// fixed, the coefficients are numbers.
#pragma once

#include <vector>

#include "costate/element/course.h"
#include "costate/kind/law/law_options.h"

namespace costate {

class PiecewiseLaw final : public ScalarLawOf<PiecewiseLaw>, public PlacedLaw {
 public:
  /// breaks increasing, n >= 1; sizes: the numbers of coefficients of the n + 1 pieces, each at least 1.
  /// Throws ModelError otherwise.
  PiecewiseLaw(std::vector<double> breaks, const std::vector<std::size_t>& sizes);
  int number_count() const override { return offsets_.back(); }
  const std::vector<double>& breaks() const { return breaks_; }

  template <class S, class P>
  S physics(const S& x, const P* p) const {
    return polynomial<S>(piece(value_of(x)), x, p);
  }
  void add_kinks(const double* p, std::vector<double>& x) const override;
  void add_places(const double* p, LawPlaces& places) const override;
  /// Exact: piece by piece.
  double integral(double x, const double* p) const override;
  /// The polynomial of a piece, wherever x is.
  template <class S, class P>
  S polynomial(int piece, const S& x, const P* p) const {
    S sum(0.0);
    for (int i = offsets_[piece + 1] - 1; i >= offsets_[piece]; --i) sum = sum * x + S(p[i]);
    return sum;
  }

 private:
  int piece(double x) const {
    int k = 0;
    while (k < static_cast<int>(breaks_.size()) && x >= breaks_[k]) ++k;
    return k;
  }
  /// The integral of a piece's polynomial from 0.
  double primitive(int piece, double x, const double* p) const;

  std::vector<double> breaks_;
  std::vector<int> offsets_;  // of each piece's coefficients, and their end
};

/// How pieces have to meet at the breaks.
enum class Joins { none, value, slope };

/// coefficients: one polynomial c0 + c1 x + ... an interval, one more than breaks. Pieces must meet as
/// `joins` says, to 1e-3 of the largest terms at the breaks (printed data has few digits); throws ModelError
/// otherwise.
LawOptions piecewise_law(const std::vector<double>& breaks, const std::vector<std::vector<double>>& coefficients,
                         Joins joins = Joins::value);

}  // namespace costate
