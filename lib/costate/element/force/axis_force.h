// A force along a direction fixed in a body, with any constitutive law of the displacement along it:
//   x = u . d,  u = a / |a| fixed to the body of the first point, of either kind (or to the ground),
//   d = r_j - r_i.
// The force acts at the second point along u, its reaction on the first body as virtual work has it, Q = -F
// x_q: at the place of the second point, so that no moment is lost when that point moves across the axis.
// Numbers: those of the law, the axis a (3, of any length), those of the points. Geometry by hand, the law's
// derivatives by dual numbers.
#pragma once

#include "costate/element/element.h"
#include "costate/element/force/force_law.h"
#include "costate/element/point/direction_forces.h"
#include "costate/element/point/number_gradient.h"
#include "costate/element/point/point_speed.h"
#include "costate/element/point/spatial_vector.h"

namespace costate {

template <class Law>
class AxisForce final : public ForceOf<AxisForce<Law>>, public MotionLawElement {
 public:
  AxisForce(std::string kind, std::string name, Law law, const std::vector<int>& law_numbers, SpatialVector d,
            const std::vector<int>& axis_numbers)
      : ForceOf<AxisForce<Law>>(std::move(kind), std::move(name)),
        law_(std::move(law)),
        axis_(static_cast<int>(law_numbers.size())),
        d_(std::move(d)),
        u_(d_.from().direction_coordinates()),
        rotation_(u_.size() > 0 ? SpatialPoint::curvature_index : 0) {
    this->append_coordinates(d_.coordinates());
    this->append_numbers(law_numbers);
    this->append_numbers(axis_numbers);
    this->append_numbers(d_.numbers());
  }

  bool by_hand() const override { return true; }
  int states() const override { return Law::states; }
  std::string state_unit(int) const override { return state_unit_of<Law>("m", "N"); }
  int initial_state_number(int i) const override {
    if constexpr (Law::states > 0)
      return Law::initial_state + i;
    else
      return -1;
  }

  template <class S>
  void physics(const S& t, const S* q, const S* v, const S* z, const S* p, S* Q, S* zdot) const {
    S x, rate, force;
    displacement(q, v, p, x, rate);
    law_(t, x, rate, z, p, force, zdot);
    apply(q, p, force, Q);
  }

  void calc_partials(const LocalState& s, ForcePartials out) const override {
    const double* points = s.p + axis_ + 3;
    const double *e = s.q + rotation_, *ev = s.v + rotation_;
    const int n = u_.size();
    const Vector3 a = unit(s.p), u = u_.value(e, a);
    Vector3 d, dv;
    d_.value(s.q, points, d.data());
    d_.rate(s.q, s.v, points, dv.data());
    const auto J = d_.jacobian(s.q, points);
    const BodyDirection::Jacobian B = u_.jacobian(e, a);
    Row x_q = u.transpose() * J;  // = rate_v
    Row rate_q = u.transpose() * d_.jacobian_dot(s.q, s.v, points);
    if (n > 0) {
      rate_q += u_.rate(e, ev, a).transpose() * J;
      x_q.segment(rotation_, n) += d.transpose() * B;
      rate_q.segment(rotation_, n) += dv.transpose() * B + d.transpose() * u_.jacobian_dot(ev, a);
    }
    const LawPartials<Law> law(law_, s.t, u.dot(d), rate_v(x_q, s.v), s.z, s.p);
    const double F = law.force.v, F_x = law.force.d[0], F_r = law.force.d[1];
    out.Q_q.noalias() = -x_q.transpose() * (F_x * x_q + F_r * rate_q);
    d_.add_curvature(s.q, points, -F * u, out.Q_q);
    if (n > 0) {
      u_.add_curvature(-F, a, d, rotation_, out.Q_q);
      const Eigen::Matrix<double, Eigen::Dynamic, Eigen::Dynamic, Eigen::ColMajor, BodyDirection::kMax,
                          SpatialVector::kMax>
          mixed = F * B.transpose() * J;
      out.Q_q.middleRows(rotation_, n) -= mixed;
      out.Q_q.middleCols(rotation_, n) -= mixed.transpose();
    }
    if (F_r != 0) out.Q_v.noalias() = -F_r * x_q.transpose() * x_q;
    for (int i = 0; i < Law::states; ++i) {
      out.Q_z.col(i) = -law.force.d[2 + i] * x_q.transpose();
      out.f_q.row(i) = law.zdot[i].d[0] * x_q + law.zdot[i].d[1] * rate_q;
      out.f_v.row(i) = law.zdot[i].d[1] * x_q;
      for (int j = 0; j < Law::states; ++j) out.f_z(i, j) = law.zdot[i].d[2 + j];
    }
  }

  void calc_number_partial(const LocalState& s, int number, double* Q_p, double* f_p) const override {
    double x, rate, force_p;
    if (number >= axis_) return Force::calc_number_partial(s, number, Q_p, f_p);
    displacement(s.q, s.v, s.p, x, rate);
    calc_law_number_partial(law_, s.t, x, rate, s.z, s.p, axis_, number, force_p, f_p);
    apply(s.q, s.p, force_p, Q_p);
  }

  /// w_Q^T Q + w_f^T zdot = w_f^T f(x, xdot) - F(x, xdot) x_w with x_w = x_q w_Q: by the law's numbers at fixed x, by
  /// those of the axis and the points through d and u, their rates along v and along w_Q.
  void add_number_gradient(const LocalState& s, const double* w_Q, const double* w_f, const int* numbers, int count,
                           double* out) const override {
    const double still[SpatialVector::kMax] = {}, *w = w_Q ? w_Q : still, *points = s.p + axis_ + 3;
    const double *e = s.q + rotation_, *ev = s.v + rotation_, *ew = w + rotation_;
    const Vector3 a = unit(s.p), u = u_.value(e, a), uv = u_.rate(e, ev, a), uw = u_.rate(e, ew, a);
    Vector3 d, dv, dw;
    d_.value(s.q, points, d.data());
    d_.rate(s.q, s.v, points, dv.data());
    d_.rate(s.q, w, points, dw.data());
    const double x = u.dot(d), rate = u.dot(dv) + uv.dot(d), along = u.dot(dw) + uw.dot(d);
    double force_p, f_p[Law::states + 1];
    bool of_geometry = false;
    for (int i = 0; i < count; ++i) {
      if (numbers[i] >= axis_) {
        of_geometry = true;
        continue;
      }
      calc_law_number_partial(law_, s.t, x, rate, s.z, s.p, axis_, numbers[i], force_p, f_p);
      out[i] -= along * force_p;
      if (w_f)
        for (int j = 0; j < Law::states; ++j) out[i] += w_f[j] * f_p[j];
    }
    if (!of_geometry) return;
    const LawPartials<Law> law(law_, s.t, x, rate, s.z, s.p);
    const double F = law.force.v;
    double by_x = -law.force.d[0] * along, by_rate = -law.force.d[1] * along;
    for (int j = 0; j < Law::states && w_f; ++j) {
      by_x += w_f[j] * law.zdot[j].d[0];
      by_rate += w_f[j] * law.zdot[j].d[1];
    }
    double by_number[3 + kMaxNumbers<SpatialVector>] = {};
    costate::add_number_gradient(d_, s.q, points, by_x * u + by_rate * uv - F * uw, by_number + 3);
    add_rate_number_gradient(d_, s.q, s.v, points, by_rate * u, by_number + 3);
    add_rate_number_gradient(d_, s.q, w, points, -F * u, by_number + 3);
    Vector3 by_a = Vector3::Zero();
    add_component_gradient(u_, e, by_x * d + by_rate * dv - F * dw, by_a);
    add_rate_component_gradient(u_, e, ev, by_rate * d, by_a);
    add_rate_component_gradient(u_, e, ew, -F * d, by_a);
    Eigen::Map<Vector3>(by_number, 3) = axis_gradient(s.p + axis_, by_a);
    for (int i = 0; i < count; ++i)
      if (numbers[i] >= axis_) out[i] += by_number[numbers[i] - axis_];
  }

  std::vector<Measure> measures() const override {
    return {{"displacement", "m", false}, {"rate", "m/s", false}, {"force", "N", false}};
  }
  PathDual measure(int i, const MeasureArguments& x) const override { return measured(i, x); }
  bool measure_value(int i, const ValueArguments& x, double& value) const override {
    value = measured(i, x);
    return true;
  }

  double potential_energy(const LocalState& s) const override {
    double x, rate;
    const double still[SpatialVector::kMax] = {};
    displacement(s.q, still, s.p, x, rate);
    return stored_energy(law_, x, s.p, s.z);
  }

  const SpatialVector& line() const { return d_; }
  void add_motion_laws(std::vector<MotionLaw>& laws) const override {
    if constexpr (requires { law_.add_motion_laws(laws); }) law_.add_motion_laws(laws);
  }
  GapMotion deformation(const LocalState& s) const override {
    GapMotion m;
    const auto &i = d_.from(), &j = d_.to();
    const double* points = s.p + axis_ + 3;
    displacement(s.q, s.v, s.p, m.gap, m.rate);
    const PointSpeed a = point_speed(i, s.q, s.v, points),
                     b = point_speed(j, s.q + i.size(), s.v + i.size(), points + i.numbers().size());
    // u turns with its body: x' = u.d' + u'.d
    Vector3 d, a_of = unit(s.p), turn = u_.rate(s.q + rotation_, s.v + rotation_, a_of);
    d_.value(s.q, points, d.data());
    if (u_.size() == 0) turn.setZero();
    m.speed = a.most() + b.most() + turn.norm() * d.norm();
    m.turn = std::max({a.turn, b.turn, turn.norm()});
    return m;
  }

 private:
  template <class S>
  S measured(int i, const MeasureArgumentsOf<S>& arguments) const {
    S x, rate, force, zdot[Law::states + 1];
    displacement(arguments.q, arguments.v, arguments.p, x, rate);
    if (i == 0) return x;
    if (i == 1) return rate;
    law_(arguments.t, x, rate, arguments.z, arguments.p, force, zdot);
    return force;
  }

  using Row = Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, SpatialVector::kMax>;

  /// x and its rate.
  template <class S>
  void displacement(const S* q, const S* v, const S* p, S& x, S& rate) const {
    S a[3], u[3], d[3], dv[3];
    direction(p, a);
    d_.value(q, p + axis_ + 3, d);
    d_.rate(q, v, p + axis_ + 3, dv);
    u_.value(q + rotation_, a, u);
    x = dot3(u, d);
    rate = dot3(u, dv);
    if (u_.size() == 0) return;
    S ud[3];
    direction_rate(u_, q + rotation_, v + rotation_, a, ud);
    rate += dot3(ud, d);
  }
  /// Q -= force x_q.
  template <class S>
  void apply(const S* q, const S* p, const S& force, S* Q) const {
    const auto &i = d_.from(), &j = d_.to();
    const S* pi = p + axis_ + 3;
    S a[3], u[3], f[3], g[3], d[3];
    direction(p, a);
    u_.value(q + rotation_, a, u);
    d_.value(q, pi, d);
    for (int k = 0; k < 3; ++k) {
      f[k] = force * u[k];
      g[k] = -f[k];
      d[k] = -force * d[k];
    }
    i.add_generalized_force(q, pi, f, Q);
    j.add_generalized_force(q + i.size(), pi + i.numbers().size(), g, Q + i.size());
    if (u_.size() > 0) add_direction_force(u_, q + rotation_, a, d, Q + rotation_);
  }
  template <class S>
  void direction(const S* p, S* a) const {
    unit_direction(p + axis_, a);
  }
  Vector3 unit(const double* p) const {
    Vector3 a;
    direction(p, a.data());
    return a;
  }
  double rate_v(const Row& x_q, const double* v) const {
    return x_q.dot(Eigen::Map<const Eigen::RowVectorXd>(v, x_q.size()));
  }

  Law law_;
  int axis_;  // the first of the axis's numbers, and the count of the law's
  SpatialVector d_;
  BodyDirection u_;
  int rotation_;  // local index of what the first body's directions depend on
};

}  // namespace costate
