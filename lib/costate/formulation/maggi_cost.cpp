#include "costate/formulation/maggi_cost.h"

namespace costate {

void add_maggi_cost_gradient(MaggiLevel& level, const Objective& objective, bool terminal, ScalarGradient& g) {
  const bool accelerations =
      terminal ? objective.terminal_needs_accelerations() : objective.running_needs_accelerations();
  const bool shared = accelerations && level.shares();
  const StateView s = shared ? level.shared_state() : level.state();
  if (terminal)
    objective.add_terminal_gradient(s, level.assembly(), g);
  else
    objective.add_running_gradient(s, level.assembly(), g);
  if (shared) level.eliminate_shares(g);
}

}  // namespace costate
