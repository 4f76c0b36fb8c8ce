// The five-bar against an independent program: float128 Gragg-Bulirsch-Stoer extrapolation on the index-1 equations,
// two tolerances agreeing to 19 digits (forward duals for the derivatives, central differences beside them).
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/integrator/simulate.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "support/paths.h"

using namespace costate;

namespace {

const double kPsi = 7.268774613130025974529e-01;
const std::vector<std::pair<std::string, double>> kGradient = {
    {"L01", -4.228810855240614756418e+00}, {"L02", 3.211604102987019604726e+00}, {"k1", -3.351280337646821926925e-03},
    {"k2", -6.825912537581548589205e-03},  {"m1", -1.649104234757745108281e-01}, {"m2", 3.593592362723724084530e-02},
    {"m3", 5.413499913828391317240e-01},   {"m4", 3.167008384834970035872e-01}};

Problem five_bar(const std::vector<std::string>& parameters, double rtol) {
  static const Scene scene = Scene::load(COSTATE_MODELS_DIR "/five_bar/five_bar.toml");
  Problem p;
  p.mechanism = scene.mechanism();
  p.objective = scene.objective();
  p.parameters = p.mechanism->select(parameters);
  p.solver.t_end = 5;
  p.solver.rtol = rtol;
  return p;
}

/// The largest error of psi and gradient, relative to psi and to the largest gradient entry in scaled parameters.
double worst_error(const Problem& p, const GradientResult& r) {
  double error = std::abs(r.psi / kPsi - 1), size = 0, largest = 0;
  for (std::size_t j = 0; j < r.gradient.size(); ++j) {
    const Parameter& q = p.parameters.parameters[j];
    for (const auto& [name, value] : kGradient)
      if (name == q.name) {
        size = std::max(size, std::abs(value) * q.scale);
        largest = std::max(largest, std::abs(r.gradient[j] - value) * q.scale);
      }
  }
  return std::max(error, largest / size);
}

bool exact_constraints(const std::string& formulation) { return formulation.rfind("penalty", 0) != 0; }

}  // namespace

TEST_CASE("five-bar: every formulation and method at rtol 1e-9 to 1e-6") {
  // Second-order schemes of fixed step have their own accuracy (test/property/discrete.cpp).
  for (const auto& f : formulations())
    for (const auto& m : sensitivity_methods()) {
      if (!refusal(m, f).empty()) continue;
      Problem p = five_bar({"L01", "L02"}, 1e-9);
      p.formulation = f.name;
      if (by_fixed_steps(p, m)) continue;
      INFO(f.name << " x " << m.name);
      CHECK(worst_error(p, gradient(p, m.name, p.parameters.values())) < 1e-6);
    }
}

TEST_CASE("five-bar: exact-constraint formulations agree to 1e-8 at rtol 1e-11") {
  for (const auto& f : formulations())
    for (const auto& m : sensitivity_methods()) {
      using Needs = SensitivityMethod::Needs;
      if (!refusal(m, f).empty() || m.needs == Needs::either) continue;
      if (!exact_constraints(f.name)) continue;
      Problem p = five_bar({"L01", "L02"}, 1e-11);
      p.formulation = f.name;
      if (by_fixed_steps(p, m)) continue;
      INFO(f.name << " x " << m.name);
      CHECK(worst_error(p, gradient(p, m.name, p.parameters.values())) < 1e-8);
    }
}

TEST_CASE("five-bar: all eight derivatives, adjoint and forward") {
  for (const auto& [formulation, method] : {std::pair{"baumgarte", "cvodes-adjoint"},
                                            {"baumgarte", "cvodes-forward"},
                                            {"index1", "idas-adjoint"},
                                            {"index2", "idas-adjoint"}}) {
    Problem p = five_bar({"L01", "L02", "k1", "k2", "m1", "m2", "m3", "m4"}, 1e-10);
    p.formulation = formulation;
    INFO(formulation << " x " << method);
    CHECK(worst_error(p, gradient(p, method, p.parameters.values())) < 1e-6);
  }
}

TEST_CASE("five-bar: the middle point at t = 1 and 5 s") {
  const double expected[2][2] = {{1.8620239048995612935e-01, -2.1055353699286655131e+00},
                                 {1.1596831830186693725e-01, -2.3037834442252775956e+00}};
  for (const char* formulation : {"index1", "baumgarte", "index2", "maggi", "augmented-lagrangian"}) {
    Problem p = five_bar({"L01"}, 1e-10);
    p.formulation = formulation;
    const int x = p.mechanism->coordinate("P2.x"), y = p.mechanism->coordinate("P2.y");
    int k = 0;
    simulate(p, p.parameters.values(), {1.0, 5.0}, [&](const MechanismState& s, System&) {
      INFO(formulation << " at t = " << s.t);
      // rtol 1e-10 over 5 s of smooth motion: errors of some 1e2 tolerances.
      CHECK(s.q[x] == Approx(expected[k][0]).margin(3e-8));
      CHECK(s.q[y] == Approx(expected[k][1]).margin(3e-8));
      ++k;
    });
    CHECK(k == 2);
  }
}

TEST_CASE("five-bar above the ground: psi and gradient") {
  // Fixed-step RK4 with variational equations of the same mechanism, converged to 1e-13 by step halving.
  const Scene scene = Scene::load(COSTATE_MODELS_DIR "/five_bar/five_bar_above.toml");
  Problem p;
  p.mechanism = scene.mechanism();
  p.objective = scene.objective();
  p.parameters = p.mechanism->select({"L01", "L02"});
  p.solver.t_end = 5;
  p.solver.rtol = 1e-10;
  p.formulation = "baumgarte";
  const GradientResult r = gradient(p, "cvodes-adjoint", p.parameters.values());
  CHECK(r.psi == Approx(0.810986853505048).epsilon(1e-7));
  CHECK(r.gradient[0] == Approx(34.2655612525555).epsilon(1e-7));
  CHECK(r.gradient[1] == Approx(-30.7251582049571).epsilon(1e-7));
}

TEST_CASE("slider-crank of SUNDIALS' forward-sensitivity example") {
  // float128 extrapolation, tolerances 1e-22 and 1e-26 agreeing to 21 digits.
  const Scene scene = Scene::load(COSTATE_MODELS_DIR "/slider_crank/slider_crank.toml");
  const std::vector<std::pair<std::string, double>> expected = {
      {"k", 3.334481061284379075292e-01},  {"c", -3.637540339709497703941e-01}, {"J1", 1.101832736269883708545e+00},
      {"m2", 1.697390594022689927965e-01}, {"J2", 1.910380374184388714143e-01}, {"l0", 7.347589449476958572598e-01},
      {"F", 1.713264856816265826912e+00}};
  std::vector<std::string> names;
  for (const auto& [name, value] : expected) names.push_back(name);
  for (const auto& [formulation, method] : {std::pair{"index1", "idas-forward"},
                                            {"index1", "idas-adjoint"},
                                            {"baumgarte", "cvodes-adjoint"},
                                            {"index2", "idas-adjoint"}}) {
    Problem p;
    p.mechanism = scene.mechanism();
    p.objective = scene.objective();
    p.parameters = p.mechanism->select(names);
    p.solver.t_end = 10;
    p.solver.rtol = 1e-11;
    p.formulation = formulation;
    const GradientResult r = gradient(p, method, p.parameters.values());
    INFO(formulation << " x " << method);
    CHECK(r.psi == Approx(3.33660679948278440821762).epsilon(1e-7));
    for (std::size_t j = 0; j < expected.size(); ++j) {
      INFO(expected[j].first);
      CHECK(r.gradient[j] == Approx(expected[j].second).epsilon(1e-7));
    }
  }
}
