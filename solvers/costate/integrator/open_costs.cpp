#include "costate/integrator/open_costs.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/analysis/undetermined_reactions.h"
#include "costate/base/notice.h"

namespace costate {

OpenCosts::OpenCosts(const Problem& problem, const std::vector<double>& rho)
    : problem_(problem), assembly_(problem.mechanism, problem.parameters) {
  const Objective& o = problem.objective;
  empty_ = !assembly_.has_switched_rows() || (!o.running_needs_accelerations() && !o.terminal_needs_accelerations());
  assembly_.set_parameters(rho.data());
}

void OpenCosts::look(const MechanismState& s) {
  assembly_.switch_rows(s.z);
  std::vector<char> there;
  for (int i = 0; i < assembly_.m(); ++i) there.push_back(assembly_.is_there(i) ? 1 : 0);
  if (there == there_) return;
  there_ = there;
  terminal_.clear();
  const Eigen::VectorXd q = Eigen::Map<const Eigen::VectorXd>(s.q, assembly_.n()),
                        z = Eigen::Map<const Eigen::VectorXd>(s.z, assembly_.nz());
  UndeterminedReactions reactions(assembly_, s.t, q, z);
  if (reactions.none()) return;
  const auto open = [&](const std::vector<std::shared_ptr<const CostTerm>>& terms) {
    return std::any_of(terms.begin(), terms.end(), [&](const auto& term) { return reactions.leaves_open(*term); });
  };
  const Open here{s.t, first_names(reactions.rows())};
  if (running_.empty() && open(problem_.objective.running)) running_.push_back(here);
  if (open(problem_.objective.terminal)) terminal_.push_back(here);
}

void OpenCosts::tell() const {
  for (const auto* open : {&running_, &terminal_}) {
    if (open->empty()) continue;
    return notice(
        fmt::format("The cost holds reactions that the motion does not determine: from t = {:.6g} s on contacts hold a "
                    "body more often than it can move ({}). psi and its gradient are those of the choice that "
                    "formulation '{}' makes, whatever error stands beside them.",
                    open->front().t, open->front().rows, problem_.formulation));
  }
}

}  // namespace costate
