#include "costate/objective/cycle_output.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/mechanism/builder.h"

namespace costate {

namespace {

/// One number, that of a cycle.
class CycleOutput final : public Output {
 public:
  CycleOutput(const std::string& name, std::string unit, int number) : Output(name, std::move(unit)), number_(number) {}
  double value(const StateView&, Assembly& assembly) const override {
    const double x = assembly.numbers()[static_cast<std::size_t>(number_)];
    return x == 0 && std::signbit(x) ? std::numeric_limits<double>::quiet_NaN() : x;
  }
  void add_gradient(const StateView&, Assembly& assembly, double factor, ScalarGradient& g) const override {
    if (!assembly.number_columns()[static_cast<std::size_t>(number_)].empty()) g.add_number(assembly, number_, factor);
  }
  double change(const StateView&, Assembly&, const Variation& d) const override { return d.numbers[number_]; }
  void add_gradient_change(const StateView&, Assembly&, const Variation&, double, ScalarGradient&) const override {}

 private:
  int number_;
};

}  // namespace

const std::vector<std::string>& cycle_value_names() {
  static const std::vector<std::string> names = {"cycle.period", "cycle.travel", "cycle.speed", "cycle.multiplier"};
  return names;
}

void add_cycle_values(MechanismBuilder& builder) {
  for (const auto& name : cycle_value_names())
    builder.fix_number(builder.add_number(name, kUnknownCycleValue), "it is what the cycle comes out with.");
}

std::vector<int> cycle_value_numbers(const Mechanism& mechanism) {
  std::vector<int> r;
  const auto& numbers = mechanism.numbers();
  for (const auto& name : cycle_value_names()) {
    const auto at = std::find_if(numbers.begin(), numbers.end(), [&](const Number& n) { return n.path == name; });
    if (at == numbers.end()) return {};
    r.push_back(static_cast<int>(at - numbers.begin()));
  }
  return r;
}

std::unique_ptr<Output> make_cycle_output(const Mechanism& mechanism, const std::string& name) {
  static const std::vector<std::string> units = {"s", "m", "m/s", "1"};
  const auto& names = cycle_value_names();
  const auto at = std::find(names.begin(), names.end(), name);
  if (at == names.end()) return {};
  const std::vector<int> numbers = cycle_value_numbers(mechanism);
  if (numbers.empty()) return {};
  const auto i = static_cast<std::size_t>(at - names.begin());
  return std::make_unique<CycleOutput>(name, units[i], numbers[i]);
}

}  // namespace costate
