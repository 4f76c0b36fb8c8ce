#include "costate/analysis/own_jump_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numeric>

#include "costate/assembly/gathered_state.h"
#include "costate/base/error.h"
#include "costate/base/library_class.h"
#include "costate/element/guarded_force.h"
#include "costate/element/jumping_force.h"
#include "costate/objective/cost_check.h"
#include "costate/objective/sampled_cost.h"

namespace costate {

namespace {
/// Of a change: by how much the middle of a way may differ from that of its ends and still fit to these.
constexpr double kFitsMiddle = 1e-2;
/// Of the largest value: less is no jump. What is left of smooth values after so many halvings is far less.
constexpr double kIsJump = 1e-6;
constexpr int kHalvingsOfWay = 48;
constexpr double kNothing = 1e-290;  // in whatever units: smaller numbers have no digits to spare
/// Of positions, velocities and states: what is lost of them in the terms of a formula.
constexpr double kRounding = 32 * std::numeric_limits<double>::epsilon();
/// Of the way between two looks: how far beside the place values are taken, and nearer than that.
constexpr double kBesidePlace = 1e-9, kNearerPlace = 1e-2;
/// Of the mean distance of looks: nearer ones do not tell the way between them from rounding.
constexpr double kLooksNear = 1e-2;
/// Of a number, by which it is moved to see whether it moves the instant of a jump in time.
constexpr double kNumberMoved = 1e-6;

/// An assembly's parameters, one of which is moved for a while.
class MovedParameters {
 public:
  explicit MovedParameters(Assembly& assembly) : assembly_(assembly), rho_(assembly.rho()) {}
  MovedParameters(const MovedParameters&) = delete;
  MovedParameters& operator=(const MovedParameters&) = delete;
  ~MovedParameters() { assembly_.set_parameters(rho_.data()); }
  std::size_t count() const { return rho_.size(); }
  /// Parameter j alone, by this part of it.
  void move(std::size_t j, double by) const {
    std::vector<double> moved = rho_;
    moved[j] += by * std::max(std::abs(rho_[j]), kNumberMoved);
    assembly_.set_parameters(moved.data());
  }

 private:
  Assembly& assembly_;
  const std::vector<double> rho_;
};
}  // namespace

OwnJumpWatch::OwnJumpWatch(const Mechanism& mechanism, const Objective& objective) {
  for (std::size_t f = 0; f < mechanism.forces().size(); ++f) {
    const Force& force = *mechanism.forces()[f];
    if (is_wholly_of_library(typeid(force)) || dynamic_cast<const GuardedForce*>(&force) ||
        dynamic_cast<const JumpingForce*>(&force))
      continue;
    watched_.push_back({fmt::format("The force of '{}'", force.path()),
                        "Let it be an event (costate/element/guarded_force.h)",
                        [&force, first = mechanism.state_offsets()[f], own = std::make_shared<GatheredState>()](
                            const StateView& s, Assembly& assembly, std::vector<double>& values) {
                          LocalState local = own->of(force, s, assembly.numbers());
                          local.z = s.z ? s.z + first : nullptr;
                          const std::size_t count = force.coordinates().size();
                          values.assign(count + static_cast<std::size_t>(force.states()), 0);
                          force.calc_force(local, values.data(), values.data() + count);
                        },
                        force.coordinates()});
  }
  const std::vector<double> numbers = mechanism.base_numbers();
  for (const auto& owned : mechanism.constraints()) {
    const Constraint& c = *owned;
    if (is_wholly_of_library(typeid(c))) continue;
    std::vector<double> own_numbers, declared;
    for (const int k : c.numbers()) own_numbers.push_back(numbers[static_cast<std::size_t>(k)]);
    c.add_kinks(own_numbers.data(), declared);
    c.add_acceleration_jumps(own_numbers.data(), declared);
    if (!declared.empty()) continue;
    const auto rows = static_cast<std::size_t>(c.rows());
    watched_.push_back({fmt::format("What the constraint '{}' makes of velocities and accelerations", c.path()),
                        "Declare its times (add_kinks(), add_acceleration_jumps() of costate/element/element.h)",
                        [&c, rows, own = std::make_shared<GatheredState>()](const StateView& s, Assembly& assembly,
                                                                            std::vector<double>& values) {
                          const LocalState local = own->of(c, s, assembly.numbers());
                          values.assign(2 * rows, 0);
                          c.calc_bias(local, values.data());
                          if (c.rheonomic()) c.calc_phi_t(local, values.data() + rows);
                        },
                        c.coordinates(), rows});
  }
  std::vector<int> all(mechanism.coordinates().size());
  std::iota(all.begin(), all.end(), 0);
  for (std::size_t i = 0; i < objective.running.size(); ++i) {
    const CostTerm& term = ungated(*objective.running[i]);
    if (!is_of_user(term)) continue;
    watched_.push_back({fmt::format("The running cost's term {}", i), "Let it go on",
                        [&term](const StateView& s, Assembly& assembly, std::vector<double>& values) {
                          values.assign(1, term.value(s, assembly));
                        },
                        all});
  }
}

void OwnJumpWatch::look(const StateView& s, Assembly& assembly) {
  if (met_) return;
  if (looks_ > 0 && s.t - last_.t <= kLooksNear * (s.t - begin_) / static_cast<double>(looks_)) return;
  if (looks_++ == 0) begin_ = s.t;
  std::vector<double> now;
  for (Watched& of : watched_) {
    try {
      of.add(s, assembly, now);
      of.largest.resize(now.size(), 0);
      of.rounding.resize(now.size(), 0);
      for (std::size_t i = 0; i < now.size(); ++i) of.largest[i] = std::max(of.largest[i], std::abs(now[i]));
      if (!of.last.empty()) judge(of, s, now, assembly);
      of.last = now;
    } catch (const Error&) {  // what says nothing there
      of.last.clear();
    }
  }
  last_.take(s, assembly);
}

StateView OwnJumpWatch::between(const StateView& s, double w, const Assembly& assembly) {
  between_.take(s, assembly);
  between_.t = (1 - w) * last_.t + w * s.t;
  const auto mix = [w](std::vector<double>& x, const std::vector<double>& from) {
    if (from.size() != x.size()) return x.clear();
    for (std::size_t i = 0; i < x.size(); ++i) x[i] = (1 - w) * from[i] + w * x[i];
  };
  mix(between_.q, last_.q);
  mix(between_.v, last_.v);
  mix(between_.a, last_.a);
  mix(between_.lambda, last_.lambda);
  mix(between_.z, last_.z);
  return between_.view();
}

double OwnJumpWatch::rounding(const Watched& of, const StateView& s, double w, std::size_t i, Assembly& assembly) {
  between(s, w, assembly);
  std::vector<double> values;
  const auto value = [&] {
    of.add(between_.view(), assembly, values);
    return values[i];
  };
  const double f = value();
  double sum = 0;
  const auto round = [&](double& x) {
    const double exact = x;
    x += kRounding * std::abs(x);
    sum += std::abs(value() - f);
    x = exact;
  };
  for (std::vector<double>* entries : {&between_.q, &between_.v})
    for (const int k : of.coordinates)
      if (static_cast<std::size_t>(k) < entries->size()) round((*entries)[static_cast<std::size_t>(k)]);
  for (double& z : between_.z) round(z);
  return sum;
}

void OwnJumpWatch::judge(Watched& of, const StateView& s, const std::vector<double>& now, Assembly& assembly) {
  std::vector<double> values;
  const auto value = [&](double w, std::size_t i) {
    of.add(between(s, w, assembly), assembly, values);
    return values[i];
  };
  of.add(between(s, 0.5, assembly), assembly, values);
  const std::vector<double> middle = values;
  for (std::size_t i = 0; i < now.size() && !met_; ++i) {
    double low = 0, high = 1, at_low = of.last[i], at_high = now[i], at_middle = middle[i];
    double none = std::max({kIsJump * of.largest[i], of.rounding[i], kNothing});
    const double whole = std::abs(at_middle - at_low) + std::abs(at_high - at_middle);
    if (!std::isfinite(whole) || whole <= none || std::abs(at_middle - 0.5 * (at_low + at_high)) <= kFitsMiddle * whole)
      continue;
    for (int k = 0; k < kHalvingsOfWay && std::abs(at_high - at_low) > none; ++k) {
      const double w = 0.5 * (low + high);
      if (k > 0) at_middle = value(w, i);
      const bool first = std::abs(at_middle - at_low) > std::abs(at_high - at_middle);
      (first ? high : low) = w;
      (first ? at_high : at_low) = at_middle;
    }
    if (!(std::abs(at_high - at_low) > none)) continue;
    // Beside the place; and nearer, where what goes on comes together.
    const auto jump_beside = [&](double beside) {
      return std::abs(value(std::min(high + beside, 1.0), i) - value(std::max(low - beside, 0.0), i));
    };
    const double jump = jump_beside(kBesidePlace), near = jump_beside(kNearerPlace * kBesidePlace);
    if (!(jump > none) || !(near > 0.5 * jump)) continue;
    none = std::max(rounding(of, s, 0, i, assembly), rounding(of, s, 1, i, assembly));
    of.rounding[i] = std::max(of.rounding[i], none);
    if (!(jump > none)) continue;
    // What time alone brings about is at an instant that is known, if no parameter moves it.
    const auto jumps_by_time = [&] {
      StateView at = between(s, low, assembly);
      of.add(at, assembly, values);
      const double before = values[i];
      at.t = (1 - high) * last_.t + high * s.t + kBesidePlace * (s.t - last_.t);
      of.add(at, assembly, values);
      return std::abs(values[i] - before) > 0.5 * jump;
    };
    if (i >= of.rates_from) needs_impulse_ = true;
    if (i < of.rates_from && jumps_by_time()) {
      const MovedParameters moved(assembly);
      bool moves = false;
      for (std::size_t j = 0; j < moved.count() && !moves; ++j)
        for (const double by : {-kNumberMoved, kNumberMoved}) {
          moved.move(j, by);
          moves = moves || !(jump_beside(kBesidePlace) > 0.5 * jump);
        }
      if (!moves) continue;
    }
    met_ = fmt::format(
        "Near t = {:.6g} s {} jumps from {:.4g} to {:.4g}. What the instant depends on is in no derivative. {}, or "
        "write it smooth; the method 'differences' tells what psi does.",
        (1 - high) * last_.t + high * s.t, of.name, value(std::max(low - kBesidePlace, 0.0), i),
        value(std::min(high + kBesidePlace, 1.0), i), of.advice);
  }
}

}  // namespace costate
