#include "costate/record/json_number.h"

#include <fmt/format.h>

#include <cmath>
#include <limits>
#include <string>

#include "costate/base/error.h"

namespace costate {

nlohmann::json with_nonfinite_as_text(const nlohmann::json& value) {
  if (value.is_number_float()) {
    const double number = value.get<double>();
    if (std::isnan(number)) return "nan";
    if (std::isinf(number)) return number > 0 ? "inf" : "-inf";
    return value;
  }
  if (!value.is_structured()) return value;
  nlohmann::json copy = value;
  for (auto& element : copy) {
    if (element.is_structured() || element.is_number_float()) element = with_nonfinite_as_text(element);
  }
  return copy;
}

double number_from_json(const nlohmann::json& value) {
  if (value.is_number()) return value.get<double>();
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    if (text == "nan") return std::numeric_limits<double>::quiet_NaN();
    if (text == "inf") return std::numeric_limits<double>::infinity();
    if (text == "-inf") return -std::numeric_limits<double>::infinity();
  }
  const std::string text = value.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace);
  throw Error(fmt::format("expected a number (or \"nan\", \"inf\", \"-inf\") but found {}", text.substr(0, 80)));
}

std::vector<double> numbers_from_json(const nlohmann::json& value) {
  if (!value.is_array()) {
    throw Error(fmt::format("expected an array of numbers but found {}", value.type_name()));
  }
  std::vector<double> numbers;
  numbers.reserve(value.size());
  for (const auto& element : value) numbers.push_back(number_from_json(element));
  return numbers;
}

std::string json_to_line(const nlohmann::json& value, const std::string& what) {
  try {
    return with_nonfinite_as_text(value).dump();
  } catch (const nlohmann::json::exception& error) {
    throw Error(fmt::format("cannot store {} as JSON: {}; text must be valid UTF-8", what, error.what()));
  }
}

std::string json_reason(const std::exception& error) {
  std::string text = error.what();
  // "[json.exception.parse_error.101] parse error at line 1, column 3: syntax error while ..."
  if (text.rfind("[json.exception", 0) == 0) text.erase(0, text.find("] ") + 2);
  if (text.rfind("parse error", 0) == 0) {
    const std::size_t reason = text.find(": ");
    if (reason != std::string::npos) text.erase(0, reason + 2);
  }
  return text;
}

}  // namespace costate
