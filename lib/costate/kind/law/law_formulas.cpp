#include "costate/kind/law/law_formulas.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/element/law/composed_law.h"
#include "costate/element/law/formula_law.h"
#include "costate/kind/law/law_table.h"

namespace costate {

namespace {
LawOptions composed(ComposedLaw::Operation operation, const std::string& key, const std::vector<LawOptions>& parts) {
  if (parts.empty()) throw ModelError("", fmt::format("'{}' must hold at least one law.", key));
  LawOptions o;
  std::vector<std::shared_ptr<const ScalarLaw>> laws;
  for (std::size_t i = 0; i < parts.size(); ++i) {
    laws.push_back(parts[i].law);
    for (const auto& [k, value] : parts[i].numbers)
      o.numbers.emplace_back(fmt::format("{}[{}]{}{}", key, i, k.empty() ? "" : ".", k), value);
  }
  o.law = std::make_shared<ComposedLaw>(operation, std::move(laws));
  return o;
}
}  // namespace

LawOptions formula_law(const std::string& formula, const std::vector<std::pair<std::string, double>>& numbers) {
  std::vector<std::string> names;
  for (const auto& [name, value] : numbers) names.push_back(name);
  return {std::make_shared<FormulaLaw>(formula, std::move(names)), numbers};
}

LawOptions sum_law(const std::vector<LawOptions>& terms) {
  return composed(ComposedLaw::Operation::sum, "terms", terms);
}

LawOptions product_law(const std::vector<LawOptions>& factors) {
  return composed(ComposedLaw::Operation::product, "factors", factors);
}

LawOptions chirp_law(double mean, double amplitude, double from, double to, double first_rad_per_s,
                     double last_rad_per_s, double phase_rad) {
  if (!(to > from)) throw ModelError("", fmt::format("'to' must be greater than 'from', found {} after {}.", to, from));
  return {std::make_shared<ChirpLaw>(),
          {{"mean", mean},
           {"amplitude", amplitude},
           {"from", from},
           {"to", to},
           {"first_angular_frequency_rad_per_s", first_rad_per_s},
           {"last_angular_frequency_rad_per_s", last_rad_per_s},
           {"phase_rad", phase_rad}}};
}

namespace {

const RegisterLawKind formula(
    {.name = "formula",
     .summary = "'formula' of t (or x) and of the other keys of the law, all numbers",
     .example = R"({ kind = "formula", formula = "a*sin(w*t) + b*t^2", a = 0.3, w = 2.0, b = 0.1 })",
     .read = [](SceneTable& t) {
       const std::string text = t.text("formula");
       std::vector<std::pair<std::string, double>> numbers;
       for (const auto& key : t.keys())
         if (key != "kind" && key != "formula") numbers.emplace_back(key, t.value(key));
       return formula_law(text, numbers);
     }});

const RegisterLawKind sum(
    {.name = "sum",
     .summary = "the sum of the laws in 'terms'",
     .example =
         R"({ kind = "sum", terms = [{ kind = "sine", amplitude = 0.2, angular_frequency_rad_per_s = 3 }, { kind = "polynomial", coefficients = [0.1, 0.4] }] })",
     .read = [](SceneTable& t) { return sum_law(read_laws(t, "terms")); }});

const RegisterLawKind product(
    {.name = "product",
     .summary = "the product of the laws in 'factors'",
     .example =
         R"({ kind = "product", factors = [{ kind = "sine", amplitude = 0.2, angular_frequency_rad_per_s = 3 }, { kind = "polynomial", coefficients = [0.1, 0.4] }] })",
     .read = [](SceneTable& t) { return product_law(read_laws(t, "factors")); }});

const RegisterLawKind chirp(
    {.name = "chirp",
     .summary = "mean + amplitude sin(...) with an angular frequency linear in x, through those at 'from' and 'to'",
     .example =
         R"({ kind = "chirp", amplitude = 0.2, to = 2.0, first_angular_frequency_rad_per_s = 1.0, last_angular_frequency_rad_per_s = 6.0 })",
     .read = [](SceneTable& t) {
       const double mean = t.value("mean", NumberRule::any, 0), amplitude = t.value("amplitude");
       const double from = t.value("from", NumberRule::any, 0), to = t.value("to");
       const double first = t.value("first_angular_frequency_rad_per_s"),
                    last = t.value("last_angular_frequency_rad_per_s");
       return chirp_law(mean, amplitude, from, to, first, last, t.value("phase_rad", NumberRule::any, 0));
     }});

}  // namespace

}  // namespace costate
