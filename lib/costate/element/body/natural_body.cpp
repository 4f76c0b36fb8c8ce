#include "costate/element/body/natural_body.h"

#include <algorithm>

#include "costate/element/body/cardan_angles.h"
#include "costate/element/body/turning_measures.h"

namespace costate {

NaturalBody::NaturalBody(std::string kind, std::string name, const std::vector<int>& coordinates,
                         const std::vector<int>& numbers, Reports reports)
    : BodyOf(std::move(kind), std::move(name)), reports_(reports) {
  append_coordinates(coordinates);
  append_numbers(numbers);
}

std::vector<Measure> NaturalBody::measures() const {
  if (reports_ == Reports::nothing) return {};
  return turning_measures();
}

PathDual NaturalBody::measure(int i, const MeasureArguments& x) const {
  if (i >= 6 && i < 9) return cardan_angle(static_cast<CardanAngle>(i - 6), x.q[3], x.q[4], x.q[5], x.q[8], x.q[11]);
  // In the body's frame u3 . u2', u1 . u3', u2 . u1'; globally the sum of u x u' over two.
  const int k = i % 3, j = (k + 1) % 3, l = (k + 2) % 3;
  const bool acceleration = i >= 9;
  if (i < 3) return dot3(x.q + 3 + 3 * l, x.v + 3 + 3 * j);
  if (acceleration && i < 12) return dot3(x.v + 3 + 3 * l, x.v + 3 + 3 * j) + dot3(x.q + 3 + 3 * l, x.a + 3 + 3 * j);
  const PathDual* change = acceleration ? x.a : x.v;  // u' x u' = 0
  PathDual sum;
  for (int u = 3; u < 12; u += 3) sum += x.q[u + j] * change[u + l] - x.q[u + l] * change[u + j];
  return PathDual(0.5) * sum;
}

void NaturalBody::calc_mass(const LocalState& s, LocalMatrix& M) const {
  double P[4][4];
  moments(s.p, P);
  for (int k = 0; k < 4; ++k)
    for (int l = 0; l < 4; ++l)
      for (int i = 0; i < 3; ++i) M(3 * k + i, 3 * l + i) = P[k][l];
}

void NaturalBody::calc_force(const LocalState& s, double* Q) const {
  double P[4][4];
  moments(s.p, P);
  for (int k = 0; k < 4; ++k)
    for (int i = 0; i < 3; ++i) Q[3 * k + i] = P[k][0] * s.p[10 + i];
}

void NaturalBody::calc_number_partial(const LocalState& s, int number, double* r_p) const {
  const double m = s.p[0], *c = s.p + 7, *g = s.p + 10;
  if (number >= 10) {
    r_p[number - 10] = -m;
    for (int k = 0; k < 3; ++k) r_p[3 + 3 * k + number - 10] = -m * c[k];
    return;
  }
  double P[4][4] = {};  // dP/dnumber
  if (number == 0) {
    const double x[4] = {1, c[0], c[1], c[2]};
    for (int k = 0; k < 4; ++k)
      for (int l = 0; l < 4; ++l) P[k][l] = x[k] * x[l];
  } else if (number < 4) {
    for (int k = 1; k < 4; ++k) P[k][k] = k == number ? -0.5 : 0.5;
  } else if (number < 7) {
    constexpr int at[3][2] = {{1, 2}, {1, 3}, {2, 3}};
    const int k = at[number - 4][0], l = at[number - 4][1];
    P[k][l] = P[l][k] = -1;
  } else {
    const int k = number - 6;
    P[0][k] = P[k][0] = m;
    for (int l = 1; l < 4; ++l) {
      P[k][l] += m * c[l - 1];
      P[l][k] += m * c[l - 1];
    }
  }
  for (int k = 0; k < 4; ++k)
    for (int i = 0; i < 3; ++i) {
      r_p[3 * k + i] = P[k][0] * (s.a[i] - g[i]);
      for (int l = 1; l < 4; ++l) r_p[3 * k + i] += P[k][l] * s.a[3 * l + i];
    }
}

double NaturalBody::potential_energy(const LocalState& s) const {
  double Q[12], energy = 0;
  calc_force(s, Q);
  for (int i = 0; i < 12; ++i) energy -= Q[i] * s.q[i];
  return energy;
}

}  // namespace costate
