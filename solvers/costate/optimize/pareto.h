// The Pareto front of a design with several targets: designs at which no target becomes less without another becoming
// more. With the ideal I_g (each target alone at its least) and the nadir N_g (the largest that it is at the others'
// minima), f_g = (F_g - I_g) / (N_g - I_g), and points b of the simplex sum of b_g = 1, b >= 0, evenly spaced,
//   (21.1)  least t   such that   f_g(rho) - b_g <= t for all g
// finds where the ray b + t (1, ..., 1) meets the front (Pascoletti and Serafini's scalarization), on its parts that no
// weighted sum finds, too; every Pareto optimum solves it for its own b. For two targets this is the epsilon-constraint
// method with points that are even along the front's chord. Each search begins at the nearest point found before.
// At its solution the multipliers of the rows are the front's normal (21.2): sum of mu_g dF_g / (N_g - I_g) = 0.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "costate/optimize/optimizer.h"

namespace costate {

struct ParetoPoint {
  std::vector<double> simplex;  // b; of an end where it lies among these
  std::vector<double> rho;
  std::vector<double> targets;  // F_g
  std::vector<double> cases;    // psi of each
  int least_of = -1;            // an end: the target that is the least alone; else -1
  bool converged = false;
  bool dominated = false;  // another point is no worse in any target and better in one
  bool repeated = false;   // the same as one before it
  std::string stop_reason;
  double violation = 0;  // of the constraints, where they are not kept
  double excess = 0;     // likewise, in parts of their sizes (optimize/bound_size.h)
  int evaluations = 0;

  bool end() const { return least_of >= 0; }
  bool feasible() const { return excess <= kExceeded; }
  bool on_front() const { return converged && feasible() && !dominated && !repeated; }
  static constexpr double kExceeded = 1e-6;
};

struct ParetoFront {
  std::vector<double> ideal, nadir;
  std::vector<ParetoPoint> points;  // ends first, then along the front; not ordered by a target
  ParetoPoint start;                // where all began
  std::vector<std::string> notes;
};

struct ParetoOptions {
  OptimizerOptions search;
  int points = 11;  // along an edge of the simplex, ends included; at least 2
};

/// One search of the front: its number from 0 and the evaluation. Evaluations of an earlier run for it come back by
/// `replay`, as optimize() has them.
using ParetoSink = std::function<void(int search, const OptimizerEvaluation&)>;
using ParetoReplay = std::function<std::vector<OptimizerEvaluation>(int search)>;

/// `found` sees the front so far whenever a point is added. Throws CapabilityError for fewer than two targets, and what
/// ends the first search; of a later one the point says that it failed.
ParetoFront trace_front(const Design& design, const ParetoOptions& options, const ParetoReplay& replay,
                        const ParetoSink& record, const std::function<void(const ParetoFront&)>& found);

/// The points of the simplex with `along` steps on each edge, in an order in which neighbours follow each other; ends
/// (one entry 1) are left out.
std::vector<std::vector<double>> simplex_points(std::size_t targets, int along);

/// Marks points that another one dominates by more than `tolerance` of the range of each target.
void mark_dominated(ParetoFront& front, double tolerance);

}  // namespace costate
