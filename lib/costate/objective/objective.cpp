#include "costate/objective/objective.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/element/course.h"
#include "costate/objective/folded_angle.h"
#include "costate/objective/formula_output.h"
#include "costate/objective/sampled_cost.h"
#include "costate/objective/weighted_cost.h"

namespace costate {

OutputTerm::OutputTerm(std::shared_ptr<const Output> output, int power, int weight_number, Target target)
    : output_(std::move(output)), power_(power), weight_number_(weight_number), target_(std::move(target)) {
  if (!output_) throw Error("An OutputTerm has no output (a null pointer).");
  if (power_ != 1 && power_ != 2)
    throw Error(fmt::format("The OutputTerm of '{}' has the power {}; 1 or 2 is expected.", output_->name(), power_));
  if (target_.law && target_.law_numbers.size() != static_cast<std::size_t>(target_.law->number_count()))
    throw Error(fmt::format("The target of '{}' is a law of {} numbers, and {} are given.", output_->name(),
                            target_.law->number_count(), target_.law_numbers.size()));
}

bool OutputTerm::needs_accelerations() const {
  return output_->needs_accelerations() || (target_.output && target_.output->needs_accelerations());
}

void add_cost_course(const CostTerm& term, const std::vector<double>& numbers, Course& course) {
  const auto add = [&](const ScalarLaw& law, const std::vector<int>& indices) {
    std::vector<double> p;
    for (const int n : indices) p.push_back(numbers[static_cast<std::size_t>(n)]);
    course.add(law, p.data());
  };
  if (const WeightedTerm* weighted = weighted_term(term)) add(weighted->law(), weighted->law_numbers());
  const auto* of = dynamic_cast<const OutputTerm*>(&ungated(term));
  if (!of) return;
  if (of->target().law) add(*of->target().law, of->target().law_numbers);
  for (const FormulaOutput* formula : formulas_of(term)) formula->add_course(numbers, course);
}

double OutputTerm::difference(const StateView& s, Assembly& assembly, std::vector<double>& p) const {
  double d = output_->value(s, assembly);
  if (target_.output) d -= target_.output->value(s, assembly);
  if (target_.law) {
    p.resize(target_.law_numbers.size());
    for (std::size_t i = 0; i < p.size(); ++i) p[i] = assembly.numbers()[target_.law_numbers[i]];
    d -= target_.law->value(s.t, p.data());
  }
  return d;
}

namespace {
// Without a number (-1) the weight is one: a law stands for it (WeightedTerm).
double weight_of(int number, const Assembly& assembly) { return number < 0 ? 1 : assembly.numbers()[number]; }
double change_of(int number, const Variation& d) { return number < 0 ? 0 : d.numbers[number]; }
bool is_varied(int number, const Assembly& assembly) {
  return number >= 0 && !assembly.number_columns()[number].empty();
}
std::vector<double>& law_buffer() {
  thread_local std::vector<double> p;
  return p;
}
std::vector<PathDual>& dual_buffer(std::size_t n) {
  thread_local std::vector<PathDual> p;
  if (p.size() < n) p.resize(n);
  return p;
}
}  // namespace

double OutputTerm::value(const StateView& s, Assembly& assembly) const {
  for (const Output* y : {output_.get(), target_.output.get()})
    if (y) watch_folds(*y, s, assembly);
  const double d = difference(s, assembly, law_buffer());
  return weight_of(weight_number_, assembly) * (power_ == 2 ? d * d : d);
}

void OutputTerm::add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const {
  const double d = difference(s, assembly, law_buffer());
  const double weight = weight_of(weight_number_, assembly);
  const double slope = factor * weight * (power_ == 2 ? 2 * d : 1);
  output_->add_gradient(s, assembly, slope, g);
  if (target_.output) target_.output->add_gradient(s, assembly, -slope, g);
  if (target_.law) {
    const auto& p = law_buffer();
    auto& dual = dual_buffer(p.size());
    for (std::size_t i = 0; i < p.size(); ++i) {
      if (assembly.number_columns()[target_.law_numbers[i]].empty()) continue;
      for (std::size_t j = 0; j < p.size(); ++j) dual[j] = PathDual(p[j]);
      dual[i].d[0] = Taylor2(1.0);
      g.add_number(assembly, target_.law_numbers[i], -slope * target_.law->value(PathDual(s.t), dual.data()).d[0].c0);
    }
  }
  if (is_varied(weight_number_, assembly)) g.add_number(assembly, weight_number_, factor * (power_ == 2 ? d * d : d));
}

double CostTerm::change(const StateView&, Assembly&, const Variation&) const {
  throw CapabilityError(
      "A terminal term of the cost offers no time derivative, which a run that ends by an event needs for its gradient "
      "(the end time depends on the parameters): derive its class from DualCostTerm, or override change(). "
      "Terms of accelerations and multipliers have none.");
}

double OutputTerm::difference_change(const StateView& s, Assembly& assembly, const Variation& d) const {
  double change = output_->change(s, assembly, d);
  if (target_.output) change -= target_.output->change(s, assembly, d);
  if (target_.law) {
    const auto& p = law_buffer();
    auto& path = dual_buffer(p.size());
    for (std::size_t i = 0; i < p.size(); ++i) path[i] = PathDual(Taylor2(p[i], d.numbers[target_.law_numbers[i]], 0));
    change -= target_.law->value(PathDual(Taylor2(s.t, d.t, 0)), path.data()).v.c1;
  }
  return change;
}

double OutputTerm::change(const StateView& s, Assembly& assembly, const Variation& v) const {
  const double d = difference(s, assembly, law_buffer());
  const double weight = weight_of(weight_number_, assembly), weight_change = change_of(weight_number_, v);
  return weight * (power_ == 2 ? 2 * d : 1) * difference_change(s, assembly, v) +
         weight_change * (power_ == 2 ? d * d : d);
}

void CostTerm::add_gradient_change(const StateView&, Assembly&, const Variation&, ScalarGradient&) const {
  throw CapabilityError(
      "A term of the cost offers no second derivatives, which Hessians and, for accelerations and "
      "reactions in the running cost, the index-3 adjoint need: derive its class from "
      "DualCostTerm, or override add_gradient_change.");
}

void OutputTerm::add_gradient_change(const StateView& s, Assembly& assembly, const Variation& v,
                                     ScalarGradient& g) const {
  // The gradient is w u' (y - target)_x + u w_x with u = d or d^2, d = y - target: each factor changes.
  const double d = difference(s, assembly, law_buffer());
  const double weight = weight_of(weight_number_, assembly), weight_change = change_of(weight_number_, v);
  const double d_change = difference_change(s, assembly, v);
  const double u_d = power_ == 2 ? 2 * d : 1, u_dd = power_ == 2 ? 2 : 0;
  const double slope = weight * u_d, slope_change = weight_change * u_d + weight * u_dd * d_change;
  output_->add_gradient(s, assembly, slope_change, g);
  output_->add_gradient_change(s, assembly, v, slope, g);
  if (target_.output) {
    target_.output->add_gradient(s, assembly, -slope_change, g);
    target_.output->add_gradient_change(s, assembly, v, -slope, g);
  }
  if (target_.law) {
    const auto& p = law_buffer();
    auto& path = dual_buffer(p.size());
    for (std::size_t i = 0; i < p.size(); ++i) path[i] = PathDual(Taylor2(p[i], v.numbers[target_.law_numbers[i]], 0));
    for (std::size_t i = 0; i < p.size(); ++i) {
      if (assembly.number_columns()[target_.law_numbers[i]].empty()) continue;
      path[i].d[0] = Taylor2(1.0);
      const Taylor2 f_p = target_.law->value(PathDual(Taylor2(s.t, v.t, 0)), path.data()).d[0];
      path[i].d[0] = Taylor2(0.0);
      g.add_number(assembly, target_.law_numbers[i], -(slope_change * f_p.c0 + slope * f_p.c1));
    }
  }
  if (is_varied(weight_number_, assembly)) g.add_number(assembly, weight_number_, u_d * d_change);
}

void Objective::add_running_gradient_change(const StateView& s, Assembly& assembly, const Variation& d,
                                            ScalarGradient& g) const {
  for (const auto& term : running) term->add_gradient_change(s, assembly, d, g);
}

void Objective::add_terminal_gradient_change(const StateView& s, Assembly& assembly, const Variation& d,
                                             ScalarGradient& g) const {
  for (const auto& term : terminal) term->add_gradient_change(s, assembly, d, g);
}

double Objective::running_value(const StateView& s, Assembly& assembly) const {
  double sum = 0;
  for (const auto& term : running) sum += term->value(s, assembly);
  return sum;
}

double Objective::terminal_value(const StateView& s, Assembly& assembly) const {
  double sum = 0;
  for (const auto& term : terminal) sum += term->value(s, assembly);
  return sum;
}

void Objective::add_running_gradient(const StateView& s, Assembly& assembly, ScalarGradient& g) const {
  for (const auto& term : running) term->add_gradient(s, assembly, 1, g);
}

void Objective::add_terminal_gradient(const StateView& s, Assembly& assembly, ScalarGradient& g) const {
  for (const auto& term : terminal) term->add_gradient(s, assembly, 1, g);
}

bool Objective::running_needs_accelerations() const {
  for (const auto& term : running)
    if (term->needs_accelerations()) return true;
  return false;
}

bool Objective::terminal_needs_accelerations() const {
  for (const auto& term : terminal)
    if (term->needs_accelerations()) return true;
  return false;
}

}  // namespace costate
