// Doubles in JSON without loss. JSON has no NaN and no infinities (nlohmann::json writes null for them), so
// record/ stores these three as the strings "nan", "inf" and "-inf"; finite doubles are written with the
// shortest digits that read back to the same bits.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

namespace costate {

/// A copy of `value` in which every non-finite number, at any depth, is one of "nan", "inf", "-inf".
[[nodiscard]] nlohmann::json with_nonfinite_as_text(const nlohmann::json& value);

/// The number stored in `value`: a JSON number, or one of the strings "nan", "inf", "-inf".
/// Throws Error for anything else.
[[nodiscard]] double number_from_json(const nlohmann::json& value);

/// The numbers of a JSON array (length n), read with number_from_json. Throws Error if it is not an array.
[[nodiscard]] std::vector<double> numbers_from_json(const nlohmann::json& value);

/// One line of JSON text with non-finite numbers as text. `what` names the value in the error thrown for
/// text that is not valid UTF-8.
[[nodiscard]] std::string json_to_line(const nlohmann::json& value, const std::string& what);

/// What a JSON library complains of, without its own codes: "syntax error while parsing value - ...".
[[nodiscard]] std::string json_reason(const std::exception& error);

}  // namespace costate
