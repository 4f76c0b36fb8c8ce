#include "costate/scene/unit.h"

#include <cstdlib>
#include <map>
#include <numbers>
#include <sstream>

namespace costate {

namespace {

constexpr double kTurn = 2 * std::numbers::pi;

const UnitExponents* symbol_exponents(const std::string& symbol) {
  static const std::map<std::string, UnitExponents> known = {
      {"kg", {1, 0, 0, 0, 0}},   {"m", {0, 1, 0, 0, 0}},   {"s", {0, 0, 1, 0, 0}},  {"rad", {0, 0, 0, 1, 0}},
      {"K", {0, 0, 0, 0, 1}},    {"N", {1, 1, -2, 0, 0}},  {"J", {1, 2, -2, 0, 0}}, {"W", {1, 2, -3, 0, 0}},
      {"Pa", {1, -1, -2, 0, 0}}, {"Hz", {0, 0, -1, 0, 0}}, {"1", {0, 0, 0, 0, 0}}};
  const auto at = known.find(symbol);
  return at == known.end() ? nullptr : &at->second;
}

const std::map<std::string, InSi>& measured_units() {
  static const std::map<std::string, InSi> known = {{"", {1, ""}},
                                                    {"1", {1, "1"}},
                                                    {"-", {1, "1"}},
                                                    {"%", {0.01, "1"}},
                                                    {"s", {1, "s"}},
                                                    {"ms", {1e-3, "s"}},
                                                    {"us", {1e-6, "s"}},
                                                    {"min", {60, "s"}},
                                                    {"h", {3600, "s"}},
                                                    {"m", {1, "m"}},
                                                    {"mm", {1e-3, "m"}},
                                                    {"cm", {1e-2, "m"}},
                                                    {"um", {1e-6, "m"}},
                                                    {"km", {1e3, "m"}},
                                                    {"m/s", {1, "m/s"}},
                                                    {"mm/s", {1e-3, "m/s"}},
                                                    {"km/h", {1 / 3.6, "m/s"}},
                                                    {"m/s^2", {1, "m/s^2"}},
                                                    {"m/s2", {1, "m/s^2"}},
                                                    {"mm/s^2", {1e-3, "m/s^2"}},
                                                    {"rad", {1, "rad"}},
                                                    {"mrad", {1e-3, "rad"}},
                                                    {"deg", {kTurn / 360, "rad"}},
                                                    {"°", {kTurn / 360, "rad"}},
                                                    {"turn", {kTurn, "rad"}},
                                                    {"rad/s", {1, "rad/s"}},
                                                    {"deg/s", {kTurn / 360, "rad/s"}},
                                                    {"rpm", {kTurn / 60, "rad/s"}},
                                                    {"1/min", {kTurn / 60, "rad/s"}},
                                                    {"rad/s^2", {1, "rad/s^2"}},
                                                    {"rad/s2", {1, "rad/s^2"}},
                                                    {"deg/s^2", {kTurn / 360, "rad/s^2"}},
                                                    {"N", {1, "N"}},
                                                    {"mN", {1e-3, "N"}},
                                                    {"kN", {1e3, "N"}},
                                                    {"N m", {1, "N m"}},
                                                    {"Nm", {1, "N m"}},
                                                    {"N*m", {1, "N m"}},
                                                    {"kN m", {1e3, "N m"}},
                                                    {"kNm", {1e3, "N m"}},
                                                    {"N mm", {1e-3, "N m"}},
                                                    {"Nmm", {1e-3, "N m"}},
                                                    {"Pa", {1, "Pa"}},
                                                    {"kPa", {1e3, "Pa"}},
                                                    {"MPa", {1e6, "Pa"}},
                                                    {"bar", {1e5, "Pa"}},
                                                    {"mbar", {100, "Pa"}},
                                                    {"kg", {1, "kg"}},
                                                    {"g", {1e-3, "kg"}},
                                                    {"W", {1, "W"}},
                                                    {"kW", {1e3, "W"}},
                                                    {"J", {1, "J"}},
                                                    {"kJ", {1e3, "J"}},
                                                    {"Hz", {1, "Hz"}},
                                                    {"N/m", {1, "N/m"}},
                                                    {"N/mm", {1e3, "N/m"}},
                                                    {"N s/m", {1, "N s/m"}},
                                                    {"Ns/m", {1, "N s/m"}},
                                                    {"m^2", {1, "m^2"}},
                                                    {"m^3", {1, "m^3"}}};
  return known;
}

}  // namespace

const InSi* in_si(const std::string& unit) {
  const auto at = measured_units().find(unit);
  return at == measured_units().end() ? nullptr : &at->second;
}

std::vector<std::string> known_units() {
  std::vector<std::string> known;
  for (const auto& [unit, si] : measured_units())
    if (!unit.empty()) known.push_back(unit);
  return known;
}

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
