// Integrates adjoints written against candidate/candidate.h backward along a stored motion: Radau IIA of three
// stages, the system's matrices found by probing (it is linear in mu).
#pragma once

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "costate/candidate/candidate.h"
#include "costate/candidate/candidate_blocks.h"

namespace costate {

/// Where a candidate's code is at the moment; kept in memory that a crash leaves readable.
using CandidateStage = std::function<void(const std::string&)>;

/// "mu_q.P2.x", ...: by group and coordinate, force state or constraint row; "mu_y.0", ... by degree of
/// freedom.
std::vector<std::string> unknown_names(const CandidateAdjoint& candidate, const Mechanism& mechanism, int freedoms);

/// The candidate's equations at one point: E mu' + A mu + b = 0. Throws Error for a wrong size, for entries
/// that are not finite and for what is not linear.
struct CandidateMatrices {
  Eigen::MatrixXd E, A;
  Eigen::VectorXd b;
};
CandidateMatrices candidate_matrices(const CandidateAdjoint& candidate, const AdjointBlocks& blocks, int size);

/// One of the candidate's functions, complaining about a wrong size and about entries that are not finite.
Eigen::VectorXd checked(Eigen::VectorXd x, int size, const char* function, double t);

/// Blocks by time and choice of independent coordinates, evaluated once.
class BlockCache {
 public:
  BlockCache(CandidateBlocks& source, CandidateBlocks::Motion motion) : source_(source), motion_(std::move(motion)) {}
  const AdjointBlocks& at(double t) { return at(t, source_.chart(t)); }
  const AdjointBlocks& at(double t, int chart);
  /// The choice on the way from one grid point to the next.
  int chart(double from, double to) const { return source_.chart(0.5 * (from + to)); }
  void clear() { known_.clear(); }

 private:
  CandidateBlocks& source_;
  CandidateBlocks::Motion motion_;
  std::map<std::pair<double, int>, AdjointBlocks> known_;
};

struct CandidateRun {
  Eigen::VectorXd gradient;
  std::vector<Eigen::VectorXd> mu;  // at the grid's times, in their order
};

struct CandidateStart {
  Eigen::MatrixXd Sq0, Sv0, Sz0;
};

/// `at_end` are the blocks at T with their rates. Where the choice of independent coordinates changes, the
/// grid has a point, and the unknowns are transformed (lib/README.md (5.12)).
CandidateRun integrate_candidate(const CandidateAdjoint& candidate, BlockCache& blocks, const AdjointBlocks& at_end,
                                 const CandidateStart& start, const std::vector<double>& grid,
                                 const CandidateStage& stage);

}  // namespace costate
