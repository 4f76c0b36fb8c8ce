#include "costate/hessian/hessian_products.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <optional>

#include "costate/base/error.h"
#include "costate/formulation/hessian_systems.h"
#include "costate/hessian/hessian_motion.h"
#include "costate/integrator/piecewise_run.h"
#include "costate/integrator/run_end.h"
#include "costate/objective/cost_check.h"
#include "costate/problem/differentiable_laws.h"
#include "costate/problem/scaled_gradient.h"

namespace costate {

namespace {

using Eigen::MatrixXd;

/// How large the adjoint and its changes get, at least: what they begin with, and the integral of their rates
/// at mu = 0, which sees on each of the motion's steps what these were made for (a pulse may be short). One size for
/// all: errors then count against the largest entries of the Hessian in scaled parameters.
double adjoint_size(HessianEquations& equations, const Trajectory& motion) {
  constexpr double samples = 50;  // on a long step
  const int N = equations.state_size(), np = equations.parameter_count(), columns = 1 + equations.directions();
  std::vector<double> y(static_cast<std::size_t>(columns * N)), zero(y.size(), 0.0), rates(y.size()),
      integrands(static_cast<std::size_t>(columns * np), 0.0);
  const auto largest = [](const std::vector<double>& x) {
    double size = 0;
    for (const double e : x) size = std::max(size, std::abs(e));
    return size;
  };
  const double most = (motion.t_end() - motion.t_begin()) / samples;
  double size = 0, begin = motion.t_begin();
  for (std::size_t i = 0; i < motion.steps(); begin = motion.step_end(i++)) {
    const double step = motion.step_end(i) - begin;
    const int parts = std::max(1, static_cast<int>(std::ceil(step / most)));
    for (int k = 0; k < parts; ++k) {
      const double t = begin + (k + 0.5) * step / parts;
      motion.evaluate(t, y.data());
      equations.evaluate(t, y.data(), y.data() + N);
      equations.adjoint(zero.data(), zero.data() + N, rates.data(), rates.data() + N, integrands.data(),
                        integrands.data() + np);
      size += largest(rates) * step / parts;
    }
  }
  motion.evaluate(motion.t_end(), y.data());
  equations.evaluate(motion.t_end(), y.data(), y.data() + N);
  equations.end(rates.data(), rates.data() + N, integrands.data(), integrands.data() + np);
  size += largest(rates);
  return size > 0 ? size : 1;
}

/// The run back is one of its own here.
Counters as_backward(const Counters& c) {
  Counters b;
  b.backward_steps = c.steps;
  b.backward_residuals = c.residuals;
  b.backward_jacobians = c.jacobians;
  b.backward_newton_iterations = c.newton_iterations;
  b.backward_error_test_failures = c.error_test_failures;
  b.backward_convergence_failures = c.convergence_failures;
  b.factorizations = c.factorizations;
  return b;
}

/// psi of the stored motion: Gauss's rule of four points on each of its steps.
double psi_of(System& forward, const Objective& objective, const Trajectory& motion) {
  constexpr double node[2] = {0.3399810435848563, 0.8611363115940526},
                   weight[2] = {0.6521451548625461, 0.3478548451374538};
  std::vector<double> y(static_cast<std::size_t>(motion.width()));
  const auto state = [&](double t) {
    motion.evaluate(t, y.data());
    return forward.mechanism_state(t, y.data());
  };
  double psi = objective.terminal.empty() ? 0 : objective.terminal_value(state(motion.t_end()), forward.assembly());
  double begin = motion.t_begin();
  for (std::size_t i = 0; i < motion.steps() && !objective.running.empty(); begin = motion.step_end(i++)) {
    const double half = 0.5 * (motion.step_end(i) - begin);
    for (int k = 0; k < 2; ++k)
      for (const double sign : {-1.0, 1.0})
        psi +=
            half * weight[k] * objective.running_value(state(begin + half * (1 + sign * node[k])), forward.assembly());
  }
  return psi;
}

/// Where the way back is taken across something: a bend, or an event, with the stretch beside it on which a slip is
/// slow.
struct Crossing {
  double t, from, before, after;  // it arrives at `from`, and goes on at t
  bool steep;                     // rates of the adjoint may be infinite there,
  double exponent;                // as those of a force d^n are
  std::function<void(double* y)> cross;
};

/// With the event's stretch.
void take_slip(const SlipMap& slip, HessianAdjoint& backward, Crossing& at) {
  const auto carry = [&backward, &map = slip.map](double* y) { backward.cross(map, y); };
  if (slip.from_rest) {
    at.from = at.after = slip.end;
    at.cross = carry;
    return;
  }
  at.t = at.before = slip.begin;
  at.cross = [event = at.cross, carry](double* y) {
    event(y);
    carry(y);
  };
}

/// The last one first.
std::vector<Crossing> crossings_of(const HessianMotion& motion, int n, HessianAdjoint& backward,
                                   const HessianEquations::Jumps& jumps) {
  std::vector<Crossing> all;
  for (const auto& bend : motion.bends)
    all.push_back({0.5 * (bend.before + bend.after), 0.5 * (bend.before + bend.after), bend.before, bend.after, false,
                   2, [&](double* y) { backward.cross(bend, y); }});
  for (const auto& event : motion.events) {
    const bool gives = begins_steeply(event, n);
    // What is steep counts up to the event itself.
    const double behind = std::nextafter(event.behind, std::numeric_limits<double>::infinity());
    Crossing at{event.t,
                event.t,
                gives ? event.t : event.near_before,
                gives ? behind : event.near_after,
                gives,
                event.exponent,
                [&, jumps](double* y) { backward.cross(jumps, event, y); }};
    const auto slip =
        std::find_if(motion.slips.begin(), motion.slips.end(), [&](const SlipMap& of) { return of.event == event.t; });
    if (slip != motion.slips.end()) take_slip(*slip, backward, at);
    all.push_back(std::move(at));
  }
  std::sort(all.begin(), all.end(), [](const Crossing& a, const Crossing& b) { return a.t > b.t; });
  for (std::size_t i = 0; i + 1 < all.size(); ++i)
    if (all[i + 1].after >= all[i].before)
      throw CapabilityError(fmt::format(
          "At t = {:.9g} s an event and a place where derivatives of forces jump are too near to each other: second "
          "derivatives are not carried across. Differences of gradients tell them.",
          all[i].t));
  return all;
}

/// A part of the way back, in the time that is left, and the motion that it sees.
struct PieceBack {
  double begin, end, from, to;
  HessianAdjoint::Steep steep;
  double exponent;
  const std::function<void(double* y)>* cross;  // at its end; or null
};

/// Beside what is steep a layer has a clock of its own.
std::vector<PieceBack> pieces_back(const std::vector<Crossing>& crossings, double t_start, double t_end) {
  constexpr double kLayer = 0.49;  // of what is between two crossings: what is steep is so far from the end, too
  using Steep = HessianAdjoint::Steep;
  std::vector<PieceBack> pieces;
  for (std::size_t i = 0; i <= crossings.size(); ++i) {
    const Crossing *behind = i > 0 ? &crossings[i - 1] : nullptr, *at = i < crossings.size() ? &crossings[i] : nullptr;
    const double begin = behind ? t_end - behind->t : 0, end = t_end - (at ? at->from : t_start),
                 from = at ? at->after : t_start, to = behind ? behind->before : t_end, layer = kLayer * (end - begin),
                 first = behind && behind->steep ? begin + layer : begin, last = at && at->steep ? end - layer : end;
    if (first > begin) pieces.push_back({begin, first, from, to, Steep::at_begin, behind->exponent, nullptr});
    pieces.push_back({first, last, from, to, Steep::nowhere, 2, nullptr});
    if (last < end) pieces.push_back({last, end, from, to, Steep::at_end, at->exponent, nullptr});
    if (at) pieces.back().cross = &at->cross;
  }
  return pieces;
}

/// The products of some directions, which are of size 1 in scaled parameters. `end`: what the run ends by, if anything.
MatrixXd run(const Problem& problem, const std::optional<EndEvent>& end, const std::vector<double>& rho,
             const MatrixXd& directions, const Eigen::VectorXd& start_weights, HessianProducts& result) {
  const auto equations =
      find_formulation(problem.formulation)
          .make_hessian(problem.mechanism, problem.parameters, problem.objective, problem.formulation_options);
  equations->set_parameters(rho.data());
  equations->set_directions(directions);
  const int np = equations->parameter_count(), k = equations->directions();
  const double t_start = problem.solver.t_start, t_end = problem.solver.t_end;
  equations->end_by(end);
  TangentMotion forward(*equations);
  const HessianMotion all = run_hessian_motion(problem, rho, *equations, forward);
  const Trajectory& motion = all.trajectory;
  result.counters += all.counters;
  result.psi = psi_of(forward, problem.objective, motion);

  // A few unknowns of size above 1 are no harm (they count relatively), many far below it would be; and a Hessian is
  // what is left of products of that size.
  const double scale = 0.02 * adjoint_size(*equations, motion);
  HessianAdjoint backward(
      *equations, [&motion](double t, double* y) { motion.evaluate(t, y); }, t_end, scale);
  backward.set_parameters(rho.data());
  backward.weigh_start(start_weights);
  SolverOptions options = problem.solver;
  options.t_start = 0;
  options.t_end = t_end - t_start;
  options.atol = problem.solver.rtol;
  // Where it takes very many steps more than the motion it is stuck, near a singular configuration mostly.
  options.max_steps = std::min(options.max_steps, 20 * all.steps + 1000);
  const Monitor monitor =
      problem.monitor
          ? Monitor([&problem, t_end](double tau, long steps, bool) { problem.monitor(t_end - tau, steps, true); })
          : Monitor();
  const std::vector<Crossing> crossings = crossings_of(all, equations->assembly().n(), backward, forward.jumps());
  const std::vector<PieceBack> pieces = pieces_back(crossings, t_start, t_end);
  const auto enter = [&](const PieceBack& piece) {
    backward.keep_within(piece.from, piece.to);
    backward.run_clock(piece.begin, piece.end, piece.steep, piece.exponent);
  };
  std::vector<double> ends_back;
  for (std::size_t i = 0; i + 1 < pieces.size(); ++i) ends_back.push_back(pieces[i].end);
  PiecewiseRun back(backward, options, monitor, std::make_shared<const StepPlan>(all.plan_back->reversed(t_end)),
                    std::move(ends_back));
  std::vector<double> y;
  enter(pieces.front());
  try {
    y = back.run(nullptr, [&](std::size_t i, double* at) {
      if (pieces[i].cross) (*pieces[i].cross)(at);
      enter(pieces[i + 1]);
      return pieces[i + 1].begin;
    });
  } catch (const SolverError& e) {
    throw SolverError(fmt::format("On the way back, its times counted from the end at {:.9g} s: {}", t_end, e.what()));
  }
  MatrixXd products(np, k);
  result.gradient.assign(static_cast<std::size_t>(np), 0);
  backward.finish(t_start, y.data(), result.gradient.data(), products.data());
  result.counters += as_backward(back.counters());
  return products;
}

}  // namespace

std::string hessian_refusal(const Formulation& formulation) {
  if (formulation.make_hessian) return {};
  std::vector<std::string> names;
  for (const auto& f : formulations())
    if (f.make_hessian) names.push_back("'" + f.name + "'");
  return fmt::format("Formulation '{}' has no Hessian-vector products; {} do.", formulation.name,
                     fmt::join(names, ", "));
}

namespace {
void require_products(const Problem& problem) {
  const std::string refused = hessian_refusal(find_formulation(problem.formulation));
  if (!refused.empty()) throw CapabilityError(refused);
}
}  // namespace

HessianProducts hessian_products(const Problem& problem, const std::vector<double>& rho, const MatrixXd& directions) {
  check_cost_derivatives(problem.mechanism, problem.parameters, problem.objective, rho,
                         problem.ends_when ? problem.ends_when->output : nullptr);
  require_products(problem);
  if (problem.cycle)
    throw CapabilityError(
        "Psi is that of a cycle ('cycle' in [run]), not of this motion: products_of() follows the cycle.");
  const std::optional<EndEvent> end = problem.ends_when ? std::optional(*problem.ends_when) : std::nullopt;
  return hessian_products_until(with_fixed_end(problem, rho), end, rho, directions);
}

HessianProducts hessian_products_until(const Problem& problem, const std::optional<EndEvent>& end,
                                       const std::vector<double>& rho, const MatrixXd& directions,
                                       const Eigen::VectorXd& start_weights) {
  require_products(problem);
  require_twice_differentiable_laws(problem, rho);
  const Eigen::Index np = problem.parameters.size();
  if (directions.rows() != np)
    throw Error(fmt::format("A direction needs one entry a parameter: {}, found {}.", np, directions.rows()));
  // Tangents of size 1: along directions of size 1 in scaled parameters.
  const Eigen::VectorXd scale = scales(problem.parameters);
  MatrixXd unit = directions;
  Eigen::VectorXd size = Eigen::VectorXd::Zero(directions.cols());
  for (Eigen::Index k = 0; k < directions.cols() && np > 0; ++k) {
    size[k] = directions.col(k).cwiseQuotient(scale).cwiseAbs().maxCoeff();
    if (size[k] > 0) unit.col(k) /= size[k];
  }
  // As many directions at once as their stored motion fits into the memory, if that takes some thousand
  // steps.
  const Mechanism& m = *problem.mechanism;
  const double column_MB = 8e-6 * 13 * 2000 * (2 * m.coordinate_count() + m.state_count());
  const auto most =
      std::max<Eigen::Index>(1, static_cast<Eigen::Index>(problem.solver.memory_budget_MB / column_MB) - 1);
  HessianProducts result;
  result.products.resize(np, directions.cols());
  for (Eigen::Index first = 0; first == 0 || first < directions.cols(); first += most) {
    const Eigen::Index count = std::min(most, directions.cols() - first);
    result.products.middleCols(first, count) =
        run(problem, end, rho, unit.middleCols(first, count), start_weights, result);
  }
  result.products *= size.asDiagonal();
  return result;
}

}  // namespace costate
