#include "costate/sensitivity/method.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/analysis/redundant_parameters.h"
#include "costate/base/derivatives_wanted.h"
#include "costate/base/error.h"
#include "costate/formulation/law_joins.h"
#include "costate/integrator/cost_domain.h"
#include "costate/integrator/run_end.h"
#include "costate/integrator/run_watch.h"
#include "costate/integrator/sampled_run.h"
#include "costate/integrator/simulate.h"
#include "costate/objective/cost_check.h"
#include "costate/problem/differentiable_laws.h"
#include "costate/sensitivity/confirmation.h"
#include "costate/sensitivity/cycle_gradient.h"
#include "costate/sensitivity/error_estimate.h"
#include "costate/sensitivity/soft_end.h"

namespace costate {

namespace {
std::vector<SensitivityMethod>& table() {
  static std::vector<SensitivityMethod> methods;
  return methods;
}
}  // namespace

RegisterSensitivityMethod::RegisterSensitivityMethod(SensitivityMethod m) {
  auto& t = table();
  t.insert(std::upper_bound(t.begin(), t.end(), m, [](const auto& a, const auto& b) { return a.name < b.name; }),
           std::move(m));
}

const std::vector<SensitivityMethod>& sensitivity_methods() { return table(); }

const SensitivityMethod* first_method(const std::function<bool(const SensitivityMethod&)>& of) {
  const auto found = std::find_if(table().begin(), table().end(), of);
  return found == table().end() ? nullptr : &*found;
}

const SensitivityMethod& find_sensitivity_method(const std::string& name) {
  std::vector<std::string> names;
  for (const auto& m : table()) {
    if (m.name == name) return m;
    names.push_back(m.name);
  }
  throw CapabilityError(fmt::format("There is no method '{}'.{}", name, suggestion(name, names)));
}

namespace {

using Needs = SensitivityMethod::Needs;
using Form = Integrator::Form;

bool offers(const Formulation& f, Needs needs) {
  switch (needs) {
    case Needs::dae:
      return f.make_dae != nullptr;
    case Needs::ode:
      return f.make_ode != nullptr;
    case Needs::either:
      return f.make_dae || f.make_ode;
    case Needs::discrete:
      return f.make_discrete || f.make_ode || f.make_dae;
    case Needs::hand_tangent:
      return f.make_hand_tangent != nullptr;
    case Needs::hand_adjoint:
      return f.make_hand_adjoint != nullptr;
  }
  return false;
}

const char* form_name(Needs needs) {
  switch (needs) {
    case Needs::dae:
      return "a residual form (DAE)";
    case Needs::ode:
      return "an explicit right-hand side (ODE)";
    case Needs::either:
      return "a form that an integrator can carry";
    case Needs::discrete:
      return "a fixed-step scheme, an explicit right-hand side (ODE) or a residual form (DAE)";
    case Needs::hand_tangent:
      return "hand-derived tangent equations";
    case Needs::hand_adjoint:
      return "hand-derived adjoint equations";
  }
  return "";
}

/// "adjoint", "forward", ...: what a method's name ends in.
std::string direction(const std::string& method) { return method.substr(method.find('-') + 1); }

}  // namespace

std::string refusal(const SensitivityMethod& method, const Formulation& formulation) {
  if (offers(formulation, method.needs)) return {};
  std::string nearest;
  // The same direction on the other integrator's module comes before our own hand-derived and discrete ones.
  for (const bool module : {true, false})
    for (const auto& m : table())
      if (nearest.empty() && (m.needs == Needs::dae || m.needs == Needs::ode) == module && m.name != method.name &&
          direction(m.name) == direction(method.name) && offers(formulation, m.needs))
        nearest = fmt::format("method '{}' with formulation '{}'", m.name, formulation.name);
  for (const auto& f : formulations())
    if (offers(f, method.needs)) {
      nearest +=
          fmt::format("{}method '{}' with formulation '{}'", nearest.empty() ? "" : ", or ", method.name, f.name);
      break;
    }
  return fmt::format("Method '{}' needs {}, which formulation '{}' does not have.{}", method.name,
                     form_name(method.needs), formulation.name,
                     nearest.empty() ? "" : " Nearest that works: " + nearest + ".");
}

std::string integrator_of(const Problem& problem, const SensitivityMethod& method) {
  const Form form = method.needs == Needs::dae ? Form::residual : Form::rhs;
  if (method.needs == Needs::discrete) return discrete_integrator_of(problem);
  if (method.needs != Needs::dae && method.needs != Needs::ode) return integrator_of(problem);
  const auto own = std::find_if(integrators().begin(), integrators().end(),
                                [&](const Integrator& i) { return i.form == form && !i.discrete; });
  return own->name;
}

std::vector<std::string> integrators_of(const SensitivityMethod& method, const Formulation& formulation) {
  std::vector<std::string> names;
  for (const Integrator* i : integrators_of(formulation)) {
    const bool own = method.needs == Needs::discrete ? i->discrete
                     : method.needs == Needs::dae    ? i->form == Form::residual && !i->discrete
                     : method.needs == Needs::ode    ? i->form == Form::rhs && !i->discrete
                                                     : false;
    if (own) names.push_back(i->name);
  }
  return names;
}

bool by_fixed_steps(const Problem& problem, const SensitivityMethod& method) {
  return method.needs == Needs::discrete && has_fixed_steps(integrator_of(problem, method));
}

namespace {
/// Without parameters there is nothing to differentiate: psi alone, on the integrator that the method works on. No
/// method has to do with matrices of no columns.
GradientResult without_parameters(Problem problem, const SensitivityMethod& method) {
  problem.solver.integrator = integrator_of(problem, method);
  return GradientResult(simulate(problem, {}));
}
}  // namespace

namespace {
/// Runs that end by an event: to that time, on the method's own integrator; fixed steps end there themselves.
Problem with_end_of(const Problem& problem, const SensitivityMethod& method, const std::vector<double>& rho) {
  if (method.needs == Needs::dae || method.needs == Needs::ode) {
    Problem separate = with_separate_samples(problem);
    if (!problem.ends_when) return separate;
  }
  if (!problem.ends_when || method.perturbs || by_fixed_steps(problem, method)) return problem;
  return with_fixed_end(problem, rho, integrator_of(problem, method));
}
}  // namespace

GradientResult gradient(const Problem& problem, const std::string& name, const std::vector<double>& rho) {
  const SensitivityMethod& method = find_sensitivity_method(name);
  const std::string no = refusal(method, find_formulation(problem.formulation));
  if (!no.empty()) throw CapabilityError(no);
  const DerivativesWanted wanted;
  problem.check_values(rho);
  if (!method.perturbs && !rho.empty())
    check_cost_derivatives(problem.mechanism, problem.parameters, problem.objective, rho,
                           problem.ends_when ? problem.ends_when->output : nullptr);
  if (has_samples(problem.objective) && problem.cycle) with_separate_samples(problem);  // refused
  if (problem.cycle && !method.perturbs) {
    const auto on_cycle = [&](const Problem& p) { return cycle_gradient(p, name, rho); };
    GradientResult r = on_cycle(problem);
    if (!problem.solver.confirm || by_fixed_steps(problem, method) || rho.empty()) return r;
    // A multiplier that has no derivative at another tolerance leaves this one's result what it is.
    const auto beside = [&](const Problem& p) {
      try {
        return on_cycle(p);
      } catch (const CapabilityError& e) {
        throw SolverError(e.what());
      }
    };
    return confirmed(problem, std::move(r), beside);
  }
  if (rho.empty()) {
    GradientResult r = without_parameters(problem, method);
    require_finite(problem, r);
    return r;
  }
  if (!method.perturbs) {
    Assembly assembly(problem.mechanism, problem.parameters);
    assembly.set_parameters(rho.data());
    require_compatible_parameters(assembly, problem.solver.t_start, problem.solver.t_end);
  }
  const Problem whole = with_end_of(problem, method, rho);
  if (!method.perturbs) require_differentiable_laws(whole, rho, true);
  GradientResult r = with_cost_told(problem, rho, [&] { return method.gradient(whole, rho); });
  const auto tell_end = [&](GradientResult& of, const Problem& own) {
    if (!problem.ends_when || of.end) return;
    Assembly assembly(problem.mechanism, problem.parameters);
    assembly.set_parameters(rho.data());
    of.end = RunEvent{own.solver.t_end, problem.ends_when->text(assembly)};
  };
  tell_end(r, whole);
  require_finite(problem, r);  // whatever the method
  const double drift = last_drift();
  const auto run = [&](const Problem& p) {
    const Problem own = with_end_of(p, method, rho);
    GradientResult of = method.gradient(own, rho);
    tell_end(of, own);
    return of;
  };
  if (!problem.solver.confirm || method.perturbs || by_fixed_steps(problem, method)) {
    watch_penalty(problem, rho, r, drift, run);
    watch_soft_end(problem, rho, r);
    return r;
  }
  bool sensitive = false;
  const bool scheme = method.needs == Needs::discrete;
  GradientResult best =
      confirmed(problem, r, run,
                Looks{scheme && bends_of(*problem.mechanism, problem.mechanism->base_numbers()) != Bends::none, scheme},
                &sensitive);
  watch_penalty(problem, rho, best, sensitive ? HUGE_VAL : drift, run);
  watch_soft_end(problem, rho, best);
  return best;
}

std::vector<double> estimate_gradient_error(const Problem& problem, const std::string& method,
                                            const std::vector<double>& rho, const GradientResult& result) {
  const auto e = estimate_or_tell([&] { return estimate_error(problem, method, rho, result); });
  return e ? e->gradient : std::vector<double>{};
}

}  // namespace costate
