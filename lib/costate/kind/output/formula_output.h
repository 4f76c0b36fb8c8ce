// [output.NAME]: an output of one's own, a formula of others.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "costate/kind/law/formula_keys.h"
#include "costate/mechanism/builder.h"

namespace costate {

struct FormulaOutputOptions {
  std::string formula;                                       // of t, the names below and the names of outputs
  std::string unit;                                          // of its value: "W"
  FormulaKeys keys;                                          // numbers, each can be a parameter, and laws
  std::vector<std::pair<std::string, std::string>> outputs;  // short names of outputs
};

/// An output `name`, for costs, files and events, as any other. That the outputs in it exist is known when it is made.
void add_formula_output(MechanismBuilder& builder, const std::string& name, const FormulaOutputOptions& options);

}  // namespace costate
