#include "costate/kind/law/scaled_law.h"

#include "costate/base/error.h"
#include "costate/kind/law/law_table.h"

namespace costate {

double ScaledLaw::integral(double x, const double* p) const {
  const double scale = p[0] / p[1], all = scale * law_->integral(x, p + own());
  return about_ ? all + (1 - scale) * law_->value(p[2], p + own()) * x : all;
}

LawOptions scaled_law(double slope, double nominal_slope, const LawOptions& law, std::optional<double> reference) {
  if (!law) throw ModelError("", "A scaled law needs the law that it scales.");
  if (nominal_slope == 0)
    throw ModelError("", "'nominal_slope' must not be 0: the law is scaled by slope / nominal_slope.");
  LawOptions o(std::make_shared<ScaledLaw>(law.law, reference.has_value()),
               {{"slope", slope}, {"nominal_slope", nominal_slope}});
  if (reference) o.numbers.emplace_back("reference", *reference);
  for (const auto& [key, value] : law.numbers) o.numbers.emplace_back(key.empty() ? "law" : "law." + key, value);
  return o;
}

namespace {

const RegisterLawKind scaled_law_registered(
    {.name = "scaled",
     .summary = "another 'law' times slope / nominal_slope, about x = reference where that is given",
     .example = R"({ kind = "scaled", slope = 130, nominal_slope = 100, reference = 0.4, law = { kind = "polynomial",)"
                R"( coefficients = [-20, 100, 30, 80] } })",
     .read = [](SceneTable& t) {
       const double slope = t.value("slope"), nominal = t.value("nominal_slope");
       const std::optional<double> reference = t.find_value("reference");
       return scaled_law(slope, nominal, read_law(t, "law"), reference);
     }});

}  // namespace

}  // namespace costate
