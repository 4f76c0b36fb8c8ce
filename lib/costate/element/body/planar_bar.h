// The inertia of a rigid bar between two planar points, each free (natural coordinates) or on the ground; its
// length is kept by a distance constraint. With mass m, length L, centre of mass at s from the first point
// and moment of inertia I about it, c = s/L and k = (I + m s^2)/L^2:
//   M = [[(m - 2 m c + k) E, (m c - k) E], [(m c - k) E, k E]],   weight m g split (1 - c, c).
// A uniform bar has c = 1/2, k = m/3 whatever its length: M = m/6 [[2E, E], [E, 2E]].
#pragma once

#include "costate/element/element.h"
#include "costate/element/point/planar_vector.h"

namespace costate {

class PlanarBar final : public BodyOf<PlanarBar> {
 public:
  enum class Distribution { uniform, general };
  /// inertia_numbers: uniform {m}, general {m, L, s, I} [kg, m, m, kg m^2]; gravity_numbers: {gx, gy} [m/s^2].
  PlanarBar(std::string name, Distribution distribution, PlanarVector ends, const std::vector<int>& inertia_numbers,
            const std::vector<int>& gravity_numbers);

  template <class S>
  void physics(const S*, const S*, const S* a, const S* p, S* r) const {
    S m, mc, k;
    coefficients(p, m, mc, k);
    const S* g = p + gravity_offset();
    for (int i = 0; i < 2; ++i) {
      const S ai = free_i_ ? a[i] : S(0.0);
      const S aj = free_j_ ? a[offset_j() + i] : S(0.0);
      if (free_i_) r[i] = (m - S(2.0) * mc + k) * ai + (mc - k) * aj - (m - mc) * g[i];
      if (free_j_) r[offset_j() + i] = (mc - k) * ai + k * aj - mc * g[i];
    }
  }
  bool by_hand() const override { return true; }
  bool constant_mass() const override { return true; }
  bool constant_force() const override { return true; }
  void calc_mass(const LocalState& s, LocalMatrix& M) const override;
  void calc_force(const LocalState& s, double* Q) const override;
  void calc_partials(const LocalState&, LocalMatrix&, LocalMatrix&) const override {}
  void calc_number_partial(const LocalState& s, int number, double* r_p) const override;
  double potential_energy(const LocalState& s) const override;

 private:
  template <class S>
  void coefficients(const S* p, S& m, S& mc, S& k) const {
    m = p[0];
    if (distribution_ == Distribution::uniform) {
      mc = m / S(2.0);
      k = m / S(3.0);
    } else {
      mc = m * p[2] / p[1];
      k = (p[3] + m * p[2] * p[2]) / (p[1] * p[1]);
    }
  }
  int gravity_offset() const { return distribution_ == Distribution::uniform ? 1 : 4; }
  int offset_j() const { return free_i_ ? 2 : 0; }

  Distribution distribution_;
  PlanarVector ends_;
  bool free_i_, free_j_;
};

}  // namespace costate
