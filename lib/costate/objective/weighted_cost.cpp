#include "costate/objective/weighted_cost.h"

#include <algorithm>

namespace costate {

double WeightedTerm::weight(double t, const Assembly& assembly) const {
  thread_local std::vector<double> p;
  p.clear();
  for (const int n : numbers_) p.push_back(assembly.numbers()[static_cast<std::size_t>(n)]);
  return law_->value(t, p.data());
}

std::vector<PathDual>& WeightedTerm::along(const Assembly& assembly, const Variation& d) const {
  thread_local std::vector<PathDual> p;
  p.clear();
  for (const int n : numbers_)
    p.emplace_back(Taylor2(assembly.numbers()[static_cast<std::size_t>(n)], d.numbers ? d.numbers[n] : 0, 0));
  return p;
}

Taylor2 WeightedTerm::weight_along(double t, const Assembly& assembly, const Variation& d) const {
  return law_->value(PathDual(Taylor2(t, d.t, 0)), along(assembly, d).data()).v;
}

bool WeightedTerm::varies(const Assembly& assembly) const {
  const auto is_varied = [&](int n) { return !assembly.number_columns()[static_cast<std::size_t>(n)].empty(); };
  return std::any_of(numbers_.begin(), numbers_.end(), is_varied);
}

void WeightedTerm::add_by_numbers(double t, Assembly& assembly, const Variation& d, double value, double change,
                                  ScalarGradient& g) const {
  auto& p = along(assembly, d);
  for (std::size_t k = 0; k < numbers_.size(); ++k) {
    if (assembly.number_columns()[static_cast<std::size_t>(numbers_[k])].empty()) continue;
    p[k].d[0] = Taylor2(1.0);
    const Taylor2 w_p = law_->value(PathDual(Taylor2(t, d.t, 0)), p.data()).d[0];
    p[k].d[0] = Taylor2(0.0);
    g.add_number(assembly, numbers_[k], w_p.c0 * change + w_p.c1 * value);
  }
}

double WeightedTerm::value(const StateView& s, Assembly& assembly) const {
  return weight(s.t, assembly) * term_->value(s, assembly);
}

void WeightedTerm::add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const {
  term_->add_gradient(s, assembly, factor * weight(s.t, assembly), g);
  if (varies(assembly)) add_by_numbers(s.t, assembly, {}, 0, factor * term_->value(s, assembly), g);
}

double WeightedTerm::change(const StateView& s, Assembly& assembly, const Variation& d) const {
  const Taylor2 w = weight_along(s.t, assembly, d);
  return w.c1 * term_->value(s, assembly) + w.c0 * term_->change(s, assembly, d);
}

// d(w g) = w dg + g dw: each factor changes.
void WeightedTerm::add_gradient_change(const StateView& s, Assembly& assembly, const Variation& d,
                                       ScalarGradient& g) const {
  const Taylor2 w = weight_along(s.t, assembly, d);
  term_->add_gradient(s, assembly, w.c1, g);
  ScalarGradient of_term;
  of_term.resize(assembly);
  term_->add_gradient_change(s, assembly, d, of_term);
  g.add(w.c0, of_term);
  if (varies(assembly)) add_by_numbers(s.t, assembly, d, term_->value(s, assembly), term_->change(s, assembly, d), g);
}

}  // namespace costate
