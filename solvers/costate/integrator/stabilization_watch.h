// What Baumgarte's stabilization does to a motion where it is stiff. It answers an error of the constraints with the
// force that omega^2 Phi + 2 xi omega Phid takes: at omega = 1e5 rad/s an error of 1e-12 m with as much as 0.01 m/s^2,
// which reactions and accelerations then hold, and which moves velocities. The same state solved with Phidd = 0 alone
// (index 1) tells how much. Looks cost a solution each, and are taken only from omega = kStiff on.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate {

class StabilizationWatch {
 public:
  static constexpr double kStiff = 1e4;  // rad/s; the default is 10
  /// Null where there is nothing to look at: no such stabilization, a milder one, or rows that come and go.
  static std::unique_ptr<StabilizationWatch> of(const Problem& problem, const std::vector<double>& rho, System& system);

  /// At (t, y) in the system's terms, of a step or between steps.
  void look(double t, const double* y);
  /// A sentence, or empty.
  std::string warning() const;

 private:
  StabilizationWatch(const Problem& problem, const std::vector<double>& rho, System& system, double omega);

  System& system_;
  std::unique_ptr<OdeSystem> plain_;
  double rtol_, omega_;
  std::vector<char> metric_;  // of coordinates
  std::vector<double> y_, plain_force_, force_;
  // By unit, metric or not: the largest that forces and reactions are, and that reactions differ by.
  double size_[2] = {0, 0}, off_[2] = {0, 0}, off_at_[2] = {0, 0};
};

}  // namespace costate
