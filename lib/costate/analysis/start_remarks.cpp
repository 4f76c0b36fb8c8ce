#include "costate/analysis/start_remarks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

#include "costate/analysis/mechanism_size.h"
#include "costate/element/constraint/directions.h"
#include "costate/element/constraint/euler_norm.h"
#include "costate/element/constraint/turn_angle.h"

namespace costate {

namespace {

/// Of bodies in space that the assembly has turned away from their first guess: a quarter of a turn and more; where the
/// scene has an orientation, a sixth of a right angle.
void add_turned_bodies(const Assembly& assembly, const Start& start, std::vector<std::string>& remarks) {
  constexpr double kFarTurn = 1.57, kOtherThanWritten = 0.26;
  const Mechanism& m = assembly.mechanism();
  std::vector<std::pair<double, std::string>> turned;
  for (const auto& c : m.constraints()) {
    if (!dynamic_cast<const EulerNormConstraint*>(c.get())) continue;
    double along = 0, guess = 0, size = 0;
    bool written = false;
    for (std::size_t k = 0; k < 4; ++k) {
      const int i = c->coordinates()[k];
      const double e =
          assembly.numbers()[static_cast<std::size_t>(m.coordinates()[static_cast<std::size_t>(i)].position_number)];
      along += e * start.q[i];
      guess += e * e;
      size += start.q[i] * start.q[i];
      written = written || (k > 0 && e != 0);
    }
    const double angle = 2 * std::acos(std::min(1.0, std::abs(along) / std::sqrt(guess * size)));
    if (angle > (written ? kOtherThanWritten : kFarTurn)) turned.emplace_back(-angle, c->name());
  }
  std::sort(turned.begin(), turned.end());
  for (std::size_t k = 0; k < std::min<std::size_t>(3, turned.size()); ++k)
    remarks.push_back(fmt::format(
        "The start has '{}' turned by {:.3g} degrees from its first guess: its joints ask for that, or the mechanism "
        "is "
        "assembled in another way than meant. Look at the axes of its joints (axis_second is in the second body's "
        "frame), or bring the guess nearer.",
        turned[k].second, -turned[k].first * 180 / std::numbers::pi));
}

/// Rows that hold axes together hold as well where these are opposite: a guess that is turned by more than a quarter of
/// a turn from what the scene says leads there. Where neither the sense of an axis nor a normal counts, nothing is
/// said.
void add_opposite_axes(const Assembly& assembly, const Start& start, std::vector<std::string>& remarks) {
  const Mechanism& m = assembly.mechanism();
  std::set<std::string> with_angle;
  for (const auto& c : m.constraints())
    if (dynamic_cast<const TurnAngleConstraint*>(c.get())) with_angle.insert(c->path());
  for (const auto& c : m.constraints()) {
    const auto* directions = dynamic_cast<const DirectionsConstraint*>(c.get());
    if (!directions ||
        (directions->condition() != DirectionsConstraint::Condition::aligned &&
         !(directions->condition() == DirectionsConstraint::Condition::parallel && with_angle.contains(c->path()))))
      continue;
    std::vector<double> q, p;
    for (const int i : c->coordinates()) q.push_back(start.q[i]);
    for (const int k : c->numbers()) p.push_back(assembly.numbers()[static_cast<std::size_t>(k)]);
    if (directions->agreement(q.data(), p.data()) < 0)
      remarks.push_back(fmt::format(
          "The start has axes or normals of '{}' opposite to each other, half a turn from what the scene says of them: "
          "the first guess of its bodies is nearer to that. Turn the guess, or an axis.",
          c->path()));
  }
}

}  // namespace

std::vector<std::string> start_remarks(const Assembly& assembly, const Start& start) {
  constexpr double kFarMove = 0.5, kFarTurn = 1.57;
  const Mechanism& m = assembly.mechanism();
  std::vector<std::string> remarks;
  if (m.starts_at_equilibrium()) return remarks;
  const double extent = extent_of(assembly, start.q).value_or(1);
  std::vector<std::pair<double, int>> far;
  for (int i = 0; i < assembly.n(); ++i) {
    const Coordinate& c = m.coordinates()[static_cast<std::size_t>(i)];
    // The first value of an [angle] follows from its bar's points.
    if (m.numbers()[static_cast<std::size_t>(c.position_number)].path.rfind("angle.", 0) == 0) continue;
    const double limit = c.unit == "m" ? kFarMove * extent : kFarTurn;
    const double moved = std::abs(start.q[i] - assembly.numbers()[static_cast<std::size_t>(c.position_number)]) / limit;
    if (moved > 1) far.emplace_back(-moved, i);
  }
  std::sort(far.begin(), far.end());
  for (std::size_t k = 0; k < std::min<std::size_t>(3, far.size()); ++k) {
    const int i = far[k].second;
    const Coordinate& c = m.coordinates()[static_cast<std::size_t>(i)];
    remarks.push_back(fmt::format(
        "The start has '{}' at {:.6g} {}, far from its first guess {:.6g} {}: the mechanism may be "
        "assembled in another way than meant. Bring the guess nearer, or give the coordinate in "
        "[start].",
        c.name, start.q[i], c.unit, assembly.numbers()[static_cast<std::size_t>(c.position_number)], c.unit));
  }
  add_turned_bodies(assembly, start, remarks);
  add_opposite_axes(assembly, start, remarks);
  // A rate that was written and is not the one that the motion starts with: rates that are given determine it.
  constexpr double kOtherRate = 1e-3, kRounding = 1e-13;  // of the rate itself, of the largest
  const double rounding = kRounding * (start.v.size() > 0 ? start.v.cwiseAbs().maxCoeff() : 0);
  std::set<int> given;
  for (const GivenStart& g : m.given_velocities()) given.insert(g.coordinate);
  std::size_t told = 0;
  for (int i = 0; i < assembly.n() && told < 3; ++i) {
    const Coordinate& c = m.coordinates()[static_cast<std::size_t>(i)];
    if (c.velocity_number < 0 || given.contains(i)) continue;
    const double written = assembly.numbers()[static_cast<std::size_t>(c.velocity_number)];
    const double larger = std::max(std::abs(written), std::abs(start.v[i]));
    if (written == 0 || std::abs(start.v[i] - written) <= std::max(kOtherRate * larger, rounding)) continue;
    ++told;
    remarks.push_back(
        fmt::format("The start has '{}' at a rate of {:.6g} {}/s, not {:.6g} as the scene has it: the given velocities "
                    "determine it. "
                    "Name it in given_velocities of [start] in the place of another one, or leave its rate out.",
                    c.name, start.v[i] + 0.0, c.unit, written));  // no -0
  }
  return remarks;
}

}  // namespace costate
