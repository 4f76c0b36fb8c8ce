#include "costate/problem/redundant_rows.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <optional>

#include "costate/analysis/start.h"
#include "costate/analysis/undetermined_reactions.h"
#include "costate/base/notice.h"
#include "costate/objective/all_outputs.h"

namespace costate {

constexpr double kMostLooks = 1e7;

std::string redundant_rows(const Problem& problem, const std::vector<double>& rho) {
  Assembly assembly(problem.mechanism, problem.parameters);
  assembly.set_parameters(rho.data());
  const double t = problem.solver.t_start;
  const Start start = find_start(assembly, t, false);
  const ConstraintRank rank = constraint_rank(assembly, t, start.q.data());
  if (rank.dependent_rows.empty()) return {};
  const std::vector<std::string> rows = problem.mechanism->row_names();
  std::vector<std::string> names;
  for (const int i : rank.dependent_rows) names.push_back(rows[static_cast<std::size_t>(i)]);
  return fmt::format("{} of {} constraint rows depend on the others ({}).", names.size(), rows.size(),
                     fmt::join(names, ", "));
}

void tell_of_open_reactions(const Problem& problem, const std::vector<double>& rho,
                            const std::vector<std::unique_ptr<Output>>& outputs, bool multipliers) {
  Assembly assembly(problem.mechanism, problem.parameters);
  if (!find_formulation(problem.formulation).carries_redundancy && !assembly.has_switched_rows()) return;
  assembly.set_parameters(rho.data());
  const Start start = find_start(assembly, problem.solver.t_start, false);
  UndeterminedReactions reactions(assembly, problem.solver.t_start, start.q, start.z);
  if (reactions.none()) return;
  // Of very many not each is looked at.
  const bool all = static_cast<double>(outputs.size()) * assembly.n() > kMostLooks;
  std::vector<std::string> open;
  if (!all)
    for (const auto& o : outputs)
      if (reactions.leaves_open(*o)) open.push_back(o->name());
  if (open.empty() && !multipliers && !all) return;
  notice(fmt::format(
      "The motion does not determine the multipliers of rows that depend on each other ({}){}: given are "
      "those that formulation '{}' chooses. What parts would bear is decided by how they give.",
      first_names(reactions.rows()), open.empty() ? std::string() : ", nor what is made of them, " + first_names(open),
      problem.formulation));
}

std::vector<std::string> determined_outputs(const Problem& problem, const std::vector<double>& rho, std::size_t most) {
  std::vector<std::string> names;
  if (output_names(*problem.mechanism).size() > most) return names;
  Assembly assembly(problem.mechanism, problem.parameters);
  assembly.set_parameters(rho.data());
  std::optional<UndeterminedReactions> reactions;
  if (find_formulation(problem.formulation).carries_redundancy || assembly.has_switched_rows()) {
    const Start start = find_start(assembly, problem.solver.t_start, false);
    reactions.emplace(assembly, problem.solver.t_start, start.q, start.z);
  }
  for (const auto& output : make_all_outputs(*problem.mechanism))
    if (!reactions || reactions->none() || !reactions->leaves_open(*output)) names.push_back(output->name());
  return names;
}

}  // namespace costate
