#include "costate/objective/weighted_cost.h"

namespace costate {

double WeightedTerm::weight(double t, const Assembly& assembly) const {
  std::vector<double> p;
  for (const int n : numbers_) p.push_back(assembly.numbers()[static_cast<std::size_t>(n)]);
  return law_->value(t, p.data());
}

std::vector<PathDual> WeightedTerm::along(const Assembly& assembly, const Variation& d) const {
  std::vector<PathDual> p;
  for (const int n : numbers_)
    p.emplace_back(Taylor2(assembly.numbers()[static_cast<std::size_t>(n)], d.numbers ? d.numbers[n] : 0, 0));
  return p;
}

template <class Visit>
void WeightedTerm::for_each_number(double t, const Assembly& assembly, const Variation& d, const Visit& visit) const {
  std::vector<PathDual> p;
  for (std::size_t k = 0; k < numbers_.size(); ++k) {
    if (assembly.number_columns()[static_cast<std::size_t>(numbers_[k])].empty()) continue;
    if (p.empty()) p = along(assembly, d);
    p[k].d[0] = Taylor2(1.0);
    visit(numbers_[k], law_->value(PathDual(Taylor2(t, d.t, 0)), p.data()).d[0]);
    p[k].d[0] = Taylor2(0.0);
  }
}

double WeightedTerm::value(const StateView& s, Assembly& assembly) const {
  return weight(s.t, assembly) * term_->value(s, assembly);
}

void WeightedTerm::add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const {
  term_->add_gradient(s, assembly, factor * weight(s.t, assembly), g);
  for_each_number(s.t, assembly, {}, [&](int number, const Taylor2& w_p) {
    g.add_number(assembly, number, factor * w_p.c0 * term_->value(s, assembly));
  });
}

double WeightedTerm::change(const StateView& s, Assembly& assembly, const Variation& d) const {
  const Taylor2 w = law_->value(PathDual(Taylor2(s.t, d.t, 0)), along(assembly, d).data()).v;
  return w.c1 * term_->value(s, assembly) + w.c0 * term_->change(s, assembly, d);
}

// d(w g) = w dg + g dw: each factor changes.
void WeightedTerm::add_gradient_change(const StateView& s, Assembly& assembly, const Variation& d,
                                       ScalarGradient& g) const {
  const Taylor2 w = law_->value(PathDual(Taylor2(s.t, d.t, 0)), along(assembly, d).data()).v;
  term_->add_gradient(s, assembly, w.c1, g);
  ScalarGradient of_term;
  of_term.resize(assembly);
  of_term.set_zero();
  term_->add_gradient_change(s, assembly, d, of_term);
  g.q += w.c0 * of_term.q;
  g.v += w.c0 * of_term.v;
  g.a += w.c0 * of_term.a;
  g.lambda += w.c0 * of_term.lambda;
  g.z += w.c0 * of_term.z;
  g.rho += w.c0 * of_term.rho;
  for_each_number(s.t, assembly, d, [&](int number, const Taylor2& w_p) {
    g.add_number(assembly, number, w_p.c0 * term_->change(s, assembly, d) + w_p.c1 * term_->value(s, assembly));
  });
}

}  // namespace costate
