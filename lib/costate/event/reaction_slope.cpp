#include "costate/event/reaction_slope.h"

#include "costate/base/error.h"
#include "costate/level/acceleration_rates.h"
#include "costate/level/penalty_weight.h"

namespace costate {

ReactionSlope::ReactionSlope(const Assembly& assembly)
    : assembly_(assembly.mechanism_ptr(), assembly.parameters()),
      level_(std::make_unique<AccelerationLevel>(assembly_, Stabilization{})) {}

const double* ReactionSlope::solve(StateView s, const std::vector<double>& rho) {
  assembly_.set_parameters(rho.data());
  level_->forget_history();
  s.a = s.lambda = nullptr;
  try {
    level_->solve(s);
  } catch (const SolverError&) {
    // Constraints that depend on each other.
    level_ = std::make_unique<AccelerationLevel>(assembly_, augmented_stabilization(assembly_.mechanism_ptr()));
    level_->solve(s);
  }
  level_->linearize();
  return level_->lambda();
}

ReactionSlope::Slope ReactionSlope::slope(const Eigen::VectorXd& weights) {
  const int n = assembly_.n(), m = assembly_.m(), nz = assembly_.nz();
  Slope slope;
  Eigen::VectorXd y = Eigen::VectorXd::Zero(n + m);
  y.tail(m) = weights;
  level_->solve_kkt_transposed(y.data());
  slope.x = Eigen::VectorXd::Zero(2 * n + nz);
  slope.rho = Eigen::VectorXd::Zero(assembly_.np());
  const std::vector<double> none(static_cast<std::size_t>(nz), 0.0);
  level_->add_transposed(-1, y.data(), y.data() + n, none.data(), slope.x.data(), slope.x.data() + n,
                         slope.x.data() + 2 * n);
  assembly_.add_parameter_gradient(
      level_->state(), level_->stabilization().weights(y.data(), y.data() + n, none.data()), -1, slope.rho.data());
  const Eigen::VectorXd rates = acceleration_rates(assembly_, *level_).tail(m);
  slope.rate = weights.dot(rates);
  slope.terms = weights.cwiseAbs().dot(rates.cwiseAbs());
  return slope;
}

}  // namespace costate
