// One design over several runs (cases): parameters that all of them share by name, and what is made of their costs.
// With factor_i = weight_i / scale_i the cases of one target g make F_g = sum of factor_i psi_i, and psi of the design
// is
//   sum over g of (F_g - offset_g) / range_g   or   max over g of (F_g - offset_g) / range_g,
// under psi_i <= upper_i of cases with a bound of their own, which are of no target, and under the constraints of all.
// A single run is a design of one case without a name.
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate {

/// psi_c(rho) <= upper, where psi_c is a cost of its own.
struct OptimizerConstraint {
  std::string name;
  Objective objective;
  double upper = 0;
};

struct DesignCase {
  std::string name;  // in messages and summaries; empty: the only one
  Problem problem;
  std::string method;
  std::vector<OptimizerConstraint> constraints;
  double factor = 1;
  std::optional<double> upper;
  std::vector<std::size_t> places;  // of its parameters among the design's
  /// Throws where no such scene can be: a stiffness below zero, an inertia tensor of no body. Or empty.
  std::function<void(const std::vector<double>& own)> admit;
  /// Calls what it is given; errors come out with their place in the case's own file. Or empty.
  std::function<void(const std::function<void()>&)> located;

  /// "case.ride: ", before what an error says.
  std::string title() const { return name.empty() ? "" : "case." + name + ": "; }
  std::vector<double> own(const std::vector<double>& rho) const;
  /// A gradient by the case's parameters as one by the design's.
  std::vector<double> spread(const std::vector<double>& gradient, std::size_t parameters) const;
};

/// A bound on what an evaluation knows: psi of a case, or one of its constraints.
struct DesignBound {
  std::string name;  // "travel", of a case by name "ride.travel"; "ride" for the case's own psi
  double upper = 0;
  std::size_t of = 0;                               // which case
  const OptimizerConstraint* constraint = nullptr;  // or null: the case's psi
};

/// What cases are summed to: of a Pareto front one of its axes; usually each case is one of its own.
struct DesignTarget {
  std::string name;
  std::vector<std::size_t> cases;
  double offset = 0, range = 1;
};

struct Design {
  enum class Goal { sum, worst };

  ParameterSelection parameters;
  std::vector<DesignCase> cases;
  std::vector<DesignTarget> targets;
  Goal goal = Goal::sum;

  bool several() const { return cases.size() > 1 || !cases.front().name.empty(); }
  /// In the order of an evaluation's constraints.
  std::vector<DesignBound> bounds() const;
  /// Whether the worst of at least two is looked for.
  bool minimax() const { return goal == Goal::worst && targets.size() > 1; }
  /// (F_g - offset_g) / range_g of the cases' psi, and its gradient.
  double target(std::size_t g, const std::vector<double>& cases_psi) const;
  std::vector<double> target_gradient(std::size_t g, const std::vector<std::vector<double>>& case_gradients) const;
  /// psi of the design and its gradient; of the worst that of the target that is it, the first of equal ones.
  void combine(const std::vector<double>& cases_psi, const std::vector<std::vector<double>>& case_gradients,
               double& psi, std::vector<double>& gradient) const;
  /// What psi of case i counts by in its target: factor_i / range_g; 1 where it is of none.
  double weight(std::size_t i) const;
  /// The target that is the largest.
  std::size_t worst(const std::vector<double>& cases_psi) const;
  /// The tightest relative tolerance of any case.
  double rtol() const;
};

/// One run alone.
Design single_design(const Problem& problem, const std::string& method,
                     const std::vector<OptimizerConstraint>& constraints);

/// Where an optimizer starts and its bounds, in the parameters' scales. Throws ModelError where it would start outside.
void scaled_start(const ParameterSelection& parameters, std::vector<double>& x, std::vector<double>& lower,
                  std::vector<double>& upper);

}  // namespace costate
