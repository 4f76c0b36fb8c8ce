#include "costate/element/force/bushing.h"

#include <fmt/format.h>

#include <algorithm>
#include <map>

#include "costate/base/error.h"
#include "costate/base/run_epoch.h"
#include "costate/element/force/dual_partials.h"

namespace costate {

namespace {

Eigen::Matrix3d axes_of(const Vector4& euler) {
  Eigen::Matrix3d A;
  for (int k = 0; k < 3; ++k) {
    const Vector3 axis = Vector3::Unit(k);
    rotated(euler.data(), axis.data(), A.col(k).data());
  }
  return A;
}

}  // namespace

Bushing::Bushing(std::string name, SpatialVector d, const std::vector<int>& law_numbers, const Vector4& frame_from,
                 const Vector4& frame_to)
    : ForceOf("bushing", std::move(name)),
      d_(std::move(d)),
      turn_i_(d_.from().direction_coordinates()),
      turn_j_(d_.to().direction_coordinates()),
      frame_i_(axes_of(frame_from)),
      frame_j_(axes_of(frame_to)) {
  append_coordinates(d_.coordinates());
  append_numbers(law_numbers);
  append_numbers(d_.numbers());
}

void Bushing::calc_partials(const LocalState& s, ForcePartials out) const {
  if (d_.size() <= 14)  // Euler parameters: half the directions
    calc_dual_partials<14, kNumbers + 6>(*this, s, out);
  else
    calc_dual_partials<SpatialVector::kMax, kNumbers + 6>(*this, s, out);
}

double Bushing::potential_energy(const LocalState& s) const {
  const double still[SpatialVector::kMax] = {};
  Deformation<double> x;
  deform(s.q, still, s.p + kNumbers, has_moment(s.p), x);
  double sum = 0;
  for (int k = 0; k < 6; ++k) sum += x.x[k] * (0.5 * s.p[k] * x.x[k] + s.p[12 + k]);
  return sum;
}

std::vector<Measure> Bushing::measures() const {
  std::vector<Measure> r;
  for (const auto& [name, unit] :
       {std::pair("", "m"), std::pair("angle_", "rad"), std::pair("force_", "N"), std::pair("torque_", "N m")})
    for (const char* axis : {"x", "y", "z"}) r.push_back({std::string(name) + axis, unit, false});
  return r;
}

template <class S>
S Bushing::measured(int i, const MeasureArgumentsOf<S>& m) const {
  Deformation<S> x;
  deform(m.q, m.v, m.p + kNumbers, has_moment(m.p), x);
  if (i < 6) return x.x[i];
  const auto load = [&](int k) { return m.p[k] * x.x[k] + m.p[6 + k] * x.rate[k] + m.p[12 + k]; };
  if (i < 9) return load(i - 6);
  S M[3], W[3], across[3];
  for (int k = 0; k < 3; ++k) M[k] = load(3 + k);
  weigh_rho(x, M, W);
  cross3(x.rho, W, across);
  const int k = i - 9;
  return S(0.5) * (W[k] + across[k] + x.rho[k] * dot3(x.rho, W));
}

PathDual Bushing::measure(int i, const MeasureArguments& x) const { return measured(i, x); }

bool Bushing::measure_value(int i, const ValueArguments& x, double& value) const {
  value = measured(i, x);
  return true;
}

namespace {
// What was seen last, and before that at another time: an integrator's trial of a step is seen at the time of the
// step.
struct Seen {
  double t = 0;
  std::array<double, 3> rho{};
  double rate = 0;  // rad/s
};
// Rad: from here on it may have gone round the other way, as where the ends of a run are looked at.
constexpr double kOtherWay = 4;
struct SeenInRun {
  std::map<const Bushing*, std::array<Seen, 2>> of;
  long epoch = 0;
};
thread_local SeenInRun seen_near_half_turn;
thread_local long away_in_run = -1;  // the run in which a bushing was last seen far from half a turn
constexpr const char* kHoldsHalf =
    ", and with it the moment, would jump to the other side. A bushing holds up to half a turn; take a torsion_spring "
    "on "
    "the angle of a joint, or stiffnesses that keep the turn smaller.";
}  // namespace

void Bushing::forget_half_turn() const {
  away_in_run = run_epoch();
  if (!seen_near_half_turn.of.empty()) seen_near_half_turn.of.erase(this);
}

void Bushing::half_turn() const {
  const auto seen = seen_near_half_turn.of.find(this);
  if (seen_near_half_turn.epoch == run_epoch() && seen != seen_near_half_turn.of.end())
    throw StepError(
        fmt::format("{}: its two frames come to half a turn against each other at t = {:.6g} s, where the rotation "
                    "vector{}",
                    path(), seen->second[0].t, kHoldsHalf));
  // A trial of a step that leads there is too long, or without numbers.
  if (away_in_run == run_epoch())
    throw StepError(fmt::format(
        "{}: its two frames come to half a turn against each other, where the rotation vector{}", path(), kHoldsHalf));
  throw ModelError(path(),
                   "The two frames are half a turn apart, where the rotation vector has no direction. Turn one of them "
                   "by its rotation axis and angle so that they coincide where the bushing is unloaded.");
}

void Bushing::compare_half_turn(double t, const std::array<double, 3>& rho, double rate) const {
  if (seen_near_half_turn.epoch != run_epoch()) seen_near_half_turn = {{}, run_epoch()};
  auto& [last, earlier] = seen_near_half_turn.of[this];
  const Seen before = t != last.t ? last : earlier;
  double along = 0;
  for (int k = 0; k < 3; ++k) along += rho[k] * before.rho[k];
  if (!(along < 0) || std::abs(t - before.t) * std::max(rate, before.rate) > kOtherWay) {
    earlier = before;
    last = {t, rho, rate};
    return;
  }
  // The trial that turns past is not taken note of: the next one is compared with the same instant.
  throw StepError(fmt::format(
      "{}: its two frames turn past half a turn against each other between t = {:.6g} s and {:.6g} s, where the "
      "rotation vector{}",
      path(), std::min(before.t, t), std::max(before.t, t), kHoldsHalf));
}

}  // namespace costate
