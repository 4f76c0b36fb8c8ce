#include "costate/element/body/rigid_body.h"

#include "costate/element/body/cardan_angles.h"
#include "costate/element/body/turning_measures.h"

namespace costate {

namespace {

Vector3 vector3(const double* x) { return {x[0], x[1], x[2]}; }

Eigen::Matrix3d inertia(const double* n) {
  Eigen::Matrix3d J;
  J << n[1], n[4], n[5], n[4], n[2], n[6], n[5], n[6], n[3];
  return J;
}

/// rddot_c - g.
Vector3 free_acceleration(const LocalState& s) {
  const double* c = s.p + 7;
  double along[3], turning[3];
  rotated_rate(s.q + 3, s.a + 3, c, along);
  rotated_rate(s.v + 3, s.v + 3, c, turning);
  Vector3 u;
  for (int i = 0; i < 3; ++i) u[i] = s.a[i] + along[i] + turning[i] - s.p[10 + i];
  return u;
}

}  // namespace

RigidBody::RigidBody(std::string kind, std::string name, const std::vector<int>& coordinates,
                     const std::vector<int>& numbers, Reports reports)
    : BodyOf(std::move(kind), std::move(name)), reports_(reports) {
  append_coordinates(coordinates);
  append_numbers(numbers);
}

std::vector<Measure> RigidBody::measures() const {
  if (reports_ == Reports::nothing) return {};
  return turning_measures();
}

template <class S>
S RigidBody::measured(int i, const MeasureArgumentsOf<S>& x) const {
  if (i >= 6 && i < 9) {
    const S *e = x.q + 3, &e0 = e[0], &e1 = e[1], &e2 = e[2], &e3 = e[3];
    return cardan_angle<S>(static_cast<CardanAngle>(i - 6), e0 * e0 + e1 * e1 - e2 * e2 - e3 * e3,
                           2.0 * (e1 * e2 + e0 * e3), 2.0 * (e1 * e3 - e0 * e2), 2.0 * (e2 * e3 + e0 * e1),
                           e0 * e0 - e1 * e1 - e2 * e2 + e3 * e3);
  }
  // omega = 2 G(e) e', and alpha = 2 G(e) e'', since G(e') e' = 0.
  const S* change = (i < 6 ? x.v : x.a) + 3;
  S rate[3];
  if (i % 9 < 3)
    body_rate(x.q + 3, change, rate);
  else
    global_rate(x.q + 3, change, rate);
  return 2.0 * rate[i % 3];
}

PathDual RigidBody::measure(int i, const MeasureArguments& x) const { return measured(i, x); }

bool RigidBody::measure_value(int i, const ValueArguments& x, double& value) const {
  value = measured(i, x);
  return true;
}

void RigidBody::calc_mass(const LocalState& s, LocalMatrix& M) const {
  const double m = s.p[0];
  const Matrix34 B = rotation_jacobian(s.q + 3, vector3(s.p + 7)), G = body_rate_matrix(s.q + 3);
  const Matrix34 JG = inertia(s.p) * G;
  for (int i = 0; i < 3; ++i) {
    M(i, i) = m;
    for (int j = 0; j < 4; ++j) M(i, 3 + j) = M(3 + j, i) = m * B(i, j);
  }
  for (int i = 0; i < 4; ++i)
    for (int j = 0; j <= i; ++j)
      M(3 + i, 3 + j) = M(3 + j, 3 + i) = 4 * G.col(i).dot(JG.col(j)) + m * B.col(i).dot(B.col(j));
}

void RigidBody::calc_force(const LocalState& s, double* Q) const {
  const double rest[7] = {};
  LocalState still = s;
  still.a = rest;
  double r[7];
  physics<double>(still.q, still.v, still.a, still.p, r);
  for (int i = 0; i < 7; ++i) Q[i] = -r[i];
}

void RigidBody::calc_partials(const LocalState& s, LocalMatrix& r_q, LocalMatrix& r_v) const {
  const double m = s.p[0];
  const Vector3 c = vector3(s.p + 7), f = m * free_acceleration(s);
  const Eigen::Matrix3d J = inertia(s.p);
  const Matrix34 G = body_rate_matrix(s.q + 3), Gd = body_rate_matrix(s.v + 3), Ga = body_rate_matrix(s.a + 3);
  const Eigen::Map<const Vector4> pd(s.v + 3), pdd(s.a + 3);
  const Vector3 JGa = J * (G * pdd), JGv = J * (G * pd);
  // G(p) w = -G(w) p: d(4 G^T J G a) = 4 [Bs(J G a) - G^T J G(a)] dp, Bs(b) = d(G^T b)/dp.
  r_q.bottomRightCorner<4, 4>() = 4 * (body_moment_partial(JGa) - G.transpose() * J * Ga) - 8 * Gd.transpose() * J * Gd;
  r_v.bottomRightCorner<4, 4>() = 8 * (body_moment_partial(JGv) + Gd.transpose() * J * G);
  // The centre of mass.
  const Matrix34 B = rotation_jacobian(s.q + 3, c);
  const Matrix34 f_p = m * rotation_jacobian(s.a + 3, c), f_v = 2 * m * rotation_jacobian(s.v + 3, c);
  r_q.topRightCorner<3, 4>() = f_p;
  r_v.topRightCorner<3, 4>() = f_v;
  r_q.bottomRightCorner<4, 4>() += rotation_curvature(c, f) + B.transpose() * f_p;
  r_v.bottomRightCorner<4, 4>() += B.transpose() * f_v;
}

void RigidBody::calc_number_partial(const LocalState& s, int number, double* r_p) const {
  const double m = s.p[0];
  const double *p = s.q + 3, *c = s.p + 7;
  if (number == 0) {
    const Vector3 u = free_acceleration(s);
    for (int i = 0; i < 3; ++i) r_p[i] = u[i];
    add_rotated_force(p, c, u.data(), r_p + 3);
  } else if (number < 7) {
    constexpr int at[6][2] = {{0, 0}, {1, 1}, {2, 2}, {0, 1}, {0, 2}, {1, 2}};
    const int i = at[number - 1][0], j = at[number - 1][1];
    double Ga[3], Gv[3], JGa[3] = {}, JGv[3] = {};
    body_rate(p, s.a + 3, Ga);
    body_rate(p, s.v + 3, Gv);
    JGa[i] = Ga[j];
    JGa[j] = Ga[i];
    JGv[i] = Gv[j];
    JGv[j] = Gv[i];
    add_body_moment(p, JGa, 4, r_p + 3);
    add_body_moment(s.v + 3, JGv, 8, r_p + 3);
  } else if (number < 10) {
    double unit[3] = {}, along[3], turning[3];
    unit[number - 7] = 1;
    rotated_rate(p, s.a + 3, unit, along);
    rotated_rate(s.v + 3, s.v + 3, unit, turning);
    for (int i = 0; i < 3; ++i) r_p[i] = m * (along[i] + turning[i]);
    const Vector3 f = m * free_acceleration(s);
    add_rotated_force(p, c, r_p, r_p + 3);
    add_rotated_force(p, unit, f.data(), r_p + 3);
  } else {
    r_p[number - 10] = -m;
    add_rotated_force(p, c, r_p, r_p + 3);
  }
}

double RigidBody::potential_energy(const LocalState& s) const {
  double arm[3], energy = 0;
  rotated(s.q + 3, s.p + 7, arm);
  for (int i = 0; i < 3; ++i) energy -= s.p[0] * s.p[10 + i] * (s.q[i] + arm[i]);
  return energy;
}

}  // namespace costate
