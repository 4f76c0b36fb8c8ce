// What of a scene no cost and no output needs, and runs without it: psi, its gradient and residuals are those of the
// part that is left, which integrates faster.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "costate/command.h"

namespace costate::app {

/// The coordinates that what is asked for is of: the cost, the costs of [optimize.constraint], the output that ends the
/// run, and [run] outputs. Null: perhaps of all.
std::optional<std::vector<int>> wanted_coordinates(const Setup& setup);

/// Why nothing is left out, though something is not needed: a sentence, or empty.
std::string kept_because(const Setup& setup);

/// Builds the problem without the parts that wanted_coordinates() are not of, unless kept_because() tells. Parameters
/// stay: derivatives by those of such parts are zero.
void leave_out_rest(Setup& setup);

/// What the problem is built without.
struct LeftOut {
  std::vector<std::string> coordinates, elements;
};
LeftOut left_out(const Setup& setup);
/// "left_out" of a summary: coordinates and elements.
Json left_out_json(const LeftOut& rest);
/// A line, or empty where nothing is left out.
std::string left_out_text(const LeftOut& rest);
/// The first few of them.
std::string shortened(const std::vector<std::string>& names);

/// The problem with everything: for motions that are shown.
Problem whole_problem(const Setup& setup);

}  // namespace costate::app
