// Bars as SVG, for numbers that are to be compared with each other.
#pragma once

#include <string>
#include <utility>
#include <vector>

namespace costate::app {

/// To the right and left of a common zero, each with its name and value.
std::string bars(const std::string& title, const std::vector<std::pair<std::string, double>>& values);

}  // namespace costate::app
