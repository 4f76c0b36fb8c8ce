#include "units.h"

#include <fmt/format.h>

#include "costate/scene/unit.h"

namespace costate::app {

std::string base_unit_attributes(const std::string& unit) {
  const auto exponents = unit_exponents(unit);
  if (!exponents) return {};
  std::string attributes;
  for (std::size_t i = 0; i < kBaseUnits.size(); ++i)
    if ((*exponents)[i] != 0)
      attributes += fmt::format("{}{}=\"{}\"", attributes.empty() ? "" : " ", kBaseUnits[i], (*exponents)[i]);
  return attributes;
}

std::string unit_of_rate(const std::string& unit) {
  if (unit.empty() || unit == "1") return "1/s";
  const std::size_t slash = unit.find('/');
  if (slash == std::string::npos) return unit + "/s";
  const std::string over = unit.substr(0, slash + 1);
  std::string below = unit.substr(slash + 1);
  if (below == "s") return over + "s^2";
  if (below.front() == '(') below = below.substr(1, below.size() - 2);
  return over + "(" + below + " s)";
}

}  // namespace costate::app
