// A tyre on a wheel that turns about an axis fixed in a rigid body: contact (tyre_contact.h), normal force
// and a tyre model (tyre_models.h) as a generalized force.
//   F_n = K delta + c delta' r,  r = min(1, delta / ramp), for delta > 0 and never below 0: continuous at
//   lift-off
// The wrench (F, M) about the wheel's centre C depends on the motion only through u = (x and z of C, the axis
// a = A a', the velocity V of C, the wheel's spin, the states) and the axis's rate: dual numbers differentiate by u,
// the rest is written by hand: of the rate d, as V and d come in as V + r_w (d.e_z / |a|) e_y alone (tyre_contact.h),
//   [F; M]_d = ([F; M]_V e_y) r_w e_z^T / |a|,
// and of the coordinates
//   Q = C_q^T F + 2 E^T M (+ a.M on the spin's coordinate),  Q_q = T [F_u; M_u] u_q + (T [F; M])_q at fixed
//   F, M.
// Coordinates: the body's x, y, z, e0, e1, e2, e3, then the spin's, if any. Numbers: the centre's and the
// axis's three in the body's frame, radius, K, c, ramp, the share and the shift of the road, those of the
// road, those of the model.
#pragma once

#include <algorithm>
#include <cmath>
#include <type_traits>

#include "costate/element/element.h"
#include "costate/element/force/tyre_ground.h"
#include "costate/element/point/spatial_point.h"

namespace costate {

template <class Model>
class TyreForce final : public ForceOf<TyreForce<Model>>, public TyreGround {
  using Numbers = TyreNumbers;
  template <class S>
  using Evaluation = TyreWrench<Model, S>;
  static constexpr bool uses_spin = Model::inputs == TyreInput<double>::most;
  // Directions of the dual numbers: u.
  static constexpr int of_axis = 2, of_velocity = 5, of_spin = 8, of_states = of_spin + (uses_spin ? 1 : 0),
                       used = of_states + Model::most_states,
                       directions = used + used % 2;  // even: two fit into a register

 public:
  /// wheel: the centre, on a rigid body. numbers: axis (3), radius, K, c, ramp, share, shift; the road adds
  /// its own.
  TyreForce(std::string name, TyreSetup setup, const SpatialPoint& wheel, std::vector<int> spin_coordinate,
            const std::vector<int>& numbers, Model model, const std::vector<int>& model_numbers)
      : ForceOf<TyreForce<Model>>("tyre", std::move(name)),
        TyreGround(std::move(setup)),
        model_(std::move(model)),
        model_numbers_(Numbers::road + static_cast<int>(setup_.road->numbers().size())) {
    this->append_coordinates(wheel.coordinates());
    this->append_coordinates(spin_coordinate);
    this->append_numbers(wheel.numbers());
    this->append_numbers(numbers);
    this->append_numbers(setup_.road->numbers());
    this->append_numbers(model_numbers);
  }

  void add_jump_places(const LocalState& s, bool fixed_steps, std::vector<JumpPlace>& places) const override {
    TyreGround::add_jump_places(s, fixed_steps, places);
    if constexpr (requires(const TyreInput<double>& in) { model_.add_jump_places(in, s.z, s.p, true, places); }) {
      if (!model_.may_jump(s.p + model_numbers_)) return;
      WheelState<double> w;
      calc_wheel_state(s.q, s.v, s.p, w);
      double zdot[Model::most_states + 1], z[Model::most_states + 1] = {};
      Evaluation<double> y;
      y.forces(setup_, model_, s.t, w, 0.0, z, s.p, model_numbers_, zdot);
      // Whoever looks has no force states: a slip that lags is the one it follows.
      if (states() > 0) z[0] = y.input.lateral() / std::max(std::abs(y.input.forward()), 1e-3);
      model_.add_jump_places(y.input, z, s.p + model_numbers_, setup_.bilateral || y.geometry.deflection > 0, places);
    }
  }
  bool by_hand() const override { return true; }
  int states() const override { return model_.states(); }
  int initial_state_number(int i) const override { return model_numbers_ + model_.initial_state(i); }
  const Model& model() const { return model_; }

  template <class S>
  void physics(const S& t, const S* q, const S* v, const S* z, const S* p, S* Q, S* zdot) const {
    Evaluation<S> e;
    evaluate(t, q, v, z, p, e, zdot);
    if constexpr (std::is_same_v<S, double>) require_upright(t, e);
    SpatialPointMath::add_force(q, p + Numbers::center, e.force, Q);
    add_global_moment(q + 3, e.moment, Q + 3);
    if (setup_.has_spin) Q[7] += dot3(e.geometry.ey, e.moment);
  }

  void calc_partials(const LocalState& s, ForcePartials out) const override {
    using D = Dual<directions>;
    const double *e = s.q + 3, *ed = s.v + 3;
    WheelState<double> here;
    calc_wheel_state(s.q, s.v, s.p, here);
    WheelState<D> w;
    w.x = D::variable(here.x, 0);
    w.z = D::variable(here.z, 1);
    for (int i = 0; i < 3; ++i) {
      w.axis[i] = D::variable(here.axis[i], of_axis + i);
      w.velocity[i] = D::variable(here.velocity[i], of_velocity + i);
      w.axis_rate[i] = D(here.axis_rate[i]);
    }
    D spin(0.0), z[Model::most_states + 1], zdot[Model::most_states + 1];
    if constexpr (uses_spin) spin = D::variable(spin_of(s.q, s.v, s.p), of_spin);
    for (int i = 0; i < states(); ++i) z[i] = D::variable(s.z[i], of_states + i);
    Evaluation<D> y;
    y.forces(setup_, model_, D(s.t), w, spin, z, s.p, model_numbers_, zdot);

    // How u varies with the Euler parameters: x and z of C by B, the axis by A, the velocity by Bd and, with
    // theirs, by B.
    const Vector3 sc(s.p), sa(s.p + Numbers::axis);
    const Matrix34 B = rotation_jacobian(e, sc), Bd = rotation_jacobian(ed, sc), A = rotation_jacobian(e, sa);
    Eigen::Matrix<double, 1, 4> spin_e = Eigen::Matrix<double, 1, 4>::Zero(), spin_ed = spin_e;
    if constexpr (uses_spin) {
      const Vector3 unit = 2 * sa / sa.norm();
      spin_e = -unit.transpose() * body_rate_matrix(ed);
      spin_ed = unit.transpose() * body_rate_matrix(e);
    }
    // Those by the axis's rate are (G_V e_y) of_rate^T.
    Vector3 ey, of_rate = Vector3::Zero();
    const bool leans = setup_.contact == TyreContact::disc;
    const double length = length3(here.axis);
    for (int i = 0; i < 3; ++i) ey[i] = y.geometry.ey[i].v;
    if (leans)
      for (int i = 0; i < 3; ++i) of_rate[i] = y.geometry.loaded_radius.v * y.geometry.ez[i].v / length;
    const Eigen::Matrix<double, 1, 4> rate_e = of_rate.transpose() * rotation_jacobian(ed, sa),
                                      rate_ed = of_rate.transpose() * A;
    // rows = G [u_q, u_v] for derivatives G by u.
    const auto by_motion = [&](const auto& G, auto& by_q, auto& by_v) {
      by_q.col(0) = G.col(0);
      by_q.col(1).setZero();
      by_q.col(2) = G.col(1);
      by_q.template rightCols<4>() = G.col(0) * B.row(0) + G.col(1) * B.row(2) +
                                     G.template middleCols<3>(of_axis).lazyProduct(A) +
                                     G.template middleCols<3>(of_velocity).lazyProduct(Bd);
      by_v.template leftCols<3>() = G.template middleCols<3>(of_velocity);
      by_v.template rightCols<4>() = G.template middleCols<3>(of_velocity).lazyProduct(B);
      if (leans) {
        const auto along = (G.template middleCols<3>(of_velocity) * ey).eval();
        by_q.template rightCols<4>() += along * rate_e;
        by_v.template rightCols<4>() += along * rate_ed;
      }
      if constexpr (uses_spin) {
        by_q.template rightCols<4>() += G.col(of_spin) * spin_e;
        by_v.template rightCols<4>() += G.col(of_spin) * spin_ed;
      }
    };
    // The wrench and its derivatives by u and the states.
    Eigen::Matrix<double, 6, directions> W_u;
    Vector3 F, M;
    for (int i = 0; i < 3; ++i) {
      F[i] = y.force[i].v;
      M[i] = y.moment[i].v;
      for (int j = 0; j < directions; ++j) {
        W_u(i, j) = y.force[i].d[j];
        W_u(3 + i, j) = y.moment[i].d[j];
      }
    }
    Eigen::Matrix<double, 6, 7> W_q, W_v;
    by_motion(W_u, W_q, W_v);
    const Eigen::Matrix<double, 4, 3> E = 2 * global_rate_matrix(e).transpose(), Bt = B.transpose();
    const auto add = [&](const auto& W, auto&& rows) {  // rows += T W
      rows.template topRows<3>() += W.template topRows<3>();
      rows.template bottomRows<4>() +=
          Bt.lazyProduct(W.template topRows<3>()) + E.lazyProduct(W.template bottomRows<3>());
    };
    add(W_q, out.Q_q.template topLeftCorner<7, 7>());
    add(W_v, out.Q_v.template topLeftCorner<7, 7>());
    auto turning = out.Q_q.template block<4, 4>(3, 3);
    turning += rotation_curvature(sc, F);
    turning.template block<1, 3>(0, 1) -= 2 * M.transpose();
    turning.template block<3, 1>(1, 0) += 2 * M;
    turning.template block<3, 3>(1, 1) += 2 * cross_matrix(M);
    for (int k = 0; k < states(); ++k) {
      const auto W = W_u.col(of_states + k);
      add(W, out.Q_z.col(k).template head<7>());
      const Eigen::Matrix<double, 1, directions> f_u =
          Eigen::Map<const Eigen::Matrix<double, 1, directions>>(zdot[k].d.data());
      Eigen::Matrix<double, 1, 7> f_q, f_v;
      by_motion(f_u, f_q, f_v);
      out.f_q.row(k).template head<7>() = f_q;
      out.f_v.row(k).template head<7>() = f_v;
      if constexpr (uses_spin) out.f_v(k, out.f_v.cols() - 1) += setup_.has_spin ? zdot[k].d[of_spin] : 0.0;
      for (int j = 0; j < states(); ++j) out.f_z(k, j) = zdot[k].d[of_states + j];
    }
    if (!setup_.has_spin) return;
    // Row of the spin, ey.M, and column of its rate.
    out.Q_q.template block<1, 7>(7, 0) = ey.transpose() * W_q.template bottomRows<3>();
    out.Q_q.template block<1, 4>(7, 3) += (M - ey.dot(M) * ey).transpose() / length * A;
    out.Q_v.template block<1, 7>(7, 0) = ey.transpose() * W_v.template bottomRows<3>();
    for (int k = 0; k < states(); ++k) out.Q_z(7, k) = ey.dot(W_u.template block<3, 1>(3, of_states + k));
    if constexpr (uses_spin) {
      const Eigen::Matrix<double, 6, 1> W = W_u.col(of_spin);
      add(W, out.Q_v.col(7).template head<7>());
      out.Q_v(7, 7) = ey.dot(W.template tail<3>());
    }
  }

  void calc_number_partial(const LocalState& s, int number, double* Q_p, double* f_p) const override {
    Evaluation<double> e;
    NumberPartials partials(*this, s, e);
    if (!partials.calc(number)) return Force::calc_number_partial(s, number, Q_p, f_p);
    double force[3], moment[3];
    e.calc_wrench(setup_, partials.normal, partials.output, force, moment);
    SpatialPointMath::add_force(s.q, s.p + Numbers::center, force, Q_p);
    add_global_moment(s.q + 3, moment, Q_p + 3);
    if (setup_.has_spin) Q_p[7] += dot3(e.geometry.ey, moment);
    for (int i = 0; i < states(); ++i) f_p[i] = partials.zdot[i];
  }

  void add_number_gradient(const LocalState& s, const double* w_Q, const double* w_f, const int* numbers, int count,
                           double* out) const override {
    Evaluation<double> e;
    NumberPartials partials(*this, s, e);
    // w_Q^T Q = F.w_C + M.w_turn: the velocity of C and the angular velocity that w_Q would be.
    double w_C[3] = {}, w_turn[3] = {}, force[3], moment[3];
    if (w_Q) {
      SpatialPointMath::velocity(s.q, w_Q, s.p + Numbers::center, w_C);
      global_rate(s.q + 3, w_Q + 3, w_turn);
      for (int i = 0; i < 3; ++i) w_turn[i] = 2 * w_turn[i] + (setup_.has_spin ? w_Q[7] * e.geometry.ey[i] : 0.0);
    }
    for (int i = 0; i < count; ++i) {
      if (!partials.calc(numbers[i])) {
        Force::add_number_gradient(s, w_Q, w_f, numbers + i, 1, out + i);
        continue;
      }
      e.calc_wrench(setup_, partials.normal, partials.output, force, moment);
      out[i] += dot3(force, w_C) + dot3(moment, w_turn);
      if (w_f)
        for (int j = 0; j < states(); ++j) out[i] += w_f[j] * partials.zdot[j];
    }
  }

  std::vector<Measure> measures() const override {
    std::vector<Measure> m = {{"normal_force", "N", false},
                              {"deflection", "m", false},
                              {"camber", "rad", false},
                              {"contact_x", "m", false},
                              {"contact_y", "m", false}};
    if (!Model::slips) return m;
    m.insert(m.end(), {{"lateral_force", "N", false},
                       {"longitudinal_force", "N", false},
                       {"aligning_moment", "N m", false},
                       {"slip_angle", "rad", false}});
    if (uses_spin) m.push_back({"longitudinal_slip", "1", false});
    return m;
  }
  PathDual measure(int i, const MeasureArguments& x) const override { return measured(i, x); }
  bool measure_value(int i, const ValueArguments& x, double& value) const override {
    value = measured(i, x);
    return true;
  }

 private:
  template <class S>
  S measured(int i, const MeasureArgumentsOf<S>& x) const {
    Evaluation<S> e;
    S zdot[Model::most_states + 1];
    evaluate(x.t, x.q, x.v, x.z, x.p, e, zdot);
    switch (i) {
      case 0:
        return e.input.normal();
      case 1:
        return e.geometry.deflection;
      case 2:
        return e.geometry.camber;
      case 3:
      case 4: {
        S r[3];
        SpatialPointMath::position(x.q, x.p + Numbers::center, r);
        return r[i - 3] + e.arm[i - 3];
      }
      case 5:
        return e.output.lateral();
      case 6:
        return e.output.longitudinal();
      case 7:
        return e.output.aligning();
      case 8:
        return model_.slip_angle(e.input, x.z, x.p + model_numbers_);
      default:
        if constexpr (uses_spin) return model_.longitudinal_slip(e.input, x.z, x.p + model_numbers_);
        return {};
    }
  }

  /// The formulas of a point on a body without a point.
  struct SpatialPointMath {
    template <class S>
    static void position(const S* q, const S* s, S* r) {
      rotated(q + 3, s, r);
      for (int i = 0; i < 3; ++i) r[i] += q[i];
    }
    template <class S>
    static void velocity(const S* q, const S* v, const S* s, S* r) {
      rotated_rate(q + 3, v + 3, s, r);
      for (int i = 0; i < 3; ++i) r[i] += v[i];
    }
    template <class S>
    static void add_force(const S* q, const S* s, const S* f, S* Q) {
      for (int i = 0; i < 3; ++i) Q[i] += f[i];
      add_rotated_force(q + 3, s, f, Q + 3);
    }
  };

  /// Derivatives by single numbers of what does not change the geometry: dual numbers through the normal
  /// force and the model alone. Fills the evaluation with the values.
  class NumberPartials {
   public:
    using D = Dual<1>;
    double normal = 0;          // of F_n,
    TyreOutput<double> output;  // of the model's outputs
    double zdot[Model::most_states + 1] = {};

    NumberPartials(const TyreForce& f, const LocalState& s, Evaluation<double>& e) : f_(f) {
      double ignored[Model::most_states + 1];
      WheelState<double> w;
      double spin = 0;
      calc_wheel_state(s.q, s.v, s.p, w);
      if constexpr (uses_spin) spin = f.spin_of(s.q, s.v, s.p);
      e.forces(f.setup_, f.model_, s.t, w, spin, s.z, s.p, f.model_numbers_, ignored);
      geometry_ = &e.geometry;
      input_ = {{D(0.0), D(e.input.forward()), D(e.input.lateral()), D(e.input.camber()), D(0.0)}};
      spin_ = spin;
      for (int i = 0; i < f.states(); ++i) z_[i] = D(s.z[i]);
      for (int i = Numbers::radius; i <= Numbers::ramp; ++i) p_[i] = D(s.p[i]);
      for (int i = 0; i < f.model_.number_count(); ++i) model_p_[i] = D(s.p[f.model_numbers_ + i]);
    }

    /// False for numbers that move the contact.
    bool calc(int number) {
      const int of_model = number - f_.model_numbers_;
      const bool level = f_.setup_.road->level();
      const TyreContact contact = f_.setup_.contact;
      // The slip speed moves the trail as well.
      const bool trails = f_.model_.trail() >= 0;
      if (of_model >= 0 ? trails && (of_model == f_.model_.trail() || of_model == 0)
                        : number < Numbers::radius || number > Numbers::ramp)
        return false;
      if (number == Numbers::radius && contact == TyreContact::disc && !level) return false;
      D& seed = of_model >= 0 ? model_p_[of_model] : p_[number];
      seed.d[0] = 1;
      D deflection(geometry_->deflection);
      if (number == Numbers::radius) deflection.d[0] = contact == TyreContact::source && !level ? geometry_->n[2] : 1;
      input_.x[0] = Evaluation<D>::normal_force(f_.setup_.bilateral, deflection, D(geometry_->approach), p_);
      if constexpr (uses_spin)
        input_.x[4] =
            D(spin_) * f_.model_.effective_radius(deflection, p_[Numbers::radius], p_[Numbers::stiffness], model_p_);
      TyreOutput<D> y;
      D rates[Model::most_states + 1];
      f_.model_(input_, z_, model_p_, y, rates);
      normal = input_.x[0].d[0];
      for (int i = 0; i < TyreOutput<D>::count; ++i) output.x[i] = y.x[i].d[0];
      for (int i = 0; i < f_.states(); ++i) zdot[i] = rates[i].d[0];
      seed.d[0] = 0;
      return true;
    }

   private:
    const TyreForce& f_;
    const TyreGeometry<double>* geometry_ = nullptr;
    TyreInput<D> input_;
    double spin_ = 0;
    D z_[Model::most_states + 1], p_[Numbers::ramp + 1], model_p_[Model::most_numbers + 1];
  };

  void require_upright(double t, const Evaluation<double>& e) const {
    if (e.force[0] == 0 && e.force[1] == 0 && e.force[2] == 0) return;
    // A vertical force acts at the centre, wherever the contact point is.
    if (is_singular(e.geometry, setup_.contact == TyreContact::source || Model::slips))
      throw_singular(this->name(), t, e.geometry);
  }

  /// The wheel's angular velocity about its axis: the body's share, 2 a'.G p' / |a'|, and the coordinate's
  /// rate.
  template <class S>
  S spin_of(const S* q, const S* v, const S* p) const {
    S rate[3];
    body_rate(q + 3, v + 3, rate);
    const S turning = S(2.0) * dot3(p + Numbers::axis, rate) / length3(p + Numbers::axis);
    return setup_.has_spin ? turning + v[7] : turning;
  }

  template <class S>
  void evaluate(const S& t, const S* q, const S* v, const S* z, const S* p, Evaluation<S>& e, S* zdot) const {
    WheelState<S> w;
    S spin(0.0);
    calc_wheel_state(q, v, p, w);
    if constexpr (uses_spin) spin = spin_of(q, v, p);
    e.forces(setup_, model_, t, w, spin, z, p, model_numbers_, zdot);
  }

  Model model_;
  int model_numbers_;
};

}  // namespace costate
