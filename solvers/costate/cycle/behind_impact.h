// What a state is behind the impact that ends a cycle, as outputs of the state before it: v + u of (19.1), with the
// exact derivatives (19.2), and the modes of contacts. Impulses are balanced with exact constraints, whatever the
// formulation.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "costate/event/named_event.h"
#include "costate/mechanism/mechanism.h"
#include "costate/objective/output.h"

namespace costate {

/// Sum of factor q_i v_j behind the impact; q = -1: of factor v_j.
std::unique_ptr<Output> make_rate_behind(const NamedEvent& impact, std::string name, std::string unit,
                                         std::vector<GivenStart::Term> terms);
/// State i of all force states behind the impact.
std::unique_ptr<Output> make_mode_behind(const NamedEvent& impact, std::string name, std::string unit, int i);

}  // namespace costate
