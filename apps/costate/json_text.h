// The tool's JSON: objects with their keys in order, and their text.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <unordered_map>
#include <vector>

namespace costate::app {

using Json = nlohmann::ordered_json;

/// JSON as text; what is no valid UTF-8 (a file name may be) is replaced, numbers that are not finite become null, -0
/// becomes 0.
std::string json_text(const Json& json);
/// An object of many keys, in the order in which they come: Json's own assignment looks through all that are there.
class KeyedObject {
 public:
  bool has(const std::string& key) const { return places_.count(key) > 0; }
  void set(const std::string& key, Json value);
  /// The object; nothing stays.
  Json take();

 private:
  Json object_ = Json::object();
  std::unordered_map<std::string, std::size_t> places_;
};

/// x to three digits, as people write a tolerance, or a measured time of which more mean nothing.
double rounded(double x);

Json named(const std::vector<std::string>& names, const std::vector<double>& values);

}  // namespace costate::app
