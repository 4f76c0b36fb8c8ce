// Where the search for a cycle begins: the scene's own start, followed to where it meets the section for the first
// time.
#pragma once

#include <Eigen/Core>
#include <memory>

#include "costate/cycle/section.h"

namespace costate {

class ReturnMap;

class CycleStart {
 public:
  CycleStart(const Problem& problem, const CycleSettings& settings, const std::vector<double>& rho);

  const Section& section() const { return *section_; }
  const Eigen::VectorXd& x() const { return x_; }
  const std::vector<double>& positions() const { return positions_; }

 private:
  std::unique_ptr<const Section> section_;
  Eigen::VectorXd x_;
  std::vector<double> positions_;
};

/// Follows the motion from x over so many rounds, to where it has settled. Throws SolverError where a later round
/// cannot begin as the first one does.
void settle(const ReturnMap& map, int rounds, Eigen::VectorXd& x, std::vector<double>& positions);

}  // namespace costate
