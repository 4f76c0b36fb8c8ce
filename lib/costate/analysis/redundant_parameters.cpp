#include "costate/analysis/redundant_parameters.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>

#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/linear/to_dense.h"

namespace costate {

namespace {
// Of what a parameter changes the rows by: what redundant rows may leave of it, for start errors and rounding.
constexpr double kLeft = 1e-6;
// Beyond so many rows a dense factorization takes longer than a run.
constexpr int kMostRows = 1500;

/// Whether a parameter sets a number of a constraint: else there is nothing to solve a start for.
bool moves_constraints(const Assembly& assembly) {
  const auto& constraints = assembly.mechanism().constraints();
  return std::any_of(constraints.begin(), constraints.end(), [&](const auto& c) {
    return std::any_of(c->numbers().begin(), c->numbers().end(), [&](int number) {
      return !assembly.number_columns()[static_cast<std::size_t>(number)].empty();
    });
  });
}
}  // namespace

void require_compatible_parameters(Assembly& assembly, double t) {
  const Mechanism& m = assembly.mechanism();
  const int n = assembly.n(), rows = assembly.m();
  const bool counted = !m.starts_at_equilibrium();  // then as many positions are given as are free
  if (rows == 0 || rows > kMostRows || !moves_constraints(assembly)) return;
  if (counted && rows + static_cast<int>(m.given_positions().size()) <= n) return;
  const Start start = find_start(assembly, t, false);
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(n + rows);
  StateView s = start.state(t);
  s.a = rest.data();
  s.lambda = rest.data() + n;
  assembly.calc_dynamics(s);
  Assembly::ParameterColumns columns;
  assembly.calc_parameter_columns(s, columns);
  const Eigen::MatrixXd& change = columns.phi;
  if (change.isZero(0)) return;
  const Eigen::MatrixXd phi_q = to_dense(assembly.jacobian(), assembly.phi_q.data());
  const Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd> factors(phi_q);
  if (factors.rank() == rows) return;
  const Eigen::MatrixXd left = change - phi_q * factors.solve(change);
  for (int j = 0; j < assembly.np(); ++j) {
    Eigen::Index worst = 0;
    if (!(left.col(j).cwiseAbs().maxCoeff(&worst) > kLeft * change.col(j).cwiseAbs().maxCoeff())) continue;
    throw ModelError("parameter",
                     fmt::format("'{}' cannot vary alone: row '{}' and others are redundant, and hold together only at "
                                 "its present value. Let one parameter set all numbers that have to change together "
                                 "('numbers' in [parameter.NAME]), or take the redundant constraint out.",
                                 assembly.parameters().parameters[static_cast<std::size_t>(j)].name,
                                 m.row_names()[static_cast<std::size_t>(worst)]));
  }
}

}  // namespace costate
