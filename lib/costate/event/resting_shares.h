// Who bears how much, where contacts that stick hold a body more often than it takes: with forces f that balance the
// load, and Z all changes of them that move nothing (lib/README.md (19.14)),
//   h = max over xi of the least mu_c N_c - |T_c| of f + Z xi,   N_c of one without friction,
// is above zero as long as any shares within all cones of friction hold what rests. What is known of one share, such as
// that of least norm, is a bound from below.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <vector>

namespace costate {

/// A contact's rows among the forces: its normal force, and with friction one or two along the ground.
struct RestingCone {
  int first = 0, count = 1;
  double friction = 0;
};

struct RestingShares {
  double margin = 0;         // h, in the unit of the forces
  Eigen::VectorXd forces;    // the shares
  Eigen::VectorXd weights;   // dh/df: orthogonal to Z, as other shares hold no more
  Eigen::VectorXd at_limit;  // of each contact: its part in that, all together 1; 0 of what is within its cone
};

/// The margin of one contact with these forces.
double margin_of(const RestingCone& cone, const Eigen::VectorXd& forces);

/// The best shares, to 1e-11 of the largest force. Nothing where contacts may press against each other without a limit,
/// as in a groove or between two walls: then whatever they are pressed by is not determined.
std::optional<RestingShares> best_shares(const std::vector<RestingCone>& cones, const Eigen::VectorXd& forces,
                                         const Eigen::MatrixXd& moves_nothing);

}  // namespace costate
