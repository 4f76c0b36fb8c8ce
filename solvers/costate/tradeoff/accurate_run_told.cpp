// What an accurate run says of itself, and of what no tolerance makes smaller.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/integrator/run_watch.h"
#include "costate/problem/known_error.h"
#include "costate/tradeoff/accurate_run.h"

namespace costate {

void AccurateRun::widen(double times) {
  for (double* error : {&psi_error, &outputs_error, &relative, &besides_error}) *error *= times;
  for (double& error : gradient_error) error *= times;
  if (times_error) *times_error *= times;
}

void AccurateRun::add_what_stays(double accuracy) {
  const double unseen = cost_unseen(result.events), stays = what_stays(result),
               part = std::max(stays, unseen / std::max(std::abs(result.psi), unseen));
  psi_error += unseen + stays * std::abs(result.psi);
  for (std::size_t j = 0; j < gradient_error.size(); ++j)
    gradient_error[j] +=
        gradient_unseen(result.events) / problem.parameters.parameters[j].scale + stays * std::abs(result.gradient[j]);
  if (!(part > relative)) return;
  relative = part;
  worst = "psi";
  met = relative <= accuracy;
}

std::optional<double> times_apart(const std::vector<double>& a, const std::vector<double>& b) {
  if (a.size() != b.size()) return {};
  double most = 0;
  for (std::size_t i = 0; i < a.size(); ++i) most = std::max(most, std::abs(a[i] - b[i]));
  return most;
}

std::string text_of(const AccurateRun& run) {
  const SolverOptions& o = run.problem.solver;
  return fmt::format("{}, rtol {:.1e}{}; errors by a run at rtol {:.1e}", run.what.name(), o.rtol,
                     o.atol > 0 ? fmt::format(", atol {:.1e}", o.atol) : "", run.looser);
}

}  // namespace costate
