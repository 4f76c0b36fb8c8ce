// Rotations by Euler parameters p = (e0, e), on the homogeneous matrix
//   A(p) = (e0^2 - e.e) 1 + 2 e e^T + 2 e0 e~      (a rotation where p.p = 1),
// that is with its exact derivatives also off p.p = 1, where penalties and Newton's iterations go. A is
// quadratic:
//   A s = B(p, s) p / 2,  d(A s)/dp = B(p, s) = 2 [(e0 1 + e~) s, e s^T - (e0 1 + e~) s~],  B(p, s) w = B(w,
//   s) p, B(p, s)^T f = K(s, f) p,  K(s, f) = 2 [[s.f, (s x f)^T], [s x f, f s^T + s f^T - (s.f) 1]]
//   symmetric.
// Angular velocity in the body's frame: omega = 2 G(p) pdot, G = [-e, e0 1 - e~]; in the global frame 2 E(p)
// pdot, E = [-e, e0 1 + e~].
#pragma once

#include <Eigen/Core>

namespace costate {

using Vector3 = Eigen::Vector3d;
using Vector4 = Eigen::Vector4d;
using Matrix34 = Eigen::Matrix<double, 3, 4>;

template <class S>
S dot3(const S* a, const S* b) {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

template <class S>
void cross3(const S* a, const S* b, S* out) {
  out[0] = a[1] * b[2] - a[2] * b[1];
  out[1] = a[2] * b[0] - a[0] * b[2];
  out[2] = a[0] * b[1] - a[1] * b[0];
}

/// B(p, s) w.
template <class S>
void rotated_rate(const S* p, const S* w, const S* s, S* out) {
  const S scalar = p[0] * w[0] - dot3(p + 1, w + 1);
  const S es = dot3(p + 1, s), ws = dot3(w + 1, s);
  S exs[3], wxs[3];
  cross3(p + 1, s, exs);
  cross3(w + 1, s, wxs);
  for (int i = 0; i < 3; ++i)
    out[i] = S(2.0) * (scalar * s[i] + w[1 + i] * es + p[1 + i] * ws + w[0] * exs[i] + p[0] * wxs[i]);
}

/// A(p) s.
template <class S>
void rotated(const S* p, const S* s, S* out) {
  const S scalar = p[0] * p[0] - dot3(p + 1, p + 1), es = dot3(p + 1, s);
  S exs[3];
  cross3(p + 1, s, exs);
  for (int i = 0; i < 3; ++i) out[i] = scalar * s[i] + S(2.0) * (p[1 + i] * es + p[0] * exs[i]);
}

/// out += B(p, s)^T f.
template <class S>
void add_rotated_force(const S* p, const S* s, const S* f, S* out) {
  const S sf = dot3(s, f), se = dot3(s, p + 1), fe = dot3(f, p + 1);
  S sxf[3];
  cross3(s, f, sxf);
  out[0] += S(2.0) * (sf * p[0] + dot3(sxf, p + 1));
  for (int i = 0; i < 3; ++i) out[1 + i] += S(2.0) * (sxf[i] * p[0] + f[i] * se + s[i] * fe - sf * p[1 + i]);
}

/// G(p) w; the angular velocity in the body's frame is 2 G(p) pdot.
template <class S>
void body_rate(const S* p, const S* w, S* out) {
  S exw[3];
  cross3(p + 1, w + 1, exw);
  for (int i = 0; i < 3; ++i) out[i] = p[0] * w[1 + i] - p[1 + i] * w[0] - exw[i];
}

/// E(p) w; the angular velocity in the global frame is 2 E(p) pdot.
template <class S>
void global_rate(const S* p, const S* w, S* out) {
  S exw[3];
  cross3(p + 1, w + 1, exw);
  for (int i = 0; i < 3; ++i) out[i] = p[0] * w[1 + i] - p[1 + i] * w[0] + exw[i];
}

/// out += factor G(p)^T u.
template <class S>
void add_body_moment(const S* p, const S* u, double factor, S* out) {
  S exu[3];
  cross3(p + 1, u, exu);
  out[0] -= S(factor) * dot3(p + 1, u);
  for (int i = 0; i < 3; ++i) out[1 + i] += S(factor) * (p[0] * u[i] + exu[i]);
}

inline Vector3 cross(const Vector3& a, const Vector3& b) {
  Vector3 c;
  cross3(a.data(), b.data(), c.data());
  return c;
}

inline Eigen::Matrix3d cross_matrix(const Vector3& s) {
  Eigen::Matrix3d m;
  m << 0, -s[2], s[1], s[2], 0, -s[0], -s[1], s[0], 0;
  return m;
}

/// B(p, s).
inline Matrix34 rotation_jacobian(const double* p, const Vector3& s) {
  const Vector3 e(p[1], p[2], p[3]);
  Matrix34 B;
  B.col(0) = 2 * (p[0] * s + cross(e, s));
  B.rightCols<3>() =
      2 * (e * s.transpose() - s * e.transpose() + e.dot(s) * Eigen::Matrix3d::Identity() - p[0] * cross_matrix(s));
  return B;
}

/// K(s, f).
inline Eigen::Matrix4d rotation_curvature(const Vector3& s, const Vector3& f) {
  const double sf = s.dot(f);
  const Vector3 sxf = cross(s, f);
  Eigen::Matrix4d K;
  K(0, 0) = 2 * sf;
  K.block<3, 1>(1, 0) = 2 * sxf;
  K.block<1, 3>(0, 1) = 2 * sxf.transpose();
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j) K(1 + i, 1 + j) = 2 * (f[i] * s[j] + s[i] * f[j] - (i == j ? sf : 0.0));
  return K;
}

/// G(p).
inline Matrix34 body_rate_matrix(const double* p) {
  Matrix34 G;
  G << -p[1], p[0], p[3], -p[2],  //
      -p[2], -p[3], p[0], p[1],   //
      -p[3], p[2], -p[1], p[0];
  return G;
}

/// E(p).
inline Matrix34 global_rate_matrix(const double* p) {
  Matrix34 E;
  E << -p[1], p[0], -p[3], p[2],  //
      -p[2], p[3], p[0], -p[1],   //
      -p[3], -p[2], p[1], p[0];
  return E;
}

/// d(G(p)^T b)/dp = [[0, -b^T], [b, -b~]].
inline Eigen::Matrix4d body_moment_partial(const Vector3& b) {
  Eigen::Matrix4d m = Eigen::Matrix4d::Zero();
  m.block<1, 3>(0, 1) = -b.transpose();
  m.block<3, 1>(1, 0) = b;
  m.block<3, 3>(1, 1) = -cross_matrix(b);
  return m;
}

}  // namespace costate
