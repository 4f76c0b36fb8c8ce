// Costs on reactions that the motion does not determine, of contacts that come and go: where several of them hold one
// body more often than it can move, who bears what is a formulation's choice (analysis/undetermined_reactions.h).
#pragma once

#include <string>
#include <vector>

#include "costate/assembly/assembly.h"
#include "costate/problem/problem.h"

namespace costate {

class OpenCosts {
 public:
  OpenCosts(const Problem& problem, const std::vector<double>& rho);
  /// Whether nothing can be open: no cost on reactions or accelerations, or no contact that closes.
  bool empty() const { return empty_; }
  /// A state of the motion, in order of time: looked at where contacts differ from those of the one before.
  void look(const MechanismState& s);
  /// A notice, if anything was.
  void tell() const;

 private:
  const Problem& problem_;
  Assembly assembly_;
  bool empty_;
  std::vector<char> there_;
  struct Open {
    double t;
    std::string rows;
  };
  std::vector<Open> running_, terminal_;  // the first of them; of the last state
};

}  // namespace costate
