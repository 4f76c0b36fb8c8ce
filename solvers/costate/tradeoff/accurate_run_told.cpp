// What an accurate run says of itself.
#include <fmt/format.h>

#include "costate/tradeoff/accurate_run.h"

namespace costate {

void AccurateRun::widen(double times) {
  for (double* error : {&psi_error, &outputs_error, &relative, &besides_error}) *error *= times;
  for (double& error : gradient_error) error *= times;
}

std::string text_of(const AccurateRun& run) {
  const SolverOptions& o = run.problem.solver;
  return fmt::format("{}, rtol {:.1e}{}; errors by a run at rtol {:.1e}", run.what.name(), o.rtol,
                     o.atol > 0 ? fmt::format(", atol {:.1e}", o.atol) : "", run.looser);
}

}  // namespace costate
