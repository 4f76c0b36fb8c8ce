// Constraint rows that depend on each other at the start: which formulations can treat a problem depends on them, and
// what is known of its reactions.
#pragma once

#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate {

/// "2 of 9 constraint rows depend on the others (...)." at the start for rho, or empty. Throws as find_start does.
std::string redundant_rows(const Problem& problem, const std::vector<double>& rho);
/// The same, but empty where contacts that hold one body more often than it takes account for all of them: their rows
/// give, in formulations without weights, too (level/acceleration_level.h).
std::string redundant_joints(const Problem& problem, const std::vector<double>& rho);

/// What a run hands out of reactions that the motion does not determine, from the start or from where contacts close
/// that hold a body more often than it can move: of these outputs, and of all multipliers or none.
class OpenReactions {
 public:
  /// `outputs` has to live as long.
  OpenReactions(const Problem& problem, const std::vector<double>& rho,
                const std::vector<std::unique_ptr<Output>>& outputs, bool multipliers);
  /// A state that is handed out, in order of time: kept where contacts do what they have not done before.
  void look(const StateView& s);
  /// A notice, if anything is open.
  void tell();

 private:
  struct Kept {
    double t;
    Eigen::VectorXd q, z;
  };
  void judge(const Kept& s);
  const std::string formulation_;
  const std::vector<std::unique_ptr<Output>>& outputs_;
  bool multipliers_, follows_ = true, all_ = false;
  Assembly assembly_;
  std::set<std::vector<char>> seen_;
  std::vector<Kept> kept_;
  std::vector<std::string> rows_, open_;  // by name, each once
  std::optional<double> since_;           // where not from the first state on
};

/// Names of all outputs but those of reactions that the motion does not determine; of more than 5,000 none.
std::vector<std::string> determined_outputs(const Problem& problem, const std::vector<double>& rho);

}  // namespace costate
