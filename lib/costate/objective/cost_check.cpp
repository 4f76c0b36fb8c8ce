#include "costate/objective/cost_check.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "costate/base/error.h"
#include "costate/base/extrapolated_difference.h"
#include "costate/base/generic_numbers.h"
#include "costate/base/library_class.h"
#include "costate/objective/sampled_cost.h"

namespace costate {

namespace {

constexpr double kAllowed = 1e-5;
constexpr int kArguments = 200;  // of these as many are looked at, evenly

using Vector = Eigen::VectorXd;

Vector generic(int n, int seed) {
  const std::vector<double> x = generic_numbers(static_cast<std::size_t>(n), seed);
  return Eigen::Map<const Vector>(x.data(), n);
}

/// q, v, a, lambda, z and rho of a state, one behind the other, and the time.
class Point {
 public:
  Point(Assembly& assembly, const std::vector<double>& rho) : assembly_(assembly) {
    const int n = assembly.n(), m = assembly.m(), nz = assembly.nz(), np = assembly.np();
    const std::vector<double> first = assembly.mechanism().first_positions();
    Vector q = Eigen::Map<const Vector>(first.data(), n);
    const double size = q.cwiseAbs().maxCoeff();
    q += 1e-2 * (size > 0 ? size : 1) * generic(n, 1);
    x_.resize(3 * n + m + nz + np);
    x_ << q, generic(n, 2), generic(n, 3), generic(m, 4), generic(nz, 5), Eigen::Map<const Vector>(rho.data(), np);
  }
  int size() const { return static_cast<int>(x_.size()); }
  const Vector& values() const { return x_; }
  /// "the position of 'P.x'".
  std::string name(int i) const {
    const int n = assembly_.n(), m = assembly_.m(), nz = assembly_.nz();
    const Mechanism& mechanism = assembly_.mechanism();
    for (const char* kind : {"position", "velocity", "acceleration"}) {
      if (i < n) return fmt::format("the {} of '{}'", kind, mechanism.coordinate_names()[static_cast<std::size_t>(i)]);
      i -= n;
    }
    if (i < m) return fmt::format("the multiplier of '{}'", mechanism.row_names()[static_cast<std::size_t>(i)]);
    if ((i -= m) < nz) return fmt::format("the state '{}'", mechanism.state_names()[static_cast<std::size_t>(i)]);
    return fmt::format("the parameter '{}'", assembly_.parameters().names()[static_cast<std::size_t>(i - nz)]);
  }
  /// Calls f with the view of x, rho being that of x.
  template <class F>
  auto at(const Vector& x, double t, bool accelerations, const F& f) const {
    const int n = assembly_.n(), m = assembly_.m();
    assembly_.set_parameters(x.data() + size() - assembly_.np());
    const double* at = x.data();
    return f(StateView{t, at, at + n, accelerations ? at + 2 * n : nullptr, accelerations ? at + 3 * n : nullptr,
                       at + 3 * n + m});
  }

 private:
  Assembly& assembly_;
  Vector x_;
};

class TermCheck {
 public:
  TermCheck(const CostTerm& term, std::string name, Assembly& assembly, const std::vector<double>& rho)
      : term_(term),
        name_(std::move(name)),
        assembly_(assembly),
        point_(assembly, rho),
        accelerations_(term.needs_accelerations()) {}

  /// What is wrong with it, or nothing.
  std::string check_promise() {
    if (!accelerations_) at_places([&](const Vector& x, double t) { look_at_promise(x, t); });
    return told_;
  }
  std::string check_derivatives() {
    at_places([&](const Vector& x, double t) { look_at_derivatives(x, t); });
    return told_;
  }

 private:
  /// At a few times, near the start, a little away, and on the other side of zero. One that the term refuses tells
  /// nothing.
  template <class F>
  void at_places(const F& look) {
    const int n = assembly_.n();
    const Vector start = point_.values();
    for (const double t : {0.37, 1.61, 13.0}) {
      Vector x = start;
      if (t > 1)
        x.head(n) =
            t > 10 ? Vector(-x.head(n)) : Vector(x.head(n) + 0.1 * x.head(n).cwiseAbs().maxCoeff() * generic(n, 9));
      if (t > 1) x.segment(n, 2 * n + assembly_.m()) *= t > 10 ? 30 : -2;
      try {
        look(x, t);
      } catch (const std::exception&) {
      }
      if (!told_.empty()) return;
    }
  }

  void look_at_promise(const Vector& x, double t) {
    const int n = assembly_.n();
    Vector other = x;
    other.segment(2 * n, n + assembly_.m()) *= -0.7;
    const double a = value(x, t, true), b = value(other, t, true);
    if (a != b && std::isfinite(a) && std::isfinite(b))
      told_ = fmt::format(
          "{} changes with accelerations or multipliers (from {:.9g} to {:.9g}), and its needs_accelerations() says "
          "that it does not.",
          name_, a, b);
  }

  void look_at_derivatives(const Vector& x, double t) {
    const Vector g = gradient(x, t), more = gradient(x, t, 0.7, &g);
    const double rounding = 1e-9 * (std::abs(value(x, t, accelerations_)) + g.cwiseAbs().maxCoeff());
    const int stride = std::max(1, point_.size() / kArguments);
    for (int i = 0; i < point_.size(); i += stride) {
      const auto along = [&](double h) {
        Vector y = x;
        y[i] += h;
        return Vector::Constant(1, value(y, t, accelerations_));
      };
      if (const auto d = extrapolated_difference(along, std::max(1e-3, std::abs(x[i]))))
        judge("add_gradient", "by " + point_.name(i), g[i], (*d)[0], rounding);
      judge("add_gradient", "with a factor, beside what is there, by " + point_.name(i), more[i], 1.7 * g[i], 0);
    }
    look_along(x, t, rounding);
  }

  double value(const Vector& x, double t, bool accelerations) {
    return point_.at(x, t, accelerations, [&](const StateView& s) { return term_.value(s, assembly_); });
  }
  Vector flat(const ScalarGradient& g) const {
    Vector r(point_.size());
    r << g.q, g.v, g.a, g.lambda, g.z, g.rho;
    return r;
  }
  /// Added to what is `there`, or to nothing.
  Vector gradient(const Vector& x, double t, double factor = 1, const Vector* there = nullptr) {
    ScalarGradient g;
    g.resize(assembly_);
    g.set_zero();
    Eigen::Index at = 0;
    if (there)
      for (Eigen::VectorXd* of : {&g.q, &g.v, &g.a, &g.lambda, &g.z, &g.rho}) {
        *of = there->segment(at, of->size());
        at += of->size();
      }
    point_.at(x, t, accelerations_, [&](const StateView& s) { term_.add_gradient(s, assembly_, factor, g); });
    return flat(g);
  }

  /// change() and add_gradient_change() along one direction; a term need not have them.
  void look_along(const Vector& x, double t, double rounding) {
    const int n = assembly_.n(), m = assembly_.m();
    Vector d = generic(point_.size(), 7);
    d.tail(assembly_.np()).array() *= x.tail(assembly_.np()).array();
    const double time_rate = 0.3;
    std::vector<double> numbers(assembly_.numbers().size());
    for (std::size_t k = 0; k < numbers.size(); ++k)
      for (const auto& [j, factor] : assembly_.number_columns()[k])
        numbers[k] += factor * d[point_.size() - assembly_.np() + j];
    const double* at = d.data();
    const Variation variation{time_rate,
                              at,
                              at + n,
                              accelerations_ ? at + 2 * n : nullptr,
                              accelerations_ ? at + 3 * n : nullptr,
                              at + 3 * n + m,
                              numbers.data()};
    const auto moved = [&](double h) { return Vector(x + h * d); };
    const auto found = [&](const auto& f) -> std::optional<decltype(f(StateView()))> {
      try {
        return point_.at(x, t, accelerations_, f);
      } catch (const CapabilityError&) {
        return std::nullopt;
      }
    };
    if (const auto change = found([&](const StateView& s) { return term_.change(s, assembly_, variation); })) {
      const auto along = [&](double h) {
        return Vector::Constant(1, value(moved(h), t + h * time_rate, accelerations_));
      };
      if (const auto expected = extrapolated_difference(along, 1))
        judge("change", "along a direction", *change, (*expected)[0], rounding);
    }
    const auto change = found([&](const StateView& s) {
      ScalarGradient g;
      g.resize(assembly_);
      g.set_zero();
      term_.add_gradient_change(s, assembly_, variation, g);
      return flat(g);
    });
    if (!change) return;
    const auto expected = extrapolated_difference([&](double h) { return gradient(moved(h), t + h * time_rate); }, 1);
    if (!expected) return;
    const double size = rounding + 1e-9 * expected->cwiseAbs().maxCoeff();
    for (int i = 0; i < point_.size(); ++i)
      judge("add_gradient_change", "by " + point_.name(i), (*change)[i], (*expected)[i], size);
  }

  void judge(const char* function, const std::string& of, double found, double expected, double rounding) {
    if (!std::isfinite(rounding)) return;  // a value that is no number tells nothing
    if (!told_.empty() || !std::isfinite(found) ||
        std::abs(found - expected) <= kAllowed * std::max(std::abs(found), std::abs(expected)) + rounding)
      return;
    told_ = fmt::format(
        "{}: {}() is wrong: {} it gives {:.9g}, and differences of what it is the derivative of give "
        "{:.9g}. Derived from DualCostTerm, a cost has its derivatives from its formula.",
        name_, function, of, found, expected);
  }

  const CostTerm& term_;
  std::string name_, told_;
  Assembly& assembly_;
  Point point_;
  bool accelerations_;
};

/// Throws what check(TermCheck&) tells of terms of users' that have not passed it before.
template <class Check>
void for_terms_of_users(const std::shared_ptr<const Mechanism>& mechanism, const ParameterSelection& parameters,
                        const Objective& objective, const std::vector<double>& rho,
                        const std::shared_ptr<const Output>& end, const PassedOnce CostTerm::*passed,
                        const Check& check) {
  std::unique_ptr<Assembly> assembly;
  if (end && !is_of_library(typeid(*end))) {
    assembly = std::make_unique<Assembly>(mechanism, parameters);
    const OutputTerm own(end, 1, -1, {});
    TermCheck term(own, "The output that ends the run", *assembly, rho);
    if (const std::string wrong = check(term); !wrong.empty()) throw Error(wrong);
  }
  for (const bool running : {true, false}) {
    const auto& terms = running ? objective.running : objective.terminal;
    for (std::size_t i = 0; i < terms.size(); ++i) {
      const CostTerm& own = ungated(*terms[i]);
      if ((own.*passed).get() || !is_of_user(own)) continue;
      if (!assembly) assembly = std::make_unique<Assembly>(mechanism, parameters);
      TermCheck term(own, fmt::format("The {} cost's term {}", running ? "running" : "terminal", i), *assembly, rho);
      if (const std::string wrong = check(term); !wrong.empty()) throw Error(wrong);
      (own.*passed).set();
    }
  }
}

}  // namespace

bool is_of_user(const CostTerm& term) {
  if (!is_of_library(typeid(term))) return true;
  const auto* of = dynamic_cast<const OutputTerm*>(&term);
  if (!of) return false;
  const Output &output = of->output(), *target = of->target().output.get();
  return !is_of_library(typeid(output)) || (target && !is_of_library(typeid(*target)));
}

void check_cost_promises(const std::shared_ptr<const Mechanism>& mechanism, const ParameterSelection& parameters,
                         const Objective& objective, const std::vector<double>& rho,
                         const std::shared_ptr<const Output>& end) {
  for_terms_of_users(mechanism, parameters, objective, rho, end, &CostTerm::promise_passed,
                     [](TermCheck& t) { return t.check_promise(); });
}

void check_cost_derivatives(const std::shared_ptr<const Mechanism>& mechanism, const ParameterSelection& parameters,
                            const Objective& objective, const std::vector<double>& rho,
                            const std::shared_ptr<const Output>& end) {
  for_terms_of_users(mechanism, parameters, objective, rho, end, &CostTerm::derivatives_passed,
                     [](TermCheck& t) { return t.check_derivatives(); });
}

}  // namespace costate
