// What adjoints need of the numbers of points: the gradient with respect to all of them of a weighted position f.r, of
// a weighted rate f.(r_q w) along any w, and of a weighted acceleration f.rddot, each in one evaluation. An element
// whose physics is a function of d = r_j - r_i and its rates differentiates by these and hands the result on as f.
#pragma once

#include "costate/element/point/body_direction.h"
#include "costate/element/point/planar_vector.h"
#include "costate/element/point/spatial_vector.h"

namespace costate {

// A(p) s and B(p, s) w are linear in s; their transposes turn back, by the conjugate parameters (e0, -e).

/// out += A(p)^T f.
inline void add_rotated_back(const double* p, const double* f, double* out) {
  const double back[4] = {p[0], -p[1], -p[2], -p[3]};
  double s[3];
  rotated(back, f, s);
  for (int i = 0; i < 3; ++i) out[i] += s[i];
}
/// out += (B(p, s) w)_s^T f.
inline void add_rate_rotated_back(const double* p, const double* w, const double* f, double* out) {
  const double back[4] = {p[0], -p[1], -p[2], -p[3]}, rate[4] = {w[0], -w[1], -w[2], -w[3]};
  double s[3];
  rotated_rate(back, rate, f, s);
  for (int i = 0; i < 3; ++i) out[i] += s[i];
}

/// out += the gradient of f.r.
inline void add_number_gradient(const SpatialPoint& r, const double* q, const double*, const double* f, double* out) {
  switch (r.kind()) {
    case SpatialPoint::Kind::free:
      return;
    case SpatialPoint::Kind::ground:
      for (int k = 0; k < 3; ++k) out[k] += f[k];
      return;
    case SpatialPoint::Kind::on_body:
      return add_rotated_back(q + 3, f, out);
    case SpatialPoint::Kind::on_natural_body:
      for (int k = 0; k < 3; ++k) out[k] += dot3(q + 3 + 3 * k, f);
      return;
  }
}
/// out += the gradient of f.(r_q w).
inline void add_rate_number_gradient(const SpatialPoint& r, const double* q, const double* w, const double*,
                                     const double* f, double* out) {
  if (r.kind() == SpatialPoint::Kind::on_body) add_rate_rotated_back(q + 3, w + 3, f, out);
  if (r.kind() == SpatialPoint::Kind::on_natural_body)
    for (int k = 0; k < 3; ++k) out[k] += dot3(w + 3 + 3 * k, f);
}
/// out += the gradient of f.rddot.
inline void add_acceleration_number_gradient(const SpatialPoint& r, const double* q, const double* v, const double* a,
                                             const double* p, const double* f, double* out) {
  add_rate_number_gradient(r, q, a, p, f, out);
  if (r.kind() == SpatialPoint::Kind::on_body) add_rate_rotated_back(v + 3, v + 3, f, out);
}

/// out += A(angle)^T (x, y).
inline void add_turned_back(double angle, double x, double y, double* out) {
  const double c = std::cos(angle), s = std::sin(angle);
  out[0] += c * x + s * y;
  out[1] += c * y - s * x;
}
/// out += the gradient with respect to p0, p1, p2 of f.r at p0 along and p1 across the line from i to j, in units of
/// p2.
inline void add_bar_gradient(const double* i, const double* j, const double* p, const double* f, double* out) {
  const double dx = j[0] - i[0], dy = j[1] - i[1];
  const double along = (f[0] * dx + f[1] * dy) / p[2], across = (f[1] * dx - f[0] * dy) / p[2];
  out[0] += along;
  out[1] += across;
  out[2] -= (along * p[0] + across * p[1]) / p[2];
}

inline void add_number_gradient(const PlanarPoint& r, const double* q, const double* p, const double* f, double* out) {
  switch (r.kind()) {
    case PlanarPoint::Kind::free:
      return;
    case PlanarPoint::Kind::ground:
      out[0] += f[0];
      out[1] += f[1];
      return;
    case PlanarPoint::Kind::on_body:
      return add_turned_back(q[2], f[0], f[1], out);
    case PlanarPoint::Kind::on_bar:
      return add_bar_gradient(q, q + 2, p, f, out);
    case PlanarPoint::Kind::on_bar_from_ground: {
      const double rest = 1 - p[0] / p[2], across = p[1] / p[2];
      out[3] += rest * f[0] - across * f[1];
      out[4] += across * f[0] + rest * f[1];
      return add_bar_gradient(p + 3, q, p, f, out);
    }
    case PlanarPoint::Kind::on_bar_to_ground: {
      const double along = p[0] / p[2], across = p[1] / p[2];
      out[3] += along * f[0] + across * f[1];
      out[4] += along * f[1] - across * f[0];
      return add_bar_gradient(q, p + 3, p, f, out);
    }
  }
}
inline void add_rate_number_gradient(const PlanarPoint& r, const double* q, const double* w, const double* p,
                                     const double* f, double* out) {
  const double rest[2] = {0, 0};
  if (r.kind() == PlanarPoint::Kind::on_body) add_turned_back(q[2], w[2] * f[1], -w[2] * f[0], out);
  if (r.kind() == PlanarPoint::Kind::on_bar) add_bar_gradient(w, w + 2, p, f, out);
  if (r.kind() == PlanarPoint::Kind::on_bar_from_ground) add_bar_gradient(rest, w, p, f, out);
  if (r.kind() == PlanarPoint::Kind::on_bar_to_ground) add_bar_gradient(w, rest, p, f, out);
}

/// The most numbers that the points of a line have.
template <class Line>
inline constexpr int kMaxNumbers = 6;
template <>
inline constexpr int kMaxNumbers<PlanarVector> = 2 * PlanarPoint::kMaxNumbers;

// The same of d = r_j - r_i (PlanarVector, SpatialVector), on its joined coordinates and numbers.

template <class Line>
void add_number_gradient(const Line& d, const double* q, const double* p, const typename Line::Vector& f, double* out) {
  const auto &i = d.from(), &j = d.to();
  const typename Line::Vector back = -f;
  add_number_gradient(i, q, p, back.data(), out);
  add_number_gradient(j, q + i.size(), p + i.numbers().size(), f.data(), out + i.numbers().size());
}
template <class Line>
void add_rate_number_gradient(const Line& d, const double* q, const double* w, const double* p,
                              const typename Line::Vector& f, double* out) {
  const auto &i = d.from(), &j = d.to();
  const int n = i.size();
  const typename Line::Vector back = -f;
  add_rate_number_gradient(i, q, w, p, back.data(), out);
  add_rate_number_gradient(j, q + n, w + n, p + i.numbers().size(), f.data(), out + i.numbers().size());
}
inline void add_acceleration_number_gradient(const SpatialVector& d, const double* q, const double* v, const double* a,
                                             const double* p, const Vector3& f, double* out) {
  const auto &i = d.from(), &j = d.to();
  const int n = i.size();
  const Vector3 back = -f;
  add_acceleration_number_gradient(i, q, v, a, p, back.data(), out);
  add_acceleration_number_gradient(j, q + n, v + n, a + n, p + i.numbers().size(), f.data(), out + i.numbers().size());
}

// The same of a direction u by its components s: f.u, f.(u_q w) and f.uddot.

inline void add_component_gradient(const BodyDirection& u, const double* q, const Vector3& f, Vector3& out) {
  if (u.size() == 0) out += f;
  if (u.size() == 4) add_rotated_back(q, f.data(), out.data());
  for (int k = 0; k < 3 && u.linear(); ++k) out[k] += dot3(q + 3 * k, f.data());
}
inline void add_rate_component_gradient(const BodyDirection& u, const double* q, const double* w, const Vector3& f,
                                        Vector3& out) {
  if (u.size() == 4) add_rate_rotated_back(q, w, f.data(), out.data());
  for (int k = 0; k < 3 && u.linear(); ++k) out[k] += dot3(w + 3 * k, f.data());
}
inline void add_acceleration_component_gradient(const BodyDirection& u, const double* q, const double* v,
                                                const double* a, const Vector3& f, Vector3& out) {
  add_rate_component_gradient(u, q, a, f, out);
  if (u.size() == 4) add_rate_rotated_back(v, v, f.data(), out.data());
}

/// The gradient with respect to an axis of what has the gradient `by_unit` with respect to axis / |axis|.
inline Vector3 axis_gradient(const double* axis, const Vector3& by_unit) {
  const Vector3 a(axis[0], axis[1], axis[2]);
  const double length = a.norm();
  return (by_unit - by_unit.dot(a) / (length * length) * a) / length;
}

}  // namespace costate
