// Another law scaled by a design variable: { kind = "scaled", slope = 12000, nominal_slope = 9945.627, law =
// {...} } is slope/nominal_slope times that law; with reference = x0 the law is scaled about that point,
// where it keeps its value:
//   F(x) = f(x0) + (slope/nominal_slope) (f(x) - f(x0)).
// `slope` is the slope at some point in whose unit a designer thinks, `nominal_slope` that of the law as
// given.
#pragma once

#include <optional>

#include "costate/element/course.h"
#include "costate/element/law/law_at.h"
#include "costate/kind/law/law_options.h"

namespace costate {

/// Numbers: slope, nominal slope, then x0 when it scales about a reference, then those of the scaled law.
class ScaledLaw final : public ScalarLawOf<ScaledLaw>, public PlacedLaw {
 public:
  ScaledLaw(std::shared_ptr<const ScalarLaw> law, bool about_reference)
      : law_(std::move(law)), about_(about_reference) {}
  int number_count() const override { return own() + law_->number_count(); }

  template <class S, class P>
  S physics(const S& x, const P* p) const {
    const S scale = S(p[0]) / S(p[1]), f = law_at(*law_, x, p + own());
    if (!about_) return scale * f;
    const S f0 = law_at(*law_, S(p[2]), p + own());
    return f0 + scale * (f - f0);
  }
  void add_kinks(const double* p, std::vector<double>& x) const override { law_->add_kinks(p + own(), x); }
  void add_curvature_jumps(const double* p, std::vector<double>& x) const override {
    law_->add_curvature_jumps(p + own(), x);
  }
  void add_third_jumps(const double* p, std::vector<double>& x) const override { law_->add_third_jumps(p + own(), x); }
  void add_place_slopes(double x, const double* p, double* slopes) const override {
    law_->add_place_slopes(x, p + own(), slopes + own());
  }
  void add_places(const double* p, LawPlaces& places) const override { add_law_places(*law_, p + own(), places); }
  double integral(double x, const double* p) const override;

 private:
  int own() const { return about_ ? 3 : 2; }

  std::shared_ptr<const ScalarLaw> law_;
  bool about_;
};

/// Throws ModelError where nominal_slope is 0.
LawOptions scaled_law(double slope, double nominal_slope, const LawOptions& law, std::optional<double> reference = {});

}  // namespace costate
