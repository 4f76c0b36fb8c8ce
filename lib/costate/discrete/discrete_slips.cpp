// Contacts that slide or roll in space within a discrete step, where its numbers are brought back.
#include "costate/assembly/rolling_rows.h"
#include "costate/discrete/discrete_scheme.h"

namespace costate {

const StepSlips& DiscreteScheme::slips_here() {
  StepSlips& slips = stage_rows_.slips();
  if (!slips.possible()) return slips;
  slips.release();
  assembly_.switch_rows(r_.z);
  if (*r_.h > 0)
    slips.linearize(assembly_, stage(), &c_);
  else
    slips.linearize(assembly_, state(), nullptr);
  return slips;
}

const std::vector<double>* DiscreteScheme::rolling_rates(const StateView& s) {
  rolling_ = rolling_twist(assembly_, s);
  return rolling_.empty() ? nullptr : &rolling_;
}

int DiscreteScheme::factor_projection() { return matrices_.factor_projection(assembly_, stage_rows_); }

}  // namespace costate
