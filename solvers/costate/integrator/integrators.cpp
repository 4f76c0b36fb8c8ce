#include "costate/integrator/integrators.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/discrete/discrete_scheme.h"
#include "costate/discrete/explicit_scheme.h"
#include "costate/discrete/radau_scheme.h"
#include "costate/event/motion_events.h"
#include "costate/formulation/formulation.h"

namespace costate {

namespace {
using Form = Integrator::Form;
}

bool Integrator::carries(const Formulation& f) const {
  switch (form) {
    case Form::residual:
      return f.make_dae != nullptr;
    case Form::rhs:
      return f.make_ode != nullptr;
    case Form::steps:
      return f.make_discrete != nullptr;
  }
  return false;
}

const char* Integrator::form_name() const {
  return form == Form::residual ? "implicit" : form == Form::rhs ? "explicit" : "fixed-step";
}

const std::vector<Integrator>& integrators() {
  static const std::vector<Integrator> all = [] {
    std::vector<Integrator> r = {
        {"idas", "BDF of SUNDIALS' IDAS on the residual", Form::residual, false, true},
        {"cvodes", "Adams' method or BDF of SUNDIALS' CVODES on the right-hand side", Form::rhs, false, true}};
    for (const RadauScheme& s : radau_schemes()) r.push_back({s.name, s.summary, Form::residual, true, true});
    for (const ExplicitScheme& s : explicit_schemes()) r.push_back({s.name, s.summary, Form::rhs, true, true});
    r.push_back(
        {"fixed", "the formulation's own scheme by fixed steps, exact discrete gradients", Form::steps, true, false});
    return r;
  }();
  return all;
}

std::vector<std::string> integrator_names() {
  std::vector<std::string> names;
  for (const Integrator& i : integrators()) names.push_back(i.name);
  return names;
}

const Integrator& find_integrator(const std::string& name) {
  for (const Integrator& i : integrators())
    if (i.name == name) return i;
  throw CapabilityError(fmt::format("There is no integrator '{}'.{}", name, suggestion(name, integrator_names())));
}

bool is_integrator(const std::string& name) {
  const auto& all = integrators();
  return std::any_of(all.begin(), all.end(), [&](const Integrator& i) { return i.name == name; });
}

bool has_fixed_steps(const std::string& name) { return is_integrator(name) && !find_integrator(name).step_control; }

std::vector<const Integrator*> integrators_of(const Formulation& f) {
  std::vector<const Integrator*> r;
  for (const Integrator& i : integrators())
    if (i.carries(f)) r.push_back(&i);
  return r;
}

void require_form(const Problem& problem, const Integrator& integrator) {
  const Formulation& f = find_formulation(problem.formulation);
  if (integrator.carries(f)) return;
  const char* needs = integrator.form == Form::residual ? "a residual form"
                      : integrator.form == Form::rhs    ? "an explicit right-hand side"
                                                        : "a fixed-step scheme";
  std::vector<std::string> on, others;
  for (const Integrator* i : integrators_of(f)) on.push_back(i->name);
  for (const Formulation& other : formulations())
    if (integrator.carries(other)) others.push_back(other.name);
  throw CapabilityError(
      fmt::format("Formulation '{}' is without {}, which '{}' integrates: it runs on {}. '{}' takes {}.", f.name, needs,
                  integrator.name, fmt::join(on, ", "), integrator.name, fmt::join(others, ", ")));
}

std::string integrator_of(const Problem& problem) {
  const std::string& wanted = problem.solver.integrator;
  const Formulation& f = find_formulation(problem.formulation);
  if (wanted.empty()) return f.default_integrator;
  return find_integrator(wanted).name;
}

std::string discrete_integrator_of(const Problem& problem) {
  const Formulation& f = find_formulation(problem.formulation);
  const std::string& wanted = problem.solver.integrator;
  const auto serves = [&](const Integrator& i) { return i.discrete && i.carries(f); };
  if (!wanted.empty() && find_integrator(wanted).discrete) {
    require_form(problem, find_integrator(wanted));
    return wanted;
  }
  // At events fixed steps have no error test that would make them short: whoever asks for none of their length does
  // not ask for them.
  const bool events = MotionEvents::has_any(*problem.mechanism);
  for (const bool control : {false, true}) {
    if (!control && events && problem.solver.step_s == 0) continue;
    // Of the schemes with step control the last one has the highest order.
    const auto found = std::find_if(integrators().rbegin(), integrators().rend(),
                                    [&](const Integrator& i) { return serves(i) && i.step_control == control; });
    if (found != integrators().rend()) return found->name;
  }
  throw CapabilityError(fmt::format(
      "Formulation '{}' has neither fixed steps nor a residual nor an explicit right-hand side, whose steps "
      "discrete methods differentiate.",
      f.name));
}

}  // namespace costate
