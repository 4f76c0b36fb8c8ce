#include "stress_variants.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>
#include <sstream>

#include "costate/scene/key_reference.h"

namespace costate::app {

namespace {

/// "inertia_kg_m2" of "body.crank.inertia_kg_m2", "x_m" of "law.x_m[3]".
std::string key_of(const std::string& path) {
  std::string key = path.substr(path.rfind('.') + 1);
  return key.substr(0, key.find('['));
}

bool begins(const std::string& text, const char* with) { return text.rfind(with, 0) == 0; }

/// Numbers without a unit in their name that are of no dimension, or of none that matters to the motion.
bool dimensionless(const std::string& path, const std::string& key) {
  return begins(path, "cost.") || begins(path, "optimize.") || (key.size() == 2 && key[0] == 'e') ||
         (key.size() >= 6 && begins(key, "e") && key.find("_dot_per_s") == 2);
}

}  // namespace

std::optional<int> length_power(const std::string& unit) {
  static const std::map<std::string, int> powers = {{"m", 1}, {"N", 1},   {"J", 2},   {"W", 2},  {"Pa", -1}, {"kg", 0},
                                                    {"s", 0}, {"rad", 0}, {"deg", 0}, {"Hz", 0}, {"1", 0},   {"", 0}};
  int sum = 0;
  bool below = false;
  std::string token;
  for (const char c : unit + ' ') {
    if (c != ' ' && c != '/' && c != '(' && c != ')' && c != '*') {
      token += c;
      continue;
    }
    const std::size_t hat = token.find('^');
    std::string name = token.substr(0, hat);
    double power = 1;
    if (hat != std::string::npos) {
      std::istringstream(token.substr(hat + 1)) >> power;
    } else if (name.size() > 1 && (name.back() == '2' || name.back() == '3')) {
      power = name.back() - '0';
      name.pop_back();
    }
    const auto known = powers.find(name);
    if (known == powers.end() || power != std::floor(power)) return std::nullopt;
    sum += (below ? -1 : 1) * static_cast<int>(power) * known->second;
    token.clear();
    if (c == '/') below = true;
  }
  return sum;
}

RescaledScene rescaled(const Scene& scene, double factor) {
  RescaledScene r;
  std::string text = scene.dump();
  for (const std::string& prose : {scene.title, scene.description})
    if (const auto at = prose.empty() ? std::string::npos : text.find(prose); at != std::string::npos)
      text.erase(at, prose.size());
  for (const char* word : {"file", "\"formula\"", "tyre", "road", "_law", "ends_when", "contact"})
    if (text.find(word) != std::string::npos) {
      r.why_not = fmt::format(
          "the scene has '{}', whose numbers do not all name their unit; it cannot be rewritten in other ones", word);
      return r;
    }
  for (const Number& n : scene.mechanism()->numbers()) {
    const std::string key = key_of(n.path), unit = unit_of_key(key);
    if (n.value == 0 || dimensionless(n.path, key)) continue;
    const auto power = unit.empty() ? std::nullopt : length_power(unit);
    if (!power) {
      r.why_not = fmt::format("the number {} names no unit", n.path);
      return r;
    }
    if (*power != 0) r.overrides.push_back(fmt::format("{}={}", n.path, n.value * std::pow(factor, *power)));
  }
  // Bounds go with the numbers that they are of.
  for (const Parameter& p : scene.mechanism()->parameters()) {
    const auto& number = scene.mechanism()->numbers()[static_cast<std::size_t>(p.bindings.front().first)];
    const int power = length_power(unit_of_key(key_of(number.path))).value_or(0);
    for (const auto& [key, bound] : {std::pair("lower", p.lower), std::pair("upper", p.upper)})
      if (power != 0 && std::isfinite(bound))
        r.overrides.push_back(fmt::format("parameter.{}.{}={}", p.name, key, bound * std::pow(factor, power)));
  }
  return r;
}

std::vector<std::string> faster(const Scene& scene, double factor) {
  const Mechanism& m = *scene.mechanism();
  std::vector<std::string> overrides;
  std::set<std::string> done;
  for (const auto& given : m.given_velocities()) {
    const Number& n = m.numbers()[static_cast<std::size_t>(given.number)];
    if (n.value != 0 && done.insert(n.path).second) overrides.push_back(fmt::format("{}={}", n.path, n.value * factor));
  }
  return overrides;
}

namespace {

template <class Of, class To>
std::vector<std::string> changed(const Scene& scene, const Of& of, const To& to) {
  std::vector<std::string> overrides;
  for (const Number& n : scene.mechanism()->numbers())
    if (n.value != 0 && !begins(n.path, "cost.") && of(n.path, key_of(n.path)))
      overrides.push_back(fmt::format("{}={}", n.path, to(n.value)));
  return overrides;
}

}  // namespace

std::vector<std::string> stiffer(const Scene& scene, double factor, bool contacts) {
  return changed(
      scene,
      [&](const std::string& path, const std::string& key) {
        return begins(key, "stiffness") && begins(path, "contact") == contacts;
      },
      [&](double x) { return factor * x; });
}

std::vector<std::string> heavier(const Scene& scene, double factor) {
  std::string owner;
  for (const Number& n : scene.mechanism()->numbers())
    if (n.value != 0 && key_of(n.path) == "mass_kg") owner = n.path.substr(0, n.path.rfind('.') + 1);
  if (owner.empty()) return {};
  return changed(
      scene,
      [&](const std::string& path, const std::string& key) {
        return begins(path, owner.c_str()) && (key == "mass_kg" || begins(key, "inertia"));
      },
      [&](double x) { return factor * x; });
}

std::vector<std::string> spinning(const Scene& scene, double rate) {
  const auto angular = [](const std::string& key) {
    return key.find("angular_velocity") != std::string::npos || key == "spin_rad_per_s" || begins(key, "omega_");
  };
  return changed(
      scene, [&](const std::string&, const std::string& key) { return angular(key); },
      [&](double x) { return std::copysign(rate, x); });
}

}  // namespace costate::app
