// What a motion leaves open of its reactions. Where rows of Phi_q depend on each other, a door on two hinges, any
// lambda + N c, Phi_q^T N = 0, moves the mechanism alike: how hinges share a load is decided by what gives in the
// parts, of which a mechanism of rigid ones says nothing. What a solution makes of it is a choice (of least norm, or by
// weights); a scalar of the multipliers is determined where N^T y_lambda = 0, as the sum of both hinges' forces.
#pragma once

#include <Eigen/Dense>
#include <string>
#include <vector>

#include "costate/objective/objective.h"

namespace costate {

class UndeterminedReactions {
 public:
  /// At (t, q, z) of a state, with the numbers that the assembly holds.
  UndeterminedReactions(Assembly& assembly, double t, const Eigen::VectorXd& q, const Eigen::VectorXd& z);
  bool none() const { return N_.cols() == 0; }
  /// Names of the rows whose multiplier is open.
  std::vector<std::string> rows() const;
  /// Whether values of an output or a cost's term are.
  bool leaves_open(const Output& output);
  bool leaves_open(const CostTerm& term);

 private:
  template <class Add>
  bool leaves_open_of(const Add& add);
  Assembly& assembly_;
  double t_;
  Eigen::VectorXd q_, z_;
  Eigen::MatrixXd N_;  // m x rows too many, for multipliers of rows of length 1
  Eigen::VectorXd row_size_;
};

/// By rows, 1 where one is there (assembly/assembly.h), else 0: by which what is open may be another.
std::vector<char> rows_there(const Assembly& assembly);

/// The names, or the first of many: "a, b, c and 7 more".
std::string first_names(const std::vector<std::string>& names);

}  // namespace costate
