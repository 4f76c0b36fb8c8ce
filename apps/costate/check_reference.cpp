#include "check_reference.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/integrator/run_end.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scaled_gradient.h"
#include "costate/record/interrupt.h"
#include "costate/record/jobs.h"
#include "costate/sensitivity/confirmation.h"
#include "costate/sensitivity/method.h"

namespace costate::app {

namespace {

/// The forward sensitivities that others are measured by.
const SensitivityMethod* reference_method() {
  return first_method([](const auto& m) { return m.is_reference; });
}

class ReferenceSearch {
 public:
  ReferenceSearch(const Problem& problem, const std::vector<double>& rho, double patience, RunBudget& budget, int jobs)
      : problem_(problem), rho_(rho), patience_(patience), budget_(budget), jobs_(jobs) {
    problem_.solver.integrator.clear();
    problem_.solver.step_s = 0;
  }

  CheckReference find(const std::string& formulation) {
    r_ = {};
    y_ = &r_.yardstick;
    y_->formulation = problem_.formulation = formulation;
    y_->parameters = problem_.parameters;
    y_->rtol_of_scene = problem_.solver.rtol;
    y_->method = reference_method()->name;
    base_ = timed(problem_, y_->method);
    if (resolve_small_psi(problem_, base_, [&](const Problem& p) { return timed(p, y_->method); })) {
      r_.tolerances = problem_.solver.absolute_by_rtol();
      r_.note = fmt::format(
          "psi is far below absolute tolerances: all runs have smaller ones here, atol {:.1e} and {:.1e} of psi's "
          "integral.",
          problem_.solver.atol, problem_.solver.cost_atol);
    }
    tighten();
    y_->components = y_->components_of(y_->result);
    y_->uncertainty = y_->components_of(base_);
    for (std::size_t j = 0; j < y_->components.size(); ++j)
      // The error falls by far more than ten over two or three digits of the tolerance.
      y_->uncertainty[j] = y_->rtol < problem_.solver.rtol ? std::abs(y_->uncertainty[j] - y_->components[j]) / 10
                                                           : 10 * y_->rtol * std::abs(y_->components[j]);
    measure_cost();
    measure_size();
    const std::vector<double> own = y_->components_of(base_);
    for (std::size_t j = 0; j < own.size(); ++j)
      y_->own_error = std::max(y_->own_error, std::abs(own[j] - y_->components[j]) / y_->unit_of(j));
    compare_with_differences();
    budget_.unlimited();
    return r_;
  }

 private:
  /// A run whose cost is what the others are allowed a multiple of.
  GradientResult timed(const Problem& p, const std::string& method) {
    const double begin = RunBudget::processor_s();
    Problem once = p;
    once.solver.confirm = false;
    GradientResult g = gradient(once, method, rho_);
    r_.seconds = std::max(RunBudget::processor_s() - begin, kLeastSeconds);
    r_.steps = std::max(static_cast<double>(g.counters.steps), kLeastSteps);
    return g;
  }
  void add_note(const std::string& sentence) { r_.note += (r_.note.empty() ? "" : " ") + sentence; }
  void allow(double share = 1) { budget_.begin(patience_ * share * r_.seconds, patience_ * r_.steps); }

  void tighten() {
    Problem tight = problem_;
    std::string failure;
    for (double rtol = std::max(1e-13, std::min(1e-11, problem_.solver.rtol * 1e-3)); rtol < 0.5 * problem_.solver.rtol;
         rtol *= 10) {
      tight.solver.set_rtol(rtol);
      allow();
      try {
        y_->result = timed(tight, y_->method);
        y_->rtol = rtol;
        return;
      } catch (const SolverError& e) {
        failure = e.what();
      } catch (const Cut& e) {
        failure = std::string("cut ") + e.what();
      }
    }
    y_->result = base_;
    y_->rtol = problem_.solver.rtol;
    if (!failure.empty()) add_note("The reference could not be run at a tighter tolerance: " + failure);
  }

  /// What must not fail the check: it only makes it blunter.
  template <class F>
  std::string attempt(F&& f) {
    try {
      f();
      return {};
    } catch (const Interrupted&) {
      throw;
    } catch (const Error& e) {
      return e.what();
    } catch (const Cut& e) {
      return std::string("cut ") + e.what();
    }
  }

  /// Terms by their amounts, so that they do not cancel: sum |w_i| + integral of sum |g_i| dt, by rectangles. And what
  /// they change by with the states off by their absolute tolerances, some up and some down.
  void measure_cost() {
    constexpr int samples = 200;
    std::vector<double> q, v;
    allow();
    attempt([&] {
      const Problem whole = until_its_end(problem_, rho_);
      const double t0 = whole.solver.t_start, t1 = whole.solver.t_end;
      std::vector<double> times;
      for (int i = 1; i <= samples; ++i) times.push_back(i == samples ? t1 : t0 + (t1 - t0) * i / samples);
      simulate(whole, rho_, times, [&](const MechanismState& s, System& system) {
        const Objective& o = system.objective();
        Assembly& a = system.assembly();
        q.assign(s.q, s.q + a.n());
        v.assign(s.v, s.v + a.n());
        for (std::size_t i = 0; i < q.size(); ++i) {
          const double sign = std::cos(2.4 * static_cast<double>(i) + 0.3) > 0 ? 1 : -1;
          q[i] += sign * whole.solver.absolute();
          v[i] -= sign * whole.solver.absolute();
        }
        StateView moved = s;
        moved.q = q.data();
        moved.v = v.data();
        const auto add = [&](const auto& terms, double weight) {
          for (const auto& term : terms) {
            const double value = term->value(s, a);
            y_->cost += weight * std::abs(value);
            y_->by_states += weight * std::abs(term->value(moved, a) - value);
          }
        };
        add(o.running, (t1 - t0) / samples);
        if (s.t >= t1) add(o.terminal, 1);
      });
    });
    if (!std::isfinite(y_->cost)) y_->cost = 0;
    if (!std::isfinite(y_->by_states)) y_->by_states = 0;
    y_->cost = std::max(y_->cost, std::abs(y_->result.psi));
  }

  /// Changes that differ from one parameter to the next: some motions do not know a common factor.
  void measure_size() {
    const auto& p = y_->parameters.parameters;
    const auto largest = [&](const std::vector<double>& g) {
      const double size = largest_scaled(y_->parameters, g);
      return std::isfinite(size) ? size : 0;
    };
    y_->size = largest(y_->result.gradient);
    std::vector<double> elsewhere = rho_;
    for (std::size_t j = 0; j < p.size(); ++j)
      elsewhere[j] += 0.01 * p[j].scale * std::cos(2.4 * static_cast<double>(j));
    allow();
    attempt([&] { y_->size = std::max(y_->size, largest(gradient(problem_, y_->method, elsewhere).gradient)); });
  }

  void compare_with_differences() {
    Problem loose = problem_;  // they run as tightly as they can, and no looser than this
    loose.solver.set_rtol(std::min(1e-10, problem_.solver.rtol));
    loose.solver.max_steps = std::min(loose.solver.max_steps, static_cast<long>(patience_ * r_.steps));
    allow(kDifferencesShare);
    GradientResult d;
    const std::string& differences = first_method([](const auto& m) { return m.perturbs; })->name;
    const JobsHere at_once(jobs_);
    const std::string failure = attempt([&] { d = gradient(loose, differences, rho_); });
    if (!failure.empty()) {
      add_note("The reference is not proven by differences: " + failure);
      return;
    }
    r_.proven = true;
    const std::vector<double> c = y_->components_of(d);
    double most = -1;
    for (std::size_t j = 0; j < c.size(); ++j) {
      const bool psi = j + 1 == c.size();
      const double estimate = psi ? 0 : d.gradient_error[j] * y_->parameters.parameters[j].scale, unit = y_->unit_of(j);
      double apart = std::abs(c[j] - y_->components[j]);
      if (!std::isfinite(apart)) apart = std::numeric_limits<double>::infinity();
      r_.apart = std::max(r_.apart, apart / unit);
      r_.estimate = std::max(r_.estimate, estimate / unit);
      const double beyond = apart / (10 * estimate + 1e-6 * unit + y_->zero());
      if (beyond > most) r_.worst = y_->name(j);
      most = std::max(most, beyond);
      // Bounds both: what one knows is the smaller one.
      y_->uncertainty[j] = std::min(y_->uncertainty[j], apart + estimate);
    }
    r_.agrees = most <= 1;
    y_->has_digits = r_.agrees || r_.apart < kNoDigit;
  }

  Problem problem_;
  const std::vector<double>& rho_;
  double patience_;
  RunBudget& budget_;
  int jobs_;
  GradientResult base_;
  CheckReference r_;
  Yardstick* y_ = nullptr;
};

}  // namespace

CheckReference find_reference(const Problem& problem, const std::vector<double>& rho, bool redundant, double patience,
                              RunBudget& budget, int jobs) {
  ReferenceSearch search(problem, rho, patience, budget, jobs > 0 ? jobs : cores());
  std::string first, last;  // exact constraints; soft ones, which get past more
  for (const Formulation* f : stand_ins(redundant)) {
    if (!refusal(*reference_method(), *f).empty()) continue;
    if (first.empty()) first = f->name;
    last = f->name;
  }
  try {
    return search.find(first);
  } catch (const ModelError&) {
    return search.find(last);
  } catch (const SolverError&) {
    return search.find(last);
  }
}

}  // namespace costate::app
