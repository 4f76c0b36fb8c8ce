#include "costate/integrator/stabilization_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/formulation/solved_state.h"

namespace costate {

namespace {
constexpr const char* kOmegaKey = "baumgarte_omega_rad_per_s";
// In tolerances, of the largest force: a third of what psi and outputs are held to (tradeoff/motion_confirmation.h).
constexpr double kPushed = 3e3;
}  // namespace

std::unique_ptr<StabilizationWatch> StabilizationWatch::of(const Problem& problem, const std::vector<double>& rho,
                                                           System& system) {
  const Formulation& f = find_formulation(problem.formulation);
  const bool stabilized =
      std::any_of(f.options.begin(), f.options.end(), [](const FormulationOption& o) { return o.key == kOmegaKey; });
  if (!stabilized || !f.exact_constraints() || system.has_events() || system.assembly().m() == 0) return nullptr;
  const double omega = problem.formulation_options.number(kOmegaKey);
  if (!(omega >= kStiff)) return nullptr;
  return std::unique_ptr<StabilizationWatch>(new StabilizationWatch(problem, rho, system, omega));
}

StabilizationWatch::StabilizationWatch(const Problem& problem, const std::vector<double>& rho, System& system,
                                       double omega)
    : system_(system), rtol_(problem.solver.rtol), omega_(omega) {
  Problem plain = problem;
  plain.formulation_options.set(kOmegaKey, 1e-30);  // Phi_ddot = 0, to all digits
  plain_ = plain.make_ode();
  plain_->set_parameters(rho.data());
  for (const Coordinate& c : problem.mechanism->coordinates()) metric_.push_back(c.unit == "m");
}

void StabilizationWatch::look(double t, const double* y) {
  const Assembly& assembly = system_.assembly();
  const auto n = static_cast<std::size_t>(assembly.n());
  const auto reactions = [&](const Assembly& a, const double* lambda, std::vector<double>& out) {
    out.assign(n, 0.0);
    add_transposed_product(a.jacobian(), a.phi_q.data(), 1, lambda, out.data());
  };
  const MechanismState s = solved_state(system_, t, y);
  reactions(assembly, s.lambda, force_);
  y_.assign(s.q, s.q + n);
  y_.insert(y_.end(), s.v, s.v + n);
  y_.insert(y_.end(), s.z, s.z + assembly.nz());
  const MechanismState p = plain_->mechanism_state(t, y_.data());
  const Assembly& of_plain = plain_->assembly();
  reactions(of_plain, p.lambda, plain_force_);
  for (std::size_t i = 0; i < n; ++i) {
    const int k = metric_[i] ? 1 : 0;
    size_[k] = std::max({size_[k], std::abs(plain_force_[i]), std::abs(of_plain.Q[i])});
    const double off = std::abs(force_[i] - plain_force_[i]);
    if (off > off_[k]) off_[k] = off, off_at_[k] = t;
  }
}

std::string StabilizationWatch::warning() const {
  double most = 0, at = 0;
  for (const int k : {0, 1})
    if (const double part = size_[k] > 0 ? off_[k] / size_[k] : 0; part > most) most = part, at = off_at_[k];
  if (most <= kPushed * rtol_) return {};
  return fmt::format(
      "Baumgarte's stabilization is stiff (omega {:g} rad/s): at t = {:.6g} s it answers errors of the constraints "
      "with {:.1e} of the largest force, where rtol is {:g}. Reactions and accelerations hold that, and velocities "
      "follow it. Take a smaller omega ({} = 10), or maggi or index2, which need none.",
      omega_, at, most, rtol_, kOmegaKey);
}

}  // namespace costate
