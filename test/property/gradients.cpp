// Every formulation by every method of an integrator: the gradient against Richardson differences of whole runs, which
// share no derivative with it, and against each other. The kitchen sink has parameters of every kind, a moving start,
// force states, and a cost that holds positions, velocities, accelerations, multipliers, force states, time and
// parameters in its running and its terminal part: a missing boundary term or a lost block shows as an error of 1e-3
// and more.
//
// Tolerances. An integrator keeps the error of each step below rtol; over the N steps of a run (up to 1e3 here) the
// errors add up to N rtol as long as the motion does not amplify them, which a damped second of motion does not. So
// psi and the gradient are good to 1e3 rtol of their size, where the size of a gradient is its largest entry per
// parameter's own scale: smaller entries are differences of terms of that size. The oracle adds its own estimate.
#include <catch2/catch.hpp>
#include <cstdlib>
#include <map>
#ifdef __GLIBC__
#include <malloc.h>
#endif

#include <support/compare.h>
#include <support/models.h>
#include <support/sweep.h>
#include <support/variants.h>

#include "costate/integrator/simulate.h"
#include "gradient_compare.h"

using namespace costate;
using namespace costate::test;

namespace {

constexpr double kSteps = 1e3;

struct Oracle {
  GradientResult result;
  double error = 0;  // relative to the gradient's size
};

/// Differences of whole runs. All formulations with exact constraints have one and the same psi, so that they share an
/// oracle, which none of their derivative blocks has a part in; each penalty has its own.
class Oracles {
 public:
  const Oracle& of(const Problem& problem, const Variant& v, const std::vector<double>& rho) {
    const bool exact = v.formulation.rfind("penalty", 0) != 0;
    const auto [found, is_new] = known_.try_emplace(
        (exact ? "exact" : v.label) + (problem.parameters.size() > 0 ? problem.parameters.names()[0] : ""));
    if (!is_new) return found->second;
    Problem p = problem;
    if (exact) p.formulation = "baumgarte";
    p.solver.integrator = "cvodes";
    Oracle& o = found->second;
    o.result = gradient(p, "differences", rho);
    for (std::size_t j = 0; j < rho.size(); ++j)
      o.error = std::max(o.error, o.result.gradient_error[j] * p.parameters.parameters[j].scale);
    o.error /= size_of(o.result.gradient, p.parameters);
    return o;
  }

 private:
  std::map<std::string, Oracle> known_;
};

/// All methods of the problem's formulation against differences.
void check_against_differences(const Problem& problem, const Variant& v, const std::vector<double>& rho,
                               Oracles& oracles) {
  const Oracle& oracle = oracles.of(problem, v, rho);
  CAPTURE(oracle.error);
  const double tolerance = kSteps * problem.solver.rtol;
  REQUIRE(oracle.error < tolerance);
  for (const auto& method : integrator_methods(problem.formulation)) {
    CAPTURE(method);
    const GradientResult r = gradient(problem, method, rho);
    CHECK(std::abs(r.psi - oracle.result.psi) <= tolerance * std::abs(oracle.result.psi));
    CHECK_BELOW(gradient_mismatch(r.gradient, oracle.result.gradient, problem.parameters),
                tolerance + 10 * oracle.error);
  }
}

Problem problem_of(const TestModel& model, const Variant& v, double rtol) {
  Problem p = model.problem(v.formulation, rtol);
  p.formulation_options = v.options;
  p.parameters = model.all_parameters();
  return p;
}

bool runs_by_integrator(const Variant& v) { return !integrator_methods(v.formulation).empty(); }

}  // namespace

TEST_CASE("gradient: every formulation and method has what this file expects", "[gradients]") {
  // Guards the loops below against running empty.
  CHECK(integrator_methods("index1").size() >= 4);
  CHECK(integrator_methods("baumgarte").size() >= 4);
  CHECK(integrator_methods("penalty").size() >= 4);
  CHECK(integrator_methods("index2").size() >= 2);
  CHECK(kitchen_sink().all_parameters().size() == 39);
}

TEST_CASE("gradient: kitchen sink against differences", "[gradients]") {
  const TestModel model = kitchen_sink();
  Oracles oracles;
  std::size_t turn = 0;
  for (const Variant& v : variants()) {
    if (!runs_by_integrator(v)) continue;
    INFO(v.label);
    Problem p = problem_of(model, v, 1e-9);
    p.parameters = some_of(p.parameters, turn++);
    check_against_differences(p, v, p.parameters.values(), oracles);
  }
}

TEST_CASE("gradient: kitchen sink without accelerations against differences", "[gradients]") {
  const TestModel model = kitchen_sink_without_accelerations();
  Oracles oracles;
  for (const Variant& v : variants()) {
    if (!runs_by_integrator(v)) continue;
    INFO(v.label);
    Problem p = problem_of(model, v, 1e-9);
    p.parameters = model.mechanism->select({"plate_mass", "crank_length", "hole_x", "table", "motor_amplitude",
                                            "relaxation_damping", "lag_start", "start_F_vx", "track1"});
    check_against_differences(p, v, p.parameters.values(), oracles);
  }
}

TEST_CASE("gradient: forward sensitivities by the simultaneous corrector, too", "[gradients]") {
  const TestModel model = kitchen_sink();
  for (const Variant& v : variants()) {
    Problem p = problem_of(model, v, 1e-9);
    for (const auto& method : integrator_methods(v.formulation)) {
      if (method.find("forward") == std::string::npos) continue;
      INFO(v.label << ", " << method);
      p.solver.staggered = true;
      const GradientResult staggered = gradient(p, method, p.parameters.values());
      p.solver.staggered = false;
      const GradientResult simultaneous = gradient(p, method, p.parameters.values());
      CHECK(staggered.counters.residuals != simultaneous.counters.residuals);
      CHECK_BELOW(gradient_mismatch(simultaneous.gradient, staggered.gradient, p.parameters), 2 * kSteps * 1e-9);
    }
  }
}

TEST_CASE("gradient: away from the scene's own numbers and from t = 0", "[gradients]") {
  const TestModel model = kitchen_sink();
  Oracles oracles;
  for (const Variant& v : variants()) {
    if (!runs_by_integrator(v)) continue;
    INFO(v.label);
    Problem p = problem_of(model, v, 1e-9);
    p.parameters = model.mechanism->select({"bob_mass", "rod_length", "string_length", "eye_along", "natural",
                                            "motor_frequency", "gear_ratio", "wind_step", "lag", "start_R_y", "g"});
    p.solver.t_start = 0.15;
    p.solver.t_end = 0.55;
    std::vector<double> rho = p.parameters.values();
    for (std::size_t j = 0; j < rho.size(); ++j) rho[j] *= 1 + 0.02 * std::sin(1.0 + static_cast<double>(j));
    check_against_differences(p, v, rho, oracles);
  }
}

TEST_CASE("gradient: a terminal cost alone, a running cost alone", "[gradients]") {
  for (const bool terminal : {true, false}) {
    TestModel model = kitchen_sink();
    (terminal ? model.objective.running : model.objective.terminal).clear();
    CAPTURE(terminal);
    Oracles oracles;
    for (const Variant& v : variants()) {
      if (!runs_by_integrator(v)) continue;
      INFO(v.label);
      Problem p = problem_of(model, v, 1e-9);
      p.parameters = model.mechanism->select({"bar_mass", "rod_length", "motor_frequency", "lag", "start_R_y", "g"});
      p.solver.t_end = 0.5;
      check_against_differences(p, v, p.parameters.values(), oracles);
    }
  }
}

TEST_CASE("gradient: no constraint, no force state", "[gradients]") {
  for (TestModel model : {free_flight(), five_bar()}) {
    model.t_end = 1;
    Oracles oracles;
    for (const Variant& v : variants()) {
      if (!runs_by_integrator(v)) continue;
      INFO(model.name << ", " << v.label);
      const Problem p = problem_of(model, v, 1e-9);
      check_against_differences(p, v, p.parameters.values(), oracles);
    }
  }
}

TEST_CASE("gradient: exact-constraint formulations agree to 1e-8 at rtol 1e-11", "[gradients]") {
  // 1e3 rtol, as everywhere in this file.
  const TestModel model = kitchen_sink();
  const GradientResult* first = nullptr;
  std::vector<GradientResult> results;
  results.reserve(100);
  for (const Variant& v : variants()) {
    if (v.formulation.rfind("penalty", 0) == 0 || !runs_by_integrator(v)) continue;
    const Problem p = problem_of(model, v, 1e-11);
    for (const auto& method : integrator_methods(v.formulation)) {
      INFO(v.label << ", " << method);
      results.push_back(gradient(p, method, p.parameters.values()));
      if (!first) first = &results.front();
      CHECK(std::abs(results.back().psi / first->psi - 1) <= 1e-8);
      CHECK_BELOW(gradient_mismatch(results.back().gradient, first->gradient, p.parameters), 1e-8);
    }
  }
  CHECK(results.size() >= 10);
}

TEST_CASE("gradient: parameters alone and together give the same entries", "[gradients]") {
  const TestModel model = kitchen_sink();
  for (const Variant& v : variants()) {
    for (const auto& method : integrator_methods(v.formulation)) {
      INFO(v.label << ", " << method);
      Problem p = problem_of(model, v, 1e-7);
      const GradientResult all = gradient(p, method, p.parameters.values());
      const double size = size_of(all.gradient, p.parameters);
      const auto names = p.parameters.names();
      for (const char* name : {"rod_length", "relaxation_start", "end_target"}) {
        CAPTURE(name);
        p.parameters = model.mechanism->select({name});
        const GradientResult one = gradient(p, method, p.parameters.values());
        REQUIRE(one.gradient.size() == 1);
        const auto j = std::find(names.begin(), names.end(), name) - names.begin();
        CHECK(std::abs(one.gradient[0] - all.gradient[static_cast<std::size_t>(j)]) *
                  p.parameters.parameters[0].scale <=
              kSteps * 1e-7 * size);
      }
    }
  }
}

TEST_CASE("gradient: no parameter at all", "[gradients]") {
  const TestModel model = kitchen_sink();
  for (const Variant& v : variants()) {
    if (!runs_by_integrator(v)) continue;
    Problem p = problem_of(model, v, 1e-6);
    p.parameters = {};
    const double psi = simulate(p, {}).psi;
    for (const auto& method : integrator_methods(v.formulation)) {
      INFO(v.label << ", " << method);
      const GradientResult r = gradient(p, method, {});
      CHECK(r.gradient.empty());
      CHECK(std::abs(r.psi / psi - 1) <= kSteps * 1e-6);
    }
  }
}

TEST_CASE("gradient: adjoint runs through many checkpoints", "[gradients]") {
  const TestModel model = kitchen_sink();
  for (const Variant& v : variants()) {
    for (const auto& method : integrator_methods(v.formulation)) {
      if (method.find("adjoint") == std::string::npos) continue;
      INFO(v.label << ", " << method);
      Problem p = problem_of(model, v, 1e-8);
      const GradientResult one = gradient(p, method, p.parameters.values());
      CHECK(one.counters.checkpoints == 0);
      p.solver.checkpoint_steps = 20;
      const GradientResult many = gradient(p, method, p.parameters.values());
      CHECK(many.counters.checkpoints > 3);
      CHECK(std::abs(many.psi / one.psi - 1) <= kSteps * 1e-8);
      CHECK_BELOW(gradient_mismatch(many.gradient, one.gradient, p.parameters), kSteps * 1e-8);
    }
  }
}

TEST_CASE("gradient: results do not depend on the memory they are computed in", "[gradients]") {
  // Reads of memory that nobody wrote: with glibc, fresh memory is filled with different patterns for each run.
  // (CVODES' quadratures of sensitivities with Adams' method are such a case, which is why they are not used.)
  const TestModel model = kitchen_sink();
  for (const Variant& v : variants()) {
    for (const auto& method : integrator_methods(v.formulation)) {
      INFO(v.label << ", " << method);
      const Problem p = problem_of(model, v, 1e-7);
      std::vector<GradientResult> results;
      for (const int pattern : {0, 0x55, 0xC0}) {
#ifdef __GLIBC__
        mallopt(M_PERTURB, pattern);
#endif
        results.push_back(gradient(p, method, p.parameters.values()));
      }
#ifdef __GLIBC__
      mallopt(M_PERTURB, 0);
#endif
      for (const auto& r : results) {
        CHECK(r.psi == results[0].psi);
        CHECK(r.gradient == results[0].gradient);
        CHECK(r.counters.steps == results[0].counters.steps);
      }
    }
  }
}

TEST_CASE("gradient: the estimate of its own error has the right size", "[gradients]") {
  // The estimate is the distance to a run at rtol / 10, whose own error is about a tenth: 0.9 of the true error when
  // both point the same way, 1.1 when not; multistep errors are irregular in rtol, hence the wide factor.
  const TestModel model = five_bar();
  Problem p = model.problem("index1", 1e-5);
  const std::vector<double> rho = p.parameters.values();
  const std::vector<double> exact = {-4.228810855240615, 3.211604102987020};
  for (const char* method : {"idas-adjoint", "cvodes-forward"}) {
    CAPTURE(method);
    const GradientResult r = gradient(p, method, rho);
    const std::vector<double> estimate = estimate_gradient_error(p, method, rho, r);
    REQUIRE(estimate.size() == 2);
    const double true_error = std::hypot(r.gradient[0] - exact[0], r.gradient[1] - exact[1]);
    const double estimated = std::hypot(estimate[0], estimate[1]);
    CAPTURE(true_error, estimated);
    CHECK(estimated > 0.3 * true_error);
    CHECK(estimated < 3 * true_error);
  }
}
