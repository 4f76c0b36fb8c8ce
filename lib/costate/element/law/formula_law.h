// A law written as a formula, "a*sin(w*t) + b*exp(-t/T)": +, -, *, /, ^, parentheses, sin cos tan exp log
// sqrt tanh atan, pi, the variable t (or x) and named numbers; of several variables abs, min and max, and laws
// that stand beside it (tables, data) as functions of one argument, maps of two. Parsed once into a program for a
// stack, which runs on any number type, so that derivatives are exact and nothing is allocated.
#pragma once

#include <cmath>
#include <cstdlib>
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "costate/element/course.h"
#include "costate/element/law/law_at.h"
#include "costate/element/law/point_surface.h"
#include "costate/element/law/scalar_law.h"

namespace costate {

/// What a formula calls by its name: a law, or a scale times a map of two arguments. Its numbers are among the
/// formula's from `first` on.
struct FormulaFunction {
  std::string name;
  std::shared_ptr<const ScalarLaw> law;  // null: a map
  int first;
  std::shared_ptr<const PointSurface> map = {};
};

/// What decides a formula's course, at one of its points, in the order of the text from inside out, as many at all.
struct FormulaTerms {
  /// What is in a function of the language, a power or a product, and how far apart what min or max chooses from is:
  /// near its zero the formula may change.
  std::vector<double> values;
  /// The arguments of its sines, cosines and tangents, rad.
  std::vector<double> angles;
  /// Where each of its functions, and of its maps along each axis, is asked for.
  struct Table {
    int function, axis;
    double at;
  };
  std::vector<Table> tables;
};

class FormulaLaw final : public ScalarLawOf<FormulaLaw>, public PlacedLaw {
 public:
  /// `names`: of the law's numbers, in their order. Throws ModelError where the text is no formula of them,
  /// with the place in the text.
  FormulaLaw(const std::string& text, std::vector<std::string> names);
  /// The same where any other name is one more number, behind `names`, in the order of the text: dotted names
  /// ("P2.x_dot"), and in single quotes what no name of a formula can hold ('left-arm.x'). The variable is t alone.
  /// `functions` are laws that it may call, whose numbers have names, too.
  FormulaLaw(const std::string& text, std::vector<std::string> names, std::vector<std::string>& others,
             std::vector<FormulaFunction> functions = {});
  /// Whether every formula has a function of this name.
  static bool has_function(const std::string& name);
  /// Whether its variable, number i, and function i, is in it.
  bool varies() const;
  bool uses(std::size_t i) const;
  bool calls(std::size_t i) const;
  const std::vector<FormulaFunction>& functions() const { return functions_; }
  int number_count() const override { return static_cast<int>(names_.size()); }
  /// Of its terms linear in x: where they pass through zero, and over which length their sines repeat. The rest is
  /// searched.
  void add_places(const double* p, LawPlaces& places) const override;
  /// The value at x and p, with what it is made of; zero where a function or map says nothing there.
  double look(double x, const double* p, FormulaTerms& terms) const;
  /// As look(), behind what the terms hold.
  double add_terms(double x, const double* p, FormulaTerms& terms) const;
  /// What rounding may make of the value at x and p; zero where a function or map says nothing there.
  double rounding(double x, const double* p) const;

  /// Where abs, min and max bend, and where slopes of its functions jump: where one of these, in the order of the text
  /// from inside out, passes zero; with the side at zero that of positive values. As many for all x and arguments; x
  /// and p as of value().
  void add_bends(double x, const double* p, std::vector<double>& bends) const;
  bool may_bend() const;
  /// Whether it is made of sums, products and whole powers alone.
  bool is_polynomial() const;
  /// The value where arguments are not known but taken to be one: functions that say nothing there are one, too.
  double guess(double x, const double* p) const;

  template <class S, class P>
  S physics(const S& x, const P* p) const {
    struct {
      void term(double) {}
      void angle(double) {}
      void bend(double) {}
      S call(const FormulaFunction& f, const S& at, const P* numbers) { return law_at(*f.law, at, numbers); }
      S map(const FormulaFunction& f, const S& a, const S& b, const P* scale) { return S(*scale) * f.map->value(a, b); }
    } plain;
    return run<S>(x, p, plain);
  }

 private:
  /// Of a formula of its variable alone.
  void add_bend_places(const double* p, LawPlaces& places) const;
  /// `watch.term` is told what is in each operation that is not linear, `watch.angle` that of what repeats,
  /// `watch.bend` each value whose sign decides, `watch.call` and `watch.map` give what functions do.
  template <class S, class P, class Watch>
  S run(const S& x, const P* p, Watch& watch) const {
    using std::atan;
    using std::cos;
    using std::exp;
    using std::log;
    using std::sin;
    using std::sqrt;
    using std::tanh;
    S stack[kDepth + 1] = {};
    S* top = stack;  // of what the stack holds, above an empty place
    for (const Step& step : program_) {
      switch (step.op) {
        case Op::constant:
          *++top = S(step.value);
          break;
        case Op::variable:
          *++top = x;
          break;
        case Op::number:
          *++top = S(p[step.index]);
          break;
        case Op::add:
          --top;
          top[0] += top[1];
          break;
        case Op::subtract:
          --top;
          top[0] -= top[1];
          break;
        case Op::multiply:
          --top;
          watch.term(value_of(top[0]));
          watch.term(value_of(top[1]));
          top[0] *= top[1];
          break;
        case Op::divide:
          --top;
          watch.term(value_of(top[1]));
          top[0] /= top[1];
          break;
        case Op::negate:
          top[0] = -top[0];
          break;
        case Op::power:
          --top;
          watch.term(value_of(top[0]));
          if (value_of(top[0]) == 0 && is_constant(top[0]) && value_of(top[1]) > 0)
            top[0] = S(0.0);  // max(x, 0)^k
          else if (value_of(top[0]) == 0 && value_of(top[1]) > 1 && !is_whole(top[1]))
            top[0] *= S(0.0);  // its slope is zero, where the logarithm has none
          else if (is_whole(top[1]) && !(value_of(top[0]) > 0))
            top[0] = whole_power(top[0], static_cast<int>(value_of(top[1])));
          else
            top[0] = exp(top[1] * log(top[0]));
          break;
        case Op::whole_power: {
          watch.term(value_of(top[0]));
          top[0] = whole_power(top[0], step.index);
          break;
        }
        case Op::sin:
          watch.term(value_of(top[0]));
          watch.angle(value_of(top[0]));
          top[0] = sin(top[0]);
          break;
        case Op::cos:
          watch.term(value_of(top[0]));
          watch.angle(value_of(top[0]));
          top[0] = cos(top[0]);
          break;
        case Op::tan:
          watch.term(value_of(top[0]));
          watch.angle(value_of(top[0]));
          top[0] = sin(top[0]) / cos(top[0]);
          break;
        case Op::exp:
          watch.term(value_of(top[0]));
          top[0] = exp(top[0]);
          break;
        case Op::log:
          watch.term(value_of(top[0]));
          top[0] = log(top[0]);
          break;
        case Op::sqrt:
          watch.term(value_of(top[0]));
          top[0] = sqrt(top[0]);
          break;
        case Op::tanh:
          watch.term(value_of(top[0]));
          top[0] = tanh(top[0]);
          break;
        case Op::atan:
          watch.term(value_of(top[0]));
          top[0] = atan(top[0]);
          break;
        case Op::absolute: {
          const double a = value_of(top[0]);
          watch.bend(a);
          if (a < 0) top[0] = -top[0];
          break;
        }
        case Op::least:
        case Op::most: {
          --top;
          const double a = value_of(top[0]) - value_of(top[1]);
          watch.bend(a);
          if ((a < 0) == (step.op == Op::most)) top[0] = top[1];
          break;
        }
        case Op::function: {
          const FormulaFunction& f = functions_[static_cast<std::size_t>(step.index)];
          top[0] = watch.call(f, top[0], p + f.first);
          break;
        }
        case Op::map: {
          --top;
          const FormulaFunction& f = functions_[static_cast<std::size_t>(step.index)];
          top[0] = watch.map(f, top[0], top[1], p + f.first);
          break;
        }
      }
    }
    return *top;
  }

  /// An exponent by which what is not positive has a power, and derivatives: a whole number that is no parameter.
  template <class S>
  static bool is_whole(const S& exponent) {
    const double n = value_of(exponent);
    return is_constant(exponent) && n == std::floor(n) && std::abs(n) < 1e6;
  }
  /// By squares.
  template <class S>
  static S whole_power(S base, int n) {
    const bool inverse = n < 0;
    S product(1.0);
    for (n = std::abs(n); n > 0; n /= 2) {
      if (n % 2 != 0) product *= base;
      if (n > 1) base *= S(base);
    }
    if (inverse) return S(1.0) / product;
    return product;
  }

  enum class Op {
    constant,
    variable,
    number,
    add,
    subtract,
    multiply,
    divide,
    negate,
    power,
    whole_power,
    sin,
    cos,
    tan,
    exp,
    log,
    sqrt,
    tanh,
    atan,
    absolute,
    least,
    most,
    function,
    map
  };
  struct Step {
    Op op;
    double value = 0;
    int index = 0;
  };
  static constexpr int kDepth = 16;
  class Parser;

  std::vector<std::string> names_;
  std::vector<FormulaFunction> functions_;
  std::vector<Step> program_;
};

/// For the course of a formula along its variable, whose other arguments are not known: FormulaLaw::guess.
class GuessedFormula final : public ScalarLawOf<GuessedFormula>, public PlacedLaw {
 public:
  explicit GuessedFormula(const FormulaLaw& formula) : formula_(formula) {}
  int number_count() const override { return formula_.number_count(); }
  void add_places(const double* p, LawPlaces& places) const override { formula_.add_places(p, places); }
  template <class S, class P>
  S physics(const S& x, const P* p) const {
    if constexpr (std::is_same_v<S, double>)
      return formula_.guess(x, p);
    else
      return formula_.physics(x, p);
  }

 private:
  const FormulaLaw& formula_;
};

}  // namespace costate
