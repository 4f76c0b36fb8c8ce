// What a motion makes of errors of the size of the tolerance: slow motions and small costs keep their digits, and a
// gradient that is off by more than such errors explain is computed again, or comes with a word. The values stand from
// runs of an independent program (dense matrices, Dormand and Prince with projections at 1e-11 to 1e-12).
#include <catch2/catch.hpp>
#include <cmath>
#include <string>

#include "costate/base/notice.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {

Problem problem_of(const std::string& scene, const std::string& formulation) {
  Problem p = make_problem(Scene::parse(scene, "confirmation.toml"));
  p.formulation = formulation;
  p.solver.integrator.clear();
  return p;
}

/// A triangle that a driver moves slowly, with a kink: psi is 3e-6, and no unknown of 'maggi' needs any step.
const char* const kDriven = R"([gravity]
x_m_per_s2 = 2.5532315157011718
y_m_per_s2 = -9.81
[point.G0]
ground = true
x_m = 0
y_m = 0
[point.P0]
x_m = 0.83513338111571589
y_m = -0.76412330245593552
[point.P1]
x_m = 0.66559409055811014
y_m = 0.1074801073041951
[bar.B0]
from = "G0"
to = "P0"
mass_kg = 0.22510956376020871
length_m = 1.1319594452143296
[bar.B1]
from = "P0"
to = "P1"
mass_kg = 0.41092147587779315
length_m = 0.8879392293103523
[bar.B2]
from = "G0"
to = "P1"
mass_kg = 0.30480435332893596
length_m = 0.67421618702905595
[driver.D0]
coordinate = "P0.y"
law = { kind = "piecewise", breaks = [0.1238978533272401], coefficients = [[-0.76412330245593552, -0.019022556685342029], [-0.76856657623165314, 0.016839838476437319]] }
[start]
given = []
[[cost.running]]
kind = "square"
output = "P1.x_dot"
weight = 1.4904441537037976
target = 0
[run]
t_end_s = 0.35812145204616758
rtol = 1e-8
parameters = ["bar.B0.mass_kg"]
)";

/// A pendulum of 3 kg at rest, without gravity, that is pushed late: 1.2 mm/s.
const char* const kLate = R"([gravity]
x_m_per_s2 = 0
y_m_per_s2 = 0
[point.G0]
ground = true
x_m = 0
y_m = 0
[point.P2]
x_m = -0.064979387589812393
y_m = 0.050348026879722708
vy_m_per_s = 0
[mass.mP2]
point = "P2"
mass_kg = 1.4572604268867984
[bar.B3]
from = "G0"
to = "P2"
mass_kg = 2.8487680486912863
length_m = 0.08220246116892331
[force.late]
point = "P2"
x_N = { kind = "sum", terms = [{ kind = "smooth_step", from = 1.5787769190659826, to = 1.5873691059404711, before = 0, after = 0.71081807245902717 }, { kind = "smooth_step", from = 1.5873691059404711, to = 1.5959612928149596, before = 0, after = -0.71081807245902717 }] }
[start]
given = ["P2.y"]
[[cost.running]]
kind = "square"
output = "P2.x_dot"
weight = 1.0030834322489874
target = 0
[run]
t_end_s = 1.8983780585808092
rtol = 1e-8
parameters = ["mass.mP2.mass_kg"]
)";

/// Three bars that whip, drawn by a stiff spring: one error of 1e-8 becomes 5e-3 of psi.
const char* const kWhip = R"([gravity]
y_m_per_s2 = -9.81
[point.G0]
ground = true
x_m = 0
y_m = 0
[point.P0]
x_m = -0.76299479249405822
y_m = -0.2963098824955766
vy_m_per_s = 0
[point.P1]
x_m = -1.4626947629091207
y_m = -0.068461842345174329
vy_m_per_s = 0
[point.P3]
x_m = -2.264309708738939
y_m = -0.088390835443628718
vy_m_per_s = 1.1154226085938284
[bar.B0]
from = "G0"
to = "P0"
mass_kg = 0.39679808012468593
length_m = 0.8185112093536614
[bar.B1]
from = "P0"
to = "P1"
mass_kg = 0.26756116707883021
length_m = 0.73586328757400221
[bar.B3]
from = "P1"
to = "P3"
mass_kg = 3.6861428540028509
length_m = 0.80186263545800707
[spring.S0]
from = "G0"
to = "P3"
stiffness_N_per_m = 22595.243871188646
natural_length_m = 1.8938059133710283
damping_N_s_per_m = 0.17112803428851789
[start]
given = ["P0.y", "P1.y", "P3.y"]
[[cost.running]]
kind = "square"
output = "P3.x"
weight = 0.89548289301773987
target = -2.5110125206654144
[run]
t_end_s = 0.74058182141363882
rtol = 1e-8
parameters = ["spring.S0.stiffness_N_per_m"]
)";

}  // namespace

TEST_CASE("small costs: the quadrature keeps the digits that the motion has", "[confirmation]") {
  // 1e-4 is 1e4 rtol; with the absolute tolerance of the coordinates psi was off by 5e-4 to 2e-3.
  constexpr double right = 2.72211709e-06;
  for (const char* formulation : {"maggi", "maggi-implicit", "baumgarte", "index1"}) {
    CAPTURE(formulation);
    const Problem p = problem_of(kDriven, formulation);
    const double psi = gradient(p, "hand-adjoint", p.parameters.values()).psi;
    CHECK(std::abs(psi - right) < 1e-5 * right);
  }
}

TEST_CASE("slow motions: velocities keep the digits that their size asks for", "[confirmation]") {
  for (const char* formulation : {"baumgarte", "index1", "maggi", "maggi-implicit"}) {
    CAPTURE(formulation);
    Problem p = problem_of(kLate, formulation);
    p.solver.confirm = false;
    const double psi = gradient(p, "hand-adjoint", p.parameters.values()).psi;
    p.solver.rtol = 1e-11;
    const double right = gradient(p, "hand-adjoint", p.parameters.values()).psi;
    CAPTURE(psi, right);
    // Speeds of 1e-3 m/s at an absolute tolerance of 1e-8 m/s were known to 2e-3 of psi.
    CHECK(std::abs(psi - right) < 5e-5 * right);
  }
}

TEST_CASE("a motion that makes much of small errors is computed again, or comes with a word", "[confirmation]") {
  for (const char* method : {"idas-adjoint", "idas-forward", "hand-tangent"}) {
    CAPTURE(method);
    Problem p = problem_of(kWhip, "index1");
    const auto rho = p.parameters.values();
    p.solver.confirm = false;
    p.solver.rtol = 1e-11;
    const GradientResult right = gradient(p, method, rho);
    p.solver.rtol = 1e-8;
    const GradientResult once = gradient(p, method, rho);
    take_notices();
    p.solver.confirm = true;
    const GradientResult r = gradient(p, method, rho);
    const auto said = take_notices();
    const double off = std::abs(r.psi / right.psi - 1), off_once = std::abs(once.psi / right.psi - 1);
    CAPTURE(off, off_once);
    CHECK(off < off_once);
    CHECK((off < 1e-4 || !said.empty()));
  }
}

TEST_CASE("an ordinary gradient is that of its one run", "[confirmation]") {
  Problem p = problem_of(kDriven, "baumgarte");
  const auto rho = p.parameters.values();
  take_notices();
  const GradientResult r = gradient(p, "idas-adjoint", rho);
  CHECK(take_notices().empty());
  p.solver.confirm = false;
  const GradientResult once = gradient(p, "idas-adjoint", rho);
  CHECK(r.psi == once.psi);
  CHECK(r.gradient == once.gradient);
  CHECK(r.counters.steps == once.counters.steps);
}
