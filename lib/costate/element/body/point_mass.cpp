#include "costate/element/body/point_mass.h"

namespace costate {

PointMass::PointMass(std::string name, std::vector<int> coordinates, std::vector<int> numbers)
    : BodyOf("mass", std::move(name)) {
  append_coordinates(coordinates);
  append_numbers(numbers);
}

void PointMass::calc_mass(const LocalState& s, LocalMatrix& M) const { M.diagonal().setConstant(s.p[0]); }

void PointMass::calc_force(const LocalState& s, double* Q) const {
  for (std::size_t i = 0; i < coordinates().size(); ++i) Q[i] = s.p[0] * s.p[1 + i];
}

void PointMass::calc_number_partial(const LocalState& s, int number, double* r_p) const {
  if (number > 0) {
    r_p[number - 1] = -s.p[0];
    return;
  }
  for (std::size_t i = 0; i < coordinates().size(); ++i) r_p[i] = s.a[i] - s.p[1 + i];
}

double PointMass::potential_energy(const LocalState& s) const {
  double energy = 0;
  for (std::size_t i = 0; i < coordinates().size(); ++i) energy -= s.p[0] * s.p[1 + i] * s.q[i];
  return energy;
}

}  // namespace costate
