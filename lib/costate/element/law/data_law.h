// A law through measured points, by a natural cubic spline or by straight lines between them.
#pragma once

#include <string>
#include <vector>

#include "costate/element/course.h"
#include "costate/element/law/from_derivatives.h"
#include "costate/element/law/point_curve.h"
#include "costate/element/law/scalar_law.h"

namespace costate {

/// scale times the curve through (x_k, y_k). Number: scale. The points are data, not numbers, so that there may be many
/// of them.
class DataLaw final : public ScalarLawOf<DataLaw>, public PlacedLaw {
 public:
  using Between = PointCurve::Between;
  /// What is said beyond the first and the last point: nothing (a StepError), their values, the end's tangents, or
  /// the same again: of a spline, which is periodic then.
  enum class Beyond { refuse, hold, tangent, repeat };
  /// x strictly increasing, at least 2 points, all finite, the last y the first where they repeat; throws ModelError
  /// otherwise. `source` is for messages;
  /// `column` and `unit` are those of y where it was measured, `argument` and `argument_unit` those of x.
  DataLaw(std::vector<double> x, std::vector<double> y, Between between, Beyond beyond, std::string source,
          std::string column = {}, std::string unit = {}, std::string argument = {}, std::string argument_unit = {});
  const std::string& column() const { return column_; }
  const std::string& unit() const { return unit_; }
  const std::string& argument() const { return argument_; }
  const std::string& argument_unit() const { return argument_unit_; }
  int number_count() const override { return 1; }

  template <class S, class P>
  S physics(const S& x, const P* p) const {
    double f[5];
    calc_derivatives(value_of(x), f);
    return S(p[0]) * from_derivatives(x, f);
  }
  void add_kinks(const double*, std::vector<double>& x) const override;
  void add_places(const double* p, LawPlaces& places) const override;
  /// From 0, or where the data do not reach there from their first point.
  double integral(double x, const double* p) const override;

 private:
  void calc_derivatives(double x, double* f) const;
  /// How many lengths lie between x and the points, where they repeat.
  double lengths(double x) const;
  double length() const { return curve_.x().back() - curve_.x().front(); }
  double area(std::size_t k, double a, double b) const;
  /// Of the curve without its scale, from the first point on.
  double area_to(double x) const;
  PointCurve curve_;
  Between between_;
  Beyond beyond_;
  std::string source_, column_, unit_, argument_, argument_unit_;
};

}  // namespace costate
