// Which altered terms explain the difference between a candidate's equations and the exact ones: single alterations
// first, then pairs and triples, then factors by least squares.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "costate/candidate/candidate_model.h"

namespace costate {

/// A term that differs, as it is reported.
struct CandidateFinding {
  std::string where, term, what;          // "the equation of mu_q'", "(Phi_q^T lambda)_q", "missing"
  std::string message;                    // the sentence
  std::vector<std::string> alternatives;  // other sentences that explain the difference equally well
};

/// What cannot be told on this scene.
struct CandidateBlindSpot {
  std::string where, term, why;
};

/// Values of a group of outputs that share inner solves, stacked over all samples: the candidate's and the model's.
struct CandidateComparison {
  std::vector<AdjointTerm::Section> sections;
  std::vector<std::string> where;                    // of each block of outputs
  std::vector<std::vector<std::string>> components;  // names of a block's entries, within one sample
  std::vector<Eigen::VectorXd> candidate;            // of each block, samples one after another
  std::vector<char> sign_free;                       // blocks that may be multiplied by -1 (algebraic equations)
  std::vector<double> sample_time;
  /// The model's outputs, block by block, with alterations.
  std::function<std::vector<Eigen::VectorXd>(const std::vector<Alteration>&)> model;
  double tolerance = 1e-9;
};

struct CandidateDiagnosis {
  std::vector<CandidateFinding> findings;
  std::vector<CandidateBlindSpot> blind;
  bool explained = true;  // all differences
};

CandidateDiagnosis diagnose(const AdjointModel& model, const CandidateComparison& comparison);

}  // namespace costate
