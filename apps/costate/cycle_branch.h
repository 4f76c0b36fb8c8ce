// costate cycle --continue NAME=FROM..TO: the branch of cycles along a parameter (cycle/branch.h).
#pragma once

#include <string>

#include "command.h"

namespace costate::app {

struct ContinueRequest {
  std::string parameter;
  double from = 0, to = 0;
};

/// "slope=0.001..0.02". Throws Error saying what was expected.
ContinueRequest continue_request(const std::string& text);

int run_branch(const CommonOptions& common, const ContinueRequest& request, int max_points);

}  // namespace costate::app
