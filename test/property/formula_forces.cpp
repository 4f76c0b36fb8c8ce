// Forces and torques that are formulas: against numbers of an independent program, and their mistakes.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"

using namespace costate;
using Catch::Contains;

namespace {

Scene wheel(const std::string& couple, const std::string& more = "") {
  return Scene::parse(R"toml([body.wheel]
x_m = 0
y_m = 0
angle_rad = 0.3
mass_kg = 2
inertia_kg_m2 = 0.05
[couple.gas]
angle = "wheel"
)toml" + couple + R"toml(
[start]
given = ["wheel.x", "wheel.y", "wheel.angle"]
[[cost.running]]
kind = "square"
output = "gas.power"
[run]
t_end_s = 2
rtol = 1e-10
parameters = ["couple.gas.p", "couple.gas.d", "body.wheel.inertia_kg_m2"]
)toml" + more,
                      "wheel.toml");
}

const std::string kGas = R"(formula = "p*(1.2 + cos(wheel.angle))^(-1.4)*sin(wheel.angle) - d*wheel.angle_dot"
p = 3
d = 0.02)";

}  // namespace

// scipy 1.10, solve_ivp by DOP853 at rtol 1e-12 of I w' = T(a, w), psi' = (T w)^2; derivatives by differences of fourth
// order (step 1e-4 of each number), good to some 1e-7.
TEST_CASE("formula forces: gas pressure over a crank's angle, as an independent program has it") {
  const double psi = 3271.2546972059968;
  const std::vector<double> right = {2915.883941422079, -22470.126710004475, -35114.79848101923};
  for (const char* formulation : {"index1", "baumgarte", "maggi", "index3"})
    for (const SensitivityMethod& method : sensitivity_methods()) {
      Problem p = make_problem(wheel(kGas));
      p.formulation = formulation;
      if (!refusal(method, find_formulation(formulation)).empty() || by_fixed_steps(p, method) || method.perturbs)
        continue;
      INFO(formulation << " x " << method.name);
      const GradientResult r = gradient(p, method.name, p.parameters.values());
      // Errors of a tolerance a step, some thousand steps of a motion whose energy grows a hundredfold; of derivatives
      // against the largest scaled one, that by p.
      CHECK(r.psi == Approx(psi).epsilon(2e-7));
      for (std::size_t j = 0; j < right.size(); ++j)
        CHECK(std::abs(r.gradient[j] - right[j]) * p.parameters.parameters[j].scale <= 1e-6 * 3 * right[0]);
    }
}

TEST_CASE("formula forces: mistakes have their place") {
  const auto with = [](const std::string& couple) { return [=] { wheel(couple); }; };
  CHECK_THROWS_WITH(with("formula = \"p*whel.angle\"\np = 1\nd = 1")(),
                    Contains("wheel.toml:9") && Contains("'whel.angle' is no position or velocity"));
  CHECK_THROWS_WITH(with("formula = \"p*wheel.angle\"\np = 1\nd = 1")(),
                    Contains("wheel.toml:11") && Contains("'d' is in no formula"));
  CHECK_THROWS_WITH(with("formula = \"p*wheel.angle +\"\np = 1")(), Contains("wheel.toml:9"));
  CHECK_THROWS_WITH(with("formula = \"p*sinus(t)\"\np = 1")(), Contains("wheel.toml:9") && Contains("sinus"));
  CHECK_THROWS_WITH(with("formula = \"p\"\np = \"x\"")(), Contains("wheel.toml:10"));
  CHECK_THROWS_WITH(with("formula = \"p\"\np = 1\ntorque_N_m = 1")(), Contains("wheel.toml:11"));
  CHECK_THROWS_WITH(with("formula = \"gas.power*p\"\np = 1\nd = 1")(), Contains("wheel.toml:9"));
}
