#include "costate/problem/problem.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "costate/base/error.h"
#include "costate/discrete/discrete_scheme.h"
#include "costate/event/end_event.h"
#include "costate/formulation/law_joins.h"
#include "costate/objective/cost_check.h"
#include "costate/objective/sampled_cost.h"

namespace costate {

namespace {
struct NamedCounter {
  const char* name;
  long Counters::*count;
};
constexpr NamedCounter kCounters[] = {
    {"steps", &Counters::steps},
    {"residuals", &Counters::residuals},
    {"jacobians", &Counters::jacobians},
    {"newton_iterations", &Counters::newton_iterations},
    {"error_test_failures", &Counters::error_test_failures},
    {"convergence_failures", &Counters::convergence_failures},
    {"backward_steps", &Counters::backward_steps},
    {"backward_residuals", &Counters::backward_residuals},
    {"backward_jacobians", &Counters::backward_jacobians},
    {"backward_newton_iterations", &Counters::backward_newton_iterations},
    {"backward_error_test_failures", &Counters::backward_error_test_failures},
    {"backward_convergence_failures", &Counters::backward_convergence_failures},
    {"sensitivity_residuals", &Counters::sensitivity_residuals},
    {"factorizations", &Counters::factorizations},
    {"checkpoints", &Counters::checkpoints},
    {"simulations", &Counters::simulations},
    {"jumps", &Counters::jumps},
    {"position_iterations", &Counters::position_iterations},
};
// All of them: what is added, and what is reported.
static_assert(sizeof(Counters) == std::size(kCounters) * sizeof(long));
}  // namespace

Counters& Counters::operator+=(const Counters& other) {
  for (const NamedCounter& c : kCounters) this->*c.count += other.*c.count;
  return *this;
}

std::vector<std::pair<std::string, long>> counter_list(const Counters& counters) {
  std::vector<std::pair<std::string, long>> list;
  for (const NamedCounter& c : kCounters) list.emplace_back(c.name, counters.*c.count);
  return list;
}

std::vector<std::pair<std::string, long*>> counter_fields(Counters& counters) {
  std::vector<std::pair<std::string, long*>> fields;
  for (const NamedCounter& c : kCounters) fields.emplace_back(c.name, &(counters.*c.count));
  return fields;
}

/// Of a selection made by hand: each number is one of the mechanism's, and varied once.
static void check_selection(const ParameterSelection& selection, std::size_t numbers) {
  std::vector<const Parameter*> of(numbers, nullptr);
  for (const Parameter& p : selection.parameters) {
    if (!(p.scale > 0) || !std::isfinite(p.scale))
      throw Error(fmt::format("Parameter '{}' has the scale {}; expected a number above 0, its typical size.", p.name,
                              p.scale));
    for (const auto& [number, factor] : p.bindings) {
      if (number < 0 || static_cast<std::size_t>(number) >= numbers)
        throw Error(
            fmt::format("Parameter '{}' is bound to number {}, and the mechanism has numbers 0 to {}; "
                        "Mechanism::number() gives them by their paths.",
                        p.name, number, static_cast<long>(numbers) - 1));
      const Parameter*& owner = of[static_cast<std::size_t>(number)];
      if (owner)
        throw Error(
            fmt::format("Parameters '{}' and '{}' vary the same number {}: derivatives by either of them would be "
                        "those of a motion that only the last one decides.",
                        owner->name, p.name, number));
      owner = &p;
    }
  }
}

namespace {
/// Throws Error for a cost that is none, or whose outputs or numbers are another mechanism's.
void require_of(const Mechanism& mechanism, const CostTerm* term) {
  if (!term) throw Error("A term of the cost is a null pointer.");
  const auto* of = dynamic_cast<const OutputTerm*>(&ungated(*term));
  if (!of) return;
  for (const Output* output : {&of->output(), of->target().output.get()})
    if (output && output->made_for() != 0 && output->made_for() != mechanism.signature())
      throw Error(
          fmt::format("The cost's output '{}' was made for another mechanism than that of the problem: "
                      "make_output(*problem.mechanism, \"{}\") makes one for this.",
                      output->name(), output->name()));
  std::vector<int> numbers = of->target().law_numbers;
  numbers.push_back(std::max(of->weight_number(), 0));
  for (const int number : numbers)
    if (number < 0 || number >= static_cast<int>(mechanism.numbers().size()))
      throw Error(fmt::format("The cost's term of '{}' has the number {}, and the mechanism {} numbers.",
                              of->output().name(), number, mechanism.numbers().size()));
}
}  // namespace

void Problem::check_values(const std::vector<double>& rho) const {
  if (!mechanism) throw Error("The problem has no mechanism.");
  for (const auto* terms : {&objective.running, &objective.terminal})
    for (const auto& term : *terms) require_of(*mechanism, term.get());
  solver.check();
  const std::size_t expected = parameters.parameters.size();
  if (rho.size() != expected)
    throw Error(
        fmt::format("The run varies {} parameters, but {} values are given; parameters.values() are those of "
                    "the scene.",
                    expected, rho.size()));
  for (std::size_t j = 0; j < expected; ++j)
    if (!std::isfinite(rho[j]))
      throw Error(fmt::format("The value of parameter '{}' is {}; expected a finite number.",
                              parameters.parameters[j].name, rho[j]));
  check_selection(parameters, mechanism->numbers().size());
  if (ends_when && (!ends_when->output || ends_when->level_number >= static_cast<int>(mechanism->numbers().size())))
    throw Error(ends_when->output
                    ? fmt::format("The event that ends the run has the level number {}, and the mechanism {} "
                                  "numbers.",
                                  ends_when->level_number, mechanism->numbers().size())
                    : "The event that ends the run has no output (a null pointer).");
  check_cost_promises(mechanism, parameters, objective, rho, ends_when ? ends_when->output : nullptr);
  std::vector<double> numbers = mechanism->base_numbers();
  parameters.apply(rho.data(), numbers);
  require_joined_drivers(*mechanism, numbers, solver.t_start, solver.t_end);
}

void SolverOptions::check() const {
  const auto require = [](bool holds, const char* name, const char* expected, double found) {
    if (!holds) throw Error(fmt::format("SolverOptions::{}: {} is expected, found {}.", name, expected, found));
  };
  require(std::isfinite(t_start), "t_start", "a time", t_start);
  require(std::isfinite(t_end) && t_end >= t_start, "t_end", "a time that is not before t_start", t_end);
  require(rtol > 0 && std::isfinite(rtol), "rtol", "a number above 0", rtol);
  if (cvodes_method != "adams" && cvodes_method != "bdf")
    throw Error(
        fmt::format("SolverOptions::cvodes_method: \"adams\" or \"bdf\" is expected, found \"{}\".", cvodes_method));
  for (const auto& [name, value] : {std::pair("atol", atol),
                                    {"cost_atol", cost_atol},
                                    {"max_step_s", max_step_s},
                                    {"step_s", step_s},
                                    {"memory_budget_MB", memory_budget_MB},
                                    {"checkpoint_steps", static_cast<double>(checkpoint_steps)}})
    require(value >= 0 && std::isfinite(value), name, "a number that is not negative", value);
}

Objective Problem::followed_objective() const {
  Objective all = objective;
  if (ends_when) all.followed.push_back(ends_when->output);
  return all;
}

std::unique_ptr<DaeSystem> Problem::make_dae() const {
  const Formulation& f = find_formulation(formulation);
  if (!f.make_dae)
    throw CapabilityError(fmt::format("Formulation '{}' has no residual form for IDAS; use CVODES.", formulation));
  return f.make_dae(mechanism, parameters, followed_objective(), formulation_options);
}

std::unique_ptr<OdeSystem> Problem::make_ode() const {
  const Formulation& f = find_formulation(formulation);
  if (!f.make_ode)
    throw CapabilityError(
        fmt::format("Formulation '{}' is a DAE without an explicit right-hand side, so CVODES cannot "
                    "integrate it; use IDAS, or a formulation at acceleration level (index1, "
                    "baumgarte, penalty).",
                    formulation));
  return f.make_ode(mechanism, parameters, followed_objective(), formulation_options);
}

std::unique_ptr<DiscreteScheme> Problem::make_discrete() const {
  const Formulation& f = find_formulation(formulation);
  if (!f.make_discrete)
    throw CapabilityError(
        fmt::format("Formulation '{}' has no fixed-step scheme; formulation 'index3' has one.", formulation));
  return f.make_discrete(mechanism, parameters, objective, formulation_options);
}

}  // namespace costate
