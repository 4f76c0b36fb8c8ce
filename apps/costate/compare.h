// costate compare: what a reduced model costs in accuracy, and what it saves.
#pragma once

#include "command.h"

namespace costate::app {

void add_compare(CLI::App& app, std::function<int()>& action, CommonOptions& common);

}  // namespace costate::app
