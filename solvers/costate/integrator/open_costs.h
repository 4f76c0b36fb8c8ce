// Costs on reactions that the motion does not determine: where rows depend on each other, as those of several contacts
// that hold one body more often than it can move, who bears what is a formulation's choice
// (analysis/undetermined_reactions.h).
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/problem/problem.h"

namespace costate {

class UndeterminedReactions;

class OpenCosts {
 public:
  OpenCosts(const Problem& problem, const std::vector<double>& rho);
  /// Whether a motion has to be looked at: costs on reactions or accelerations, and contacts that close.
  bool follows() const { return on_reactions_ && assembly_.has_switched_rows(); }
  /// A state of the motion, in order of time: judged where contacts differ from those of the one before.
  void look(const MechanismState& s);
  /// A notice, if anything was open; `redundant`: whether rows that are there from the start on depend on each other.
  void tell(bool redundant) const;
  /// Of a gradient: throws CapabilityError where a formulation's choice moves with the parameters by what its
  /// derivatives do not hold. The turns of an augmented Lagrangian choose multipliers in the range of Phi_q, which
  /// turns with the positions; those of Phi_q's pseudo-inverse are differentiated with it, and a weight's are a law.
  void refuse_gradient(bool redundant) const;

 private:
  /// The rows that are there from the start on, `redundant`, and leave a cost open; empty where none do.
  std::string open_rows(bool redundant) const;

  bool leaves_open(UndeterminedReactions& reactions, const std::vector<std::shared_ptr<const CostTerm>>& terms) const;

  const Problem& problem_;
  std::vector<double> rho_;
  Assembly assembly_;
  bool on_reactions_;
  std::vector<char> there_;
  struct Open {
    double t;
    std::string rows;
  };
  std::optional<Open> running_, terminal_;  // the first of them; of the last state
};

}  // namespace costate
