// A torque between two angle coordinates (or one angle and the ground), with any constitutive law:
//   x = angle_j - angle_i, Q_j = -F(x, xdot, z), Q_i = +F. Numbers: those of the law.
// The same is a force on other coordinates that measure a length.
#pragma once

#include <cmath>

#include "costate/element/element.h"
#include "costate/element/force/force_law.h"

namespace costate {

template <class Law>
class AngularForce : public ForceOf<AngularForce<Law>>, public MotionLawElement {
 public:
  enum class Measures { angle, length };
  /// coordinates: {angle_j} against the ground, or {angle_i, angle_j} [rad]; or lengths [m].
  AngularForce(std::string kind, std::string name, Law law, const std::vector<int>& law_numbers,
               const std::vector<int>& coordinates, Measures measures = Measures::angle)
      : ForceOf<AngularForce<Law>>(std::move(kind), std::move(name)),
        law_(std::move(law)),
        relative_(coordinates.size() == 2),
        measures_(measures) {
    this->append_coordinates(coordinates);
    this->append_numbers(law_numbers);
  }

  bool by_hand() const override { return true; }
  int states() const override { return Law::states; }
  std::string state_unit(int) const override { return state_unit_of<Law>("rad", "N m"); }
  int initial_state_number(int i) const override {
    if constexpr (Law::states > 0)
      return Law::initial_state + i;
    else
      return -1;
  }

  template <class S>
  S difference(const S* q) const {
    return relative_ ? q[1] - q[0] : q[0];
  }

  template <class S>
  void physics(const S& t, const S* q, const S* v, const S* z, const S* p, S* Q, S* zdot) const {
    S force;
    law_(t, difference(q), difference(v), z, p, force, zdot);
    Q[relative_ ? 1 : 0] = -force;
    if (relative_) Q[0] = force;
  }

  void calc_partials(const LocalState& s, ForcePartials out) const override {
    const LawPartials<Law> law(law_, s.t, difference(s.q), difference(s.v), s.z, s.p);
    const int n = relative_ ? 2 : 1;
    const auto sign = [&](int i) { return i == n - 1 ? 1.0 : -1.0; };  // d(difference)/dq_i
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        out.Q_q(i, j) = -sign(i) * sign(j) * law.force.d[0];
        out.Q_v(i, j) = -sign(i) * sign(j) * law.force.d[1];
      }
      for (int k = 0; k < Law::states; ++k) {
        out.Q_z(i, k) = -sign(i) * law.force.d[2 + k];
        out.f_q(k, i) = sign(i) * law.zdot[k].d[0];
        out.f_v(k, i) = sign(i) * law.zdot[k].d[1];
      }
    }
    for (int k = 0; k < Law::states; ++k)
      for (int j = 0; j < Law::states; ++j) out.f_z(k, j) = law.zdot[k].d[2 + j];
  }

  void calc_number_partial(const LocalState& s, int number, double* Q_p, double* f_p) const override {
    double force_p;
    calc_law_number_partial(law_, s.t, difference(s.q), difference(s.v), s.z, s.p,
                            static_cast<int>(this->numbers().size()), number, force_p, f_p);
    Q_p[relative_ ? 1 : 0] = -force_p;
    if (relative_) Q_p[0] = force_p;
  }

  std::vector<Measure> measures() const override {
    if (measures_ == Measures::length)
      return {{"displacement", "m", false}, {"rate", "m/s", false}, {"force", "N", false}};
    std::vector<Measure> m = {{"angle", "rad", false}, {"rate", "rad/s", false}, {"torque", "N m", false}};
    if constexpr (requires { Law::drives; }) m.push_back({"power", "W", false});
    return m;
  }
  PathDual measure(int i, const MeasureArguments& x) const override { return measured(i, x); }
  bool measure_value(int i, const ValueArguments& x, double& value) const override {
    value = measured(i, x);
    return true;
  }

  double potential_energy(const LocalState& s) const override { return stored_energy(law_, difference(s.q), s.p, s.z); }
  const Law& law() const { return law_; }
  void add_motion_laws(std::vector<MotionLaw>& laws) const override {
    if constexpr (requires { law_.add_motion_laws(laws); }) law_.add_motion_laws(laws);
  }
  GapMotion deformation(const LocalState& s) const override {
    GapMotion m;
    m.gap = difference(s.q);
    m.rate = difference(s.v);
    m.speed = std::abs(m.rate);
    return m;
  }

 private:
  template <class S>
  S measured(int i, const MeasureArgumentsOf<S>& x) const {
    if (i == 0) return difference(x.q);
    if (i == 1) return difference(x.v);
    S force, zdot[Law::states + 1];
    law_(x.t, difference(x.q), difference(x.v), x.z, x.p, force, zdot);
    if (i == 3) return -force * difference(x.v);
    if constexpr (requires { Law::pushes; }) return -force;
    return force;
  }

  Law law_;
  bool relative_;
  Measures measures_;
};

}  // namespace costate
