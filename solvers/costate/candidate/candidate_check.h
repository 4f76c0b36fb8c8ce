// Sets a candidate adjoint (candidate/candidate.h) beside the exact one: its gradient, its multipliers along the
// trajectory, and term by term.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "costate/candidate/candidate_run.h"
#include "costate/candidate/candidate_search.h"
#include "costate/sensitivity/hand_run.h"

namespace costate {

/// The motion and the gradient of an independent method, found before any of the candidate's code runs.
struct CandidateReference {
  Problem problem;  // of the candidate's formulation, tolerances tightened
  std::vector<double> rho;
  ForwardMotion motion;
  std::string method;  // "idas-adjoint", ...
  std::vector<double> gradient;
};
CandidateReference candidate_reference(const Problem& problem, const std::string& formulation,
                                       const std::vector<double>& rho);

struct CandidateReport {
  std::string formulation, method;  // of the reference
  std::vector<double> gradient, reference;
  double error = 0;      // largest scaled difference of the gradients, relative
  double own_error = 0;  // the same of the exact equations on the candidate's grid
  bool agrees = false;   // gradient and terms
  struct Disagreement {
    double t = 0;
    std::string component;
    double expected = 0, found = 0;
  };
  std::optional<Disagreement> first;  // backward from the end
  std::vector<CandidateFinding> findings;
  std::vector<CandidateBlindSpot> blind;
  std::vector<std::string> notes;
  std::string failure;  // what the candidate did wrong, or empty
};

/// Runs the candidate in this process; see candidate_process.h for the way to run foreign code. `terms_only` leaves out
/// the integration, and with it gradient and multipliers along the trajectory.
CandidateReport check_candidate(
    const CandidateAdjoint& candidate, const CandidateReference& reference,
    const CandidateStage& stage = [](const std::string&) {}, bool terms_only = false);

}  // namespace costate
