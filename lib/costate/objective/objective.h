// The cost psi = w(q, v, a, lambda, z, rho) at T + integral of g(q, v, a, lambda, z, t, rho) dt, as sums of terms
// with exact partial derivatives. The formulation pulls these back to its own unknowns.
#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "costate/element/law/scalar_law.h"
#include "costate/objective/output.h"

namespace costate {

/// Whether an object has passed a check that it takes once; a copy has not.
class PassedOnce {
 public:
  PassedOnce() = default;
  PassedOnce(const PassedOnce&) {}
  PassedOnce& operator=(const PassedOnce&) { return *this; }
  bool get() const { return passed_; }
  void set() const { passed_ = true; }

 private:
  mutable std::atomic<bool> passed_ = false;
};

/// One term of a running or terminal cost. A user's own cost derives from this (or from DualCostTerm).
class CostTerm {
 public:
  virtual ~CostTerm() = default;
  virtual double value(const StateView& s, Assembly& assembly) const = 0;
  /// gradient += factor * d(value).
  virtual void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const = 0;
  virtual bool needs_accelerations() const { return true; }
  /// gradient += the change of d(value) along the variation d; Hessians need it.
  virtual void add_gradient_change(const StateView& s, Assembly& assembly, const Variation& d, ScalarGradient& g) const;
  /// The change of the value along the variation d: g_t dt + g_q dq + g_v dv + ...; runs whose end an event decides
  /// need it of terminal terms.
  virtual double change(const StateView& s, Assembly& assembly, const Variation& d) const;

  // Of a user's term, in cost_check.h.
  PassedOnce promise_passed, derivatives_passed;
};

/// weight (y - target)^power with power 1 or 2; the target is a law of time (its numbers may be parameters) or
/// another output.
class OutputTerm final : public CostTerm {
 public:
  struct Target {
    std::shared_ptr<const ScalarLaw> law;  // of time, or null
    std::vector<int> law_numbers;
    std::shared_ptr<const Output> output;  // or null
  };
  OutputTerm(std::shared_ptr<const Output> output, int power, int weight_number, Target target);

  const Output& output() const { return *output_; }
  const Target& target() const { return target_; }
  int weight_number() const { return weight_number_; }  // in the mechanism; -1: the weight is one

  double value(const StateView& s, Assembly& assembly) const override;
  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const override;
  bool needs_accelerations() const override;
  void add_gradient_change(const StateView& s, Assembly& assembly, const Variation& d,
                           ScalarGradient& g) const override;
  double change(const StateView& s, Assembly& assembly, const Variation& d) const override;

 private:
  /// The change of y - target; the law's numbers are in law_buffer().
  double difference_change(const StateView& s, Assembly& assembly, const Variation& d) const;
  double difference(const StateView& s, Assembly& assembly, std::vector<double>& p) const;
  std::shared_ptr<const Output> output_;
  int power_, weight_number_;
  Target target_;
};

/// What a templated cost sees: everything in global numbering, on a differentiating scalar.
template <class S>
struct CostArguments {
  S t;
  const S *q, *v, *a, *lambda, *z, *numbers;
};

/// A user's cost as one formula: Derived provides
///   template <class S> S physics(const CostArguments<S>& x) const;
/// Its derivatives come from dual numbers, one evaluation for each entry of q, v, a, lambda, z and each varied number.
template <class Derived>
class DualCostTerm : public CostTerm {
 public:
  double value(const StateView& s, Assembly& assembly) const override {
    std::vector<Dual<1>> x = load<Dual<1>>(s, assembly);
    return evaluate(x, {s.t}, assembly).v;
  }
  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const override {
    std::vector<Dual<1>> x = load<Dual<1>>(s, assembly);
    differentiate(s, assembly, g, [&](std::size_t i) {
      x[i].d[0] = 1;
      const double d = evaluate(x, {s.t}, assembly).d[0];
      x[i].d[0] = 0;
      return factor * d;
    });
  }
  double change(const StateView& s, Assembly& assembly, const Variation& d) const override {
    if (needs_accelerations() && !d.a) {
      // They need not be used by this formula; what depends on them has no rate without theirs.
      ScalarGradient g;
      g.resize(assembly);
      add_gradient(s, assembly, 1, g);
      if (!g.a.isZero(0) || !g.lambda.isZero(0)) return CostTerm::change(s, assembly, d);
    }
    std::vector<Dual<1>> x = load<Dual<1>>(s, assembly);
    direct(x, d, assembly, [](Dual<1>& at, double by) { at.d[0] = by; });
    Dual<1> t(s.t);
    t.d[0] = d.t;
    return evaluate(x, t, assembly).d[0];
  }
  void add_gradient_change(const StateView& s, Assembly& assembly, const Variation& d,
                           ScalarGradient& g) const override {
    using Second = Dual<1, Dual<1>>;  // outside: the direction; inside: the variable
    std::vector<Second> x = load<Second>(s, assembly);
    direct(x, d, assembly, [](Second& at, double by) { at.d[0].v = by; });
    Second t(s.t);
    t.d[0].v = d.t;
    differentiate(s, assembly, g, [&](std::size_t i) {
      x[i].v.d[0] = 1;
      const double y = evaluate(x, t, assembly).d[0].d[0];
      x[i].v.d[0] = 0;
      return y;
    });
  }

 private:
  /// set(argument, its change along d), in the order of load().
  template <class S, class Set>
  static void direct(std::vector<S>& x, const Variation& d, const Assembly& assembly, const Set& set) {
    std::size_t at = 0;
    const auto block = [&](const double* from, int count) {
      for (int i = 0; i < count; ++i, ++at)
        if (from) set(x[at], from[i]);
    };
    block(d.q, assembly.n());
    block(d.v, assembly.n());
    block(d.a, assembly.n());
    block(d.lambda, assembly.m());
    block(d.z, assembly.nz());
    block(d.numbers, static_cast<int>(assembly.numbers().size()));
  }
  /// Adds derivative(i) for every argument i, in the order of load().
  template <class Derivative>
  static void differentiate(const StateView& s, Assembly& assembly, ScalarGradient& g, const Derivative& derivative) {
    const int n = assembly.n(), m = assembly.m(), nz = assembly.nz();
    for (int i = 0; i < n; ++i) {
      g.q[i] += derivative(i);
      g.v[i] += derivative(n + i);
      if (s.a) g.a[i] += derivative(2 * n + i);
    }
    if (s.lambda)
      for (int i = 0; i < m; ++i) g.lambda[i] += derivative(3 * n + i);
    for (int i = 0; i < nz; ++i) g.z[i] += derivative(3 * n + m + i);
    for (std::size_t k = 0; k < assembly.numbers().size(); ++k)
      if (!assembly.number_columns()[k].empty())
        g.add_number(assembly, static_cast<int>(k), derivative(3 * n + m + nz + k));
  }
  template <class S>
  static std::vector<S> load(const StateView& s, const Assembly& assembly) {
    std::vector<S> x;
    const auto append = [&](const double* from, int count) {
      for (int i = 0; i < count; ++i) x.emplace_back(from ? from[i] : 0.0);
    };
    append(s.q, assembly.n());
    append(s.v, assembly.n());
    append(s.a, assembly.n());
    append(s.lambda, assembly.m());
    append(s.z, assembly.nz());
    append(assembly.numbers().data(), static_cast<int>(assembly.numbers().size()));
    return x;
  }
  template <class S>
  S evaluate(const std::vector<S>& x, const S& t, const Assembly& assembly) const {
    const int n = assembly.n(), m = assembly.m();
    const S* p = x.data();
    return static_cast<const Derived*>(this)->template physics<S>(
        {t, p, p + n, p + 2 * n, p + 3 * n, p + 3 * n + m, p + 3 * n + m + assembly.nz()});
  }
};

/// The whole cost. Immutable once built; evaluations are reentrant.
struct Objective {
  std::vector<std::shared_ptr<const CostTerm>> running, terminal;
  /// Outputs that a run follows as closely as those of its running costs: what ends it.
  std::vector<std::shared_ptr<const Output>> followed;

  double running_value(const StateView& s, Assembly& assembly) const;
  double terminal_value(const StateView& s, Assembly& assembly) const;
  void add_running_gradient(const StateView& s, Assembly& assembly, ScalarGradient& g) const;
  void add_terminal_gradient(const StateView& s, Assembly& assembly, ScalarGradient& g) const;
  void add_running_gradient_change(const StateView& s, Assembly& assembly, const Variation& d, ScalarGradient& g) const;
  void add_terminal_gradient_change(const StateView& s, Assembly& assembly, const Variation& d,
                                    ScalarGradient& g) const;
  bool running_needs_accelerations() const;
  bool terminal_needs_accelerations() const;
};

}  // namespace costate
