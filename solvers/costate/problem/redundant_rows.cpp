#include "costate/problem/redundant_rows.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <optional>

#include "costate/analysis/start.h"
#include "costate/analysis/undetermined_reactions.h"
#include "costate/base/notice.h"
#include "costate/level/acceleration_level.h"
#include "costate/objective/all_outputs.h"

namespace costate {

constexpr double kMostLooks = 1e7;

namespace {
std::string dependent_rows(const Problem& problem, const std::vector<double>& rho, bool contacts_give) {
  Assembly assembly(problem.mechanism, problem.parameters);
  assembly.set_parameters(rho.data());
  const double t = problem.solver.t_start;
  const Start start = find_start(assembly, t, false);
  const ConstraintRank rank = constraint_rank(assembly, t, start.q.data());
  if (contacts_give) {
    const AccelerationLevel level(assembly, Stabilization{});
    std::size_t give = 0;
    for (int i = 0; i < assembly.m(); ++i) give += assembly.is_there(i) && level.gives(i) ? 1 : 0;
    if (rank.dependent_rows.size() <= give) return {};
  }
  if (rank.dependent_rows.empty()) return {};
  const std::vector<std::string> rows = problem.mechanism->row_names();
  std::vector<std::string> names;
  for (const int i : rank.dependent_rows) names.push_back(rows[static_cast<std::size_t>(i)]);
  return fmt::format("{} of {} constraint rows depend on the others ({}).", names.size(), rows.size(),
                     fmt::join(names, ", "));
}
}  // namespace

std::string redundant_rows(const Problem& problem, const std::vector<double>& rho) {
  return dependent_rows(problem, rho, false);
}

std::string redundant_joints(const Problem& problem, const std::vector<double>& rho) {
  return dependent_rows(problem, rho, true);
}

OpenReactions::OpenReactions(const Problem& problem, const std::vector<double>& rho,
                             const std::vector<std::unique_ptr<Output>>& outputs, bool multipliers)
    : formulation_(problem.formulation),
      outputs_(outputs),
      multipliers_(multipliers),
      assembly_(problem.mechanism, problem.parameters) {
  assembly_.set_parameters(rho.data());
  follows_ = find_formulation(problem.formulation).carries_redundancy || assembly_.has_switched_rows();
  // Of very many not each is looked at.
  all_ = static_cast<double>(outputs.size()) * assembly_.n() > kMostLooks;
}

void OpenReactions::look(const StateView& s) {
  if (!follows_) return;
  assembly_.switch_rows(s.z);
  if (seen_.insert(rows_there(assembly_)).second)
    kept_.push_back({s.t, Eigen::Map<const Eigen::VectorXd>(s.q, assembly_.n()),
                     Eigen::Map<const Eigen::VectorXd>(s.z, assembly_.nz())});
  follows_ = assembly_.has_switched_rows();
}

void OpenReactions::judge(const Kept& s) {
  assembly_.switch_rows(s.z.data());
  UndeterminedReactions reactions(assembly_, s.t, s.q, s.z);
  if (reactions.none()) return;
  const auto add = [](std::vector<std::string>& to, const std::string& name) {
    if (std::find(to.begin(), to.end(), name) == to.end()) to.push_back(name);
  };
  const bool none_before = rows_.empty();
  const std::size_t open_before = open_.size();
  if (!all_)
    for (const auto& o : outputs_)
      if (reactions.leaves_open(*o)) add(open_, o->name());
  if (open_.size() == open_before && !multipliers_ && !all_) return;
  for (const std::string& row : reactions.rows()) add(rows_, row);
  if (none_before && &s != kept_.data()) since_ = s.t;
}

void OpenReactions::tell() {
  for (const Kept& s : kept_) judge(s);
  if (rows_.empty()) return;
  notice(fmt::format(
      "The motion does not determine the multipliers of rows that depend on each other ({}){}{}: given are "
      "those that formulation '{}' chooses. What parts would bear is decided by how they give.",
      first_names(rows_), open_.empty() ? std::string() : ", nor what is made of them, " + first_names(open_),
      since_ ? fmt::format(", from t = {:.4g} s on", *since_) : std::string(), formulation_));
}

std::vector<std::string> determined_outputs(const Problem& problem, const std::vector<double>& rho) {
  constexpr std::size_t kMost = 5000;
  std::vector<std::string> names;
  if (output_names(*problem.mechanism).size() > kMost) return names;
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
