#include "costate/objective/folded_angle.h"

#include <fmt/format.h>

#include <cmath>
#include <map>
#include <numbers>
#include <utility>

#include "costate/base/error.h"
#include "costate/base/run_epoch.h"
#include "costate/objective/formula_output.h"

namespace costate {

bool folds(const Output& output) {
  return output.unit() == "rad" && (output.name().ends_with(".yaw") || output.name().ends_with(".roll"));
}

void watch_fold(const Output& output, const Assembly& assembly, double t, double value) {
  struct Seen {
    double t, value;
    long epoch;
  };
  // A system has an assembly of its own, and its runs begin anew at an earlier time.
  constexpr std::size_t most = 256;
  thread_local std::map<std::pair<const Assembly*, const Output*>, Seen> seen;
  const auto key = std::pair(&assembly, &output);
  const auto at = seen.find(key);
  if (at != seen.end() && at->second.epoch == run_epoch() && at->second.t < t &&
      std::abs(value - at->second.value) > std::numbers::pi) {
    const Seen before = at->second;
    seen.erase(at);
    throw CapabilityError(fmt::format(
        "'{}' in the running cost passes half a turn at t = {:.6g} s, where it jumps from {:.4g} to {:.4g} rad: the "
        "integral "
        "would be that of a sawtooth whose jumps no gradient knows. Take an output that goes on (a rate such as "
        "omega_global_z, or the angle of a joint), or end the run before.",
        output.name(), t, before.value, value));
  }
  if (at == seen.end() && seen.size() >= most) seen.clear();
  seen[key] = {t, value, run_epoch()};
}

void watch_folds(const Output& output, const StateView& s, Assembly& assembly) {
  if (folds(output)) watch_fold(output, assembly, s.t, output.value(s, assembly));
  const auto* formula = dynamic_cast<const FormulaOutput*>(&output);
  if (!formula) return;
  for (std::size_t i = 0; i < formula->inputs().size(); ++i) {
    const Output& y = *formula->inputs()[i];
    if (folds(y)) {
      const double turn = 2 * std::numbers::pi, here = formula->value(s, assembly);
      if (std::abs(formula->shifted_value(s, assembly, i, turn) - here) <= 1e-9 * std::max(1.0, std::abs(here)))
        continue;
    }
    watch_folds(y, s, assembly);
  }
}

}  // namespace costate
