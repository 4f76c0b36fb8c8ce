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

std::vector<Measure> CoordinateDriver::measures() const {
  std::vector<Measure> r;
  if (unit_ == "rad") r.push_back({"torque", "N m", true});
  if (unit_ == "m") r.push_back({"force", "N", true});
  r.push_back({"power", "W", true});
  return r;
}

PathDual CoordinateDriver::measure(int i, const MeasureArguments& x) const {
  if (i + 1 < static_cast<int>(measures().size())) return -x.lambda[0];
  PathDual rate(0.0);
  for (std::size_t k = 0; k < coordinates().size(); ++k) rate += x.p[k] * x.v[k];
  return -x.lambda[0] * rate;
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
