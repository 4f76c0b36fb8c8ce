// A driven (rheonomic) or constant condition on a weighted sum of coordinates: phi = sum_k c_k q_k - f(t).
// Drives a point's x or y, an angle, a relative angle (weights +1, -1) or ties two by a ratio (a gear).
// Numbers: the weights c_k, then those of the law f.
#pragma once

#include "costate/element/course.h"
#include "costate/element/element.h"
#include "costate/element/law/scalar_law.h"

namespace costate {

class CoordinateDriver final : public ConstraintOf<CoordinateDriver>, public CourseElement {
 public:
  CoordinateDriver(std::string kind, std::string name, const std::vector<int>& coordinates,
                   const std::vector<int>& weight_numbers, std::shared_ptr<const ScalarLaw> law,
                   const std::vector<int>& law_numbers);

  /// Of all its coordinates, "rad" or "m"; otherwise its effort is not reported, its power is.
  void set_unit(std::string unit) { unit_ = std::move(unit); }

  int rows() const override { return 1; }
  std::string row_name(int) const override { return "drive"; }
  bool rheonomic() const override { return true; }
  void add_kinks(const double* p, std::vector<double>& times) const override {
    law_->add_kinks(p + coordinates().size(), times);
  }
  void add_acceleration_jumps(const double* p, std::vector<double>& times) const override {
    law_->add_curvature_jumps(p + coordinates().size(), times);
  }
  void add_third_jumps(const double* p, std::vector<double>& times) const override {
    law_->add_third_jumps(p + coordinates().size(), times);
  }
  void add_time_slopes(double t, const double* p, double* slopes) const override {
    law_->add_place_slopes(t, p + coordinates().size(), slopes + coordinates().size());
  }
  void add_course(const double* p, Course& course) const override { course.add(*law_, p + coordinates().size()); }

  template <class S>
  void physics(const S& t, const S* q, const S* p, S* phi) const {
    const auto n = coordinates().size();
    phi[0] = -law_->value(t, p + n);
    for (std::size_t k = 0; k < n; ++k) phi[0] += p[k] * q[k];
  }
  bool by_hand() const override { return true; }
  void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const override;
  void calc_phi_t(const LocalState& s, double* phi_t) const override;
  void calc_bias(const LocalState& s, double* bias) const override;
  void calc_hessian(const LocalState&, LocalMatrix&) const override {}
  void calc_partials(const LocalState&, LocalMatrix&, LocalMatrix&, LocalMatrix&) const override {}
  /// The torque or force -lambda on a coordinate of weight 1, and the power that it gives to the mechanism.
  std::vector<Measure> measures() const override;
  PathDual measure(int i, const MeasureArguments& x) const override;

 private:
  std::shared_ptr<const ScalarLaw> law_;
  std::string unit_;
};

}  // namespace costate
