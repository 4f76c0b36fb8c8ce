// A rigid body in natural coordinates: reference point r [m] and base vectors u1, u2, u3 of the body's frame,
// kept of length 1 and perpendicular by constraints. Its mass matrix is constant, P x E with E the 3 x 3
// identity and
//   P = [[m, m c^T], [m c, S + m c c^T]],   S = tr(J)/2 E - J
// where S holds the second moments of mass about the centre. Numbers as of RigidBody: mass m [kg]; inertia
// tensor J about the centre of mass in the body's frame, xx, yy, zz, xy, xz, yz [kg m^2] (entries of the
// tensor: xy is minus the integral of x y); centre of mass c in the body's frame [m]; gravity g [m/s^2]. See
// lib/README.md (11.24).
#pragma once

#include "costate/element/element.h"
#include "costate/element/point/rotation.h"

namespace costate {

class NaturalBody final : public BodyOf<NaturalBody> {
 public:
  enum class Reports { nothing, rates };
  /// coordinates: x, y, z, u1x, u1y, u1z, u2x, ..., u3z.
  NaturalBody(std::string kind, std::string name, const std::vector<int>& coordinates, const std::vector<int>& numbers,
              Reports reports = Reports::rates);

  template <class S>
  void physics(const S*, const S*, const S* a, const S* n, S* r) const {
    S P[4][4];
    moments(n, P);
    for (int k = 0; k < 4; ++k)
      for (int i = 0; i < 3; ++i) {
        S sum = P[k][0] * (a[i] - n[10 + i]);
        for (int l = 1; l < 4; ++l) sum += P[k][l] * a[3 * l + i];
        r[3 * k + i] = sum;
      }
  }
  /// Angular velocity in the body's and in the global frame; roll, pitch and yaw.
  std::vector<Measure> measures() const override;
  PathDual measure(int i, const MeasureArguments& x) const override;

  bool by_hand() const override { return true; }
  bool constant_mass() const override { return true; }
  bool constant_force() const override { return true; }
  void calc_mass(const LocalState& s, LocalMatrix& M) const override;
  void calc_force(const LocalState& s, double* Q) const override;
  void calc_partials(const LocalState&, LocalMatrix&, LocalMatrix&) const override {}
  void calc_number_partial(const LocalState& s, int number, double* r_p) const override;
  double potential_energy(const LocalState& s) const override;

 private:
  /// P.
  template <class S>
  static void moments(const S* n, S (*P)[4]) {
    const S half(0.5), *c = n + 7;
    P[0][0] = n[0];
    P[1][1] = half * (n[2] + n[3] - n[1]);
    P[2][2] = half * (n[1] + n[3] - n[2]);
    P[3][3] = half * (n[1] + n[2] - n[3]);
    P[1][2] = -n[4];
    P[1][3] = -n[5];
    P[2][3] = -n[6];
    for (int k = 0; k < 3; ++k) {
      P[0][1 + k] = n[0] * c[k];
      for (int l = k; l < 3; ++l) P[1 + k][1 + l] += n[0] * c[k] * c[l];
    }
    for (int k = 0; k < 4; ++k)
      for (int l = 0; l < k; ++l) P[k][l] = P[l][k];
  }

  Reports reports_;
};

}  // namespace costate
