#include "costate/element/body/planar_bar.h"

#include "costate/base/error.h"

namespace costate {

PlanarBar::PlanarBar(std::string name, Distribution distribution, PlanarVector ends,
                     const std::vector<int>& inertia_numbers, const std::vector<int>& gravity_numbers)
    : BodyOf("bar", std::move(name)),
      distribution_(distribution),
      ends_(std::move(ends)),
      free_i_(ends_.from().kind() == PlanarPoint::Kind::free),
      free_j_(ends_.to().kind() == PlanarPoint::Kind::free) {
  for (const PlanarPoint* end : {&ends_.from(), &ends_.to()})
    if (end->kind() != PlanarPoint::Kind::free && end->kind() != PlanarPoint::Kind::ground)
      throw ModelError(path(), "The ends of a bar must be free points or ground points, but '" + end->name() +
                                   "' is fixed to a body or a bar. Use a rigid body, or a free point with a "
                                   "revolute joint.");
  append_coordinates(ends_.coordinates());
  append_numbers(inertia_numbers);
  append_numbers(gravity_numbers);
  append_numbers(ends_.numbers());
}

void PlanarBar::calc_mass(const LocalState& s, LocalMatrix& M) const {
  double m, mc, k;
  coefficients(s.p, m, mc, k);
  const int j = offset_j();
  for (int i = 0; i < 2; ++i) {
    if (free_i_) M(i, i) = m - 2 * mc + k;
    if (free_j_) M(j + i, j + i) = k;
    if (free_i_ && free_j_) M(i, j + i) = M(j + i, i) = mc - k;
  }
}

void PlanarBar::calc_force(const LocalState& s, double* Q) const {
  double m, mc, k;
  coefficients(s.p, m, mc, k);
  const double* g = s.p + gravity_offset();
  for (int i = 0; i < 2; ++i) {
    if (free_i_) Q[i] = (m - mc) * g[i];
    if (free_j_) Q[offset_j() + i] = mc * g[i];
  }
}

void PlanarBar::calc_number_partial(const LocalState& s, int number, double* r_p) const {
  const int j = offset_j(), gravity = gravity_offset();
  if (number >= gravity + 2) return;  // places of ends on the ground
  double m, mc, k;
  coefficients(s.p, m, mc, k);
  if (number >= gravity) {
    const int i = number - gravity;
    if (free_i_) r_p[i] = mc - m;
    if (free_j_) r_p[j + i] = -mc;
    return;
  }
  double dm = number == 0 ? 1 : 0, dmc = 0, dk = 0;
  if (distribution_ == Distribution::uniform) {
    dmc = dm / 2;
    dk = dm / 3;
  } else {
    const double L = s.p[1], c = s.p[2];
    switch (number) {
      case 0:
        dmc = c / L;
        dk = c * c / (L * L);
        break;
      case 1:
        dmc = -mc / L;
        dk = -2 * k / L;
        break;
      case 2:
        dmc = m / L;
        dk = 2 * m * c / (L * L);
        break;
      default:
        dk = 1 / (L * L);
    }
  }
  const double* g = s.p + gravity;
  for (int i = 0; i < 2; ++i) {
    const double ai = free_i_ ? s.a[i] : 0, aj = free_j_ ? s.a[j + i] : 0;
    if (free_i_) r_p[i] = (dm - 2 * dmc + dk) * ai + (dmc - dk) * aj - (dm - dmc) * g[i];
    if (free_j_) r_p[j + i] = (dmc - dk) * ai + dk * aj - dmc * g[i];
  }
}

double PlanarBar::potential_energy(const LocalState& s) const {
  double m, mc, k;
  coefficients(s.p, m, mc, k);
  const double* g = s.p + gravity_offset();
  double xi = 0, yi = 0, xj = 0, yj = 0;
  const double* points = g + 2;
  ends_.from().position(s.q, points, xi, yi);
  ends_.to().position(s.q + offset_j(), points + ends_.from().numbers().size(), xj, yj);
  return -(m - mc) * (g[0] * xi + g[1] * yi) - mc * (g[0] * xj + g[1] * yj);
}

}  // namespace costate
