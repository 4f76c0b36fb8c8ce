#include "costate/scene/unit.h"

#include <cstdlib>
#include <map>
#include <sstream>

namespace costate {

namespace {

const UnitExponents* symbol_exponents(const std::string& symbol) {
  static const std::map<std::string, UnitExponents> known = {
      {"kg", {1, 0, 0, 0, 0}},   {"m", {0, 1, 0, 0, 0}},   {"s", {0, 0, 1, 0, 0}},  {"rad", {0, 0, 0, 1, 0}},
      {"K", {0, 0, 0, 0, 1}},    {"N", {1, 1, -2, 0, 0}},  {"J", {1, 2, -2, 0, 0}}, {"W", {1, 2, -3, 0, 0}},
      {"Pa", {1, -1, -2, 0, 0}}, {"Hz", {0, 0, -1, 0, 0}}, {"1", {0, 0, 0, 0, 0}}};
  const auto at = known.find(symbol);
  return at == known.end() ? nullptr : &at->second;
}

}  // namespace

std::optional<UnitExponents> unit_exponents(const std::string& unit) {
  UnitExponents sum{};
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
    const UnitExponents* of = symbol_exponents(word.substr(0, power));
    if (!of) return {};
    const int times = sign * (power == std::string::npos ? 1 : std::atoi(word.c_str() + power + 1));
    for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += times * (*of)[i];
  }
  return sum;
}

bool units_disagree(const std::string& a, const std::string& b) {
  for (const std::string* unit : {&a, &b})
    if (unit->empty() || *unit == "1") return false;
  auto x = unit_exponents(a), y = unit_exponents(b);
  if (!x || !y) return false;
  (*x)[3] = (*y)[3] = 0;
  return *x != *y;
}

}  // namespace costate
