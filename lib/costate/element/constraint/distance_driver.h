// Drives the distance between two planar points: phi = d.d - f(t)^2 [m^2] (a hydraulic ram of given stroke).
// Numbers: those of the points, then those of the law f [m].
#pragma once

#include "costate/element/element.h"
#include "costate/element/law/scalar_law.h"
#include "costate/element/point/planar_vector.h"

namespace costate {

class DistanceDriver final : public ConstraintOf<DistanceDriver> {
 public:
  DistanceDriver(std::string kind, std::string name, PlanarVector d, std::shared_ptr<const ScalarLaw> law,
                 const std::vector<int>& law_numbers);
  int rows() const override { return 1; }
  std::string row_name(int) const override { return "length"; }
  bool rheonomic() const override { return true; }
  void add_kinks(const double* p, std::vector<double>& times) const override {
    law_->add_kinks(p + d_.number_count(), times);
  }

  template <class S>
  void physics(const S& t, const S* q, const S* p, S* phi) const {
    S d[2];
    d_.value(q, p, d);
    const S f = law_->value(t, p + d_.number_count());
    phi[0] = d[0] * d[0] + d[1] * d[1] - f * f;
  }
  // All derivative blocks come from dual numbers.

 private:
  PlanarVector d_;
  std::shared_ptr<const ScalarLaw> law_;
};

}  // namespace costate
