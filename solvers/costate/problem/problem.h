// A differentiable simulation: mechanism, parameters, cost, formulation, time span and accuracy; and what a run of
// it gives: psi, its gradient, counters.
#pragma once

#include <algorithm>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "costate/event/end_event.h"
#include "costate/formulation/defaults.h"
#include "costate/formulation/formulation.h"
#include "costate/scene/cycle_settings.h"

namespace costate {

/// Those of SolverOptions in parts of rtol, whatever that is.
struct AbsoluteTolerances {
  double atol = 0, cost_atol = 0;
};

struct SolverOptions {
  double t_start = 0;  // s
  double t_end = 1;    // s
  double rtol = kDefaultTolerance;
  double atol = 0;       // absolute tolerance of every unknown in its SI unit; 0: the same number as rtol
  double cost_atol = 0;  // of psi's integral, where that is less than what atol makes of it; 0: what that makes
  long max_steps = 2'000'000;
  double max_step_s = 0;   // largest step, so that nothing short (a bump in the road) is stepped over; 0: unlimited
  std::string integrator;  // "idas", "cvodes", "fixed" or empty: the formulation's default
  std::string cvodes_method = "adams";  // "adams" (smooth, not stiff) or "bdf" (stiff); both with exact Newton
  double step_s = 0;                    // fixed-step runs: their step; 0: from rtol, see fixed_run.h
  long checkpoint_steps = 0;            // steps between checkpoints; 0: from memory_budget_MB and the expected steps
  double memory_budget_MB = 512;        // for the stored forward trajectory of adjoint runs
  bool staggered = true;                // forward sensitivities: staggered or simultaneous corrector
  // Events from here on are not crossed: of a run whose end is one, known from another run.
  double events_until = std::numeric_limits<double>::infinity();
  bool confirm = true;  // gradients are compared with a looser run, see sensitivity/confirmation.h
  // Adjoint gradients that are small against their adjoint are repeated at smaller tolerances, see
  // sensitivity/integrator_gradient.h.
  bool resolve = true;

  /// Throws Error for numbers that are none, or out of range.
  void check() const;
  double absolute() const { return atol > 0 ? atol : rtol; }
  /// Another relative tolerance, the absolute one in proportion.
  void set_rtol(double to) {
    if (atol > 0) atol *= to / rtol;
    cost_atol *= to / rtol;
    rtol = to;
  }
  /// All of them `part` as large, but no smaller than these.
  void tighten(double part, double least_rtol, double least_atol = 0) {
    atol = std::max(absolute() * part, least_atol);  // which may be rtol's
    rtol = std::max(rtol * part, least_rtol);
    cost_atol *= part;
  }
  AbsoluteTolerances absolute_by_rtol() const { return {absolute() / rtol, cost_atol / rtol}; }
  void set_absolute(const AbsoluteTolerances& by_rtol) {
    atol = by_rtol.atol * rtol;
    cost_atol = by_rtol.cost_atol * rtol;
  }
};

/// What a run cost. Zero where a method has no such thing.
struct Counters {
  long steps = 0, residuals = 0, jacobians = 0, newton_iterations = 0, error_test_failures = 0,
       convergence_failures = 0;
  long backward_steps = 0, backward_residuals = 0, backward_jacobians = 0, backward_newton_iterations = 0,
       backward_error_test_failures = 0, backward_convergence_failures = 0;
  long sensitivity_residuals = 0, factorizations = 0, checkpoints = 0, simulations = 0;
  long jumps = 0;                // between smooth segments of the trajectory
  long position_iterations = 0;  // Newton's, where positions are found from independent coordinates

  Counters& operator+=(const Counters& other);
};

/// (name, value) in a fixed order, for reports.
std::vector<std::pair<std::string, long>> counter_list(const Counters& c);
/// The same, to be set by name.
std::vector<std::pair<std::string, long*>> counter_fields(Counters& c);

/// Called now and then from inside a run; may throw (Interrupted) to stop it.
using Monitor = std::function<void(double t, long steps, bool backward)>;

struct Problem {
  std::shared_ptr<const Mechanism> mechanism;
  ParameterSelection parameters;
  Objective objective;
  std::string formulation = kDefaultFormulation;
  FormulationOptions formulation_options;
  SolverOptions solver;
  std::shared_ptr<const EndEvent> ends_when;   // before solver.t_end; or null: the run ends there
  std::shared_ptr<const CycleSettings> cycle;  // psi is that of a cycle from there to there (cycle/); or null
  Monitor monitor;                             // or empty

  /// Throws Error unless there is one finite value a parameter, a mechanism, and options that can be.
  void check_values(const std::vector<double>& rho) const;
  /// Throw CapabilityError when the formulation has no such form.
  std::unique_ptr<DaeSystem> make_dae() const;
  std::unique_ptr<OdeSystem> make_ode() const;
  std::unique_ptr<DiscreteScheme> make_discrete() const;

 private:
  /// With what ends the run among what it follows.
  Objective followed_objective() const;
};

/// An event that a run met: "contact.foot: touch".
struct RunEvent {
  double t;  // s
  std::string name;
  std::string mode = {};   // behind it, of an event of the mechanism: "closed"
  double jump = 0;         // of the state that jumped most, an approach speed [m/s]
  double energy_lost = 0;  // by an impact, J
  double cost_unseen = 0;  // what psi may be off by, as bounces from here on are too small to be seen
};

/// By how much psi and each derivative may be off, as far as a run has found that out besides: by confirming itself, or
/// from what it gives notice of.
struct KnownError {
  double psi = 0;
  std::vector<double> gradient = {};  // one entry a parameter; empty of a simulation
  double stays = 0;                   // what no tolerance takes away, in parts of psi and of the gradient
  bool all = true;                    // false: there may be more, which nothing has told
};

/// What a run gives.
struct Simulation {
  double psi = 0;
  std::optional<KnownError> known_error;  // see problem/known_error.h
  Counters counters;
  std::string integrator;        // "idas", "cvodes" or "fixed"
  std::vector<RunEvent> events;  // in order of time
  std::optional<RunEvent> end;   // what ended the run, of a problem with ends_when
};

/// And what a method gives that differentiates it.
struct GradientResult : Simulation {
  GradientResult() = default;
  /// Of a problem without parameters.
  explicit GradientResult(Simulation run) : Simulation(std::move(run)) {}

  std::vector<double> gradient;        // one entry a parameter
  std::vector<double> gradient_error;  // estimate of the method itself (differences) or empty
};

}  // namespace costate
