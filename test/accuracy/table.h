// What the records of many variants amount to.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace costate::accuracy {

struct Verdict {
  std::string text;  // two tables: by request and by family
  long judged = 0, within = 0;
  double worst = 0;  // true error / request, of all that were called met
};
Verdict tabulate(const std::vector<nlohmann::json>& records);

}  // namespace costate::accuracy
