// A bushing between two bodies of space, or a body and the ground: three springs and dampers along the axes
// of a frame on the first body, three about them.
//
// Translation: x_k = u_k . d, d = r_j - r_i, u_k the axes of the frame on the first body. Forces act at the
// second point. Rotation: theta, the rotation vector (angle times axis) of the second body's frame seen from
// the first's. With the Euler parameters e = (e0, eps) of that rotation and rho = eps / e0,
//   theta = 2 g(s) rho,  s = rho.rho,  g(s) = atan(sqrt(s)) / sqrt(s):
// smooth up to half a turn, exact for any angle about one axis, the same for e and -e and for Euler
// parameters of any length. Force and moment, each component of its own: F = k x + c x' + F0, M = k theta + c
// theta' + M0; generalized forces by virtual work, Q = -x_q^T F - theta_q^T M.
//
// Numbers: stiffnesses (3 N/m, 3 N m/rad), dampings (3, 3), preloads (3 N, 3 N m), then those of the points.
#pragma once

#include <array>

#include "costate/element/element.h"
#include "costate/element/point/body_direction.h"
#include "costate/element/point/quaternion.h"
#include "costate/element/point/spatial_vector.h"

namespace costate {

class Bushing final : public ForceOf<Bushing> {
 public:
  static constexpr int kNumbers = 18;
  /// frame_from, frame_to: Euler parameters of the bushing's frame in each body's.
  Bushing(std::string name, SpatialVector d, const std::vector<int>& law_numbers, const Vector4& frame_from,
          const Vector4& frame_to);

  template <class S>
  void physics(const S&, const S* q, const S* v, const S*, const S* p, S* Q, S*) const {
    Deformation<S> x;
    deform(q, v, p + kNumbers, x);
    S load[6];
    for (int k = 0; k < 6; ++k) load[k] = p[k] * x.x[k] + p[6 + k] * x.rate[k] + p[12 + k];
    apply(q, p + kNumbers, x, load, Q);
  }
  void calc_partials(const LocalState& s, ForcePartials out) const override;
  double potential_energy(const LocalState& s) const override;

  std::vector<Measure> measures() const override;
  PathDual measure(int i, const MeasureArguments& x) const override;

 private:
  template <class S>
  struct Deformation {
    S x[6], rate[6];           // translations [m], rotation vector [rad], and their rates
    S d[3], u[3][3];           // line between the points, axes
    S a[4], b[4], e0, rho[3];  // orientations of both frames, and of the second in the first
    S g, g_s;                  // g(s), g'(s)
  };

  /// g and its derivative: by its series where s is small, else in closed form.
  template <class S>
  static void arc(const S& s, S& g, S& g_s) {
    using std::atan;
    using std::sqrt;
    if (value_of(s) < 0.01) {
      g = g_s = S(0.0);
      for (int k = 13; k >= 0; --k) {
        const double c = (k % 2 == 0 ? 1.0 : -1.0) / (2 * k + 1);
        g = g * s + S(c);
        if (k > 0) g_s = g_s * s + S(k * c);
      }
      return;
    }
    const S root = sqrt(s);
    g = atan(root) / root;
    g_s = (S(1.0) / (S(1.0) + s) - g) / (S(2.0) * s);
  }

  /// Euler parameters of a body's bushing frame and their rates; on the ground the frame itself, at rest.
  template <class S>
  static void orient(const S* q, const S* v, bool ground, const Vector4& frame, S* a, S* ad) {
    S f[4];
    for (int i = 0; i < 4; ++i) f[i] = S(frame[i]);
    for (int i = 0; i < 4; ++i) {
      a[i] = f[i];
      ad[i] = S(0.0);
    }
    if (ground) return;
    quaternion_product(q + 3, f, a);
    quaternion_product(v + 3, f, ad);
  }

  template <class S>
  void deform(const S* q, const S* v, const S* p, Deformation<S>& x) const {
    const int n = d_.from().size();
    S ad[4], bd[4], e[4], ed[4], ef[4], dv[3];
    d_.value(q, p, x.d);
    d_.rate(q, v, p, dv);
    orient(q, v, n == 0, frame_i_, x.a, ad);
    orient(q + n, v + n, d_.to().size() == 0, frame_j_, x.b, bd);
    for (int k = 0; k < 3; ++k) {
      S axis[3] = {S(0.0), S(0.0), S(0.0)}, ud[3];
      axis[k] = S(1.0);
      rotated(x.a, axis, x.u[k]);
      rotated_rate(x.a, ad, axis, ud);
      x.x[k] = dot3(x.u[k], x.d);
      x.rate[k] = dot3(x.u[k], dv) + dot3(ud, x.d);
    }
    quaternion_difference(x.a, x.b, e);
    quaternion_difference(ad, x.b, ed);
    quaternion_difference(x.a, bd, ef);
    if (!(value_of(e[0]) * value_of(e[0]) > 1e-12)) half_turn();
    x.e0 = e[0];
    S rhod[3];
    for (int k = 0; k < 3; ++k) {
      x.rho[k] = e[1 + k] / e[0];
      rhod[k] = (ed[1 + k] + ef[1 + k] - x.rho[k] * (ed[0] + ef[0])) / e[0];
    }
    arc(dot3(x.rho, x.rho), x.g, x.g_s);
    const S turning = S(4.0) * x.g_s * dot3(x.rho, rhod);
    for (int k = 0; k < 3; ++k) {
      x.x[3 + k] = S(2.0) * x.g * x.rho[k];
      x.rate[3 + k] = S(2.0) * x.g * rhod[k] + turning * x.rho[k];
    }
  }

  /// Q -= x_q^T load.
  template <class S>
  void apply(const S* q, const S* p, const Deformation<S>& x, const S* load, S* Q) const {
    const auto &i = d_.from(), &j = d_.to();
    const int n = i.size();
    S f[3], g[3];
    for (int k = 0; k < 3; ++k) {
      f[k] = load[0] * x.u[0][k] + load[1] * x.u[1][k] + load[2] * x.u[2][k];
      g[k] = -f[k];
    }
    i.add_generalized_force(q, p, f, Q);
    j.add_generalized_force(q + n, p + i.numbers().size(), g, Q + n);
    // Weights of the moment on rho, then on e = conj(a) b; de = conj(da) b + conj(a) db.
    const S* m = load + 3;
    const S along = S(4.0) * x.g_s * dot3(x.rho, m);
    S w[4], on_a[4], on_b[4], c[4];
    for (int k = 0; k < 3; ++k) w[1 + k] = (S(2.0) * x.g * m[k] + along * x.rho[k]) / x.e0;
    w[0] = -dot3(x.rho, w + 1);
    if (n > 0) {
      quaternion_conjugate(w, c);
      quaternion_product(x.b, c, on_a);
      // The axes turn with the first body: x_k = u_k . d.
      for (int k = 0; k < 3; ++k) {
        S axis[3] = {S(0.0), S(0.0), S(0.0)}, reaction[3];
        axis[k] = S(1.0);
        for (int l = 0; l < 3; ++l) reaction[l] = load[k] * x.d[l];
        add_rotated_force(x.a, axis, reaction, on_a);
      }
      subtract_frame(on_a, frame_i_, Q + 3);
    }
    if (j.size() > 0) {
      quaternion_product(x.a, w, on_b);
      subtract_frame(on_b, frame_j_, Q + n + 3);
    }
  }
  /// Q -= the force on the Euler parameters p, given that on a = p f.
  template <class S>
  static void subtract_frame(const S* on_a, const Vector4& frame, S* Q) {
    const S c[4] = {S(frame[0]), S(-frame[1]), S(-frame[2]), S(-frame[3])};
    S on_p[4];
    quaternion_product(on_a, c, on_p);
    for (int k = 0; k < 4; ++k) Q[k] -= on_p[k];
  }
  [[noreturn]] void half_turn() const;

  SpatialVector d_;
  Vector4 frame_i_, frame_j_;
};

}  // namespace costate
