#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/fit/fit.h"
#include "costate/integrator/run_watch.h"
#include "costate/integrator/sampled_run.h"
#include "costate/integrator/segmented_run.h"
#include "costate/integrator/simulate.h"
#include "costate/integrator/stiffness_watch.h"

namespace costate {

namespace {

template <class Run, class SystemType, class... More>
SampleResiduals residuals_on(SystemType& system, const Problem& problem, const std::vector<double>& rho,
                             bool derivatives, More... more) {
  const SampleTerm& samples = *sample_term(problem.objective);
  system.set_parameters(rho.data());
  Run session(system, problem.solver, problem.monitor, derivatives ? StartDerivative::columns : StartDerivative::none,
              more...);
  RunWatch watch(problem, rho, system);
  watch.begin(problem.solver.t_start, session.y());
  session.watch(watch.sink());
  if (derivatives) session.enable_sensitivities();
  SampleResiduals out;
  std::vector<double> values;
  std::vector<std::vector<double>> rows;
  for (std::size_t i = 0; i < samples.times().size(); ++i) {
    const double t = samples.times()[i];
    session.advance(t);
    for (std::size_t k = 0; k < samples.at(i).size(); ++k) {
      const OpenSample open(samples, i, static_cast<std::ptrdiff_t>(k));
      values.push_back(system.terminal_cost(t, session.y()));
      if (derivatives) rows.push_back(session.terminal_gradient());
      out.terms.push_back(samples.costs()[samples.at(i)[k].cost]->data().path);
      out.times.push_back(t);
    }
  }
  session.read_forward_counters();
  out.counters = session.counters();
  out.r = Eigen::Map<const Eigen::VectorXd>(values.data(), static_cast<Eigen::Index>(values.size()));
  if (derivatives) out.r_rho.resize(out.r.size(), static_cast<Eigen::Index>(rho.size()));
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (std::size_t j = 0; j < rho.size(); ++j)
      out.r_rho(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) = rows[i][j];
  if (!out.r.allFinite() || !out.r_rho.allFinite()) throw SolverError("A residual or its derivative is not finite.");
  return out;
}

}  // namespace

SampleResiduals sample_residuals(const Problem& problem, const std::vector<double>& rho, bool derivatives) {
  problem.check_values(rho);
  if (!has_samples(problem.objective))
    throw CapabilityError("There is nothing to fit: give the scene [[cost.samples]] with measured data.");
  const Problem p = with_separate_samples(problem);
  if (!p.objective.running.empty() || p.objective.terminal.size() > 1)
    throw CapabilityError(
        "Only sums of squares at samples ([[cost.samples]]) can be fitted; this cost has [[cost.running]] or "
        "[[cost.terminal]], too. Remove them (remove = [\"cost.running\"] in a scene that includes this one), or take "
        "costate optimize.");
  const std::string integrator = integrator_of(p);
  if (integrator == "fixed")
    throw CapabilityError("Fixed steps do not take samples; choose --integrator idas or cvodes.");
  if (integrator == "idas") return residuals_on<IdaRun>(*p.make_dae(), p, rho, derivatives);
  SampleResiduals found;
  with_bdf_where_stiff(p, [&](const Problem& on) {
    found = residuals_on<CvodeRun>(*on.make_ode(), on, rho, derivatives, CvodeSession::Cost::state);
    return 0;
  });
  return found;
}

}  // namespace costate
