// The directions in which several contacts slide in space behind an impact, or from rest, while others stick, open or
// slide in a direction that is known (lib/README.md (19.9)): with the response W = J K^-1 J^T of the rows in play and
// rates b of them without impulses,
//   v = b + W p,   v_n as asked for or p_n given,   v_t as asked for where it sticks,   p_t = -mu p_n s where it
//   slides,
// such that s x v_t = 0 for each s that is unknown. What is said of impulses and velocities is as true of forces and
// accelerations.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace costate {

/// A contact of several: its gap among the rows of the response, and, with friction, one or two rows along the ground.
struct SlidingContact {
  enum class Way { open, sticks, slides };
  std::vector<int> rows = {};
  double friction = 0;
  Way way = Way::sticks;
  bool given = false;          // whether p_n = normal; if not the gap's rate changes by `normal`
  double normal = 0;           // where it strikes or is closed
  double along[2] = {};        // by how much rates along the ground change where it sticks
  bool unknown = false;        // whether it slides in a direction that is looked for
  Eigen::Vector2d slip{0, 0};  // if not that which it has; in the plane +-1 and 0
};

/// Directions of all contacts, zero where they do not slide.
using Slips = std::vector<Eigen::Vector2d>;

struct SlipsTogether {
  std::vector<Slips> found;
  /// From how many starts they were looked for; 0 where all that there are are found.
  int starts = 0;
};

/// Directions along which the unknown v_t point, be it forward or back. `guesses`: where to look as well.
SlipsTogether slips_together(const Eigen::MatrixXd& response, const Eigen::VectorXd& rates,
                             const std::vector<SlidingContact>& contacts, const std::vector<Slips>& guesses);

/// What the contacts do by Gauss and Seidel's iteration on projections, whatever their ways: near a solution as a rule,
/// and no proof of one. Returns the rates behind the impact.
Eigen::VectorXd rates_by_projection(const Eigen::MatrixXd& response, const Eigen::VectorXd& rates,
                                    const std::vector<SlidingContact>& contacts);

/// Whether these contacts have one solution, whatever the rates: a sufficient condition (lib/README.md (19.10)).
bool has_one_solution(const Eigen::MatrixXd& response, const std::vector<SlidingContact>& contacts);

}  // namespace costate
