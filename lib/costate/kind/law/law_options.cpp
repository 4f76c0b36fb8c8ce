#include "costate/kind/law/law_options.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/element/law/spline_law.h"
#include "costate/kind/law/measured_columns.h"
#include "costate/scene/key_reference.h"

namespace costate {

LawOptions::LawOptions(double constant) : law(std::make_shared<PolynomialLaw>(1)), numbers{{"", constant}} {}

LawOptions polynomial_law(const std::vector<double>& coefficients) {
  if (coefficients.empty()) throw ModelError("", "A polynomial needs at least one coefficient.");
  LawOptions o;
  o.law = std::make_shared<PolynomialLaw>(static_cast<int>(coefficients.size()));
  for (std::size_t i = 0; i < coefficients.size(); ++i)
    o.numbers.emplace_back(fmt::format("coefficients[{}]", i), coefficients[i]);
  return o;
}

LawOptions sine_law(double mean, double amplitude, double angular_frequency_rad_per_s, double phase_rad) {
  return {std::make_shared<SineLaw>(),
          {{"mean", mean},
           {"amplitude", amplitude},
           {"angular_frequency_rad_per_s", angular_frequency_rad_per_s},
           {"phase_rad", phase_rad}}};
}

LawOptions smooth_step_law(double from, double to, double before, double after) {
  if (!(to > from)) throw ModelError("", fmt::format("'to' must be greater than 'from', found {} after {}.", to, from));
  return {std::make_shared<SmoothStepLaw>(), {{"from", from}, {"to", to}, {"before", before}, {"after", after}}};
}

LawOptions table_law(std::vector<double> x, const std::vector<double>& y) {
  if (x.size() != y.size())
    throw ModelError("", fmt::format("'x' and 'y' must have the same length, found {} and {}.", x.size(), y.size()));
  LawOptions o;
  o.law = std::make_shared<SplineLaw>(std::move(x));
  for (std::size_t i = 0; i < y.size(); ++i) o.numbers.emplace_back(fmt::format("y[{}]", i), y[i]);
  return o;
}

RegisteredLaw add_law(MechanismBuilder& builder, const std::string& path, const LawOptions& options) {
  // Where the key says in what: "x_N".
  require_units(path, options, unit_of_key(path.substr(path.rfind('.') + 1)));
  RegisteredLaw r{options.law, {}};
  for (const auto& [key, value] : options.numbers)
    r.numbers.push_back(builder.add_number(key.empty() ? path : path + "." + key, value));
  return r;
}

}  // namespace costate
