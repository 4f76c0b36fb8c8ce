// Numbers of an option that takes several, separated by commas.
#pragma once

#include <functional>
#include <string>
#include <vector>

namespace costate::app {

/// Throws Error, naming the option, for what is no number or not as it must be ("positive numbers").
std::vector<double> read_numbers(const std::string& option, const std::vector<std::string>& texts,
                                 const std::function<bool(double)>& accepts, const std::string& expected);

}  // namespace costate::app
