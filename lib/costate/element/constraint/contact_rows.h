// The rows of a rigid contact with a plane of the ground while it is closed: the gap, and where it sticks the place
// along the ground, for an arc less what it has rolled; in space two places, of a point. What a sphere has rolled is no
// function of how it is turned: its rows are t.(r' + omega x (-R n)), linear in the rates (element/switched_rows.h).
// The multiplier of a row is minus the force of the ground.
// Numbers: h, alpha, R, x0, where it sticks at the start if that is said, in both directions in space; those of the
// point.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "costate/element/force/contact_surface.h"
#include "costate/element/switched_rows.h"

namespace costate {

template <class Point>
class ContactRows final : public ConstraintOf<ContactRows<Point>>, public SwitchedRows {
 public:
  using Surface = ContactSurface<Point>;
  static constexpr int kAlong = Surface::kNumbers;

  /// `placed`: where it sticks at the start is said; `friction`: its coefficient among all numbers; states: of the
  /// force's own.
  ContactRows(std::string name, const Point& point, bool round, bool sticks, bool placed, int friction,
              const Force& force, int state, int sliding_state, const std::vector<int>& numbers)
      : ConstraintOf<ContactRows<Point>>("contact", std::move(name)),
        surface_(point, round),
        sticks_(sticks),
        placed_(placed),
        own_(static_cast<int>(numbers.size())),
        friction_(friction),
        force_(force),
        state_(state),
        sliding_state_(sliding_state) {
    this->append_coordinates(point.coordinates());
    this->append_numbers(numbers);
    this->append_numbers(point.numbers());
  }

  int rows() const override { return sticks_ ? 1 + Surface::tangents : 1; }
  std::string row_name(int i) const override { return i == 0 ? "normal" : i == 1 ? "along" : "across"; }
  const Force& switched_by() const override { return force_; }
  int switching_state() const override { return state_; }
  bool holds_position(int i) const override { return i == 0; }
  bool is_integrable(int i) const override { return i == 0 || !rolls(); }
  bool has_place(int i) const override { return i == 0 || (placed_ && !rolls()); }
  int sliding_state() const override { return sliding_state_; }
  int friction_number() const override { return friction_; }

  /// Of a sphere what its material point at the ground has gone, from 0 on the path: its derivatives in time alone.
  template <class S>
  static S place(const Surface& surface, int k, const S* q, const S* ground, const S* point) {
    if constexpr (Surface::dim == 3)
      if (surface.round()) {
        S ways[Surface::tangents];
        ways_of_sphere(surface, q, ground, point, ways);
        return ways[k];
      }
    S s = surface.along(k, q, ground, point);
    if constexpr (Surface::dim == 2)
      if (surface.round()) s += ground[Surface::kRadius] * q[2];
    return s;
  }
  template <class S>
  void physics(const S&, const S* q, const S* p, S* phi) const {
    phi[0] = surface_.gap(q, p, p + own_);
    if (!sticks_) return;
    if constexpr (Surface::dim == 3)
      if (surface_.round()) return ways_of_sphere(surface_, q, p, p + own_, phi + 1);
    for (int k = 0; k < Surface::tangents; ++k) {
      phi[1 + k] = place(surface_, k, q, p, p + own_);
      if (has_place(1 + k)) phi[1 + k] -= p[kAlong + k];
    }
  }

  // Of what rolls phi_q is J, by the rates, and (J^T lambda)_q is not symmetric.
  void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const override {
    if (!rolls()) return Constraint::calc_phi_q(s, phi_q);
    const auto q = varied<Dual<kOfSphere>>(s), p = constants<Dual<kOfSphere>>(s);
    const Dual<kOfSphere> gap = surface_.gap(q.data(), p.data(), p.data() + own_);
    double slip[Surface::tangents], rate[kOfSphere] = {};
    for (int j = 0; j < kOfSphere; ++j) {
      phi_q(0, j) = gap.d[j];
      rate[j] = 1;
      slips(surface_, s.q, rate, s.p, s.p + own_, slip);
      rate[j] = 0;
      for (int k = 0; k < Surface::tangents; ++k) phi_q(1 + k, j) = slip[k];
    }
  }
  void calc_hessian(const LocalState& s, LocalMatrix& hessian) const override {
    if (!rolls()) return Constraint::calc_hessian(s, hessian);
    auto path = varied<Dual<kOfSphere, Taylor2>>(s);
    const auto g = constants<Dual<kOfSphere, Taylor2>>(s);
    const auto q = varied<Dual<kOfSphere>>(s), p = constants<Dual<kOfSphere>>(s);
    Dual<kOfSphere> rate[kOfSphere], slip[Surface::tangents];
    for (int i = 0; i < kOfSphere; ++i) {
      path[i].v.c1 = 1;
      rate[i] = 1.0;
      const Dual<kOfSphere, Taylor2> gap = surface_.gap(path.data(), g.data(), g.data() + own_);
      slips(surface_, q.data(), rate, p.data(), p.data() + own_, slip);
      path[i].v.c1 = 0;
      rate[i] = 0.0;
      for (int j = 0; j < kOfSphere; ++j) {
        hessian(i, j) = s.lambda[0] * gap.d[j].c1;
        for (int k = 0; k < Surface::tangents; ++k) hessian(i, j) += s.lambda[1 + k] * slip[k].d[j];
      }
    }
  }
  void calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                     LocalMatrix& phidd_q) const override {
    if (!rolls()) return Constraint::calc_partials(s, hessian, phid_q, phidd_q);
    calc_hessian(s, hessian);
    auto path = varied<Dual<kOfSphere, Taylor2>>(s);
    const auto p = constants<Dual<kOfSphere, Taylor2>>(s);
    for (int j = 0; j < kOfSphere; ++j) path[j].v = Taylor2(s.q[j], s.v[j], s.a ? s.a[j] : 0);
    Dual<kOfSphere, Taylor2> phi[1 + Surface::tangents];
    physics(Dual<kOfSphere, Taylor2>(), path.data(), p.data(), phi);
    for (int i = 0; i < rows(); ++i)
      for (int j = 0; j < kOfSphere; ++j) {
        phid_q(i, j) = phi[i].d[j].c1;
        phidd_q(i, j) = phi[i].d[j].c2;
      }
  }
  /// Along v d/dt J e_j is (J e_j)_q v.
  void calc_twist(const LocalState& s, LocalMatrix& twist) const override {
    if (!rolls()) return;
    std::array<Dual<1>, kOfSphere> along;
    for (int j = 0; j < kOfSphere; ++j) {
      along[j] = s.q[j];
      along[j].d[0] = s.v[j];
    }
    const auto numbers = constants<Dual<1>>(s);
    const auto q = varied<Dual<kOfSphere>>(s), p = constants<Dual<kOfSphere>>(s);
    Dual<1> rate[kOfSphere], slip[Surface::tangents];
    Dual<kOfSphere> velocity[kOfSphere], of_velocity[Surface::tangents];
    for (int j = 0; j < kOfSphere; ++j) velocity[j] = s.v[j];
    slips(surface_, q.data(), velocity, p.data(), p.data() + own_, of_velocity);
    for (int j = 0; j < kOfSphere; ++j) {
      rate[j] = 1.0;
      slips(surface_, along.data(), rate, numbers.data(), numbers.data() + own_, slip);
      rate[j] = 0.0;
      for (int k = 0; k < Surface::tangents; ++k) twist(1 + k, j) += slip[k].d[0] - of_velocity[k].d[j];
    }
  }

  std::vector<Measure> measures() const override {
    std::vector<Measure> m{{"normal_force", "N", true}};
    if (sticks_) m.push_back({"friction_force", "N", true});
    return m;
  }
  PathDual measure(int i, const MeasureArguments& x) const override {
    if (i == 0 || Surface::tangents == 1) return -x.lambda[i];
    return sqrt(x.lambda[1] * x.lambda[1] + x.lambda[2] * x.lambda[2] + PathDual(1e-24));
  }

 private:
  bool rolls() const { return Surface::dim == 3 && surface_.round() && sticks_; }
  static constexpr int kOfSphere = 7;                  // coordinates of its body: spheres are of rigid bodies
  static constexpr int kMostNumbers = kAlong + 2 + 3;  // of the plane, where it sticks, and of the point

  /// The coordinates, each in a direction of its own.
  template <class S>
  static std::array<S, kOfSphere> varied(const LocalState& s) {
    std::array<S, kOfSphere> q;
    for (int j = 0; j < kOfSphere; ++j) q[j] = S::variable(s.q[j], j);
    return q;
  }
  template <class S>
  std::array<S, kMostNumbers> constants(const LocalState& s) const {
    std::array<S, kMostNumbers> p;
    for (std::size_t i = 0; i < this->numbers().size(); ++i) p[i] = s.p[i];
    return p;
  }
  /// J(q) rate of the rows that roll.
  template <class S>
  static void slips(const Surface& surface, const S* q, const S* rate, const S* ground, const S* point, S* slip) {
    typename Surface::template Motion<S> m;
    surface.motion(q, rate, ground, point, m);
    for (int k = 0; k < Surface::tangents; ++k) slip[k] = m.slip[k];
  }

  // d/ds of a path, of which the second derivative is not known any more, and back.
  static double rate_of(double) { return 0; }
  static double way_of(double) { return 0; }
  static Taylor2 rate_of(const Taylor2& x) { return {x.c1, x.c2, 0}; }
  static Taylor2 way_of(const Taylor2& rate) { return {0, rate.c0, rate.c1}; }
  template <int N, class T>
  static Dual<N, T> rate_of(const Dual<N, T>& x) {
    Dual<N, T> rate;
    rate.v = rate_of(x.v);
    for (int i = 0; i < N; ++i) rate.d[i] = rate_of(x.d[i]);
    return rate;
  }
  template <int N, class T>
  static Dual<N, T> way_of(const Dual<N, T>& rate) {
    Dual<N, T> x;
    x.v = way_of(rate.v);
    for (int i = 0; i < N; ++i) x.d[i] = way_of(rate.d[i]);
    return x;
  }
  template <class S>
  static void ways_of_sphere(const Surface& surface, const S* q, const S* ground, const S* point, S* ways) {
    S v[SpatialPoint::kMaxCoordinates];
    for (int i = 0; i < surface.point().size(); ++i) v[i] = rate_of(q[i]);
    slips(surface, q, v, ground, point, ways);
    for (int k = 0; k < Surface::tangents; ++k) ways[k] = way_of(ways[k]);
  }

  Surface surface_;
  bool sticks_, placed_;
  int own_;  // numbers before the point's
  int friction_;
  const Force& force_;
  int state_, sliding_state_;
};

}  // namespace costate
