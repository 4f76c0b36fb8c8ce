#include "costate/problem/redundant_rows.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "costate/analysis/start.h"

namespace costate {

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

}  // namespace costate
