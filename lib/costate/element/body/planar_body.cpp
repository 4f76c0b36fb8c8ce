#include "costate/element/body/planar_body.h"

namespace costate {

namespace {
struct Arm {  // A(angle) c
  double x, y;
  explicit Arm(const LocalState& s) {
    const double c = std::cos(s.q[2]), n = std::sin(s.q[2]);
    x = c * s.p[2] - n * s.p[3];
    y = n * s.p[2] + c * s.p[3];
  }
};
}  // namespace

PlanarBody::PlanarBody(std::string kind, std::string name, std::vector<int> coordinates, std::vector<int> numbers)
    : BodyOf(std::move(kind), std::move(name)) {
  append_coordinates(coordinates);
  append_numbers(numbers);
}

void PlanarBody::calc_mass(const LocalState& s, LocalMatrix& M) const {
  const Arm r(s);
  const double m = s.p[0];
  M(0, 0) = M(1, 1) = m;
  M(0, 2) = M(2, 0) = -m * r.y;
  M(1, 2) = M(2, 1) = m * r.x;
  M(2, 2) = s.p[1] + m * (r.x * r.x + r.y * r.y);
}

void PlanarBody::calc_force(const LocalState& s, double* Q) const {
  const Arm r(s);
  const double m = s.p[0], w2 = s.v[2] * s.v[2];
  Q[0] = m * (w2 * r.x + s.p[4]);
  Q[1] = m * (w2 * r.y + s.p[5]);
  Q[2] = m * (r.x * s.p[5] - r.y * s.p[4]);
}

void PlanarBody::calc_partials(const LocalState& s, LocalMatrix& r_q, LocalMatrix& r_v) const {
  const Arm r(s);
  const double m = s.p[0], w = s.v[2], alpha = s.a[2];
  // d(r.x)/d(angle) = -r.y, d(r.y)/d(angle) = r.x
  r_q(0, 2) = m * (-alpha * r.x + w * w * r.y);
  r_q(1, 2) = m * (-alpha * r.y - w * w * r.x);
  r_q(2, 2) = -m * (r.x * (s.a[0] - s.p[4]) + r.y * (s.a[1] - s.p[5]));
  r_v(0, 2) = -2 * m * w * r.x;
  r_v(1, 2) = -2 * m * w * r.y;
}

void PlanarBody::calc_number_partial(const LocalState& s, int number, double* r_p) const {
  const Arm r(s);
  const double m = s.p[0], w2 = s.v[2] * s.v[2], alpha = s.a[2];
  const double ax = s.a[0] - alpha * r.y - w2 * r.x - s.p[4], ay = s.a[1] + alpha * r.x - w2 * r.y - s.p[5];
  switch (number) {
    case 0:
      r_p[0] = ax;
      r_p[1] = ay;
      r_p[2] = r.x * ay - r.y * ax;
      return;
    case 1:
      r_p[2] = alpha;
      return;
    case 2:
    case 3: {
      const double c = std::cos(s.q[2]), n = std::sin(s.q[2]);
      const double dx = number == 2 ? c : -n, dy = number == 2 ? n : c;  // of the arm
      r_p[0] = m * (-alpha * dy - w2 * dx);
      r_p[1] = m * (alpha * dx - w2 * dy);
      r_p[2] = m * (dx * ay - dy * ax) + r.x * r_p[1] - r.y * r_p[0];
      return;
    }
    default:
      r_p[number - 4] = -m;
      r_p[2] = number == 4 ? m * r.y : -m * r.x;
  }
}

double PlanarBody::potential_energy(const LocalState& s) const {
  const Arm r(s);
  return -s.p[0] * (s.p[4] * (s.q[0] + r.x) + s.p[5] * (s.q[1] + r.y));
}

}  // namespace costate
