#include "costate/sensitivity/hessian.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/formulation/hessian_systems.h"
#include "costate/integrator/cvode_session.h"
#include "costate/integrator/run_end.h"
#include "costate/integrator/run_watch.h"
#include "costate/integrator/segmented_run.h"
#include "costate/integrator/trajectory.h"

namespace costate {

namespace {

using Eigen::MatrixXd;

/// How large the adjoint and its changes get, at least: what they begin with, and the integral of their rates
/// at mu = 0. One size for all: errors then count against the largest entries of the Hessian in scaled
/// parameters.
double adjoint_size(HessianEquations& equations, const Trajectory& motion) {
  constexpr int samples = 50;
  const int N = equations.state_size(), np = equations.parameter_count(), columns = 1 + equations.directions();
  std::vector<double> y(static_cast<std::size_t>(columns * N)), zero(y.size(), 0.0), rates(y.size()),
      integrands(static_cast<std::size_t>(columns * np), 0.0);
  const auto largest = [](const std::vector<double>& x) {
    double size = 0;
    for (const double e : x) size = std::max(size, std::abs(e));
    return size;
  };
  const double span = motion.t_end() - motion.t_begin();
  double size = 0;
  for (int i = 0; i <= samples; ++i) {
    const double t = motion.t_begin() + i * span / samples;
    motion.evaluate(t, y.data());
    equations.evaluate(t, y.data(), y.data() + N);
    equations.adjoint(zero.data(), zero.data() + N, rates.data(), rates.data() + N, integrands.data(),
                      integrands.data() + np);
    size += largest(rates) * span / (samples + 1);
  }
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

/// The products of some directions, which are of size 1 in scaled parameters.
MatrixXd run(const Problem& problem, const std::vector<double>& rho, const MatrixXd& directions,
             HessianProducts& result) {
  const auto equations =
      find_formulation(problem.formulation)
          .make_hessian(problem.mechanism, problem.parameters, problem.objective, problem.formulation_options);
  equations->set_parameters(rho.data());
  equations->set_directions(directions);
  const int np = equations->parameter_count(), k = equations->directions();
  const double t_start = problem.solver.t_start, t_end = problem.solver.t_end;

  TangentMotion forward(*equations);
  forward.set_parameters(rho.data());
  Trajectory motion(0, forward.size());  // all of the unknowns, the tangents among them
  CvodeRun forward_session(forward, problem.solver, problem.monitor, StartDerivative::none);
  // The passes know nothing of the cost.
  const auto plan = std::make_shared<const StepPlan>(forward, problem.objective, t_start, t_end, forward_session.y());
  forward_session.follow(plan);
  RunWatch watch(problem, rho, forward);
  watch.begin(t_start, forward_session.y());
  forward_session.watch(watch.sink());
  forward_session.advance_recording(t_end, motion);
  watch.finish(t_end, forward_session.y());
  watch.conclude(Simulation{});
  forward_session.read_forward_counters();

  result.psi = psi_of(forward, problem.objective, motion);

  // A few unknowns of size above 1 are no harm (they count relatively), many far below it would be.
  const double scale = 0.1 * adjoint_size(*equations, motion);
  std::vector<double> parameter_scale;
  for (const Parameter& p : problem.parameters.parameters) parameter_scale.push_back(p.scale);
  HessianAdjoint backward(
      *equations, [&motion](double t, double* y) { motion.evaluate(t, y); }, t_end, scale, parameter_scale);
  backward.set_parameters(rho.data());
  SolverOptions options = problem.solver;
  options.t_start = 0;
  options.t_end = t_end - t_start;
  options.atol = problem.solver.rtol;
  // Where it takes very many steps more than the motion it is stuck, near a singular configuration mostly.
  options.max_steps = std::min(options.max_steps, 20 * forward_session.counters().steps + 1000);
  const Monitor monitor =
      problem.monitor
          ? Monitor([&problem, t_end](double tau, long steps, bool) { problem.monitor(t_end - tau, steps, true); })
          : Monitor();
  CvodeSession backward_session(backward, options, monitor, StartDerivative::none);
  backward_session.follow(std::make_shared<const StepPlan>(forward_session.plan_back()->reversed(t_end)));
  try {
    backward_session.advance(options.t_end);
  } catch (const SolverError& e) {
    throw SolverError(fmt::format("On the way back, its times counted from the end at {:.9g} s: {}", t_end, e.what()));
  }
  backward_session.read_forward_counters();
  MatrixXd products(np, k);
  result.gradient.assign(static_cast<std::size_t>(np), 0);
  backward.finish(t_start, backward_session.y(), result.gradient.data(), products.data());
  result.counters += forward_session.counters();
  result.counters += as_backward(backward_session.counters());
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

HessianProducts hessian_products(const Problem& problem, const std::vector<double>& rho, const MatrixXd& directions) {
  const std::string refused = hessian_refusal(find_formulation(problem.formulation));
  if (!refused.empty()) throw CapabilityError(refused);
  MotionEvents::refuse(*problem.mechanism, "Hessian products are");
  if (problem.cycle)
    throw CapabilityError(
        "Psi is that of a cycle ('cycle' in [run]), whose second derivatives are not computed; gradients are.");
  refuse_free_end(problem, "Hessian products are");
  const auto& parameters = problem.parameters.parameters;
  const auto np = static_cast<Eigen::Index>(parameters.size());
  if (directions.rows() != np)
    throw Error(fmt::format("A direction needs one entry a parameter: {}, found {}.", np, directions.rows()));
  // Tangents of size 1: along directions of size 1 in scaled parameters.
  MatrixXd unit = directions;
  Eigen::VectorXd size = Eigen::VectorXd::Zero(directions.cols());
  for (Eigen::Index k = 0; k < directions.cols(); ++k) {
    for (Eigen::Index j = 0; j < np; ++j)
      size[k] = std::max(size[k], std::abs(directions(j, k)) / parameters[static_cast<std::size_t>(j)].scale);
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
    result.products.middleCols(first, count) = run(problem, rho, unit.middleCols(first, count), result);
  }
  result.products *= size.asDiagonal();
  return result;
}

Hessian hessian(const Problem& problem, const std::vector<double>& rho) {
  const auto& parameters = problem.parameters.parameters;
  const auto np = static_cast<Eigen::Index>(parameters.size());
  HessianProducts p = hessian_products(problem, rho, MatrixXd::Identity(np, np));
  Hessian h;
  h.psi = p.psi;
  h.gradient = std::move(p.gradient);
  h.counters = p.counters;
  Eigen::VectorXd scale(np);
  for (Eigen::Index j = 0; j < np; ++j) scale[j] = parameters[static_cast<std::size_t>(j)].scale;
  const MatrixXd scaled = scale.asDiagonal() * p.products * scale.asDiagonal();
  const double largest = np > 0 ? scaled.cwiseAbs().maxCoeff() : 0;
  if (largest > 0) h.asymmetry = (scaled - scaled.transpose()).cwiseAbs().maxCoeff() / largest;
  h.matrix = (p.products + p.products.transpose()) / 2;
  return h;
}

}  // namespace costate
