// The exact adjoint, tight, that a candidate is set beside.
#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/candidate/candidate_check.h"
#include "costate/integrator/run_end.h"
#include "costate/level/fixed_times.h"
#include "costate/sensitivity/method.h"

namespace costate {

CandidateReference candidate_reference(const Problem& problem, const std::string& formulation,
                                       const std::vector<double>& rho) {
  find_formulation(formulation);
  candidate_stabilization(formulation, problem.mechanism, problem.formulation_options);
  Problem p = problem;
  p.formulation = formulation;
  p.solver.integrator.clear();
  std::string method;
  using Needs = SensitivityMethod::Needs;
  for (const Needs form : {Needs::dae, Needs::ode, Needs::hand_adjoint}) {
    const SensitivityMethod* m = first_method([&](const auto& x) {
      return x.adjoint && x.needs == form && refusal(x, find_formulation(formulation)).empty();
    });
    if (method.empty() && m) method = m->name;
  }
  if (method.empty())
    throw CapabilityError(fmt::format("Formulation '{}' has no adjoint to compare a candidate with.", formulation));
  MotionEvents::refuse(*p.mechanism, "adjoints of users are");
  refuse_free_end(p, "adjoints of users are");
  std::vector<double> numbers = p.mechanism->base_numbers();
  p.parameters.apply(rho.data(), numbers);
  for (const double t : driver_kinks(*p.mechanism, numbers))
    if (p.solver.t_start < t && t <= p.solver.t_end)
      throw CapabilityError(
          fmt::format("A driver's law has a kink at t = {:.6g} s, where the velocities jump; adjoints of users "
                      "are not carried across. Take a law with a continuous slope.",
                      t));
  const auto attempt = [&](double rtol) {
    Problem tight = p;
    tight.solver.set_rtol(rtol);
    return CandidateReference{tight, rho, record_motion(tight, rho), method, gradient(tight, method, rho).gradient};
  };
  const double tight = std::min(problem.solver.rtol, 1e-9);
  try {
    return attempt(tight);
  } catch (const SolverError&) {
    if (tight == problem.solver.rtol) throw;
    return attempt(problem.solver.rtol);
  }
}

}  // namespace costate
