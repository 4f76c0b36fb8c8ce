// Laws as options of a kind: the function with its numbers, not yet part of a mechanism. add_law registers
// the numbers under the option's path, so that each of them can be a parameter.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "costate/element/law/scalar_law.h"
#include "costate/mechanism/builder.h"

namespace costate {

struct LawOptions {
  std::shared_ptr<const ScalarLaw> law;  // null: no law
  /// Key below the option's path ("amplitude", "coefficients[2]"; empty for the path itself) and value.
  std::vector<std::pair<std::string, double>> numbers;

  LawOptions() = default;
  /// A constant; its number is the option itself.
  LawOptions(double constant);  // NOLINT: implicit by design, `options.x_N = 3`
  LawOptions(std::shared_ptr<const ScalarLaw> l, std::vector<std::pair<std::string, double>> n)
      : law(std::move(l)), numbers(std::move(n)) {}
  explicit operator bool() const { return law != nullptr; }
};

/// c0 + c1 x + c2 x^2 + ...
LawOptions polynomial_law(const std::vector<double>& coefficients);
/// mean + amplitude sin(angular_frequency x + phase)
LawOptions sine_law(double mean, double amplitude, double angular_frequency_rad_per_s, double phase_rad);
/// From `before` up to x = from, to `after` beyond x = to, by a quintic between.
LawOptions smooth_step_law(double from, double to, double before, double after);
/// The natural cubic spline through the points, continued by its end tangents.
LawOptions table_law(std::vector<double> x, const std::vector<double>& y);

/// A law whose numbers are part of a mechanism.
struct RegisteredLaw {
  std::shared_ptr<const ScalarLaw> law;
  std::vector<int> numbers;
};
RegisteredLaw add_law(MechanismBuilder& builder, const std::string& path, const LawOptions& options);

}  // namespace costate
