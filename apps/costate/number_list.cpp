#include "number_list.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/base/text_file.h"

namespace costate::app {

std::vector<double> read_numbers(const std::string& option, const std::vector<std::string>& texts,
                                 const std::function<bool(double)>& accepts, const std::string& expected) {
  std::vector<double> numbers;
  for (const auto& text : texts) {
    double x = 0;
    if (!read_number(text, x) || !accepts(x))
      throw Error(fmt::format("{} must be {}, separated by commas; found '{}'.", option, expected, text));
    numbers.push_back(x);
  }
  return numbers;
}

}  // namespace costate::app
