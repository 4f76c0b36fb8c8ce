#include "costate/element/constraint/coordinate_driver.h"

namespace costate {

CoordinateDriver::CoordinateDriver(std::string kind, std::string name, const std::vector<int>& coordinates,
                                   const std::vector<int>& weight_numbers, std::shared_ptr<const ScalarLaw> law,
                                   const std::vector<int>& law_numbers)
    : ConstraintOf(std::move(kind), std::move(name)), law_(std::move(law)) {
  append_coordinates(coordinates);
  append_numbers(weight_numbers);
  append_numbers(law_numbers);
}

void CoordinateDriver::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  for (int k = 0; k < phi_q.cols(); ++k) phi_q(0, k) = s.p[k];
}

void CoordinateDriver::calc_phi_t(const LocalState& s, double* phi_t) const {
  phi_t[0] = -law_->curve(s.t, s.p + coordinates().size()).c1;
}

void CoordinateDriver::calc_bias(const LocalState& s, double* bias) const {
  bias[0] = -law_->curve(s.t, s.p + coordinates().size()).c2;
}

}  // namespace costate
