// A search that wanders off and calls itself converged there has not converged at the best point that it met.
#include "costate/optimize/stop_reason.h"

#include <catch2/catch.hpp>

using namespace costate;

namespace {

std::vector<OptimizerEvaluation> evaluations_with(const std::vector<double>& psi) {
  std::vector<OptimizerEvaluation> list(psi.size());
  for (std::size_t i = 0; i < psi.size(); ++i) list[i].psi = psi[i];
  return list;
}

}  // namespace

TEST_CASE("stop reason: the end of a search is compared with its best point") {
  // Of SLSQP on a damped pendulum that was fitted to measurements: it jumped away from its start, and settled there.
  CHECK(ended_elsewhere(evaluations_with({247733.5, 1976130.8, 1307014.3, 1244017.0}), 0));
  CHECK_FALSE(ended_elsewhere(evaluations_with({247733.5, 1976130.8, 130.0, 130.0}), 2));
  // The last trial of a line search lies a little above.
  CHECK_FALSE(ended_elsewhere(evaluations_with({10, 2, 2.0001}), 1));
  // A perfect fit: psi is nothing beside what it has fallen by.
  CHECK_FALSE(ended_elsewhere(evaluations_with({10, 1e-20, 1e-18}), 1));
  CHECK(ended_elsewhere(evaluations_with({10, 1e-20, 1}), 1));
  CHECK(ended_elsewhere(evaluations_with({-1, -3, -2}), 1));
}
