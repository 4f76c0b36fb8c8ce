// Aerodynamic drag at a point, of the plane or of space: F = -1/2 density c_d area |w| w, w = velocity of the
// point less that of the wind. |w| w has no second derivative at rest, so that |w| is taken as sqrt(w.w +
// w0^2): smooth everywhere, the force too large by the fraction (w0/w)^2/2 at most. Numbers: density
// [kg/m^3], c_d, area [m^2], w0 [m/s], those of the wind's laws of time [m/s], those of the point.
#pragma once

#include <array>
#include <memory>
#include <type_traits>

#include "costate/element/course.h"
#include "costate/element/element.h"
#include "costate/element/law/scalar_law.h"
#include "costate/element/point/planar_point.h"
#include "costate/element/point/spatial_point.h"

namespace costate {

template <class Point>
class Drag final : public ForceOf<Drag<Point>>, public CourseElement {
 public:
  static constexpr int dim = Point::Vector::RowsAtCompileTime;
  using Wind = std::array<std::shared_ptr<const ScalarLaw>, dim>;

  Drag(std::string name, Point point, Wind wind, const std::vector<int>& numbers)
      : ForceOf<Drag<Point>>("drag", std::move(name)), point_(std::move(point)), wind_(std::move(wind)) {
    this->append_coordinates(point_.coordinates());
    this->append_numbers(numbers);
    this->append_numbers(point_.numbers());
    point_numbers_ = static_cast<int>(numbers.size());
  }

  template <class S>
  void physics(const S& t, const S* q, const S* v, const S*, const S* p, S* Q, S*) const {
    S f[dim], speed;
    force(t, q, v, p, f, speed);
    point_.add_generalized_force(q, p + point_numbers_, f, Q);
  }

  void add_course(const double* p, Course& course) const override {
    p += 4;
    for (const auto& f : wind_) {
      course.add(*f, p);
      p += f->number_count();
    }
  }

  std::vector<Measure> measures() const override { return {{"speed", "m/s", false}, {"force", "N", false}}; }
  PathDual measure(int i, const MeasureArguments& x) const override {
    PathDual f[dim], speed;
    const PathDual true_speed = force(x.t, x.q, x.v, x.p, f, speed);
    return i == 0 ? true_speed : PathDual(0.5) * x.p[0] * x.p[1] * x.p[2] * speed * true_speed;
  }

 private:
  /// The force and the smoothed speed against the air; returns |w|, whose slope is taken as zero where it is zero.
  template <class S>
  S force(const S& t, const S* q, const S* v, const S* p, S* f, S& speed) const {
    using std::sqrt;
    S w[dim];
    if constexpr (std::is_same_v<Point, PlanarPoint>)
      point_.velocity(q, v, p + point_numbers_, w[0], w[1]);
    else
      point_.velocity(q, v, p + point_numbers_, w);
    const S* wind = p + 4;
    S square(0);
    for (int k = 0; k < dim; ++k) {
      w[k] -= wind_[k]->value(t, wind);
      wind += wind_[k]->number_count();
      square += w[k] * w[k];
    }
    speed = sqrt(square + p[3] * p[3]);
    const S factor = S(-0.5) * p[0] * p[1] * p[2] * speed;
    for (int k = 0; k < dim; ++k) f[k] = factor * w[k];
    return value_of(square) > 0 ? sqrt(square) : S(0);
  }

  Point point_;
  Wind wind_;
  int point_numbers_ = 0;
};

}  // namespace costate
