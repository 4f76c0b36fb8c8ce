// Long steps that end at a bend: their last stages, which are known less well than the end, lay beyond it, and with
// them a part of the step's derivative (event/bend_watch.h approaches bends since). From the standing adversary,
// 543277.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/method.h"

using namespace costate;

namespace {
/// Bars of some millimetres, two of which stay where they are; a pulse, and steps of a quarter of the run before the
/// damper turns from one branch to the other.
constexpr const char* kLongSteps = R"([gravity]
x_m_per_s2 = 0
y_m_per_s2 = 0
[point.G0]
ground = true
x_m = 0
y_m = 0
[point.P0]
x_m = 0.00088275107232053474
y_m = 0.0010070438376691231
vx_m_per_s = 0
[point.P1]
x_m = 0.0012772552730309242
y_m = 0.00026497006064601773
vy_m_per_s = 0.00053589929222847975
[mass.mP1]
point = "P1"
mass_kg = 2.0508341382332658
[point.P2]
x_m = -8.559877258489244e-05
y_m = 0.00081468373394932424
vx_m_per_s = 0
[mass.mP2]
point = "P2"
mass_kg = 4.9037699916428368
[point.P3]
x_m = 0.0019709833049511663
y_m = 0.0014621957988646009
vy_m_per_s = 0
[mass.mP3]
point = "P3"
mass_kg = 1.8141667349202664
[bar.B0]
from = "G0"
to = "P0"
mass_kg = 0
length_m = 0.0013391739045659488
[bar.B1]
from = "G0"
to = "P1"
mass_kg = 0
length_m = 0.0013044501391483137
[bar.B2]
from = "G0"
to = "P2"
mass_kg = 2.1922927277115103
length_m = 0.00081916831984010069
[bar.B3]
from = "P0"
to = "P3"
mass_kg = 0
length_m = 0.0011795815783218805
[spring.S0]
from = "P2"
to = "P3"
stiffness_N_per_m = 29.233676182707644
natural_length_m = 0.0021907365753631434
damper_law = { kind = "piecewise", breaks = [0], coefficients = [[0, 2.285959082936468], [0, 3.9383696825942023]] }
[force.F0]
point = "P3"
x_N = { kind = "sum", terms = [{ kind = "smooth_step", from = 0.13846412190092397, to = 0.14179568703302856, before = 0, after = -0.018367794292233119 }, { kind = "smooth_step", from = 0.17622450768460063, to = 0.17955607281670521, before = 0, after = 0.018367794292233119 }] }
[start]
given = ["P0.x", "P1.y", "P2.x", "P3.y"]
[[cost.terminal]]
kind = "value"
output = "P0.x"
weight = 0.71355842400463154
target = 0.00088106605147565827
[run]
t_end_s = 0.41561846341290876
rtol = 1e-8
parameters = ["point.P2.x_m"]
)";
}  // namespace

TEST_CASE("bends: long steps that end at one", "[bends]") {
  Problem p = make_problem(Scene::parse(kLongSteps, "long_steps.toml"));
  const auto rho = p.parameters.values();
  p.formulation = "baumgarte";
  p.solver.rtol = 1e-12;
  const double expected = gradient(p, "cvodes-forward", rho).gradient[0];
  for (const char* formulation : {"baumgarte", "index1", "maggi"})
    for (const char* integrator : {"dopri5", "dop853"})
      for (const double rtol : {1e-6, 1e-7, 1e-8}) {
        CAPTURE(formulation, integrator, rtol);
        p.formulation = formulation;
        p.solver.integrator = integrator;
        p.solver.rtol = rtol;
        take_notices();
        // Off by 5.5e-4 in silence before, at any of these tolerances.
        CHECK(std::abs(gradient(p, "discrete-tangent", rho).gradient[0] / expected - 1) < 2e-5);
      }
}
