// Which rows costate check has: formulations with gradient methods, and of discrete methods with schemes.
#pragma once

#include <string>
#include <vector>

#include "check_row.h"

namespace costate::app {

struct CheckOptions {
  std::vector<std::string> formulations, methods, integrators;
  bool all = false, no_motions = false;
  double patience = 20;
  int jobs = 0;
};

/// `redundant`: a sentence that names constraint rows that depend on others, or empty. Throws CapabilityError where
/// every row is refused.
std::vector<CheckRow> check_rows(const Problem& problem, const CheckOptions& options, const std::string& redundant);

}  // namespace costate::app
