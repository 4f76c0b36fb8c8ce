// A bushing between two bodies of space, or a body and the ground: three springs and dampers along the axes
// of a frame on the first body, three about them.
//
// Translation: x_k = a_k . d, d = r_j - r_i, a_k the axes of the frame on the first body. Forces act at the
// second point. Rotation: theta, the rotation vector (angle times axis) of the second body's frame b_l seen
// from the first's. With R_kl = a_k . b_l,
//   rho = (R_32 - R_23, R_13 - R_31, R_21 - R_12) / (1 + R_11 + R_22 + R_33) = tan(angle / 2) times the axis,
//   theta = 2 g(s) rho,  s = rho.rho,  g(s) = atan(sqrt(s)) / sqrt(s):
// smooth up to half a turn and exact for any angle about one axis. Only the axes enter, so that a body may
// have Euler parameters or natural coordinates. Force and moment, each component of its own: F = k x + c x' +
// F0, M = k theta + c theta' + M0; generalized forces by virtual work, Q = -x_q^T F - theta_q^T M. The moment between
// the bodies is M itself about one axis alone: with rho' = (omega + omega x rho + rho (rho.omega)) / 2, omega of the
// second frame against the first and in it, it is
//   (W + rho x W + rho (rho.W)) / 2,  W = 2 g M + 4 g' (rho.M) rho      (M.theta' = W.rho').
//
// Numbers: stiffnesses (3 N/m, 3 N m/rad), dampings (3, 3), preloads (3 N, 3 N m), then those of the points.
#pragma once

#include <array>
#include <cmath>

#include "costate/element/element.h"
#include "costate/element/point/direction_forces.h"
#include "costate/element/point/spatial_vector.h"

namespace costate {

class Bushing final : public ForceOf<Bushing> {
 public:
  static constexpr int kNumbers = 18;
  static constexpr double kNearHalfTurn = 0.5;  // of n = 2 (1 + cos(angle)): from 139 degrees on
  static constexpr double kAtHalfTurn = 4e-12;  // and where theta has no direction
  /// frame_from, frame_to: Euler parameters of the bushing's frame in each body's.
  Bushing(std::string name, SpatialVector d, const std::vector<int>& law_numbers, const Vector4& frame_from,
          const Vector4& frame_to);

  template <class S>
  void physics(const S& t, const S* q, const S* v, const S*, const S* p, S* Q, S*) const {
    Deformation<S> x;
    const bool turns = has_moment(p);
    deform(q, v, p + kNumbers, turns, x);
    if (turns)
      watch_half_turn(value_of(t), value_of(x.n), {value_of(x.rho[0]), value_of(x.rho[1]), value_of(x.rho[2])},
                      std::hypot(value_of(x.rate[3]), value_of(x.rate[4]), value_of(x.rate[5])));
    S load[6];
    for (int k = 0; k < 6; ++k) load[k] = p[k] * x.x[k] + p[6 + k] * x.rate[k] + p[12 + k];
    apply(q, p + kNumbers, x, load, Q);
  }
  void calc_partials(const LocalState& s, ForcePartials out) const override;
  double potential_energy(const LocalState& s) const override;

  std::vector<Measure> measures() const override;
  PathDual measure(int i, const MeasureArguments& x) const override;
  bool measure_value(int i, const ValueArguments& x, double& value) const override;

 private:
  template <class S>
  S measured(int i, const MeasureArgumentsOf<S>& x) const;
  template <class S>
  struct Deformation {
    S x[6], rate[6];           // translations [m], rotation vector [rad], and their rates
    S d[3], a[3][3], b[3][3];  // line between the points, axes of both frames
    S rho[3], n, g, g_s;       // n = 1 + trace of R; g(s), g'(s)
  };

  /// Whether the rotation has a stiffness, a damping or a preload: without them frames may turn round and round.
  template <class P>
  static bool has_moment(const P* p) {
    for (const int first : {3, 9, 15})
      for (int k = first; k < first + 3; ++k)
        if (value_of(p[k]) != 0) return true;
    return false;
  }

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

  /// held: the rotation has to have a direction.
  template <class S>
  void deform(const S* q, const S* v, const S* p, bool held, Deformation<S>& x) const {
    const int i = kDirections, j = d_.from().size() + kDirections;
    S ad[3][3], bd[3][3], dv[3];
    d_.value(q, p, x.d);
    d_.rate(q, v, p, dv);
    for (int k = 0; k < 3; ++k) {
      S axis[3];
      components(frame_i_, k, axis);
      turn_i_.value(q + i, axis, x.a[k]);
      direction_rate(turn_i_, q + i, v + i, axis, ad[k]);
      components(frame_j_, k, axis);
      turn_j_.value(q + j, axis, x.b[k]);
      direction_rate(turn_j_, q + j, v + j, axis, bd[k]);
      x.x[k] = dot3(x.a[k], x.d);
      x.rate[k] = dot3(x.a[k], dv) + dot3(ad[k], x.d);
    }
    S nd(0.0);
    x.n = S(1.0);
    for (int k = 0; k < 3; ++k) {
      x.n += dot3(x.a[k], x.b[k]);
      nd += dot3(ad[k], x.b[k]) + dot3(x.a[k], bd[k]);
    }
    if (!(value_of(x.n) > kAtHalfTurn)) {
      if (held) half_turn();
      x.n = S(kAtHalfTurn);
    }
    S rhod[3];
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      x.rho[k] = (dot3(x.a[m], x.b[l]) - dot3(x.a[l], x.b[m])) / x.n;
      rhod[k] =
          (dot3(ad[m], x.b[l]) + dot3(x.a[m], bd[l]) - dot3(ad[l], x.b[m]) - dot3(x.a[l], bd[m]) - x.rho[k] * nd) / x.n;
    }
    arc(dot3(x.rho, x.rho), x.g, x.g_s);
    const S turning = S(4.0) * x.g_s * dot3(x.rho, rhod);
    for (int k = 0; k < 3; ++k) {
      x.x[3 + k] = S(2.0) * x.g * x.rho[k];
      x.rate[3 + k] = S(2.0) * x.g * rhod[k] + turning * x.rho[k];
    }
  }

  /// W with W.rho' = M.theta'.
  template <class S>
  static void weigh_rho(const Deformation<S>& x, const S* M, S* W) {
    const S along = S(4.0) * x.g_s * dot3(x.rho, M);
    for (int k = 0; k < 3; ++k) W[k] = S(2.0) * x.g * M[k] + along * x.rho[k];
  }

  /// Q -= x_q^T load.
  template <class S>
  void apply(const S* q, const S* p, const Deformation<S>& x, const S* load, S* Q) const {
    const auto &from = d_.from(), &to = d_.to();
    const int n = from.size(), i = kDirections, j = n + kDirections;
    S f[3], g[3];
    for (int k = 0; k < 3; ++k) {
      f[k] = load[0] * x.a[0][k] + load[1] * x.a[1][k] + load[2] * x.a[2][k];
      g[k] = -f[k];
    }
    from.add_generalized_force(q, p, f, Q);
    to.add_generalized_force(q + n, p + from.numbers().size(), g, Q + n);
    // Weights of the moment on rho / n, then of rho's part on R, and of both on the axes, whose first ones
    // also turn x_k.
    S w[3], R[3][3];
    weigh_rho(x, load + 3, w);
    for (S& of_rho : w) of_rho /= x.n;
    const S trace = -dot3(x.rho, w);
    for (int k = 0; k < 3; ++k) {
      const int l = (k + 1) % 3, m = (k + 2) % 3;
      R[k][k] = trace;
      R[m][l] = w[k];
      R[l][m] = -w[k];
    }
    for (int k = 0; k < 3; ++k) {
      S on_a[3], on_b[3], axis[3];
      for (int c = 0; c < 3; ++c) {
        on_a[c] = -(load[k] * x.d[c] + R[k][0] * x.b[0][c] + R[k][1] * x.b[1][c] + R[k][2] * x.b[2][c]);
        on_b[c] = -(R[0][k] * x.a[0][c] + R[1][k] * x.a[1][c] + R[2][k] * x.a[2][c]);
      }
      components(frame_i_, k, axis);
      add_direction_force(turn_i_, q + i, axis, on_a, Q + i);
      components(frame_j_, k, axis);
      add_direction_force(turn_j_, q + j, axis, on_b, Q + j);
    }
  }
  /// Axis k of a frame in its body's.
  template <class S>
  static void components(const Eigen::Matrix3d& frame, int k, S* axis) {
    for (int c = 0; c < 3; ++c) axis[c] = S(frame(c, k));
  }
  [[noreturn]] void half_turn() const;
  /// Along a motion the angle must not go on from one side of the half turn to the other, where the moment would jump
  /// from one sign to the other between two instants: throws StepError with the time.
  void watch_half_turn(double t, double n, const std::array<double, 3>& rho, double rate) const {
    n < kNearHalfTurn ? compare_half_turn(t, rho, rate) : forget_half_turn();
  }
  void compare_half_turn(double t, const std::array<double, 3>& rho, double rate) const;
  /// It is far from there: what comes near again may come from the other side.
  void forget_half_turn() const;

  static constexpr int kDirections = 3;  // behind a body's x, y, z: what its directions depend on
  SpatialVector d_;
  BodyDirection turn_i_, turn_j_;
  Eigen::Matrix3d frame_i_, frame_j_;  // the frames' axes in their bodies'
};

}  // namespace costate
