// A program and the command line agree, to the bit: make_problem() takes all that a scene says of its run.
#include <catch2/catch.hpp>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/sensitivity/method.h"
#include "five_bar.h"
#include "process.h"

using namespace costate;
using costate::test::costate_json;
using costate::test::kFiveBar;
using costate::test::WorkingDirectory;

TEST_CASE("a program and the command line agree") {
  const WorkingDirectory here;
  const std::vector<std::vector<std::string>> settings = {
      {},
      {"run.rtol=1e-6", "run.atol=1e-9", "run.max_step_s=0.01", "run.t_end_s=2"},
      {"run.formulation=\"baumgarte\"", "formulation.baumgarte_omega_rad_per_s=7", "run.method=\"cvodes-adjoint\"",
       "run.cvodes_method=\"bdf\"", "run.rtol=1e-7"},
      {"run.formulation=\"index3\"", "run.integrator=\"fixed\"", "run.method=\"discrete-adjoint\"", "run.step_s=0.004"},
      {"run.method=\"idas-forward\"", "run.sensitivity_corrector=\"simultaneous\"", "run.parameters=['k1']"}};
  for (const auto& overrides : settings) {
    std::vector<std::string> arguments = {"gradient", kFiveBar, "--no-files"};
    for (const auto& o : overrides) {
      INFO(o);
      arguments.insert(arguments.end(), {"--set", o});
    }
    const auto j = costate_json(arguments, here.path());
    const Scene scene = Scene::load(kFiveBar, overrides);
    const Problem problem = make_problem(scene);
    const GradientResult r = gradient(problem, scene.run.method, problem.parameters.values());
    CHECK(j.at("psi").get<double>() == r.psi);
    const auto names = problem.parameters.names();
    for (std::size_t i = 0; i < names.size(); ++i) CHECK(j.at("gradient").at(names[i]).get<double>() == r.gradient[i]);
  }
}
