#include "costate/assembly/reaction_rates.h"

#include "costate/assembly/slip_directions.h"

namespace costate {

bool calc_reaction_rates(Assembly& assembly, const StateView& s, std::vector<double>& phid_q,
                         std::vector<double>& phidd_q) {
  phid_q = assembly.phid_q;
  phidd_q = assembly.phidd_q;
  if (assembly.sliding_rows().empty()) return false;
  std::vector<char> along(static_cast<std::size_t>(assembly.m()), 0);
  for (const Assembly::SlidingRow& r : assembly.sliding_rows()) along[static_cast<std::size_t>(r.along)] = 1;
  const Mechanism& mech = assembly.mechanism();
  std::vector<double> z(s.z, s.z + assembly.nz());
  for (const auto& c : mech.constraints())
    if (const int state = sliding_state(mech, *c); state >= 0) z[static_cast<std::size_t>(state)] = 0;
  StateView sticks = s;
  sticks.z = z.data();
  assembly.calc_partials(sticks);
  for (std::size_t k = 0; k < phid_q.size(); ++k) {
    if (!along[static_cast<std::size_t>(assembly.jacobian().row[k])]) continue;
    phid_q[k] = assembly.phid_q[k];
    phidd_q[k] = assembly.phidd_q[k];
  }
  return true;
}

}  // namespace costate
