#include "costate/tradeoff/trade_table.h"

#include <fmt/format.h>

#include "costate/integrator/integrators.h"
#include "costate/sensitivity/method.h"

namespace costate {

const char* name_of(TradeMeasure measure) {
  switch (measure) {
    case TradeMeasure::psi:
      return "psi";
    case TradeMeasure::outputs:
      return "outputs";
    case TradeMeasure::gradient:
      break;
  }
  return "gradient";
}

const char* name_of(TradeStatus status) {
  switch (status) {
    case TradeStatus::ok:
      return "ok";
    case TradeStatus::failed:
      return "failed";
    case TradeStatus::cut:
      return "cut";
    case TradeStatus::left_out:
      break;
  }
  return "left out";
}

std::string Combination::name() const {
  if (method.empty()) return fmt::format("{} on {}", formulation, integrator);
  // The others' integrators are in their names, and fixed steps say what they are.
  const bool scheme = find_sensitivity_method(method).needs == SensitivityMethod::Needs::discrete &&
                      !integrator.empty() && !has_fixed_steps(integrator);
  return fmt::format("{} by {}{}", formulation, method, scheme ? " on " + integrator : "");
}

std::string TradeRow::setting() const {
  return step_s > 0 ? fmt::format("steps of {:.3g} s", step_s) : fmt::format("rtol {:g}", rtol);
}

long callbacks(const Counters& c) {
  return c.residuals + c.jacobians + c.sensitivity_residuals + c.backward_residuals + c.backward_jacobians;
}

}  // namespace costate
