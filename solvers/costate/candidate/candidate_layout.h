// How a candidate's unknowns and equations correspond to those of the exact equations.
#pragma once

#include <memory>

#include "costate/candidate/candidate_model.h"
#include "costate/candidate/candidate_run.h"
#include "costate/candidate/candidate_search.h"

namespace costate {

class CandidateLayout {
 public:
  /// `why` says why there is no term-by-term comparison, if there is none.
  CandidateLayout() = default;
  static std::unique_ptr<CandidateLayout> make(const CandidateAdjoint& candidate, const AdjointBlocks& sizes,
                                               std::string& why);

  const AdjointModel& model() const { return *model_; }
  AdjointModel& model() { return *model_; }
  int size() const { return size_; }  // of the model's unknowns
  int candidate_size() const { return candidate_size_; }
  /// The candidate's unknowns out of the model's, and back (zero where the candidate has none).
  Eigen::VectorXd to_candidate(const Eigen::VectorXd& x) const;
  Eigen::VectorXd from_candidate(const Eigen::VectorXd& y) const;

  struct Block {
    std::string group, where;
    int first = 0, count = 0;
    bool differential = true, present = true;
  };
  const std::vector<Block>& blocks() const { return blocks_; }

  /// The candidate's equations at a point as the model writes them: derivatives of differential unknowns and algebraic
  /// expressions, for each column of x. Throws Error when they cannot be brought to that form.
  Eigen::MatrixXd flow(const CandidateAdjoint& candidate, const AdjointBlocks& b, const Eigen::MatrixXd& x) const;
  /// The order of algebraic equations that fits best; `flow` and `exact` as by flow() and by the model.
  void choose_order(const std::vector<Eigen::MatrixXd>& flow, const std::vector<Eigen::MatrixXd>& exact);
  /// Rows of flow() in the model's order.
  Eigen::MatrixXd ordered(const Eigen::MatrixXd& flow) const;

 private:
  std::unique_ptr<AdjointModel> model_;
  int size_ = 0, candidate_size_ = 0;
  std::vector<int> place_;  // of each of the model's unknowns among the candidate's, or -1
  std::vector<Block> blocks_;
  std::vector<int> order_;  // algebraic blocks in the order of the candidate's equations
};

}  // namespace costate
