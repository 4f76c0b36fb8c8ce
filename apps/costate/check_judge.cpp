#include "check_judge.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/sensitivity/error_estimate.h"
#include "costate/sensitivity/method.h"

namespace costate::app {

namespace {

// In units of rtol. A right gradient's error is a modest multiple (20 to 400 on smooth scenes) ...
constexpr double kComponent = 1000;   // ... of the component itself,
constexpr double kOthers = 10;        // and of the largest one, where a component is small beside it.
constexpr double kRounding = 1e-9;    // of the largest one, at any tolerance
constexpr double kFallsInDecade = 5;  // what errors of the tolerance fall by in a decade, at least

/// Tells right rows from wrong ones, a row at a time.
class RowJudge {
 public:
  RowJudge(const Yardstick& yardstick, const Problem& problem, const std::string& method, const GradientResult& result,
           const RunMethod& run)
      : y_(yardstick), p_(problem), method_(method), r_(result), run_(run), error_(errors(result)), strict_(strict()) {}

  Judgement judge() {
    find_worst();
    if (by_fixed_steps(p_, find_sensitivity_method(method_))) {
      judge_discrete();
    } else if (!within(error_, strict_)) {
      // What a weight does first, of which the estimate is a part.
      const bool soft = y_.has_digits && by_softness();
      if (!soft && !by_own_estimate() && !by_reference_without_digits() && !by_tolerance())
        j_.verdict = Verdict::disagreement;
    }
    return j_;
  }

 private:
  std::vector<double> errors(const GradientResult& r) const {
    std::vector<double> e = y_.components_of(r);
    for (std::size_t j = 0; j < e.size(); ++j) {
      e[j] = std::abs(e[j] - y_.components[j]);
      if (!std::isfinite(e[j])) e[j] = std::numeric_limits<double>::infinity();
    }
    return e;
  }

  /// What no one needs to explain.
  std::vector<double> strict() const {
    std::vector<double> a;
    const std::size_t psi = y_.components.size() - 1;
    for (std::size_t j = 0; j <= psi; ++j) {
      const double own = std::abs(y_.components[j]), rtol = p_.solver.rtol;
      // psi counts against the larger of itself and the gradient: it may well be zero.
      a.push_back(kComponent * rtol * (j == psi ? std::max(own, y_.size) : own) +
                  (kOthers * rtol + kRounding) * y_.size + y_.uncertainty[j] + y_.zero());
    }
    return a;
  }

  static bool within(const std::vector<double>& error, const std::vector<double>& allowed) {
    for (std::size_t j = 0; j < error.size(); ++j)
      if (!(error[j] <= allowed[j])) return false;
    return true;
  }

  double relative(const std::vector<double>& error) const {
    double largest = 0;
    for (std::size_t j = 0; j < error.size(); ++j) largest = std::max(largest, relative(error[j], j));
    return largest;
  }
  double relative(double error, std::size_t j) const { return error == 0 ? 0 : error / y_.unit_of(j); }

  void find_worst() {
    j_.error = relative(error_);
    double most = -1;
    for (std::size_t j = 0; j < error_.size(); ++j) {
      const double beyond = error_[j] == 0 ? 0 : error_[j] / strict_[j];
      if (!(beyond > most)) continue;
      most = beyond;
      j_.worst = y_.name(j);
      const bool psi = j + 1 == error_.size();
      j_.found = psi ? r_.psi : r_.gradient[j];
      j_.expected = psi ? y_.result.psi : y_.result.gradient[j];
    }
    times_allowed_ = most;
  }

  /// A row that is explained: as it is, with a warning, or wrong all the same.
  bool explain(double without_warning, double tolerable, const std::string& remark) {
    j_.verdict = j_.error <= without_warning ? Verdict::ok
                 : j_.error <= tolerable     ? Verdict::inaccurate
                                             : Verdict::disagreement;
    j_.remark = remark;
    return true;
  }

  /// Where errors grow along the motion the reference's own run at this tolerance is far off, too.
  double tolerable() const { return std::clamp(30 * y_.own_error, kTolerable, 10 * kTolerable); }

  bool by_own_estimate() {
    // All of it, or of a cycle's multiplier a part.
    const std::vector<double>& known =
        r_.gradient_error.empty() && r_.known_error ? r_.known_error->gradient : r_.gradient_error;
    if (known.empty()) return false;
    std::vector<double> allowed = strict_;
    double estimate = 0;
    for (std::size_t j = 0; j < known.size(); ++j) {
      const double e = known[j] * y_.parameters.parameters[j].scale;
      allowed[j] += 10 * e;
      estimate = std::max(estimate, relative(e, j));
    }
    if (!within(error_, allowed)) return false;
    return explain(kForgiven * p_.solver.rtol, tolerable(),
                   fmt::format("its own estimate of its error is {:.1e}", estimate));
  }

  /// Then no more runs are made.
  bool by_reference_without_digits() {
    if (y_.has_digits) return false;
    j_.verdict = Verdict::disagreement;
    j_.remark = "not run again: the reference has no digit itself";
    return true;
  }

  /// Soft constraints are off by O(1/alpha): with ten times alpha by a tenth of that. The difference tells what they
  /// may be off by, and the error must fall as it says.
  bool by_softness() {
    softness_.assign(error_.size(), 0.0);
    if (!has_soft_constraints(p_.formulation)) return false;
    const GradientResult firm = run_(with_firmer_constraints(p_), method_);
    const std::vector<double> here = y_.components_of(r_), there = y_.components_of(firm), left = errors(firm);
    std::vector<double> allowed = strict_, least = strict_;
    for (std::size_t j = 0; j < error_.size(); ++j) {
      softness_[j] = std::abs(here[j] - there[j]) / 0.9;
      // Beyond a hundredth the expansion in 1/alpha says nothing.
      if (!(softness_[j] <= kTolerable * y_.unit_of(j))) softness_[j] = 0;
      allowed[j] += 1.5 * softness_[j];
      least[j] = std::max(strict_[j], 0.3 * error_[j]);
    }
    if (!within(error_, allowed) || !within(left, least)) return false;
    return explain(kSoft, kTolerable,
                   fmt::format("the penalty's own O(1/alpha) is {:.1e}: {:.1e} is left at 10 alpha",
                               relative(softness_), relative(left)));
  }

  /// Tighter, the error falls to what is allowed here, or to noise about zero. A first error may be small by luck and
  /// hardly fall; one that does not fall in the next try either is no tolerance's.
  bool by_tolerance() {
    std::string failure;
    bool falls = false;  // by as much as errors of the tolerance do, if not to what is allowed here
    for (const double factor : {1e-2, 1e-4, 1e-3, 1e-1}) {
      // Only where the formulation cannot follow the tightest; the last one where it could follow none.
      if (factor == 1e-3 && failure.empty()) break;
      if (factor == 1e-1 && !last_.empty()) break;
      Problem tighter = p_;
      tighter.solver.tighten(factor, 1e-13, 1e-15);
      std::vector<double> left, allowed = strict_;
      try {
        left = errors(run_(tighter, method_));
      } catch (const SolverError& e) {
        failure = fmt::format("at rtol {:g} it fails: {}", tighter.solver.rtol, e.what());
        continue;
      }
      bool is_noise = y_.size <= y_.noise(p_.solver.rtol), all_fall = true;
      for (std::size_t j = 0; j < error_.size(); ++j) {
        const double zero = y_.noise(tighter.solver.rtol) + y_.uncertainty[j];
        if (error_[j] > strict_[j]) allowed[j] = std::min(allowed[j], error_[j] / 2);
        // A decade is all that this one can follow: errors fall with the power 5/6 of the tolerance.
        if (factor == 1e-1) allowed[j] = std::max(allowed[j], error_[j] / kFallsInDecade);
        allowed[j] = std::max(allowed[j], zero) + 1.5 * softness_[j];
        is_noise = is_noise && left[j] <= zero;
        all_fall =
            all_fall && left[j] <= std::max(allowed[j], error_[j] * std::pow(kFallsInDecade, std::log10(factor)));
      }
      last_ = fmt::format("{:.1e} at rtol {:g}", relative(left), tighter.solver.rtol);
      falls = falls || all_fall;
      if (within(left, allowed)) return explain_by_tolerance(is_noise);
    }
    // Where no tighter run is to be had.
    if (falls && !failure.empty()) return explain_by_tolerance(false);
    j_.remark = last_.empty() ? failure : last_;
    return false;
  }

  bool explain_by_tolerance(bool is_noise) {
    return explain(kForgiven * p_.solver.rtol, tolerable(),
                   is_noise ? fmt::format("nothing but noise about zero: {}", last_)
                            : fmt::format("limited by the tolerance: {:.2g} times what is expected, and {}",
                                          times_allowed_, last_));
  }

  /// A discrete gradient is exact for its own psi: tangent and adjoint agree to rounding. To the reference it converges
  /// with the square of the step.
  void judge_discrete() {
    Problem same = p_;
    const double span = p_.solver.t_end - p_.solver.t_start, steps = static_cast<double>(r_.counters.steps);
    same.solver.step_s = span / steps;
    const SensitivityMethod& own = find_sensitivity_method(method_);
    const SensitivityMethod* twin =
        first_method([&](const auto& m) { return m.needs == own.needs && m.adjoint != own.adjoint; });
    const std::vector<double> here = y_.components_of(r_), other = y_.components_of(run_(same, twin->name));
    double apart = 0;
    for (std::size_t j = 0; j < here.size(); ++j) {
      const double e = std::abs(here[j] - other[j]);
      apart = std::max(apart, std::isfinite(e) ? relative(e, j) : std::numeric_limits<double>::infinity());
    }
    // Each step adds its rounding.
    if (!(apart <= 1e-12 + steps * std::numeric_limits<double>::epsilon())) {
      j_.verdict = Verdict::disagreement;
      j_.remark = fmt::format("tangent and adjoint of the same steps are {:.1e} apart", apart);
      return;
    }
    if (within(error_, strict_) || by_reference_without_digits()) return;
    double fall = 1;
    for (const double part : {2.0, 4.0}) {
      fall *= 2.5;
      Problem finer = p_;
      finer.solver.step_s = span / (part * steps);
      const std::vector<double> left = errors(run_(finer, method_));
      std::vector<double> allowed = strict_;
      for (std::size_t j = 0; j < error_.size(); ++j)
        allowed[j] = std::max({strict_[j], error_[j] / fall, y_.noise(1e-2 * p_.solver.rtol)});
      j_.remark = fmt::format("tangent and adjoint {:.0e} apart; {:.1e} at {} of the step", apart, relative(left),
                              part == 2 ? "half" : "a quarter");
      if (!within(left, allowed)) continue;
      explain(10 * std::sqrt(p_.solver.rtol), 10 * kTolerable, j_.remark + ", as is of second order");
      return;
    }
    j_.verdict = Verdict::disagreement;
    j_.remark += ": not of second order; kinks, or steps too long for the motion";
  }

  const Yardstick& y_;
  const Problem& p_;
  const std::string& method_;
  const GradientResult& r_;
  const RunMethod& run_;
  std::vector<double> error_, strict_, softness_;
  double times_allowed_ = 0;
  std::string last_;
  Judgement j_;
};

}  // namespace

const char* name_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::ok:
      return "ok";
    case Verdict::inaccurate:
      return "inaccurate";
    case Verdict::disagreement:
      return "disagreement";
    case Verdict::cut:
      return "cut";
    case Verdict::failed:
      return "failed";
    case Verdict::refused:
      return "refused";
  }
  return "";
}

std::vector<double> Yardstick::components_of(const GradientResult& r) const {
  std::vector<double> c;
  for (std::size_t j = 0; j < r.gradient.size(); ++j) c.push_back(r.gradient[j] * parameters.parameters[j].scale);
  c.push_back(r.psi);
  return c;
}

std::string Yardstick::name(std::size_t component) const {
  return component < parameters.parameters.size() ? "parameter " + parameters.parameters[component].name : "psi";
}

double Yardstick::unit() const {
  const double u = std::max({size, 1e-2 * cost, by_states});
  return u > 0 ? u : 1;
}

double Yardstick::unit_of(std::size_t component) const {
  return component < parameters.parameters.size() ? unit() : std::max(unit(), std::abs(result.psi));
}

Judgement judge(const Yardstick& yardstick, const Problem& problem, const std::string& method,
                const GradientResult& result, const RunMethod& run) {
  return RowJudge(yardstick, problem, method, result, run).judge();
}

}  // namespace costate::app
