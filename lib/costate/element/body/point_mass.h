// A mass concentrated at a free point. Coordinates x, y, in space z; numbers: mass [kg], gravity x, y(, z) [m/s^2].
#pragma once

#include "costate/element/element.h"

namespace costate {

class PointMass final : public BodyOf<PointMass> {
 public:
  PointMass(std::string name, std::vector<int> coordinates, std::vector<int> numbers);

  template <class S>
  void physics(const S*, const S*, const S* a, const S* p, S* r) const {
    for (std::size_t i = 0; i < coordinates().size(); ++i) r[i] = p[0] * (a[i] - p[1 + i]);
  }
  bool by_hand() const override { return true; }
  bool constant_mass() const override { return true; }
  bool constant_force() const override { return true; }
  void calc_mass(const LocalState& s, LocalMatrix& M) const override;
  void calc_force(const LocalState& s, double* Q) const override;
  void calc_partials(const LocalState&, LocalMatrix&, LocalMatrix&) const override {}
  void calc_number_partial(const LocalState& s, int number, double* r_p) const override;
  double potential_energy(const LocalState& s) const override;
};

}  // namespace costate
