// The rows of a rigid contact with a plane of the ground while it is closed: the gap, and where it sticks the place
// along the ground, for an arc less what it has rolled; in space two places, of a point. What a sphere has rolled is no
// function of how it is turned: its rows are t.(r' + omega x (-R n)), linear in the rates (element/switched_rows.h).
// The multiplier of a row is minus the force of the ground.
// Numbers: h, alpha, R, where it sticks at the start if that is said, in both directions in space; those of the point.
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
      if (surface.round()) return way_of_sphere(surface, k, q, ground, point);
    S s = surface.along(k, q, ground, point);
    if constexpr (Surface::dim == 2)
      if (surface.round()) s += ground[Surface::kRadius] * q[2];
    return s;
  }
  template <class S>
  void physics(const S&, const S* q, const S* p, S* phi) const {
    phi[0] = surface_.gap(q, p, p + own_);
    if (!sticks_) return;
    for (int k = 0; k < Surface::tangents; ++k) {
      phi[1 + k] = place(surface_, k, q, p, p + own_);
      if (has_place(1 + k)) phi[1 + k] -= p[kAlong + k];
    }
  }

  // Of what rolls phi_q is J, by the rates, and (J^T lambda)_q is not symmetric.
  void calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const override {
    Constraint::calc_phi_q(s, phi_q);
    if (!rolls()) return;
    for_each_rate(s, [&](int j, const auto& phi) {
      for (int i = 1; i < rows(); ++i) phi_q(i, j) = phi[i].v.c1;
    });
  }
  void calc_hessian(const LocalState& s, LocalMatrix& hessian) const override {
    if (!rolls()) return Constraint::calc_hessian(s, hessian);
    const int n = static_cast<int>(this->coordinates().size());
    for (int j = 0; j < n; ++j)
      for_each_rate(
          s,
          [&](int i, const auto& phi) {
            hessian(i, j) = 0;
            for (int r = 0; r < rows(); ++r) hessian(i, j) += s.lambda[r] * phi[r].d[0].c1;
          },
          j);
  }
  void calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                     LocalMatrix& phidd_q) const override {
    Constraint::calc_partials(s, hessian, phid_q, phidd_q);
    if (rolls()) calc_hessian(s, hessian);
  }
  /// Along v d/dt J e_j is (J e_j)_q v.
  void calc_twist(const LocalState& s, LocalMatrix& twist) const override {
    if (!rolls()) return;
    const int n = static_cast<int>(this->coordinates().size());
    for (int k = 0; k < n; ++k)
      for_each_rate(
          s,
          [&](int j, const auto& phi) {
            for (int i = 1; i < rows(); ++i) {
              twist(i, j) += phi[i].d[0].c1 * s.v[k];
              twist(i, k) -= phi[i].d[0].c1 * s.v[j];
            }
          },
          k);
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
  /// Calls visit(j, phi) with phi along the rate e_j, and its derivatives by coordinate `by`.
  template <class Visit>
  void for_each_rate(const LocalState& s, const Visit& visit, int by = -1) const {
    std::vector<PathDual> q, p;
    for (std::size_t i = 0; i < this->coordinates().size(); ++i) q.emplace_back(s.q[i]);
    for (std::size_t i = 0; i < this->numbers().size(); ++i) p.emplace_back(s.p[i]);
    if (by >= 0) q[static_cast<std::size_t>(by)].d[0] = Taylor2(1.0);
    std::array<PathDual, 3> phi;
    for (std::size_t j = 0; j < q.size(); ++j) {
      q[j].v.c1 = 1;
      phi.fill(PathDual());
      physics(PathDual(), q.data(), p.data(), phi.data());
      visit(static_cast<int>(j), phi);
      q[j].v.c1 = 0;
    }
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
  static S way_of_sphere(const Surface& surface, int k, const S* q, const S* ground, const S* point) {
    S v[SpatialPoint::kMaxCoordinates];
    for (int i = 0; i < surface.point().size(); ++i) v[i] = rate_of(q[i]);
    typename Surface::template Motion<S> m;
    surface.motion(q, v, ground, point, m);
    return way_of(m.slip[k]);
  }

  Surface surface_;
  bool sticks_, placed_;
  int own_;  // numbers before the point's
  int friction_;
  const Force& force_;
  int state_, sliding_state_;
};

}  // namespace costate
