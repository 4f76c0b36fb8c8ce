// Integrators of many steps where a force or its slope jumps: their error estimates take the motion for as smooth as it
// was over the steps before, and CVODES passed pulses by a thousandth late, in silence. And what leaves a contact by
// less than a step shows.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/objective/output.h"
#include "costate/sensitivity/method.h"
#include "support/cases.h"

using namespace costate;

namespace {

double at_end(Problem& p, const std::string& name) {
  const auto output = make_output(*p.mechanism, name);
  double y = std::nan("");
  simulate(p, p.parameters.values(), {p.solver.t_end},
           [&](const MechanismState& x, System& system) { y = output->value(x, system.assembly()); });
  take_notices();
  return y;
}

}  // namespace

TEST_CASE("steps over jumps: a pulse gives its impulse, whatever came before") {
  // 75 m/s^2 for 10 ms on 1 m/s. Local errors of some steps, of rtol each.
  for (const char* formulation : {"baumgarte", "index1", "maggi", "penalty"})
    for (const double rtol : {1e-5, 1e-6, 1e-8})
      for (const char* method : {"adams", "bdf"}) {
        INFO(formulation << " at " << rtol << " by " << method);
        Problem p = problem_of_case("pulse", {fmt::format("run.rtol={}", rtol)});
        p.formulation = formulation;
        p.solver.integrator = "cvodes";
        p.solver.cvodes_method = method;
        p.solver.confirm = false;
        CHECK(std::abs(at_end(p, "P.x_dot") - 1.75) < 100 * rtol);
      }
  // psi = int x^2 and its derivative by the pulse's end, in closed form.
  for (const char* method : {"cvodes-adjoint", "cvodes-forward", "idas-adjoint"}) {
    INFO(method);
    Problem p = problem_of_case("pulse", {"run.rtol=1e-8"});
    const GradientResult r = gradient(p, method, p.parameters.values());
    CHECK(std::abs(r.psi - 4.90879154) < 1e-5);
    CHECK(std::abs(r.gradient[0] - 259.619543) < 1e-3);
    take_notices();
  }
}

TEST_CASE("steps over jumps: a run that ends where a pulse does") {
  // int (x1 + s + 75 s^2/2)^2 behind x1^3/3: the last segment has no step.
  for (const char* integrator : {"idas", "cvodes"}) {
    INFO(integrator);
    Problem p = problem_of_case("pulse", {"run.t_end_s=0.7491", "run.rtol=1e-8"});
    p.solver.integrator = integrator;
    CHECK(std::abs(simulate(p, p.parameters.values()).psi - 0.1401380504) < 1e-6);
    take_notices();
  }
}

TEST_CASE("steps over jumps: what leaves at a tenth of a millimetre a second at the start comes back") {
  // It rises by v^2/2 = 5e-9 m, and is drawn back at 1 m/s^2.
  for (const char* integrator : {"idas", "cvodes", "dop853"}) {
    INFO(integrator);
    Problem p =
        problem_of_case("leaves_slowly", {"run.rtol=1e-6", "force.F.a=-1", "force.F.b=0", "point.P.vy_m_per_s=1e-4"});
    p.solver.integrator = integrator;
    CHECK(std::abs(simulate(p, p.parameters.values()).psi) < 5e-9);
    take_notices();
  }
}

TEST_CASE("steps over jumps: bounces that die out by CVODES as by IDAS") {
  // int y^2 of hops, each with half the speed of the one before; known to an absolute tolerance of the quadrature
  // behind each of some 14 events, 1e-9 at rtol 1e-8.
  const double v = 0.3, g = 9.81, right = std::pow(v, 5) / (g * g * g) * 4 / 15 / (1 - std::pow(0.5, 5));
  for (const char* integrator : {"idas", "cvodes", "dop853"})
    for (const double rtol : {1e-6, 1e-8}) {
      INFO(integrator << " at " << rtol);
      Problem p = problem_of_case("bounces_die_out", {fmt::format("run.rtol={}", rtol)});
      p.formulation = "baumgarte";
      p.solver.integrator = integrator;
      p.solver.confirm = false;
      CHECK(std::abs(simulate(p, p.parameters.values()).psi - right) < 0.05 * right);
      take_notices();
    }
}

TEST_CASE("steps over jumps: what leaves by next to nothing does not fall through") {
  for (const char* integrator : {"idas", "cvodes", "dop853"}) {
    INFO(integrator);
    Problem p = problem_of_case("leaves_slowly");
    p.formulation = "baumgarte";
    p.solver.integrator = integrator;
    std::string said;
    double y = 0;
    try {
      y = simulate(p, p.parameters.values()).psi;
    } catch (const Error& e) {
      said = e.what();
    }
    take_notices();
    // Right, or refused.
    CHECK((said.find("contact.f") != std::string::npos || std::abs(y) < 1e-9));
    CAPTURE(said, y);
  }
}

TEST_CASE("steps over jumps: a small fall on bristles") {
  for (const char* integrator : {"idas", "cvodes"})
    for (const double fall : {1e-5, 1e-4})
      for (const double rtol : {1e-5, 1e-7}) {
        INFO(integrator << " from " << fall << " at " << rtol);
        Problem p = problem_of_case("friction_at_small_touch",
                                    {fmt::format("body.B.y_m={:.12g}", 0.1 + fall), fmt::format("run.rtol={}", rtol)});
        p.formulation = "baumgarte";
        p.solver.integrator = integrator;
        std::string said;
        double y = 0.1;
        try {
          y = simulate(p, p.parameters.values()).psi;
        } catch (const Error& e) {
          said = e.what();
        }
        take_notices();
        CAPTURE(said, y);
        // The floor gives by (m g/K)^(2/3) = 7e-4 m.
        CHECK((said.find("contact.floor") != std::string::npos || std::abs(y - 0.1) < 2e-3));
      }
}
