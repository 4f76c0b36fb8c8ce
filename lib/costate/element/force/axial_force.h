// A force between two points, planar or spatial, along the line that joins them, with any constitutive law:
//   Q = -d_q^T n F(L, Ldot, z), d = r_j - r_i, L = |d|, n = d / L.
// Numbers: those of the law, then those of the points. Geometry by hand, the law's derivatives by dual numbers.
#pragma once

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/element/element.h"
#include "costate/element/force/force_law.h"
#include "costate/element/meeting_ends.h"
#include "costate/element/point/number_gradient.h"
#include "costate/element/point/point_speed.h"

namespace costate {

template <class Law, class Line = PlanarVector>
class AxialForce : public ForceOf<AxialForce<Law, Line>>, public MotionLawElement, public MeetingEnds {
  static constexpr int dim = Line::Vector::RowsAtCompileTime;
  using Vector = typename Line::Vector;
  using Square = Eigen::Matrix<double, dim, dim>;

 public:
  AxialForce(std::string kind, std::string name, Law law, const std::vector<int>& law_numbers, Line d)
      : ForceOf<AxialForce<Law, Line>>(std::move(kind), std::move(name)),
        law_(std::move(law)),
        law_number_count_(static_cast<int>(law_numbers.size())),
        d_(std::move(d)),
        plain_(is_plain(d_.from()) && is_plain(d_.to())) {
    this->append_coordinates(d_.coordinates());
    this->append_numbers(law_numbers);
    this->append_numbers(d_.numbers());
  }

  const Line& line() const { return d_; }
  const Law& law() const { return law_; }
  void add_motion_laws(std::vector<MotionLaw>& laws) const override {
    if constexpr (requires { law_.add_motion_laws(laws); }) law_.add_motion_laws(laws);
  }
  GapMotion deformation(const LocalState& s) const override {
    GapMotion m;
    const auto &i = d_.from(), &j = d_.to();
    const double* points = s.p + law_number_count_;
    Vector d, dv;
    d_.value(s.q, points, d.data());
    d_.rate(s.q, s.v, points, dv.data());
    const double length = d.norm();
    const PointSpeed a = point_speed(i, s.q, s.v, points),
                     b = point_speed(j, s.q + i.size(), s.v + i.size(), points + i.numbers().size());
    m.gap = length;
    m.rate = length > 0 ? d.dot(dv) / length : 0;
    m.speed = a.most() + b.most();
    m.turn = std::max(a.turn, b.turn);
    return m;
  }
  void ends_apart(const LocalState& s, double* d, double* rate) const override {
    d[2] = rate[2] = 0;
    d_.value(s.q, s.p + law_number_count_, d);
    d_.rate(s.q, s.v, s.p + law_number_count_, rate);
  }
  double jump_where_ends_meet(const LocalState& s, double speed) const override {
    if (Law::states > 0) return HUGE_VAL;
    double jump = 0, force, no_rates[Law::states + 1] = {}, none[Law::states + 1] = {};
    for (const double rate : {speed, -speed}) {
      law_(s.t, 0.0, rate, none, s.p, force, no_rates);
      jump += force;
    }
    return jump;
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
    S d[dim], n[dim], length, rate, force;
    geometry(q, v, p, d, n, length, rate);
    law_(t, length, rate, z, p, force, zdot);
    // -d_q^T n F by the directional trick: the generalized force of a point force f is r_q^T f.
    apply(q, p, n, force, Q);
  }

  void calc_partials(const LocalState& s, ForcePartials out) const override {
    double d[dim], along[dim], length, rate;
    geometry(s.q, s.v, s.p, d, along, length, rate);
    const LawPartials<Law> law(law_, s.t, length, rate, s.z, s.p);
    const double F = law.force.v, F_L = law.force.d[0], F_r = law.force.d[1];
    if (plain_) return calc_plain_partials(s, law, along, length, out);
    const double* p = s.p + law_number_count_;
    const Vector n(along);
    const auto J = d_.jacobian(s.q, p);
    Vector dv;
    d_.rate(s.q, s.v, p, dv.data());
    const Square P = (Square::Identity() - n * n.transpose()) / length;  // n_d
    using Row = Eigen::Matrix<double, 1, Eigen::Dynamic, Eigen::RowMajor, 1, Line::kMax>;
    const Row L_q = n.transpose() * J;                                                         // = Ldot_v
    const Row rate_q = dv.transpose() * P * J + n.transpose() * d_.jacobian_dot(s.q, s.v, p);  // Ldot_q
    out.Q_q.noalias() = -L_q.transpose() * (F_L * L_q + F_r * rate_q);
    out.Q_q.noalias() -= F * J.transpose() * P * J;
    d_.add_curvature(s.q, p, -F * n, out.Q_q);
    if (F_r != 0) out.Q_v.noalias() = -F_r * L_q.transpose() * L_q;
    for (int i = 0; i < Law::states; ++i) {
      out.Q_z.col(i) = -law.force.d[2 + i] * L_q.transpose();
      out.f_q.row(i) = law.zdot[i].d[0] * L_q + law.zdot[i].d[1] * rate_q;
      out.f_v.row(i) = law.zdot[i].d[1] * L_q;
      for (int j = 0; j < Law::states; ++j) out.f_z(i, j) = law.zdot[i].d[2 + j];
    }
  }

  void calc_number_partial(const LocalState& s, int number, double* Q_p, double* f_p) const override {
    double d[dim], n[dim], length, rate, force_p;
    if (number >= law_number_count_) return Force::calc_number_partial(s, number, Q_p, f_p);
    geometry(s.q, s.v, s.p, d, n, length, rate);
    calc_law_number_partial(law_, s.t, length, rate, s.z, s.p, law_number_count_, number, force_p, f_p);
    apply(s.q, s.p, n, force_p, Q_p);
  }

  /// w_Q^T Q + w_f^T zdot = w_f^T f(L, Ldot) - F(L, Ldot) L_w with L_w = L_q w_Q: by the law's numbers at fixed
  /// lengths, by those of the points through d, d' and d_w = d_q w_Q.
  void add_number_gradient(const LocalState& s, const double* w_Q, const double* w_f, const int* numbers, int count,
                           double* out) const override {
    const double still[Line::kMax] = {}, *w = w_Q ? w_Q : still, *p = s.p + law_number_count_;
    Vector d, n, dv, dw;
    double length, rate, force_p, f_p[Law::states + 1];
    geometry(s.q, s.v, s.p, d.data(), n.data(), length, rate);
    d_.rate(s.q, w, p, dw.data());
    const double along = n.dot(dw);
    bool of_points = false;
    for (int i = 0; i < count; ++i) {
      if (numbers[i] >= law_number_count_) {
        of_points = true;
        continue;
      }
      calc_law_number_partial(law_, s.t, length, rate, s.z, s.p, law_number_count_, numbers[i], force_p, f_p);
      out[i] -= along * force_p;
      if (w_f)
        for (int j = 0; j < Law::states; ++j) out[i] += w_f[j] * f_p[j];
    }
    if (!of_points) return;
    const LawPartials<Law> law(law_, s.t, length, rate, s.z, s.p);
    const double F = law.force.v;
    double by_length = -law.force.d[0] * along, by_rate = -law.force.d[1] * along;
    for (int j = 0; j < Law::states && w_f; ++j) {
      by_length += w_f[j] * law.zdot[j].d[0];
      by_rate += w_f[j] * law.zdot[j].d[1];
    }
    d_.rate(s.q, s.v, p, dv.data());
    const Vector by_d = by_length * n + by_rate / length * (dv - rate * n) - F / length * (dw - along * n);
    const Vector by_dv = by_rate * n, by_dw = -F * n;
    double by_number[kMaxNumbers<Line>] = {};
    costate::add_number_gradient(d_, s.q, p, by_d, by_number);
    add_rate_number_gradient(d_, s.q, s.v, p, by_dv, by_number);
    add_rate_number_gradient(d_, s.q, w, p, by_dw, by_number);
    for (int i = 0; i < count; ++i)
      if (numbers[i] >= law_number_count_) out[i] += by_number[numbers[i] - law_number_count_];
  }

  std::vector<Measure> measures() const override {
    std::vector<Measure> m = {{"length", "m", false}, {"rate", "m/s", false}, {"force", "N", false}};
    if constexpr (requires { Law::drives; }) m.push_back({"power", "W", false});
    return m;
  }
  PathDual measure(int i, const MeasureArguments& x) const override { return measured(i, x); }
  bool measure_value(int i, const ValueArguments& x, double& value) const override {
    value = measured(i, x);
    return true;
  }

  double potential_energy(const LocalState& s) const override {
    double d[dim], n[dim], length, rate;
    geometry(s.q, s.v, s.p, d, n, length, rate);
    return stored_energy(law_, length, s.p, s.z);
  }

  /// Length L, rate Ldot and unit vector n of the line; throws when the end points coincide.
  template <class S>
  void geometry(const S* q, const S* v, const S* p, S* d, S* n, S& length, S& rate) const {
    using std::sqrt;
    S dv[dim];
    d_.value(q, p + law_number_count_, d);
    d_.rate(q, v, p + law_number_count_, dv);
    S square = d[0] * d[0];
    for (int i = 1; i < dim; ++i) square += d[i] * d[i];
    if (!(value_of(square) > 1e-24)) coincident(std::sqrt(value_of(square)));
    length = sqrt(square);
    for (int i = 0; i < dim; ++i) n[i] = d[i] / length;
    rate = n[0] * dv[0];
    for (int i = 1; i < dim; ++i) rate += n[i] * dv[i];
  }

 private:
  template <class S>
  S measured(int i, const MeasureArgumentsOf<S>& x) const {
    S d[dim], n[dim], length, rate, force, zdot[Law::states + 1];
    geometry(x.q, x.v, x.p, d, n, length, rate);
    if (i == 0) return length;
    if (i == 1) return rate;
    law_(x.t, length, rate, x.z, x.p, force, zdot);
    return i == 2 ? force : -force * rate;
  }

  [[noreturn]] void coincident(double length) const {
    throw ModelError(this->path(),
                     fmt::format("The length between '{}' and '{}' fell to {:.3g} m; the end points coincide, so "
                                 "the force has no direction. Check the attachment points or the start.",
                                 d_.from().name(), d_.to().name(), length));
  }

  /// Between points that are free or on the ground: J = [-E, E], so that Q_q = -J^T (n F_d^T + F n_d) J comes in
  /// blocks of one square matrix.
  void calc_plain_partials(const LocalState& s, const LawPartials<Law>& law, const double* n, double length,
                           ForcePartials out) const {
    double dv[dim];
    d_.rate(s.q, s.v, s.p + law_number_count_, dv);
    const double F = law.force.v / length;
    double rate = n[0] * dv[0];
    for (int i = 1; i < dim; ++i) rate += n[i] * dv[i];
    const bool from = d_.from().size() > 0, to = d_.to().size() > 0;
    const int j = from ? dim : 0;
    const auto add = [&](Eigen::Map<Eigen::MatrixXd>& A, int a, int b, double x) {
      if (from) A(a, b) = -x;
      if (to) A(j + a, j + b) = -x;
      if (from && to) A(a, j + b) = A(j + a, b) = x;
    };
    const double sign[2] = {-1, 1};
    for (int b = 0; b < dim; ++b) {
      const double rate_d = (dv[b] - rate * n[b]) / length;
      for (int a = 0; a < dim; ++a) {
        add(out.Q_q, a, b,
            n[a] * (law.force.d[0] * n[b] + law.force.d[1] * rate_d) + F * ((a == b ? 1 : 0) - n[a] * n[b]));
        add(out.Q_v, a, b, law.force.d[1] * n[a] * n[b]);
      }
      for (int i = 0; i < Law::states; ++i)
        for (const int end : {0, 1}) {
          if (end == 0 ? !from : !to) continue;
          const int c = (end == 0 ? 0 : j) + b;
          out.Q_z(c, i) = -sign[end] * n[b] * law.force.d[2 + i];
          out.f_q(i, c) = sign[end] * (law.zdot[i].d[0] * n[b] + law.zdot[i].d[1] * rate_d);
          out.f_v(i, c) = sign[end] * law.zdot[i].d[1] * n[b];
        }
    }
    for (int i = 0; i < Law::states; ++i)
      for (int k = 0; k < Law::states; ++k) out.f_z(i, k) = law.zdot[i].d[2 + k];
  }

  static bool is_plain(const PlanarPoint& p) {
    return p.kind() == PlanarPoint::Kind::free || p.kind() == PlanarPoint::Kind::ground;
  }
  static bool is_plain(const SpatialPoint& p) {
    return p.kind() == SpatialPoint::Kind::ground || p.kind() == SpatialPoint::Kind::free;
  }

  template <class S>
  void apply(const S* q, const S* p, const S* n, const S& force, S* Q) const {
    const auto &i = d_.from(), &j = d_.to();
    S f[dim], g[dim];
    for (int k = 0; k < dim; ++k) {
      f[k] = n[k] * force;
      g[k] = -f[k];
    }
    const S* pi = p + law_number_count_;
    i.add_generalized_force(q, pi, f, Q);
    j.add_generalized_force(q + i.size(), pi + i.numbers().size(), g, Q + i.size());
  }

  Law law_;
  int law_number_count_;
  Line d_;
  bool plain_;  // both points free or on the ground
};

}  // namespace costate
