#include "costate/hessian/slip_maps.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "costate/assembly/packed_state.h"
#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/slip_steps.h"

namespace costate {

namespace {
using Eigen::MatrixXd;
using Eigen::VectorXd;
using Tangents = std::vector<MatrixXd>;

// Of the largest speed since the last event or until the next one: what is faster is not slow.
constexpr double kNoLongerSlow = 1e-2;
// Of the run's tolerance.
constexpr double kSharper = 0.1, kSharpest = 1e-10;

class SecondSlipSystem : public SlipSystem {
 public:
  SecondSlipSystem(SecondTangents& tangents, TangentMotion& motion) : tangents_(tangents), motion_(motion) {}
  const Assembly& assembly() const override { return motion_.assembly(); }
  int state_size() const override { return tangents_.state_size(); }
  void rates(double t, const double* x, VectorXd& f, MatrixXd& A) override { tangents_.rates(t, x, f, A); }
  void changes(double t, const double* x, const MatrixXd& S, Tangents& all) override {
    tangents_.changes(t, x, S, all);
  }
  double slip(double t, const double* x) override {
    return motion_.slowest_in_space(packed_view(t, x, assembly().n())).speed;
  }
  double parts_of_slips(const double* x) const override { return tangents_.parts_of_slips(x); }
  MatrixXd along(const MatrixXd& S) const override { return tangents_.along(S); }

 private:
  SecondTangents& tangents_;
  TangentMotion& motion_;
};

/// The slowest |w| at the ends of steps, in order.
using Speeds = std::vector<std::pair<double, double>>;

Speeds speeds_between(double from, double to, TangentMotion& forward, const Trajectory& motion) {
  Speeds speeds;
  std::vector<double> y(static_cast<std::size_t>(motion.width()));
  for (std::size_t i = 0; i < motion.steps() && motion.step_end(i) < to; ++i) {
    const double t = motion.step_end(i);
    if (t <= from) continue;
    motion.evaluate(t, y.data());
    speeds.emplace_back(t, forward.slowest_in_space(forward.look_state(t, y.data())).speed);
  }
  return speeds;
}
}  // namespace

std::vector<SlipMap> find_slip_maps(const Problem& problem, HessianEquations& equations, TangentMotion& forward,
                                    const Trajectory& motion, const std::vector<HessianEquations::Bend>& bends,
                                    std::vector<HessianEquations::Event>& events, Counters& work) {
  std::vector<SlipMap> all;
  if (!forward.may_slip_in_space()) return all;
  std::vector<double> places{motion.t_begin(), motion.t_end()};  // between which a stretch lies
  for (const auto& event : events) places.push_back(event.t);
  for (const auto& bend : bends) places.insert(places.end(), {bend.before, bend.after});
  std::sort(places.begin(), places.end());
  const double rtol = std::max(kSharpest, kSharper * problem.solver.rtol);
  const auto state_at = [&](double t) {
    std::vector<double> y(static_cast<std::size_t>(motion.width()));
    motion.evaluate(t, y.data());
    return y;
  };
  // Returns (x, tangents along the directions) at the end.
  const auto follow = [&](SlipMap& slip, const std::vector<double>& from, const auto& begin) {
    SecondTangents system(equations, problem.objective);
    SecondSlipSystem both(system, forward);
    SlipSteps steps(both, rtol, equations.direction_columns());
    const auto x_of = [&](const std::vector<double>& y) {
      return VectorXd(Eigen::Map<const VectorXd>(y.data(), system.state_size()));
    };
    VectorXd x = x_of(from);
    Tangents tangents = begin(system);
    const double t = steps.run(slip.begin, slip.end, x, tangents, x_of(state_at(slip.end)));
    work.steps += steps.steps();
    work.factorizations += steps.factorizations();
    if (t < slip.end)
      throw CapabilityError(
          fmt::format("A slip in space at t = {:.9g} s is slow for so long that second derivatives do not follow it: "
                      "{} steps come to t = {:.9g} s. Differences of gradients tell them.",
                      slip.begin, steps.steps(), t));
    slip.map = system.map(tangents);
    all.push_back(std::move(slip));
    std::vector<double> y(x.data(), x.data() + x.size());
    const MatrixXd moved = system.along(tangents[0]);
    y.insert(y.end(), moved.data(), moved.data() + moved.size());
    return y;
  };
  for (HessianEquations::Event& event : events) {
    const bool begins = forward.begins_from_rest(event);
    if (!begins && !forward.stops_slip(event)) continue;
    SlipMap slip{event.t, event.t, event.t, begins};
    const auto here = std::lower_bound(places.begin(), places.end(), event.t);
    double from = begins ? event.t : *std::prev(here),
           to = begins ? *std::upper_bound(here, places.end(), event.t) : event.t;
    if (!all.empty()) from = std::max(from, all.back().end);
    const Speeds speeds = speeds_between(from, to, forward, motion);
    double largest = 0;
    for (const auto& [t, speed] : speeds) largest = std::max(largest, speed);
    const auto fast = [&](const auto& at) { return at.second > kNoLongerSlow * largest; };
    if (begins) {
      const auto end = std::find_if(speeds.begin(), speeds.end(), fast);
      slip.end = end != speeds.end() ? end->first : 0.5 * (from + to);
      const VectorXd shifts = equations.bend_shifts(forward.jumps(), event);
      follow(slip, event.after, [&](SecondTangents& system) { return system.begin(event, shifts); });
    } else {
      const auto begin = std::find_if(speeds.rbegin(), speeds.rend(), fast);
      if (begin == speeds.rend()) continue;
      slip.begin = begin->first;
      const std::vector<double> y = state_at(slip.begin);
      try {
        // What is stored tells the direction to e/|w|.
        event.before = event.state_before = follow(slip, y, [&](SecondTangents& system) { return system.begin(y); });
        event.near_before = event.t;
      } catch (const CapabilityError& e) {
        notice(
            fmt::format("{} At the stop they are taken from the stored motion, which tells its direction to few "
                        "digits: what the Hessian is unsymmetric by tells how few.",
                        e.what()));
      }
    }
  }
  return all;
}

}  // namespace costate
