#include "costate/element/kind/smooth_steps_law.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/scene/law_table.h"

namespace costate {

SmoothStepsLaw::SmoothStepsLaw(std::vector<double> x) : x_(std::move(x)) {
  if (x_.size() < 2) throw ModelError("", fmt::format("'x' needs at least 2 entries, found {}.", x_.size()));
  for (std::size_t i = 1; i < x_.size(); ++i)
    if (!(x_[i] > x_[i - 1]))
      throw ModelError("", fmt::format("'x' must increase strictly, found {} after {}.", x_[i], x_[i - 1]));
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
