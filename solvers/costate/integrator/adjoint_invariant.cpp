#include "costate/integrator/adjoint_invariant.h"

namespace costate {

bool AdjointInvariant::autonomous(System& system, double t_start, double t, const double* y) {
  for (const auto& c : system.assembly().mechanism().constraints())
    if (c->rheonomic()) return false;
  Assembly assembly(system.assembly().mechanism_ptr(), system.parameters());
  assembly.set_parameters(system.assembly().rho().data());
  StateView s = system.mechanism_state(t, y);
  struct Terms {
    std::vector<double> M, Q, bias, zdot;
    double g;
    bool operator==(const Terms&) const = default;
  };
  const auto at = [&](double time) {
    s.t = time;
    assembly.calc_dynamics(s);
    return Terms{assembly.M, assembly.Q, assembly.bias, assembly.zdot,
                 system.has_running_cost() ? system.objective().running_value(s, assembly) : 0};
  };
  const Terms here = at(t);
  constexpr int kTimes = 16;
  for (int k = 0; k < kTimes; ++k)
    if (!(at(t_start + (t - t_start) * (k + 0.37) / kTimes) == here)) return false;
  return true;
}

}  // namespace costate
