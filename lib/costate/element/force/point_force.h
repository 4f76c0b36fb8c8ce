// A force on a planar point with components in the ground frame, given as laws of time.
// Numbers: those of the x law, of the y law, then those of the point.
#pragma once

#include "costate/element/course.h"
#include "costate/element/element.h"
#include "costate/element/law/scalar_law.h"
#include "costate/element/point/planar_point.h"

namespace costate {

class PointForce : public ForceOf<PointForce>, public CourseElement {
 public:
  PointForce(std::string name, PlanarPoint point, std::shared_ptr<const ScalarLaw> x,
             std::shared_ptr<const ScalarLaw> y, const std::vector<int>& law_numbers);

  template <class S>
  void physics(const S& t, const S* q, const S*, const S*, const S* p, S* Q, S*) const {
    const S f[2] = {x_->value(t, p), y_->value(t, p + x_->number_count())};
    point_.add_generalized_force(q, p + law_number_count_, f, Q);
  }
  void add_course(const double* p, Course& course) const override {
    course.add(*x_, p);
    course.add(*y_, p + x_->number_count());
  }
  bool by_hand() const override { return true; }
  void calc_partials(const LocalState& s, ForcePartials out) const override;
  /// The power is what it gives to the mechanism.
  std::vector<Measure> measures() const override {
    return {{"force_x", "N", false}, {"force_y", "N", false}, {"power", "W", false}};
  }
  PathDual measure(int i, const MeasureArguments& x) const override;

 private:
  PlanarPoint point_;
  std::shared_ptr<const ScalarLaw> x_, y_;
  int law_number_count_;
};

/// A torque on angle coordinates as a law of time: Q_j = +T(t), Q_i = -T(t). Numbers: those of the law [N m].
class Couple : public ForceOf<Couple>, public CourseElement {
 public:
  Couple(std::string name, const std::vector<int>& coordinates, std::shared_ptr<const ScalarLaw> torque,
         const std::vector<int>& law_numbers);

  template <class S>
  void physics(const S& t, const S*, const S*, const S*, const S* p, S* Q, S*) const {
    const S torque = torque_->value(t, p);
    const auto n = coordinates().size();
    Q[n - 1] = torque;
    if (n == 2) Q[0] = -torque;
  }
  void add_course(const double* p, Course& course) const override { course.add(*torque_, p); }
  bool by_hand() const override { return true; }
  void calc_partials(const LocalState&, ForcePartials) const override {}
  /// The torque on the last angle, and the power that it gives to the mechanism.
  std::vector<Measure> measures() const override { return {{"torque", "N m", false}, {"power", "W", false}}; }
  PathDual measure(int i, const MeasureArguments& x) const override;

 private:
  std::shared_ptr<const ScalarLaw> torque_;
};

}  // namespace costate
