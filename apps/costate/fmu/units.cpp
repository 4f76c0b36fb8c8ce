#include "units.h"

#include <fmt/format.h>

#include <array>
#include <cstdlib>
#include <map>
#include <sstream>
#include <string_view>

namespace costate::app {

namespace {

constexpr std::array<const char*, 5> kBase = {"kg", "m", "s", "rad", "K"};
using Exponents = std::array<int, kBase.size()>;

const Exponents* exponents_of(const std::string& symbol) {
  static const std::map<std::string, Exponents> known = {
      {"kg", {1, 0, 0, 0, 0}},   {"m", {0, 1, 0, 0, 0}},   {"s", {0, 0, 1, 0, 0}},  {"rad", {0, 0, 0, 1, 0}},
      {"K", {0, 0, 0, 0, 1}},    {"N", {1, 1, -2, 0, 0}},  {"J", {1, 2, -2, 0, 0}}, {"W", {1, 2, -3, 0, 0}},
      {"Pa", {1, -1, -2, 0, 0}}, {"Hz", {0, 0, -1, 0, 0}}, {"1", {0, 0, 0, 0, 0}}};
  const auto at = known.find(symbol);
  return at == known.end() ? nullptr : &at->second;
}

}  // namespace

std::string base_unit_attributes(const std::string& unit) {
  Exponents sum{};
  std::string text;
  for (const char c : unit) {  // words, a slash among them
    if (c == '(' || c == ')') continue;
    text += c == '/' ? " / " : std::string(1, c);
  }
  std::istringstream words(text);
  int sign = 1;
  for (std::string word; words >> word;) {
    if (word == "/") {
      sign = -1;
      continue;
    }
    const std::size_t power = word.find('^');
    const Exponents* of = exponents_of(word.substr(0, power));
    if (!of) return {};
    const int times = sign * (power == std::string::npos ? 1 : std::atoi(word.c_str() + power + 1));
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += times * (*of)[i];
  }
  std::string attributes;
  for (std::size_t i = 0; i < sum.size(); ++i)
    if (sum[i] != 0) attributes += fmt::format("{}{}=\"{}\"", attributes.empty() ? "" : " ", kBase[i], sum[i]);
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
