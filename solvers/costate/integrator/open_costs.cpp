#include "costate/integrator/open_costs.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "costate/analysis/start.h"
#include "costate/analysis/undetermined_reactions.h"
#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/formulation/formulation.h"

namespace costate {

OpenCosts::OpenCosts(const Problem& problem, const std::vector<double>& rho)
    : problem_(problem),
      rho_(rho),
      assembly_(problem.mechanism, problem.parameters),
      on_reactions_(problem.objective.running_needs_accelerations() ||
                    problem.objective.terminal_needs_accelerations()) {
  assembly_.set_parameters(rho.data());
}

bool OpenCosts::leaves_open(UndeterminedReactions& reactions,
                            const std::vector<std::shared_ptr<const CostTerm>>& terms) const {
  return std::any_of(terms.begin(), terms.end(), [&](const auto& term) { return reactions.leaves_open(*term); });
}

void OpenCosts::look(const MechanismState& s) {
  assembly_.switch_rows(s.z);
  std::vector<char> there = rows_there(assembly_);
  if (there == there_) return;
  there_ = std::move(there);
  terminal_.reset();
  const Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(s.q, assembly_.n()),
                        z = Eigen::Map<const Eigen::VectorXd>(s.z, assembly_.nz());
  UndeterminedReactions reactions(assembly_, s.t, q, z);
  if (reactions.none()) return;
  const Open here{s.t, first_names(reactions.rows())};
  if (!running_ && leaves_open(reactions, problem_.objective.running)) running_ = here;
  if (leaves_open(reactions, problem_.objective.terminal)) terminal_ = here;
}

void OpenCosts::tell(bool redundant) const {
  if (const std::string rows = open_rows(redundant); !rows.empty())
    notice(
        fmt::format("The cost holds reactions that the motion does not determine: constraint rows depend on each "
                    "other ({}). psi and its gradient are those of the choice that formulation '{}' makes.",
                    rows, problem_.formulation));
  if (const std::optional<Open>& open = running_ ? running_ : terminal_)
    notice(
        fmt::format("The cost holds reactions that the motion does not determine: from t = {:.6g} s on contacts hold a "
                    "body more often than it can move ({}). psi and its gradient are those of the choice that "
                    "formulation '{}' makes, whatever error stands beside them.",
                    open->t, open->rows, problem_.formulation));
}

void OpenCosts::refuse_gradient(bool redundant) const {
  const Formulation& f = find_formulation(problem_.formulation);
  if (!f.weighted || !f.exact_constraints()) return;
  std::string rows = open_rows(redundant);
  if (const std::optional<Open>& open = running_ ? running_ : terminal_; rows.empty() && open) rows = open->rows;
  if (rows.empty()) return;
  throw CapabilityError(
      fmt::format("The cost holds reactions that the motion does not determine: rows depend on each other ({}). "
                  "Formulation '{}' chooses some, by turns whose derivative is another choice's: it has no gradient of "
                  "this psi. Take maggi, whose choice is the least of all, or a cost that no sharing changes.",
                  rows, problem_.formulation));
}

std::string OpenCosts::open_rows(bool redundant) const {
  if (!redundant || !on_reactions_) return "";
  Assembly assembly(problem_.mechanism, problem_.parameters);
  assembly.set_parameters(rho_.data());
  const Start start = find_start(assembly, problem_.solver.t_start, false);
  UndeterminedReactions reactions(assembly, problem_.solver.t_start, start.q, start.z);
  const bool open =
      leaves_open(reactions, problem_.objective.running) || leaves_open(reactions, problem_.objective.terminal);
  return open ? first_names(reactions.rows()) : "";
}

}  // namespace costate
