// From the motion of a wheel to the force and the moment about its centre: contact, normal force and tyre
// model, for every scalar type that a tyre's physics is compiled for.
#pragma once

#include <memory>
#include <vector>

#include "costate/element/force/tyre_contact.h"
#include "costate/element/force/tyre_models.h"

namespace costate {

/// Where a tyre's numbers stand: the centre's and the axis's three in the body's frame, those of the contact,
/// then those of the road, then those of the model.
struct TyreNumbers {
  enum Index { center = 0, axis = 3, radius = 6, stiffness, damping, ramp, share, shift, road };
};

/// The wheel that a tyre with these numbers is on, at the coordinates and rates of its body.
template <class S>
void calc_wheel_state(const S* q, const S* v, const S* p, WheelState<S>& w) {
  S r[3], u[3];
  rotated(q + 3, p + TyreNumbers::center, r);
  rotated_rate(q + 3, v + 3, p + TyreNumbers::center, u);
  w.x = q[0] + r[0];
  w.z = q[2] + r[2];
  for (int i = 0; i < 3; ++i) w.velocity[i] = v[i] + u[i];
  rotated(q + 3, p + TyreNumbers::axis, w.axis);
  rotated_rate(q + 3, v + 3, p + TyreNumbers::axis, w.axis_rate);
}

struct TyreSetup {
  std::shared_ptr<const Road> road;
  TyreContact contact = TyreContact::disc;
  bool bilateral = false;  // may pull: for linearisations
  bool has_spin = false;   // the last coordinate is the spin relative to the body
};

/// The outputs of a model, for Dual<N> by its own few inputs and chained.
template <class Model, class S, class P>
void apply_model(const Model& model, const TyreInput<S>& in, const S* z, const P* p, TyreOutput<S>& out, S* zdot) {
  model(in, z, p, out, zdot);
}
template <class Model, int N>
void apply_model(const Model& model, const TyreInput<Dual<N>>& in, const Dual<N>* z, const double* p,
                 TyreOutput<Dual<N>>& out, Dual<N>* zdot) {
  constexpr int k = Model::inputs, m = k + Model::most_states;
  if constexpr (k == 1) return;
  using D = Dual<m>;
  TyreInput<D> few;
  TyreOutput<D> found;
  D few_z[Model::most_states + 1], found_zdot[Model::most_states + 1];
  for (int i = 0; i < k; ++i) few.x[i] = D::variable(in.x[i].v, i);
  for (int i = 0; i < model.states(); ++i) few_z[i] = D::variable(z[i].v, k + i);
  model(few, few_z, p, found, found_zdot);
  const auto chained = [&](const D& y, Dual<N>& r) {
    r.v = y.v;
    for (int j = 0; j < k; ++j)
      for (int i = 0; i < N; ++i) r.d[i] += y.d[j] * in.x[j].d[i];
    for (int j = 0; j < model.states(); ++j)
      for (int i = 0; i < N; ++i) r.d[i] += y.d[k + j] * z[j].d[i];
  };
  chained(found.lateral(), out.lateral());
  chained(found.aligning(), out.aligning());
  if (Model::pulls_along) chained(found.longitudinal(), out.longitudinal());
  if (Model::overturns) chained(found.overturning(), out.overturning());
  if (Model::resists) chained(found.rolling(), out.rolling());
  for (int i = 0; i < model.states(); ++i) chained(found_zdot[i], zdot[i]);
}

/// The contact, the normal force and the model's outputs as one wrench on the wheel.
template <class Model, class S>
struct TyreWrench {
  TyreGeometry<S> geometry;
  TyreInput<S> input;
  TyreOutput<S> output;
  S arm[3];  // from the centre to the contact point, m
  // By which the side force acts behind it, m: the normal force would drive a wheel that turns about its axis there.
  S trail;
  bool trails = false;
  S force[3], moment[3];  // about the centre

  template <class P>
  void forces(const TyreSetup& setup, const Model& model, const S& t, const WheelState<S>& w, const S& spin, const S* z,
              const P* p, int model_numbers, S* zdot) {
    calc_tyre_geometry(*setup.road, setup.contact, t, w, p[TyreNumbers::radius], p[TyreNumbers::share],
                       p[TyreNumbers::shift], p + TyreNumbers::road, geometry);
    const TyreGeometry<S>& g = geometry;
    const S normal = normal_force(setup.bilateral, g.deflection, g.approach, p);
    input = {{normal, g.forward, g.lateral, g.camber, S(0.0)}};
    if constexpr (Model::inputs == TyreInput<S>::most)
      input.x[4] = spin * model.effective_radius(g.deflection, p[TyreNumbers::radius], p[TyreNumbers::stiffness],
                                                 p + model_numbers);
    apply_model(model, input, z, p + model_numbers, output, zdot);
    for (int i = 0; i < 3; ++i) arm[i] = -g.loaded_radius * g.ez[i];
    trails = model.trail() >= 0;
    if constexpr (requires { model.slip; })
      if (trails) trail = S(p[model_numbers + model.trail()]) * model.slip.direction(g.forward, p[model_numbers]);
    calc_wrench(setup, normal, output, force, moment);
  }

  /// Force and moment about the centre of a normal force and a model's outputs: linear in these.
  void calc_wrench(const TyreSetup& setup, const S& normal, TyreOutput<S>& y, S* F, S* M) const {
    // On level ground n, and the z of e_x and e_g, are known: no products with 0 and 1.
    const TyreGeometry<S>& g = geometry;
    const bool level = setup.road->level(), vertical = setup.contact == TyreContact::vertical;
    const int across = level ? 2 : 3;
    for (int i = 0; i < 3; ++i) {
      F[i] = S(0.0);
      if (Model::slips && i < across) F[i] = y.lateral() * g.eg[i];
      if (Model::pulls_along && i < across) F[i] += y.longitudinal() * g.ex[i];
      if (!level && !vertical) F[i] += normal * g.n[i];
    }
    if (level && !vertical) F[2] += normal;
    cross3(arm, F, M);
    if (Model::slips && trails) {
      S back[3], side[3], turning[3];
      for (int i = 0; i < 3; ++i) {
        back[i] = -trail * g.ex[i];
        side[i] = i < across ? y.lateral() * g.eg[i] : S(0.0);
      }
      cross3(back, side, turning);
      for (int i = 0; i < 3; ++i) M[i] += turning[i];
    }
    if (vertical) F[2] += normal;
    if (Model::overturns)
      for (int i = 0; i < across; ++i) M[i] += y.overturning() * g.ex[i];
    if (Model::resists)
      for (int i = 0; i < 3; ++i) M[i] += y.rolling() * g.ey[i];
    if (Model::slips)
      for (int i = level ? 2 : 0; i < 3; ++i) M[i] += level ? y.aligning() : y.aligning() * g.n[i];
  }

  template <class P>
  static S normal_force(bool bilateral, const S& deflection, const S& approach, const P* p) {
    if (!bilateral && !(value_of(deflection) > 0)) return S(0.0);
    S damper = S(p[TyreNumbers::damping]) * approach;
    if (!bilateral && value_of(deflection) < value_of(p[TyreNumbers::ramp]))
      damper *= deflection / S(p[TyreNumbers::ramp]);
    const S force = S(p[TyreNumbers::stiffness]) * deflection + damper;
    return bilateral || value_of(force) > 0 ? force : S(0.0);
  }
};

/// Q += 2 E(p)^T M: the generalized force of a moment M [N m] in the global frame on the Euler parameters p.
template <class S>
void add_global_moment(const S* p, const S* M, S* Q) {
  S exM[3];
  cross3(p + 1, M, exM);
  Q[0] -= S(2.0) * dot3(p + 1, M);
  for (int i = 0; i < 3; ++i) Q[1 + i] += S(2.0) * (p[0] * M[i] - exM[i]);
}

}  // namespace costate
