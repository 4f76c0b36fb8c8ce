// Laws of formulas and of other laws, as options of a kind: { kind = "formula", ... }, "sum", "product",
// "chirp".
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "costate/kind/law/law_options.h"

namespace costate {

/// "a*sin(w*t)" of the variable t (or x) and the named numbers; see FormulaLaw.
LawOptions formula_law(const std::string& formula, const std::vector<std::pair<std::string, double>>& numbers);
LawOptions sum_law(const std::vector<LawOptions>& terms);
LawOptions product_law(const std::vector<LawOptions>& factors);
/// A sine whose angular frequency goes from `first` at x = from to `last` at x = to, and on.
LawOptions chirp_law(double mean, double amplitude, double from, double to, double first_rad_per_s,
                     double last_rad_per_s, double phase_rad);

}  // namespace costate
