// What a certificate weighs: the costs and constraints of every case with their gradients, the rows that must not be
// positive, and which of them psi is made of (of the worst of several targets: that one, the others as rows).
#pragma once

#include <Eigen/Core>
#include <string>
#include <utility>
#include <vector>

#include "costate/optimize/design.h"
#include "costate/optimize/optimizer.h"

namespace costate {

struct CertificateTerms {
  /// A cost or a constraint of a case, times its weight in psi, and its gradient in scaled parameters: here, at the
  /// first evaluation, and by the Hessian's run.
  struct Quantity {
    std::string what;
    std::size_t of;  // which case
    const Objective* objective;
    double weight, run, first;
    Eigen::VectorXd g_run, g_first;
    double hessian = 0;
    Eigen::VectorXd g_hessian = {};
    Eigen::MatrixXd second = {};
  };
  using Terms = std::vector<std::pair<std::size_t, double>>;  // quantities, with factors
  /// What must not be positive.
  struct Row {
    std::string name;
    double value, size;
    Eigen::VectorXd g;
    Terms terms;
    bool of_worst = false;  // a target against the worst one
  };

  std::vector<Quantity> quantities;
  Terms psi;
  std::vector<Row> rows;
  std::size_t worst = 0;  // of the targets
};

/// `first` is the evaluation an optimization began with, `best` the one that is judged; gradients are multiplied by
/// `scale`.
CertificateTerms certificate_terms(const Design& design, const OptimizerEvaluation& first,
                                   const OptimizerEvaluation& best, const Eigen::VectorXd& scale);

}  // namespace costate
