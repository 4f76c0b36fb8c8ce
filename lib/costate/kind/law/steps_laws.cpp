#include "costate/kind/law/steps_laws.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/element/course.h"
#include "costate/kind/law/law_table.h"

namespace costate {

SmoothStepsLaw::SmoothStepsLaw(std::vector<double> x) : x_(std::move(x)) {
  if (x_.size() < 2) throw ModelError("", fmt::format("'x' needs at least 2 entries, found {}.", x_.size()));
  for (std::size_t i = 1; i < x_.size(); ++i)
    if (!(x_[i] > x_[i - 1]))
      throw ModelError("", fmt::format("'x' must increase strictly, found {} after {}.", x_[i], x_[i - 1]));
}

void StepsLaw::add_places(const double* p, LawPlaces& places) const {
  for (int k = 0; k < n_; ++k) places.sharp.insert(places.sharp.end(), {p[1 + k], p[1 + k] + p[0]});
}

void StepsLaw::add_third_jumps(const double* p, std::vector<double>& x) const {
  for (int k = 0; k < n_; ++k) x.insert(x.end(), {p[1 + k], p[1 + k] + p[0]});
}

// Where one step ends as another begins, a change of either parts them.
void StepsLaw::add_place_slopes(double x, const double* p, double* slopes) const {
  int owners = 0;
  for (int k = 0; k < n_; ++k)
    for (const bool end : {false, true}) {
      if (x != p[1 + k] + (end ? p[0] : 0)) continue;
      ++owners;
      slopes[1 + k] += 1;
      if (end) slopes[0] += 1;
    }
  if (owners > 1) std::fill(slopes, slopes + n_ + 1, std::nan(""));
}

void SmoothStepsLaw::add_places(const double*, LawPlaces& places) const {
  places.sharp.insert(places.sharp.end(), x_.begin(), x_.end());
}

double SmoothStepsLaw::primitive(double x, const double* p) const {
  if (x <= x_.front()) return p[0] * (x - x_.front());
  double sum = 0;
  for (std::size_t k = 0; k + 1 < x_.size() && x_[k] < x; ++k) {
    const double h = x_[k + 1] - x_[k], s = std::min(1.0, (x - x_[k]) / h);
    sum += h * (p[k] * s + (p[k + 1] - p[k]) * quintic_step_integral(s));
  }
  return sum + p[x_.size() - 1] * std::max(0.0, x - x_.back());
}

LawOptions steps_law(const std::vector<double>& at, const std::vector<double>& values, double width) {
  if (at.empty() || values.size() != at.size() + 1)
    throw ModelError("", fmt::format("There must be one entry more in 'values' than in 'at', found {} and {}.",
                                     values.size(), at.size()));
  if (!(width > 0)) throw ModelError("", fmt::format("'width' must be positive, found {}.", width));
  for (std::size_t i = 1; i < at.size(); ++i)
    if (!(at[i] > at[i - 1]))
      throw ModelError("", fmt::format("'at' must increase: entry {} is {} after {}.", i + 1, at[i], at[i - 1]));
  LawOptions o;
  o.law = std::make_shared<StepsLaw>(static_cast<int>(at.size()));
  o.numbers.emplace_back("width", width);
  for (std::size_t i = 0; i < at.size(); ++i) o.numbers.emplace_back(fmt::format("at[{}]", i), at[i]);
  for (std::size_t i = 0; i < values.size(); ++i) o.numbers.emplace_back(fmt::format("values[{}]", i), values[i]);
  return o;
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

const RegisterLawKind steps(
    {.name = "steps",
     .summary = "values[0], then from at[k] on values[k + 1] by a quintic of 'width'",
     .example = R"({ kind = "steps", at = [-0.5, 0.4], values = [0.0, 1.0, -0.5], width = 0.3 })",
     .read = [](SceneTable& t) {
       const auto at = t.values("at");
       const auto values = t.values("values");
       return steps_law(at, values, t.value("width", NumberRule::positive));
     }});

const RegisterLawKind smooth_steps(
    {.name = "smooth_steps",
     .summary = "levels y at x, a quintic between neighbours, level at both ends",
     .example = R"({ kind = "smooth_steps", x = [-1, 0.2, 1, 2], y = [0, 3.5, 3.5, -1] })",
     .read = [](SceneTable& t) {
       const auto x = t.values("x");
       return smooth_steps_law(x, t.values("y"));
     }});

}  // namespace

}  // namespace costate
