#include "costate/hessian/hessian_motion.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "costate/adjoint/block_jumps.h"
#include "costate/adjoint/steep_begins.h"
#include "costate/base/error.h"
#include "costate/integrator/run_watch.h"
#include "costate/integrator/segmented_run.h"

namespace costate {

namespace {

using Eigen::MatrixXd;

/// Of the steps at an event, as many behind it as begin it: where the motion is on one side of it beyond rounding, and
/// still what it is at the event. And that in spacings of numbers, at least.
constexpr double kNear = 1e-9, kSpacings = 4;
constexpr std::size_t kStepsBehind = 8;
// Where a force begins as d^n its slopes go with t^(n-1) from the event on: so many spacings away depths have three
// digits, and so many times as far they tell the limit.
constexpr double kDepths = 256, kFurther = 16;
/// Of the span: a bend this near to an event is the event's own; and of a time, of 1 s at least, what is one instant.
constexpr double kEventsOwn = 4e-12, kOneInstant = 1e-10;
/// Of the largest speed of a slip in space, and in tolerances: where it ends. Above rounding, which a slip that is a
/// difference of larger speeds has of its direction, and above the errors of tangents.
constexpr double kSlowSlip = 1e-7, kSlipErrors = 10;

/// The times of a smooth piece: its ends, and the steps' between them.
using Piece = std::vector<double>;

double beyond(double t) { return std::nextafter(t, std::numeric_limits<double>::infinity()); }

std::vector<Piece> pieces_of(const Trajectory& motion, const std::vector<HessianEquations::Event>& events) {
  std::vector<Piece> pieces{{motion.t_begin()}};
  auto next = events.begin();
  for (std::size_t i = 0; i < motion.steps(); ++i) {
    const double end = motion.step_end(i);
    pieces.back().push_back(end);
    for (; next != events.end() && next->t <= end && i + 1 < motion.steps(); ++next) pieces.push_back({beyond(end)});
  }
  return pieces;
}

/// Of the piece's ends.
bool is_between(const BlockJump& at, const Piece& piece) {
  return at.last_before > piece.front() && at.first_after < piece.back();
}

/// Where forces bend along a piece of the stored motion, in order.
std::vector<BlockJump> jumps_along(HessianEquations& equations, const Trajectory& motion, const Piece& piece) {
  std::vector<double> y(static_cast<std::size_t>(motion.width()));
  BlockJumps found =
      find_block_jumps(piece, [&](double t, std::vector<double>& values, std::vector<std::size_t>& ends) {
        motion.evaluate(t, y.data());
        equations.append_blocks(t, y.data(), values, ends);
      });
  if (found.rough)
    throw CapabilityError(
        fmt::format("Second derivatives need the times at which derivatives of forces jump, and these are rough near t "
                    "= {:.9g} s: more jumps than can be told from rounding. Differences of gradients do without.",
                    *found.rough));
  // What bends in the instant of an event is the event's own, which looks beyond it.
  const double own = kEventsOwn * (motion.t_end() - motion.t_begin());
  const auto of_event = [&](const BlockJump& at) {
    return (piece.front() > motion.t_begin() && at.last_before <= piece.front() + own) ||
           (piece.back() < motion.t_end() && at.first_after >= piece.back() - own);
  };
  found.all.erase(std::remove_if(found.all.begin(), found.all.end(), of_event), found.all.end());
  return std::move(found.all);
}

HessianEquations::Sizes sizes_of(HessianEquations& equations, const Trajectory& motion) {
  std::vector<double> y(static_cast<std::size_t>(motion.width()));
  const int N = equations.state_size(), k = equations.directions();
  HessianEquations::Sizes sizes;
  sizes.span = motion.t_end() - motion.t_begin();
  sizes.columns = MatrixXd::Zero(N, 1 + k);
  MatrixXd rates(N, 1 + k);
  for (std::size_t i = 0; i <= motion.steps(); ++i) {
    const double t = i == 0 ? motion.t_begin() : motion.step_end(i - 1);
    motion.evaluate(t, y.data());
    equations.motion(t, y.data(), y.data() + N, rates.data(), rates.data() + N);
    rates.rightCols(k) = Eigen::Map<const MatrixXd>(y.data() + N, N, k);
    sizes.columns = sizes.columns.cwiseMax(rates.cwiseAbs());
  }
  return sizes;
}

/// With what they do to the motion's tangents: the bends between the ends of the pieces. Those at an end must not move.
std::vector<HessianEquations::Bend> bends_along(HessianEquations& equations, const Trajectory& motion,
                                                const std::vector<Piece>& pieces,
                                                const std::vector<std::vector<BlockJump>>& jumps) {
  std::vector<HessianEquations::Bend> bends;
  if (std::all_of(jumps.begin(), jumps.end(), [](const auto& of) { return of.empty(); })) return bends;
  const HessianEquations::Sizes sizes = sizes_of(equations, motion);
  std::vector<double> y(static_cast<std::size_t>(motion.width()));
  for (std::size_t i = 0; i < pieces.size(); ++i)
    for (const BlockJump& at : jumps[i]) {
      HessianEquations::Bend bend{at.last_before, at.first_after, y, y, {}};
      motion.evaluate(bend.before, bend.state_before.data());
      motion.evaluate(bend.after, bend.state_after.data());
      equations.follow_bend(bend, sizes);
      if (is_between(at, pieces[i])) {
        bends.push_back(std::move(bend));
        continue;
      }
      for (const auto& [force, moved] : bend.moved)
        if (moved.cwiseAbs().maxCoeff() > 0)
          throw CapabilityError(fmt::format(
              "At t = {:.6g} s, where the run {}, '{}' is where its derivative jumps: psi has no second derivatives.",
              at.last_before, at.last_before > motion.t_begin() ? "ends" : "begins",
              equations.assembly().mechanism().forces()[force]->path()));
    }
  return bends;
}

/// Nothing else happens in the instant of an event.
void require_apart(const Trajectory& motion, const TangentMotion& forward) {
  double last = -std::numeric_limits<double>::infinity();
  for (const HessianEquations::Event& e : forward.met()) {
    const double instant = kOneInstant * std::max(1.0, std::abs(e.t));
    const auto refuse = [&](const char* why) {
      throw CapabilityError(
          fmt::format("At t = {:.9g} s '{}' happens {}: second derivatives are not carried across. Differences of "
                      "gradients tell them.",
                      e.t, forward.name_of(e), why));
    };
    if (e.t - last <= instant) refuse("in the instant of another event");
    if (e.t - motion.t_begin() <= instant) refuse("where the run begins");
    if (motion.t_end() - e.t <= instant) refuse("where the run ends");
    last = e.t;
  }
}

/// The motion near to each of the events, on either side.
void look_beside(const Trajectory& motion, const HessianEquations& equations,
                 std::vector<HessianEquations::Event>& events) {
  const int n = equations.assembly().n();
  const SteepBegins& steep = SteepBegins::of(equations.assembly());
  std::size_t i = 0;
  for (HessianEquations::Event& e : events) {
    while (motion.step_end(i) < e.t) ++i;
    const double least = kSpacings * std::numeric_limits<double>::epsilon() * std::abs(e.t),
                 begin = i == 0 ? motion.t_begin() : motion.step_end(i - 1),
                 end = motion.step_end(std::min(i + kStepsBehind, motion.steps() - 1));
    const bool gives = begins_steeply(e, n);
    if (gives) e.exponent = steep.exponent_between(e.before.data() + 2 * n, e.after.data() + 2 * n);
    const bool limits = e.exponent < 2;
    const double near = gives ? 0 : kNear, spacings = limits ? kDepths * least : least;
    const auto evaluate = [&](double t, std::vector<double>& state) {
      state = e.before;  // of its size
      motion.evaluate(t, state.data());
      return t;
    };
    e.near_before = evaluate(e.t - std::max(spacings, near * (e.t - begin)), e.state_before);
    e.near_after = evaluate(e.behind + std::max(spacings, near * (end - e.t)), e.state_after);
    if (!limits) continue;
    e.further_before = evaluate(e.t - kFurther * spacings, e.state_further_before);
    e.further_after = evaluate(e.behind + kFurther * spacings, e.state_further_after);
    e.ratio = std::pow(kFurther, e.exponent - 1);
  }
}

}  // namespace

bool begins_steeply(const HessianEquations::Event& event, int n) {
  return event.event >= 0 && !event.rigid &&
         std::equal(event.before.begin(), event.before.begin() + 2 * n, event.after.begin());
}

HessianMotion run_hessian_motion(const Problem& problem, const std::vector<double>& rho, HessianEquations& equations,
                                 TangentMotion& forward) {
  const double t_start = problem.solver.t_start, t_end = problem.solver.t_end;
  // All of the unknowns, the tangents among them.
  HessianMotion all{Trajectory(0, forward.size()), {}, {}, {}, {}, 0, {}};
  std::vector<std::vector<BlockJump>> jumps;
  std::vector<Piece> pieces;
  const auto look = [&] {
    require_apart(all.trajectory, forward);
    pieces = pieces_of(all.trajectory, forward.met());
    jumps.clear();
    for (const Piece& piece : pieces) jumps.push_back(jumps_along(equations, all.trajectory, piece));
  };
  {
    forward.set_parameters(rho.data());
    forward.end_slow_slips(std::max(kSlowSlip, kSlipErrors * problem.solver.rtol));
    CvodeRun session(forward, problem.solver, problem.monitor, StartDerivative::none);
    // The passes know nothing of the cost.
    session.follow(std::make_shared<const StepPlan>(forward, problem.objective, t_start, t_end, session.y()));
    RunWatch watch(problem, rho, forward);
    watch.begin(t_start, session.y());
    session.watch(watch.sink());
    session.advance_recording(t_end, all.trajectory);
    watch.finish(t_end, session.y());
    Simulation seen;
    watch.conclude(seen);
    session.read_forward_counters();
    all.counters = session.counters();
    all.steps = all.counters.steps;
    all.plan_back = session.plan_back();
  }
  look();
  std::vector<double> ends;
  for (std::size_t i = 0; i < pieces.size(); ++i)
    for (const BlockJump& at : jumps[i])
      if (is_between(at, pieces[i])) ends.push_back(0.5 * (at.last_before + at.first_after));
  if (!ends.empty()) {
    // Once more, with steps that end there: what is stored of a step across one is no more than its end.
    forward.end_segments_at(ends);
    CvodeRun again(forward, problem.solver, problem.monitor, StartDerivative::none);
    again.follow(all.plan_back);
    all.trajectory = Trajectory(0, forward.size());
    again.advance_recording(t_end, all.trajectory);
    again.read_forward_counters();
    all.counters += again.counters();
    look();
  }
  all.bends = bends_along(equations, all.trajectory, pieces, jumps);
  all.events = forward.met();
  look_beside(all.trajectory, equations, all.events);
  all.slips = find_slip_maps(problem, equations, forward, all.trajectory, all.bends, all.events, all.counters);
  return all;
}

}  // namespace costate
