#include "check_rows.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/integrator/integrators.h"
#include "costate/sensitivity/method.h"

namespace costate::app {

namespace {

bool listed(const std::vector<std::string>& list, const std::string& name) {
  return list.empty() || std::find(list.begin(), list.end(), name) != list.end();
}

/// Discrete methods differentiate the steps of any scheme; beside the one that they take by themselves those that are
/// asked for.
std::vector<std::string> schemes_beside_default(Problem problem, const Formulation& f, const SensitivityMethod& m,
                                                const CheckOptions& options) {
  if (m.needs != SensitivityMethod::Needs::discrete || options.integrators.empty()) return {};
  problem.formulation = f.name;
  problem.solver.integrator.clear();
  std::vector<std::string> names;
  for (const std::string& name : integrators_of(m, f))
    if (name != discrete_integrator_of(problem) && listed(options.integrators, name)) names.push_back(name);
  return names;
}

}  // namespace

std::vector<CheckRow> check_rows(const Problem& problem, const CheckOptions& options, const std::string& redundant) {
  std::vector<CheckRow> rows;
  std::string why;
  bool any = false;
  for (const auto& f : formulations())
    for (const auto& m : sensitivity_methods()) {
      if (!listed(options.formulations, f.name) || !listed(options.methods, m.name)) continue;
      CheckRow row;
      row.formulation = f.name;
      row.method = m.name;
      row.why = refusal(m, f);
      const bool possible = row.why.empty();  // on other scenes
      if (possible && !f.carries_redundancy && !redundant.empty())
        row.why = fmt::format(
            "{} Formulation '{}' needs independent rows; the penalties, augmented-lagrangian and "
            "maggi carry them.",
            redundant, f.name);
      if (!row.why.empty()) row.judged.verdict = Verdict::refused;
      any = any || !row.refused();
      if (row.refused()) why = row.why;
      if (!possible && !options.all && options.methods.empty()) continue;
      rows.push_back(row);
      if (!possible) continue;
      for (const std::string& name : schemes_beside_default(problem, f, m, options)) {
        row.integrator = name;
        rows.push_back(row);
      }
    }
  if (!any) throw CapabilityError("No combination of formulation and method is left. " + why);
  return rows;
}

}  // namespace costate::app
