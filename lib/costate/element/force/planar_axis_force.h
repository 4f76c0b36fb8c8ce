// A force along an axis fixed in a body of the plane (or in the ground), with a law without states of the
// displacement along it: x = u . d, d = r_j - r_i, u = (cos, sin)(angle_i + axis), as a prismatic joint's
// travel. Q = -F x_q. Numbers: those of the law, the axis [rad] in the first body's frame, those of the
// points.
#pragma once

#include "costate/element/element.h"
#include "costate/element/force/dual_partials.h"
#include "costate/element/point/planar_vector.h"

namespace costate {

template <class Law>
class PlanarAxisForce final : public ForceOf<PlanarAxisForce<Law>> {
 public:
  /// axis_number: local index Law::number_count. The first point is on a body or on the ground.
  PlanarAxisForce(std::string kind, std::string name, Law law, const std::vector<int>& law_numbers, int axis_number,
                  PlanarVector d)
      : ForceOf<PlanarAxisForce<Law>>(std::move(kind), std::move(name)),
        law_(std::move(law)),
        d_(std::move(d)),
        turns_(d_.from().kind() == PlanarPoint::Kind::on_body) {
    this->append_coordinates(d_.coordinates());
    this->append_numbers(law_numbers);
    this->append_numbers({axis_number});
    this->append_numbers(d_.numbers());
  }

  template <class S>
  void physics(const S& t, const S* q, const S* v, const S* z, const S* p, S* Q, S* zdot) const {
    const auto &i = d_.from(), &j = d_.to();
    const S* points = p + kAxis + 1;
    S x, rate, force, u[2], across;
    displacement(q, v, p, x, rate, u, across);
    law_(t, x, rate, z, p, force, zdot);
    S f[2], g[2];
    for (int k = 0; k < 2; ++k) {
      f[k] = force * u[k];
      g[k] = -f[k];
    }
    i.add_generalized_force(q, points, f, Q);
    j.add_generalized_force(q + i.size(), points + i.numbers().size(), g, Q + i.size());
    if (turns_) Q[2] -= force * across;
  }
  void calc_partials(const LocalState& s, ForcePartials out) const override {
    calc_dual_partials<PlanarVector::kMax, kAxis + 1 + 2 * PlanarPoint::kMaxNumbers>(*this, s, out);
  }

  std::vector<Measure> measures() const override {
    return {{"displacement", "m", false}, {"rate", "m/s", false}, {"force", "N", false}};
  }
  PathDual measure(int k, const MeasureArguments& m) const override {
    PathDual x, rate, force, u[2], across;
    displacement(m.q, m.v, m.p, x, rate, u, across);
    if (k == 0) return x;
    if (k == 1) return rate;
    law_(m.t, x, rate, m.z, m.p, force, static_cast<PathDual*>(nullptr));
    return force;
  }

 private:
  static constexpr int kAxis = Law::number_count;
  static_assert(Law::states == 0);

  /// x, its rate, the axis u and the distance across it, which is dx/d(angle_i) at fixed d.
  template <class S>
  void displacement(const S* q, const S* v, const S* p, S& x, S& rate, S* u, S& across) const {
    using std::cos;
    using std::sin;
    S d[2], dv[2];
    d_.value(q, p + kAxis + 1, d);
    d_.rate(q, v, p + kAxis + 1, dv);
    const S theta = turns_ ? q[2] + p[kAxis] : p[kAxis];
    u[0] = cos(theta);
    u[1] = sin(theta);
    across = u[0] * d[1] - u[1] * d[0];
    x = u[0] * d[0] + u[1] * d[1];
    rate = u[0] * dv[0] + u[1] * dv[1];
    if (turns_) rate += v[2] * across;
  }

  Law law_;
  PlanarVector d_;
  bool turns_;
};

}  // namespace costate
