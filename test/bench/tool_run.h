// What a run of the tool costs as a process: processor time and memory as the system counts them.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace costate::bench {

struct ToolRun {
  double user_s = 0, system_s = 0;
  double peak_MiB = 0;  // of memory in use at a time
  std::string out;      // what it printed
};

/// Runs `costate ARGUMENTS` in `directory` to its end. Throws Error, with what it said, where it fails.
ToolRun run_tool(const std::vector<std::string>& arguments, const std::string& directory);

}  // namespace costate::bench
