#include "costate/sensitivity/hand_run.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "costate/assembly/packed_state.h"
#include "costate/base/notice.h"
#include "costate/event/bend_watch.h"
#include "costate/integrator/integrators.h"
#include "costate/integrator/radau_linear.h"
#include "costate/integrator/run_watch.h"
#include "costate/integrator/segmented_run.h"
#include "costate/integrator/simulate.h"
#include "costate/integrator/stiffness_watch.h"
#include "costate/level/fixed_times.h"
#include "costate/problem/known_error.h"
#include "costate/problem/scaled_gradient.h"

namespace costate {

namespace {
constexpr std::size_t kStretches = 30;  // of the stored steps, in each of which the linear pass makes one step at least
constexpr long kPoll = 64;              // steps between calls of the monitor
// Of index 3, steps cannot be chosen by their estimated error: grids that are refined until the gradient stands still.
bool without_estimate(const Problem& problem) {
  return find_formulation(problem.formulation).constraints == ConstraintForm::index3;
}
/// Evaluations of the equations are the price of a step, and of order 9 they are a third of those of order 5 at rtol
/// 1e-8, for the same errors, and fewer at 1e-4, too. Grids that are refined want many short steps.
const RadauScheme& linear_scheme(const Problem& problem) {
  return *find_radau_scheme(without_estimate(problem) ? "radau5" : "radau9");
}
constexpr std::size_t kCoarsest = 60;
constexpr int kMaxRefinements = 7;
// Errors of order 3 fall by this in a halving. What is left in units of rtol from here on is said.
constexpr double kFallsByHalving = 0.125, kSaidOfHalving = 3e3;
// Of these grids' intervals: points so near to a jump give way, as what the motion is off there counts by the step.
constexpr double kNearJump = 0.3;

std::vector<double> away_from(const std::vector<MotionJump>& jumps, const std::vector<double>& grid) {
  std::vector<char> keeps(grid.size(), 1);
  for (const MotionJump& j : jumps) {
    const auto above =
        static_cast<std::size_t>(std::upper_bound(grid.begin() + 1, grid.end() - 1, j.before) - grid.begin());
    const double near = kNearJump * (grid[above] - grid[above - 1]);
    if (above + 1 < grid.size() && grid[above] - j.before < near) keeps[above] = 0;
    if (above > 1 && j.before - grid[above - 1] < near) keeps[above - 1] = 0;
  }
  std::vector<double> r;
  for (std::size_t i = 0; i < grid.size(); ++i)
    if (keeps[i]) r.push_back(grid[i]);
  return r;
}

template <class Run, class SystemType>
void record(SystemType& system, const Problem& problem, const std::vector<double>& rho, ForwardMotion& motion) {
  system.set_parameters(rho.data());
  Run session(system, problem.solver, problem.monitor, StartDerivative::none);
  session.enable_cost();
  RunWatch watch(problem, rho, system);
  watch.begin(problem.solver.t_start, session.y());
  session.watch(watch.sink());
  session.follow_slow_slips();
  session.advance_recording(problem.solver.t_end, motion.trajectory);
  watch.finish(problem.solver.t_end, session.y());
  if (SlowStretches* slow = session.slow_slips(problem.solver.t_end)) {
    // Index 3 has no adjoint between an event and a map right behind it; its own steps, Radau's, carry these slips.
    const bool maps_from_rest = !without_estimate(problem);
    if (maps_from_rest) slow->leave_out_long_ones(problem.solver.rtol);
    for (std::size_t i = 0; i < slow->all().size(); ++i) {
      if (slow->all()[i].from_rest && !maps_from_rest) continue;
      slow->map(i, problem.solver.rtol);
      motion.slow.push_back(slow->all()[i]);
    }
  }
  motion.plan = session.plan_back();
  motion.psi = session.cost();
  if (!system.objective().terminal.empty()) motion.psi += system.terminal_cost(problem.solver.t_end, session.y());
  session.read_forward_counters();
  motion.counters = session.counters();
  motion.events = session.events();
  motion.met = session.met_events();
  motion.history = system.event_history();
  GradientResult seen;
  seen.psi = motion.psi;
  seen.events = motion.events;
  watch.conclude(seen);
  motion.told_drift = watch.told_drift();
  motion.stays = what_stays(seen);
}
/// The kinks of drivers that the run passes, and other times of laws that parameters move.
std::vector<double> times_of_laws(const Problem& problem, const std::vector<double>& rho) {
  std::vector<double> numbers = problem.mechanism->base_numbers();
  problem.parameters.apply(rho.data(), numbers);
  std::vector<double> times = driver_kinks(*problem.mechanism, numbers);
  for (const MovingInstant& at : moving_instants(*problem.mechanism, problem.objective, problem.parameters, numbers))
    times.push_back(at.t);
  std::erase_if(times, [&](double t) { return !(problem.solver.t_start < t && t <= problem.solver.t_end); });
  std::sort(times.begin(), times.end());
  times.erase(std::unique(times.begin(), times.end()), times.end());
  return times;
}
/// Where forces and running costs bend along the motion: of grids that do not follow their error a step across such a
/// place leaves an error of the first order of its length. A step's end is a stage, its beginning is none: the times
/// are on the side that steps that way come from.
std::vector<double> bends_along(Assembly& assembly, const Objective& objective, const Problem& problem,
                                const Trajectory& motion, bool backward) {
  BendWatch watch(assembly, objective, problem.solver.rtol, problem.solver.absolute(), false);
  std::vector<double> times, qvz(static_cast<std::size_t>(motion.width()));
  if (watch.empty()) return times;
  const auto at = [&](double t) {
    motion.evaluate(t, qvz.data());
    return packed_view(t, qvz.data(), assembly.n());
  };
  double from = motion.t_begin();
  for (std::size_t i = 0; i < motion.steps(); ++i) {
    const double end = motion.step_end(i);
    watch.each_passage(from, end, at, [&](const BendWatch::Passage& p) {
      times.push_back(backward ? p.t : p.t - 2 * BendWatch::kResolved * (end - from));
    });
    from = end;
  }
  return times;
}
}  // namespace

ForwardMotion record_motion(const Problem& problem, const std::vector<double>& rho) {
  const Mechanism& m = *problem.mechanism;
  if (const std::vector<double> at = times_of_laws(problem, rho); !at.empty()) {
    if (at.back() == problem.solver.t_end)
      throw CapabilityError(
          fmt::format("A driver's law has a kink at the end of the run, t = {:.6g} s; hand-derived methods "
                      "are carried across kinks within the run only. Take idas-adjoint, cvodes-adjoint or a "
                      "forward method, or another t_end_s.",
                      at.back()));
  }
  return with_bdf_where_stiff(problem, [&](const Problem& p) {
    ForwardMotion motion{Trajectory(m.coordinate_count(), m.state_count()), 0, {}, integrator_of(p)};
    // A motion needs an integrator's own dense output.
    if (find_integrator(motion.integrator).discrete)
      motion.integrator = find_formulation(p.formulation).default_integrator;
    motion.states = m.state_count();
    if (motion.integrator == "idas") {
      const auto system = p.make_dae();
      record<IdaRun>(*system, p, rho, motion);
    } else {
      const auto system = p.make_ode();
      record<CvodeRun>(*system, p, rho, motion);
    }
    return motion;
  });
}

std::vector<MotionJump> jumps_of(const ForwardMotion& motion, const std::vector<double>& times) {
  std::vector<MetEvent> events = motion.met;
  for (const SlowStretches::Stretch& s : motion.slow)
    std::erase_if(events, [&](const MetEvent& e) { return e.event == s.stop && e.t == s.end; });
  std::vector<MotionJump> all = motion_jumps(times, events);
  for (const SlowStretches::Stretch& s : motion.slow) {
    MotionJump jump{s.begin, s.end, {}, s.map};
    const double infinity = std::numeric_limits<double>::infinity();
    for (const MotionJump& j : all) {
      if (j.before == jump.before) jump.before = j.after;
      if (s.stop >= 0 && j.before <= std::nextafter(s.end, infinity) && s.end <= j.after)
        throw CapabilityError(
            fmt::format("At t = {:.9g} s a slip in space stops in the instant of another "
                        "event, which hand-derived methods do not cross. Take idas or cvodes methods.",
                        s.end));
    }
    if (s.stop >= 0) jump.after = std::nextafter(s.end, infinity);
    all.push_back(std::move(jump));
  }
  std::stable_sort(all.begin(), all.end(),
                   [](const MotionJump& a, const MotionJump& b) { return a.before < b.before; });
  return all;
}

std::vector<double> grid_of(const Trajectory& trajectory, std::size_t stride) {
  std::vector<double> grid{trajectory.t_begin()};
  for (std::size_t i = stride - 1; i + 1 < trajectory.steps(); i += stride) grid.push_back(trajectory.step_end(i));
  // The first steps of a multistep method are tiny; the linear pass needs no start-up.
  const double span = trajectory.t_end() - trajectory.t_begin();
  grid.erase(
      std::remove_if(grid.begin() + 1, grid.end(), [&](double t) { return t - trajectory.t_begin() < 1e-5 * span; }),
      grid.end());
  if (grid.size() > 1 && trajectory.t_end() - grid.back() < 1e-9 * span) grid.pop_back();
  grid.push_back(trajectory.t_end());
  return grid;
}

std::vector<double> with_times(const std::vector<double>& grid, const std::vector<double>& times) {
  std::vector<double> inner;
  for (const double t : times)
    if (grid.front() < t && t < grid.back()) inner.push_back(t);
  std::sort(inner.begin(), inner.end());
  // A grid point so near that the step between would be lost in rounding gives way.
  const double near = 1e-9 * (grid.back() - grid.front());
  const auto gives_way = [&](double t) {
    const auto above = std::lower_bound(inner.begin(), inner.end(), t);
    return (above != inner.end() && *above - t < near) || (above != inner.begin() && t - *(above - 1) < near);
  };
  std::vector<double> r{grid.front()};
  std::copy_if(grid.begin() + 1, grid.end() - 1, std::back_inserter(r), [&](double t) { return !gives_way(t); });
  r.insert(r.end(), inner.begin(), inner.end());
  r.push_back(grid.back());
  std::sort(r.begin(), r.end());
  r.erase(std::unique(r.begin(), r.end()), r.end());
  return r;
}

std::vector<double> with_looks(const std::vector<double>& grid, const ForwardMotion& motion) {
  if (!motion.plan || motion.plan->empty()) return grid;
  std::vector<double> qvz(static_cast<std::size_t>(motion.trajectory.width()));
  const int n = (motion.trajectory.width() - motion.states) / 2;
  return motion.plan->divided(grid, [&](double t) {
    StateView s;
    if (!motion.plan->needs_state()) return s;
    motion.trajectory.evaluate(t, qvz.data());
    s.q = qvz.data();
    s.v = s.q + n;
    return s;
  });
}

std::vector<double> refined(const std::vector<double>& grid) {
  std::vector<double> r;
  for (std::size_t i = 0; i + 1 < grid.size(); ++i) {
    r.push_back(grid[i]);
    r.push_back(0.5 * (grid[i] + grid[i + 1]));
  }
  r.push_back(grid.back());
  return r;
}

GradientResult run_hand_equations(const Problem& problem, const std::vector<double>& rho, HandEquations& equations) {
  equations.t_start = problem.solver.t_start;
  equations.set_parameters(rho.data());
  if (equations.assembly().has_switched_rows() && !equations.carries_switched_rows())
    throw CapabilityError(
        "This scene has rigid contacts that close, whose rows come and go, which these hand-derived equations do not "
        "hold. Take idas or cvodes methods, or let the contacts bounce for good (restitution above 0, "
        "closing_speed_m_per_s = 0).");
  const ForwardMotion motion = record_motion(problem, rho);
  // Passes stop at the last instant before a jump and go on at the first one behind it.
  equations.set_jumps(jumps_of(motion, times_of_laws(problem, rho)), motion.history);
  std::vector<double> ends{motion.trajectory.t_begin()};
  for (std::size_t i = 0; i < motion.trajectory.steps(); ++i) ends.push_back(motion.trajectory.step_end(i));
  std::vector<double> changes =
      equations.plan(ends, [&](double t, double* qvz) { motion.trajectory.evaluate(t, qvz); });
  if (without_estimate(problem)) {
    const std::vector<double> bends = bends_along(equations.assembly(), problem.objective, problem, motion.trajectory,
                                                  equations.direction() == HandEquations::Direction::backward);
    changes.insert(changes.end(), bends.begin(), bends.end());
    std::sort(changes.begin(), changes.end());
  }
  const std::size_t steps = motion.trajectory.steps();
  const std::vector<MotionJump>& jumps = equations.jumps();
  const auto grid = [&](std::size_t stretches) {
    const std::vector<double> looked =
        with_looks(grid_of(motion.trajectory, std::max<std::size_t>(1, steps / stretches)), motion);
    const std::vector<double> all = with_times(looked, changes);
    std::vector<double> r = with_jumps(without_estimate(problem) ? away_from(jumps, all) : all, jumps);
    // However near a jump is: they are crossed one by one.
    std::copy_if(changes.begin(), changes.end(), std::back_inserter(r),
                 [&](double t) { return r.front() < t && t < r.back(); });
    std::sort(r.begin(), r.end());
    r.erase(std::unique(r.begin(), r.end()), r.end());
    return outside_stretches(std::move(r), jumps);
  };
  std::vector<double> sizes;
  for (const auto& p : problem.parameters.parameters) sizes.push_back(p.scale);
  const bool backward = equations.direction() == HandEquations::Direction::backward;
  RadauLinear radau(equations, linear_scheme(problem), sizes);
  GradientResult r;
  r.psi = motion.psi;
  r.counters = motion.counters;
  r.integrator = motion.integrator;
  r.events = motion.events;
  const auto pass = [&](const std::vector<double>& times, double rtol) {
    const RadauResult x =
        radau.integrate(motion.trajectory, times, rtol, problem.solver.absolute(), [&](double t, long done) {
          if (problem.monitor && done % kPoll == 0) problem.monitor(t, done, backward);
        });
    (backward ? r.counters.backward_steps : r.counters.steps) += x.steps;
    (backward ? r.counters.backward_error_test_failures : r.counters.error_test_failures) += x.rejected;
    r.counters.backward_residuals += x.evaluations;
    r.counters.factorizations += x.factorizations;
    return x.gradient;
  };
  const auto size_of = [&](const Eigen::VectorXd& g) {
    double size = 0;
    for (Eigen::Index j = 0; j < g.size(); ++j)
      size = std::max(size, std::abs(g[j]) * sizes[static_cast<std::size_t>(j)]);
    return size;
  };
  Eigen::VectorXd gradient;
  if (!without_estimate(problem)) {
    gradient = pass(grid(kStretches), problem.solver.rtol);
  } else {
    // Order 3 to 5: once a halving changes the gradient by less than a few tolerances, the rest is below them. Errors
    // of the stored motion are differentiated twice, so that steps below some size make of them more than they mend:
    // two halvings in a row that do not halve the change are the last, and the gradient is that which changed least. A
    // change that is small by chance is none: it counts as no less than a part of the one before it.
    std::vector<double> times = grid(kCoarsest);
    Eigen::VectorXd coarser = pass(times, 0), before = Eigen::VectorXd::Zero(coarser.size());
    double least = std::numeric_limits<double>::infinity();
    for (int level = 0, stuck = 0; level < kMaxRefinements && stuck < 2; ++level) {
      times = outside_stretches(refined(times), jumps);
      const Eigen::VectorXd finer = pass(times, 0), moved = (finer - coarser).cwiseAbs(),
                            change = moved.cwiseMax(kFallsByHalving * before);
      coarser = finer;
      before = moved;
      stuck = size_of(change) > 0.5 * least ? stuck + 1 : 0;
      if (size_of(change) < least || gradient.size() == 0) {
        least = size_of(change);
        gradient = finer;
        r.gradient_error.assign(change.data(), change.data() + change.size());
      }
      if (least <= 3 * problem.solver.rtol * size_of(finer)) break;
    }
  }
  r.gradient.assign(gradient.data(), gradient.data() + gradient.size());
  const double left = largest_scaled(problem.parameters, r.gradient_error),
               size = gradient_size(problem.parameters, r.psi, r.gradient);
  if (motion.stays > 0) widen_by_what_stays(r, motion.stays);
  widen_by_drift(r, problem.parameters, motion.told_drift);
  if (const double unseen = cost_unseen(motion.events); unseen > 0)
    widen_error(r, problem.parameters, unseen, gradient_unseen(motion.events));
  if (left > kSaidOfHalving * problem.solver.rtol * size) {
    widen_error(r, 0, r.gradient_error);
    notice(fmt::format(
        "The gradient is known to some {:.0e} of its size: halving the steps further changes it by that. Of "
        "index 3 the errors of the stored motion are differentiated twice; index1, baumgarte or a smaller "
        "rtol tell more.",
        left / size));
  }
  return r;
}

}  // namespace costate
