#include "costate/element/constraint/turn_angle.h"

namespace costate {

/// g = sin(angle) w - cos(angle) c and h = g' = cos(angle) w + sin(angle) c in the first body's frame, u in
/// the second's; phi = A_i g . A_j u. With respect to the angle, h' = -g.
struct TurnAngleConstraint::Frame {
  Vector3 g, h, u;
  double rate = 0, acceleration = 0;  // of the angle
  Frame(const LocalState& s, int k) {
    Vector3 w, c, unused;
    across_axis(s.p, s.p + 6, w.data(), c.data());
    across_axis(s.p + 3, s.p + 9, u.data(), unused.data());
    const double sn = std::sin(s.q[k]), cs = std::cos(s.q[k]);
    g = sn * w - cs * c;
    h = cs * w + sn * c;
    if (s.v) rate = s.v[k];
    if (s.a) acceleration = s.a[k];
  }
};

TurnAngleConstraint::TurnAngleConstraint(std::string kind, std::string name, BodyDirection i, BodyDirection j,
                                         int angle_coordinate, const std::vector<int>& numbers)
    : ConstraintOf(std::move(kind), std::move(name)), i_(std::move(i)), j_(std::move(j)) {
  append_coordinates(i_.coordinates());
  append_coordinates(j_.coordinates());
  append_coordinates({angle_coordinate});
  append_numbers(numbers);
}

void TurnAngleConstraint::calc_phi_q(const LocalState& s, LocalMatrix& phi_q) const {
  const int n = i_.size(), m = j_.size();
  const Frame f(s, n + m);
  const Vector3 G = i_.value(s.q, f.g), H = i_.value(s.q, f.h), U = j_.value(s.q + n, f.u);
  phi_q.row(0).head(n) = U.transpose() * i_.jacobian(s.q, f.g);
  phi_q.row(0).segment(n, m) = G.transpose() * j_.jacobian(s.q + n, f.u);
  phi_q(0, n + m) = H.dot(U);
}

void TurnAngleConstraint::calc_bias(const LocalState& s, double* bias) const {
  const int n = i_.size();
  const Frame f(s, n + j_.size());
  const double w = f.rate;
  const Vector3 Gd = i_.rate(s.q, s.v, f.g) + w * i_.value(s.q, f.h);
  const Vector3 Gdd = i_.turning(s.v, f.g) + 2 * w * i_.rate(s.q, s.v, f.h) - w * w * i_.value(s.q, f.g);
  bias[0] = Gdd.dot(j_.value(s.q + n, f.u)) + 2 * Gd.dot(j_.rate(s.q + n, s.v + n, f.u)) +
            i_.value(s.q, f.g).dot(j_.turning(s.v + n, f.u));
}

void TurnAngleConstraint::calc_hessian(const LocalState& s, LocalMatrix& hessian) const {
  const int n = i_.size(), m = j_.size();
  const Frame f(s, n + m);
  const double l = s.lambda[0];
  const Vector3 G = i_.value(s.q, f.g), H = i_.value(s.q, f.h), U = j_.value(s.q + n, f.u);
  i_.add_curvature(l, f.g, U, 0, hessian);
  j_.add_curvature(l, f.u, G, n, hessian);
  const auto Bj = j_.jacobian(s.q + n, f.u);
  const BodyDirection::Square mixed = l * i_.jacobian(s.q, f.g).transpose() * Bj;
  hessian.block(0, n, n, m) += mixed;
  hessian.block(n, 0, m, n) += mixed.transpose();
  hessian.col(n + m).head(n) = l * i_.jacobian(s.q, f.h).transpose() * U;
  hessian.col(n + m).segment(n, m) = l * Bj.transpose() * H;
  hessian.row(n + m).head(n + m) = hessian.col(n + m).head(n + m).transpose();
  hessian(n + m, n + m) = -l * G.dot(U);
}

void TurnAngleConstraint::calc_partials(const LocalState& s, LocalMatrix& hessian, LocalMatrix& phid_q,
                                        LocalMatrix& phidd_q) const {
  calc_hessian(s, hessian);
  const int n = i_.size(), m = j_.size();
  const Frame f(s, n + m);
  const double w = f.rate, alpha = f.acceleration;
  const double *qj = s.q + n, *vj = s.v + n, *aj = s.a + n;
  const Vector3 G = i_.value(s.q, f.g), H = i_.value(s.q, f.h), U = j_.value(qj, f.u);
  const Vector3 Gv = i_.rate(s.q, s.v, f.g), Hv = i_.rate(s.q, s.v, f.h);
  const Vector3 Ga = i_.rate(s.q, s.a, f.g) + i_.turning(s.v, f.g), Ha = i_.rate(s.q, s.a, f.h) + i_.turning(s.v, f.h);
  const Vector3 Ud = j_.rate(qj, vj, f.u), Udd = j_.rate(qj, aj, f.u) + j_.turning(vj, f.u);
  // A_i g along the motion, and the same of h = dg/dangle.
  const Vector3 Gd = Gv + w * H, Gdd = Ga + 2 * w * Hv + alpha * H - w * w * G;
  const Vector3 Hd = Hv - w * G, Hdd = Ha - 2 * w * Gv - alpha * G - w * w * H;
  const auto B = i_.jacobian(s.q, f.g), Bh = i_.jacobian(s.q, f.h);
  const BodyDirection::Jacobian Bd = i_.jacobian_dot(s.v, f.g) + w * Bh;
  const BodyDirection::Jacobian Bdd =
      i_.jacobian_dot(s.a, f.g) + 2 * w * i_.jacobian_dot(s.v, f.h) + alpha * Bh - w * w * B;
  const auto C = j_.jacobian(qj, f.u), Cd = j_.jacobian_dot(vj, f.u), Cdd = j_.jacobian_dot(aj, f.u);
  phid_q.row(0).head(n) = U.transpose() * Bd + Ud.transpose() * B;
  phid_q.row(0).segment(n, m) = Gd.transpose() * C + G.transpose() * Cd;
  phid_q(0, n + m) = Hd.dot(U) + H.dot(Ud);
  phidd_q.row(0).head(n) = U.transpose() * Bdd + 2 * Ud.transpose() * Bd + Udd.transpose() * B;
  phidd_q.row(0).segment(n, m) = Gdd.transpose() * C + 2 * Gd.transpose() * Cd + G.transpose() * Cdd;
  phidd_q(0, n + m) = Hdd.dot(U) + 2 * Hd.dot(Ud) + H.dot(Udd);
}

}  // namespace costate
