// Slips in space that stop slowly: friction turns them the faster the slower they are.
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "property/sliding_in_space.h"
#include "property/ways_compared.h"

using namespace costate;
using costate::test::event_names;
using costate::test::MethodWay;
using costate::test::SceneWords;
using costate::test::sliding_point;

// Two that turn until they stop, in what a spring pulls. Runs whose velocities were as large as their errors turned
// about at random beyond the stop, for 1e3 to 1e6 steps or for good, at rtol 1e-4 to 1e-8. What counts is that the stop
// is met in the steps that the slip takes; errors are those of the runs, measured to be at most 90 rtol of psi, and of
// a gradient 600 rtol.
TEST_CASE("slow stops: a slip in space ends where it is not resolved any more", "[events]") {
  const auto spring = [](const char* at, const char* numbers) {
    return std::string("[point.A]\nground = true\n") + at + "\n[spring.S]\nfrom = \"P\"\nto = \"A\"\n" + numbers;
  };
  const SceneWords first = {{"VX", "-1.25"},
                            {"VY", "-1.302"},
                            {"FRICTION", "0.3746"},
                            {"CONTACT", "closed = true\nsliding = \"forward\"\nground_angle_rad = -0.1479"},
                            {"MORE", spring("x_m = 0.2561\ny_m = 0.3232\nz_m = 0.7445",
                                            "stiffness_N_per_m = 8.8\nnatural_length_m = 0.51")}},
                   second = {{"VX", "-1"},
                             {"VY", "0.6"},
                             {"FRICTION", "0.7"},
                             {"CONTACT", "closed = true\nsliding = \"forward\"\nground_angle_rad = -0.0132"},
                             {"MORE", spring("x_m = -0.1382\ny_m = 0.5188\nz_m = 0.6394",
                                             "stiffness_N_per_m = 16.2\nnatural_length_m = 0.26")}};
  for (SceneWords words : {first, second}) {
    words.insert(words.end(), {{"END", "0.48"},
                               {"PARAMETERS", R"("spring.S.stiffness_N_per_m", "contact.floor.ground_angle_rad")"}});
    const std::string scene = sliding_point(words);
    Problem p = make_problem(Scene::parse(scene, "pulled.toml"));
    p.formulation = "index1";
    p.solver.confirm = false;
    p.solver.rtol = 1e-12;
    const std::vector<double> rho = p.parameters.values();
    const GradientResult expected = gradient(p, "cvodes-forward", rho);
    for (const MethodWay& way : std::vector<MethodWay>{{"index1", "idas-forward"},
                                                       {"baumgarte", "cvodes-adjoint"},
                                                       {"penalty", "cvodes-forward"},
                                                       {"index2", "idas-adjoint"},
                                                       {"maggi", "cvodes-adjoint"},
                                                       {"maggi-implicit", "idas-forward"}})
      for (const double rtol : {1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9}) {
        p.formulation = way.formulation;
        p.solver.rtol = rtol;
        CAPTURE(way.formulation, way.method, rtol);
        const GradientResult r = gradient(p, way.method, rho);
        CHECK(event_names(r.events) == std::vector<std::string>{"contact.floor: stop sticks"});
        CHECK(r.counters.steps < 1000);
        CHECK(std::abs(r.psi / expected.psi - 1) <= 300 * rtol);
        for (std::size_t j = 0; j < rho.size(); ++j)
          CHECK(std::abs(r.gradient[j] / expected.gradient[j] - 1) <= 2000 * rtol);
      }
  }
}
