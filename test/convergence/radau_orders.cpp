// Radau IIA on mechanisms: the order of equal steps, and errors that follow the tolerance.
#include <support/models.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/discrete/radau_step.h"
#include "costate/integrator/simulate.h"
#include "costate/sensitivity/method.h"
#include "property/gradient_compare.h"

using namespace costate;
using namespace costate::test;

namespace {

struct End {
  std::vector<double> y;  // positions and velocities
  double psi;
};

End equal_steps(const Problem& p, const RadauScheme& scheme, double t_end, int n) {
  const auto system = p.make_dae();
  const auto rho = p.parameters.values();
  system->set_parameters(rho.data());
  RadauStep step(scheme, *system, true, {},
                 [&](double t, const double* y, const double* yp, double* r) { system->residual(t, y, yp, r); });
  std::vector<double> y(static_cast<std::size_t>(step.size()), 0), yp(y);
  system->start(0, y.data(), yp.data(), nullptr, nullptr);
  step.begin(0, y.data());
  for (int i = 0; i < n; ++i) {
    if (i > 0) step.go_on();
    step.attempt(t_end / n, t_end * (i + 1) / n);
  }
  const int count = 2 * system->assembly().n();
  return {{step.end(), step.end() + count}, step.end()[system->size()]};
}

double apart(const End& a, const End& b) {
  double d = std::abs(a.psi - b.psi);
  for (std::size_t i = 0; i < a.y.size(); ++i) d = std::max(d, std::abs(a.y[i] - b.y[i]));
  return d;
}

}  // namespace

TEST_CASE("Radau IIA: equal steps converge with the order of the scheme, states and cost") {
  // Index 2 keeps the order of its differential unknowns (Hairer and Wanner II, VII.4). Read off where errors are some
  // 1e3 roundings at the finer steps.
  struct Expected {
    const char* scheme;
    int n;
  };
  for (const char* formulation : {"baumgarte", "index2"})
    for (const Expected& e : {Expected{"radau3", 64}, {"radau5", 24}, {"radau9", 8}}) {
      const RadauScheme& scheme = *find_radau_scheme(e.scheme);
      const Problem p = five_bar().problem(formulation, 1e-6);
      const double t_end = 1;
      const End exact = equal_steps(p, *find_radau_scheme("radau9"), t_end, 60);
      const double coarse = apart(equal_steps(p, scheme, t_end, e.n), exact),
                   fine = apart(equal_steps(p, scheme, t_end, 2 * e.n), exact);
      CAPTURE(formulation, e.scheme, coarse, fine);
      CHECK(std::log2(coarse / fine) >= scheme.order - 0.5);
    }
}

TEST_CASE("Radau IIA: errors of psi and of its gradient fall with the tolerance") {
  for (const char* formulation : {"baumgarte", "index2", "maggi-implicit"})
    for (const char* scheme : {"radau5", "radau9"}) {
      Problem p = five_bar().problem(formulation, 1e-12);
      p.solver.confirm = false;
      p.solver.t_end = 2;
      p.solver.integrator = "radau9";
      const auto rho = p.parameters.values();
      const GradientResult exact = gradient(p, "discrete-adjoint", rho);
      p.solver.integrator = scheme;
      const auto error = [&](double rtol) {
        p.solver.rtol = rtol;
        const GradientResult r = gradient(p, "discrete-adjoint", rho);
        return std::max(gradient_mismatch(r.gradient, exact.gradient, p.parameters).error,
                        std::abs(r.psi - exact.psi) / exact.psi);
      };
      const double coarse = error(1e-5), fine = error(1e-9);
      CAPTURE(formulation, scheme, coarse, fine);
      // As those of the other integrators (tolerances.cpp): 1000 rtol, and no stalling.
      CHECK(coarse < 1e-2);
      CHECK(fine < 1e-6);
      CHECK(fine < coarse / 50);
    }
}
