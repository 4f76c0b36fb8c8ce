// A link without mass or inertia is a body like others where joints determine its motion.
#include "costate/base/error.h"
#include "run_scene.h"

using namespace costate;
using namespace costate::test;
using Catch::Matchers::Contains;

namespace {

const std::string common = R"(
[gravity]
z_m_per_s2 = -9.81

[rigid_body.bob]
x_m = 1
y_m = 0
z_m = 0
mass_kg = 2
inertia_xx_kg_m2 = 0.02
inertia_yy_kg_m2 = 0.03
inertia_zz_kg_m2 = 0.04

[point.O]
ground = true
x_m = 0
y_m = 0
z_m = 0
)";

const std::string massless = R"(
[rigid_body.link]
x_m = 0.4
y_m = 0
z_m = 0
mass_kg = 0
inertia_xx_kg_m2 = 0
inertia_yy_kg_m2 = 0
inertia_zz_kg_m2 = 0

[point.A]
on = "link"
x_m = -0.4
y_m = 0
z_m = 0

[point.B]
on = "link"
x_m = 0.6
y_m = 0
z_m = 0

[point.C]
on = "bob"
x_m = 0
y_m = 0
z_m = 0
)";

const std::string hinge = R"(
[hinge.base]
points = ["O", "A"]
axis_first = [0, 1, 0]
angle = "swing"
)";

}  // namespace

TEST_CASE("massless links: a pendulum on a massless body is the pendulum without it") {
  const Scene direct = Scene::parse(common + R"(
[point.A]
on = "bob"
x_m = -1
y_m = 0
z_m = 0
)" + hinge + "[start]\ngiven = [\"swing.angle\"]\n",
                                    "direct.toml");
  const Scene linked = Scene::parse(
      common + massless + hinge + "[fixed.weld]\npoints = [\"B\", \"C\"]\n[start]\ngiven = [\"swing.angle\"]\n",
      "linked.toml");
  const auto times = times_to(2, 5);
  const std::vector<std::string> names = {"bob.x", "bob.z", "swing.angle", "bob.omega_y"};
  const auto expected = run(direct, times, names);
  for (const std::string formulation :
       {"index1", "baumgarte", "index2", "augmented-lagrangian", "maggi", "maggi-implicit"}) {
    INFO(formulation);
    const auto found = run(linked, times, names, formulation);
    for (std::size_t i = 0; i < times.size(); ++i)
      for (std::size_t j = 0; j < names.size(); ++j) CHECK(found[i][j] == Approx(expected[i][j]).margin(10 * kMotion));
  }
}

TEST_CASE("massless links: one that nothing moves is named") {
  const Scene loose = Scene::parse(
      common + massless + hinge +
          "[start]\ngiven = [\"swing.angle\", \"bob.x\", \"bob.y\", \"bob.z\", \"bob.e1\", \"bob.e2\", \"bob.e3\"]\n",
      "loose.toml");
  CHECK_THROWS_WITH(run(loose, {1}, {"bob.z"}),
                    Contains("link.") && Contains("has neither inertia nor a constraint that fixes it"));
}
