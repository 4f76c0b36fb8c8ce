#include "costate/element/body/point_mass.h"

namespace costate {

PointMass::PointMass(std::string name, std::vector<int> coordinates, std::vector<int> numbers)
    : BodyOf("mass", std::move(name)) {
  append_coordinates(coordinates);
  append_numbers(numbers);
}

void PointMass::calc_mass(const LocalState& s, LocalMatrix& M) const { M(0, 0) = M(1, 1) = s.p[0]; }

void PointMass::calc_force(const LocalState& s, double* Q) const {
  for (int i = 0; i < 2; ++i) Q[i] = s.p[0] * s.p[1 + i];
}

void PointMass::calc_number_partial(const LocalState& s, int number, double* r_p) const {
  if (number == 0)
    for (int i = 0; i < 2; ++i) r_p[i] = s.a[i] - s.p[1 + i];
  else
    r_p[number - 1] = -s.p[0];
}

double PointMass::potential_energy(const LocalState& s) const {
  return -s.p[0] * (s.p[1] * s.q[0] + s.p[2] * s.q[1]);
}

}  // namespace costate
