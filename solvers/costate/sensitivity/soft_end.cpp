#include "costate/sensitivity/soft_end.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/unsaid.h"
#include "costate/formulation/formulation.h"
#include "costate/integrator/run_end.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/known_error.h"
#include "costate/problem/scaled_gradient.h"
#include "costate/sensitivity/error_estimate.h"

namespace costate {

namespace {

// Of the run: an end that moves by more is said.
constexpr double kSaid = 1e-5;

/// By the first formulation with exact constraints that gets there: those that carry redundant rows are the last ones.
std::optional<Simulation> exact_run(const Problem& problem, const std::vector<double>& rho) {
  const Unsaid another;
  Problem exact = problem;
  exact.solver.confirm = false;
  exact.solver.integrator.clear();
  exact.solver.step_s = 0;
  for (const bool redundant : {false, true})
    for (const Formulation* f : stand_ins(redundant)) {
      if (!f->exact_constraints() || f->carries_redundancy != redundant) continue;
      exact.formulation = f->name;
      try {
        return simulate(exact, rho);
      } catch (const NoEndError&) {
        throw;
      } catch (const SolverError&) {
      } catch (const CapabilityError&) {
        // Another one may.
      }
    }
  return std::nullopt;
}

/// Of the run, what its end moves by; 1 where nothing tells.
double moved_end(const Problem& problem, const std::vector<double>& rho, Simulation& result) {
  if (!problem.ends_when || !has_soft_constraints(problem.formulation)) return 0;
  const double start = problem.solver.t_start, from = result.end ? result.end->t : problem.solver.t_end;
  std::optional<Simulation> exact;
  try {
    exact = exact_run(problem, rho);
  } catch (const NoEndError& e) {
    throw NoEndError(
        fmt::format("{} So it is with exact constraints; the end at t = {:.9g} s is one that those of '{}' "
                    "make by what they give.",
                    e.what(), from, problem.formulation));
  }
  if (!exact) {
    widen_error(result, result.psi);
    notice(
        "The run ends by an event, and no formulation with exact constraints gets there: it may be one of what soft "
        "constraints give, and when it comes is not known.");
    return 1;
  }
  widen_error(result, result.psi - exact->psi);
  const double to = exact->end->t, span = problem.solver.t_end - start;
  if (std::abs(to - from) > kSaid * span)
    notice(fmt::format(
        "With exact constraints the run ends at {:.6g} s, and not at {:.6g} s: those of '{}' are soft. Take a "
        "formulation with exact ones (augmented-lagrangian carries redundant ones, too).",
        to, from, problem.formulation));
  return std::min(1.0, std::abs(to - from) / (std::min(to, from) - start));
}

}  // namespace

void watch_soft_end(const Problem& problem, const std::vector<double>& rho, GradientResult& result) {
  const double moved = moved_end(problem, rho, result);
  if (moved == 0) return;
  const double psi = result.known_error->psi, size = gradient_size(problem.parameters, result.psi, result.gradient);
  widen_error(result, problem.parameters, psi, moved * size);
}

}  // namespace costate
