// Angular accelerations of bodies in space, against Euler's equations J alpha + omega x J omega = 0 of free flight,
// which know nothing of coordinates.
#include <Eigen/Dense>
#include <catch2/catch.hpp>
#include <string>

#include "costate/integrator/simulate.h"
#include "costate/objective/output.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"

using namespace costate;

namespace {

std::string body(const std::string& kind) {
  return "[" + kind + R"toml(.b]
mass_kg = 2
x_m = 0.3
y_m = 0
z_m = 0
inertia_xx_kg_m2 = 0.5
inertia_yy_kg_m2 = 0.7
inertia_zz_kg_m2 = 0.9
inertia_xy_kg_m2 = 0.1
inertia_xz_kg_m2 = -0.05
inertia_yz_kg_m2 = 0.08
omega_x_rad_per_s = 2
omega_y_rad_per_s = -3
omega_z_rad_per_s = 1

[run]
t_end_s = 1
rtol = 1e-11
)toml";
}

}  // namespace

TEST_CASE("angular acceleration: Euler's equations of a free body, in its own frame and in the ground's") {
  for (const char* kind : {"rigid_body", "natural_body"}) {
    INFO(kind);
    const Scene scene = Scene::parse(body(kind), "s.toml");
    const Problem problem = make_problem(scene);
    Eigen::Matrix3d J;
    J << 0.5, 0.1, -0.05, 0.1, 0.7, 0.08, -0.05, 0.08, 0.9;
    int seen = 0;
    simulate(problem, problem.parameters.values(), {0, 0.37, 1}, [&](const MechanismState& state, System& system) {
      const auto vector = [&](const std::string& name) {
        Eigen::Vector3d x;
        for (int k = 0; k < 3; ++k)
          x[k] = make_output(*scene.mechanism(), "b." + name + "_" + "xyz"[k])->value(state, system.assembly());
        return x;
      };
      const Eigen::Vector3d omega = vector("omega"), alpha = vector("alpha");
      const Eigen::Vector3d global = vector("alpha_global"), omega_global = vector("omega_global");
      // A residual of 1e-11 of terms of order 10.
      CHECK((J * alpha + omega.cross(J * omega)).norm() < 1e-9);
      CHECK(alpha.norm() > 1);
      // One vector in two frames, as far as three axes that drift by 1e-10 are one.
      CHECK(global.norm() == Approx(alpha.norm()).margin(1e-8));
      CHECK(global.dot(omega_global) == Approx(alpha.dot(omega)).margin(1e-8));
      CHECK(global.cross(omega_global).norm() == Approx(alpha.cross(omega).norm()).margin(1e-8));
      ++seen;
    });
    CHECK(seen == 3);
  }
}
