#include "costate/analysis/first_guess.h"

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <numbers>

#include "costate/assembly/gathered_state.h"
#include "costate/base/error.h"
#include "costate/element/angle_row.h"

namespace costate {

namespace {

using std::numbers::pi;
constexpr double kFarTurn = pi / 4;

/// Of each such row: its element, the coordinate, and the angle that its direction has in q, from -pi to pi.
void for_each_angle(const Assembly& assembly, double t, const Eigen::VectorXd& q,
                    const std::function<void(const Constraint&, int, double)>& look) {
  GatheredState gathered;
  Eigen::VectorXd at = q;
  const Eigen::VectorXd still = Eigen::VectorXd::Zero(q.size());
  for (const auto& constraint : assembly.mechanism().constraints()) {
    if (!dynamic_cast<const AngleRow*>(constraint.get())) continue;
    const int angle = constraint->coordinates().back();
    const double was = at[angle];
    const auto row = [&](double theta) {
      at[angle] = theta;
      double phi = 0;
      constraint->calc_phi(gathered.of(*constraint, {t, at.data(), still.data()}, assembly.numbers()), &phi);
      return phi;
    };
    const double A = row(pi / 2), B = -row(0);
    at[angle] = was;
    if (std::hypot(A, B) > 0) look(*constraint, angle, std::atan2(B, A));
  }
}

}  // namespace

Eigen::VectorXd first_guess(const Assembly& assembly, double t) {
  const Mechanism& m = assembly.mechanism();
  Eigen::VectorXd q(assembly.n());
  for (int i = 0; i < assembly.n(); ++i)
    q[i] = assembly.numbers()[static_cast<std::size_t>(m.coordinates()[static_cast<std::size_t>(i)].position_number)];
  const Eigen::VectorXd written = q;
  for_each_angle(assembly, t, written, [&](const Constraint&, int angle, double direction) {
    const double off = std::remainder(direction - written[angle], 2 * pi);
    if (std::abs(off) > kFarTurn) q[angle] = written[angle] + off;
  });
  return q;
}

void require_angles(const Assembly& assembly, double t, const Eigen::VectorXd& q) {
  for_each_angle(assembly, t, q, [&](const Constraint& of, int angle, double direction) {
    if (std::abs(std::remainder(direction - q[angle], 2 * pi)) <= pi / 2) return;
    throw ModelError(of.path(),
                     fmt::format("At the start '{}' is {:.6g} rad, and what it is the angle of points half a turn away "
                                 "from there. Bring the first guesses of its points nearer to it.",
                                 assembly.mechanism().coordinates()[static_cast<std::size_t>(angle)].name, q[angle]));
  });
}

}  // namespace costate
