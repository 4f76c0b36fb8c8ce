#include "costate/element/kind/smooth_steps_law.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/scene/law_table.h"

namespace costate {

SmoothStepsLaw::SmoothStepsLaw(std::vector<double> x) : x_(std::move(x)) {
  if (x_.size() < 2) throw ModelError("", fmt::format("'x' needs at least 2 entries, found {}.", x_.size()));
  for (std::size_t i = 1; i < x_.size(); ++i)
    if (!(x_[i] > x_[i - 1]))
      throw ModelError("", fmt::format("'x' must increase strictly, found {} after {}.", x_[i], x_[i - 1]));
}

double SmoothStepsLaw::primitive(double x, const double* p) const {
  if (x <= x_.front()) return p[0] * (x - x_.front());
  double sum = 0;
  for (std::size_t k = 0; k + 1 < x_.size() && x_[k] < x; ++k) {
    const double h = x_[k + 1] - x_[k], s = std::min(1.0, (x - x_[k]) / h), s4 = s * s * s * s;
    sum += h * (p[k] * s + (p[k + 1] - p[k]) * s4 * (2.5 - 3 * s + s * s));
  }
  return sum + p[x_.size() - 1] * std::max(0.0, x - x_.back());
}

LawOptions smooth_steps_law(std::vector<double> x, const std::vector<double>& y) {
  if (x.size() != y.size())
    throw ModelError("", fmt::format("'x' and 'y' must be of one length, found {} and {}.", x.size(), y.size()));
  LawOptions o;
  o.law = std::make_shared<SmoothStepsLaw>(std::move(x));
  for (std::size_t i = 0; i < y.size(); ++i) o.numbers.emplace_back(fmt::format("y[{}]", i), y[i]);
  return o;
}

namespace {

const RegisterLawKind registered({.name = "smooth_steps",
                                  .summary = "levels y at x, a quintic between neighbours, level at both ends",
                                  .example = R"({ kind = "smooth_steps", x = [-1, 0.2, 1, 2], y = [0, 3.5, 3.5, -1] })",
                                  .read = [](SceneTable& t) {
                                    const auto x = t.values("x");
                                    return smooth_steps_law(x, t.values("y"));
                                  }});

}  // namespace

}  // namespace costate
