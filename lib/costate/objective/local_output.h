// Outputs that are functions of one element's or point's own variables, on path duals: derivatives with respect to each
// variable and changes along a variation come from the same formula.
#pragma once

#include <algorithm>
#include <array>
#include <string>
#include <utility>
#include <vector>

#include "costate/objective/output.h"

namespace costate {

/// A function of local path duals, differentiated one local variable at a time.
class LocalOutput : public Output {
 public:
  LocalOutput(std::string name, std::string unit, std::vector<int> coordinates, std::vector<int> numbers, int row,
              int rows, int state, int states)
      : Output(std::move(name), std::move(unit)),
        coordinates_(std::move(coordinates)),
        numbers_(std::move(numbers)),
        row_(row),
        rows_(rows),
        state_(state),
        states_(states) {}

  double value(const StateView& s, Assembly& assembly) const override {
    if (double plain = 0; evaluate_value(Values(*this, s, assembly).arguments(), plain)) return plain;
    Buffers b(*this, s, assembly);
    return evaluate(b.arguments()).v.c0;
  }
  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const override {
    Buffers b(*this, s, assembly);
    differentiate(b, s, assembly, g, [&](PathDual& x) {
      x.d[0] = Taylor2(1.0);
      const double d = evaluate(b.arguments()).d[0].c0;
      x.d[0] = Taylor2(0.0);
      return factor * d;
    });
  }
  std::optional<std::vector<int>> depends_on() const override { return coordinates_; }
  double change(const StateView& s, Assembly& assembly, const Variation& d) const override {
    require_rates(d);
    Buffers b(*this, s, assembly);
    b.vary(*this, s, d);
    return evaluate(b.arguments()).v.c1;
  }
  void add_gradient_change(const StateView& s, Assembly& assembly, const Variation& d, double factor,
                           ScalarGradient& g) const override {
    Buffers b(*this, s, assembly);
    b.vary(*this, s, d);
    differentiate(b, s, assembly, g, [&](PathDual& x) {
      x.d[0] = Taylor2(1.0);
      const double y = evaluate(b.arguments()).d[0].c1;
      x.d[0] = Taylor2(0.0);
      return factor * y;
    });
  }

 protected:
  virtual PathDual evaluate(const MeasureArguments& x) const = 0;
  /// The same on plain numbers; false where it is there on path duals alone.
  virtual bool evaluate_value(const ValueArguments&, double&) const { return false; }

 private:
  /// Arguments of evaluate_value().
  struct Values {
    double t, q[kMaxLocal], v[kMaxLocal], a[kMaxLocal], lambda[kMaxLocal], z[kMaxLocal];
    std::vector<double>& p = numbers();

    Values(const LocalOutput& o, const StateView& s, const Assembly& assembly) : t(s.t) {
      for (std::size_t i = 0; i < o.coordinates_.size(); ++i) {
        const int c = o.coordinates_[i];
        q[i] = s.q[c];
        v[i] = s.v ? s.v[c] : 0;
        a[i] = s.a ? s.a[c] : 0;
      }
      for (int i = 0; i < o.rows_; ++i) lambda[i] = s.lambda ? s.lambda[o.row_ + i] : 0;
      for (int i = 0; i < o.states_; ++i) z[i] = s.z[o.state_ + i];
      p.resize(std::max(p.size(), o.numbers_.size()));
      for (std::size_t i = 0; i < o.numbers_.size(); ++i) p[i] = assembly.numbers()[o.numbers_[i]];
    }
    static std::vector<double>& numbers() {
      thread_local std::vector<double> of_thread;
      return of_thread;
    }
    ValueArguments arguments() const { return {t, q, v, a, lambda, z, p.data()}; }
  };
  /// Arguments of evaluate(), of zeros but while one output is looked at: filling them anew for each value would cost
  /// more than the formulas do.
  struct Local {
    std::array<PathDual, kMaxLocal> q, v, a, lambda, z;
    std::vector<PathDual> p;
  };
  struct Buffers {
    Local& local = buffer();
    std::array<PathDual, kMaxLocal>&q = local.q, &v = local.v, &a = local.a, &lambda = local.lambda, &z = local.z;
    std::vector<PathDual>& p = local.p;
    PathDual t;
    std::size_t coordinates;
    int rows, states;

    Buffers(const LocalOutput& o, const StateView& s, const Assembly& assembly)
        : t(s.t), coordinates(o.coordinates_.size()), rows(o.rows_), states(o.states_) {
      for (std::size_t i = 0; i < coordinates; ++i) {
        const int c = o.coordinates_[i];
        q[i] = PathDual(s.q[c]);
        if (s.v) v[i] = PathDual(s.v[c]);
        if (s.a) a[i] = PathDual(s.a[c]);
      }
      if (s.lambda)
        for (int i = 0; i < rows; ++i) lambda[i] = PathDual(s.lambda[o.row_ + i]);
      for (int i = 0; i < states; ++i) z[i] = PathDual(s.z[o.state_ + i]);
      if (p.size() < o.numbers_.size()) p.resize(o.numbers_.size());
      for (std::size_t i = 0; i < o.numbers_.size(); ++i) p[i] = PathDual(assembly.numbers()[o.numbers_[i]]);
    }
    Buffers(const Buffers&) = delete;
    Buffers& operator=(const Buffers&) = delete;
    ~Buffers() {
      for (auto* x : {&q, &v, &a}) std::fill_n(x->begin(), coordinates, PathDual());
      std::fill_n(lambda.begin(), rows, PathDual());
      std::fill_n(z.begin(), states, PathDual());
    }
    static Local& buffer() {
      thread_local Local of_thread;
      return of_thread;
    }
    /// Replaces the values by straight lines along the variation.
    void vary(const LocalOutput& o, const StateView& s, const Variation& d) {
      t.v.c1 = d.t;
      for (std::size_t i = 0; i < o.coordinates_.size(); ++i) {
        const int c = o.coordinates_[i];
        q[i].v.c1 = d.q[c];
        if (s.v) v[i].v.c1 = d.v[c];
        if (s.a && d.a) a[i].v.c1 = d.a[c];
      }
      if (s.lambda && d.lambda)
        for (int i = 0; i < o.rows_; ++i) lambda[i].v.c1 = d.lambda[o.row_ + i];
      for (int i = 0; i < o.states_; ++i) z[i].v.c1 = d.z[o.state_ + i];
      for (std::size_t i = 0; i < o.numbers_.size(); ++i) p[i].v.c1 = d.numbers[o.numbers_[i]];
    }
    MeasureArguments arguments() const { return {t, q.data(), v.data(), a.data(), lambda.data(), z.data(), p.data()}; }
  };

  /// Adds derivative(argument) for every argument.
  template <class Derivative>
  void differentiate(Buffers& b, const StateView& s, Assembly& assembly, ScalarGradient& g,
                     const Derivative& derivative) const {
    for (std::size_t i = 0; i < coordinates_.size(); ++i) {
      g.q[coordinates_[i]] += derivative(b.q[i]);
      g.v[coordinates_[i]] += derivative(b.v[i]);
      if (s.a && needs_accelerations()) g.a[coordinates_[i]] += derivative(b.a[i]);
    }
    if (s.lambda)
      for (int i = 0; i < rows_; ++i) g.lambda[row_ + i] += derivative(b.lambda[i]);
    for (int i = 0; i < states_; ++i) g.z[state_ + i] += derivative(b.z[i]);
    for (std::size_t i = 0; i < numbers_.size(); ++i)
      if (!assembly.number_columns()[numbers_[i]].empty()) g.add_number(assembly, numbers_[i], derivative(b.p[i]));
  }

  std::vector<int> coordinates_, numbers_;
  int row_, rows_, state_, states_;
};

}  // namespace costate
