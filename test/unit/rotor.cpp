// A rotor against the same wheel as a rigid body of its own on a hinge: two descriptions of one thing.
#include <catch2/catch.hpp>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"

using namespace costate;

namespace {

// A frame that flies and turns freely, with a wheel of 0.3 kg m^2 about its y axis. The frame's reference point is the
// wheel's centre. Both descriptions have the same mass, centre and transverse inertia.
std::string frame(double transverse, double axial, double mass) {
  return "[gravity]\nz_m_per_s2 = -9.81\n[rigid_body.frame]\nx_m = 0\ny_m = 0\nz_m = 0\nvx_m_per_s = 1\n"
         "omega_x_rad_per_s = 0.7\nomega_z_rad_per_s = -1.1\ninertia_xx_kg_m2 = " +
         std::to_string(0.5 + transverse) + "\ninertia_yy_kg_m2 = " + std::to_string(0.4 + axial) +
         "\ninertia_zz_kg_m2 = " + std::to_string(0.6 + transverse) + "\nmass_kg = " + std::to_string(5 + mass) + "\n";
}

const char* run = "\n[[cost.running]]\nkind = \"square\"\noutput = \"frame.e1\"\ntarget = 0\n[run]\nt_end_s = 2\n";

const std::string as_rotor = frame(0.2, 0, 2) +
                             "[rotor.wheel]\non = \"frame\"\naxis = [0, 1, 0]\ninertia_kg_m2 = 0.3\n"
                             "spin_rad_per_s = 25\n[start]\ngiven = [\"frame\", \"wheel.spin_angle\"]\n" +
                             run;

const std::string as_body =
    frame(0, 0, 0) +
    "[rigid_body.wheel]\nx_m = 0\ny_m = 0\nz_m = 0\nvx_m_per_s = 1\nomega_x_rad_per_s = 0.7\nomega_z_rad_per_s = -1.1\n"
    "omega_y_rad_per_s = 25\ninertia_xx_kg_m2 = 0.2\ninertia_yy_kg_m2 = 0.3\ninertia_zz_kg_m2 = 0.2\nmass_kg = 2\n"
    "[point.hub]\non = \"frame\"\nx_m = 0\ny_m = 0\nz_m = 0\n[point.center]\non = \"wheel\"\nx_m = 0\ny_m = 0\nz_m = "
    "0\n"
    "[hinge.axle]\npoints = [\"hub\", \"center\"]\naxis_first = [0, 1, 0]\n"
    "[start]\ngiven = [\"frame\", \"wheel.e2\"]\ngiven_velocities = [\"frame.x\", \"frame.y\", \"frame.z\", "
    "\"frame.omega_x\", \"frame.omega_y\", \"frame.omega_z\", \"wheel.omega_y\"]\n" +
    std::string(run);

double psi(const std::string& text) {
  const Scene scene = Scene::parse(text, "s.toml");
  Problem problem = make_problem(scene);
  problem.solver.rtol = 1e-12;
  return simulate(problem, problem.parameters.values()).psi;
}

}  // namespace

TEST_CASE("rotor: moves its frame as a wheel on a hinge does") {
  // psi is 0.01: an error of the tolerance, 1e-12, is 1e-10 of it, and those of 2500 steps at random 50 times that.
  // What the spin changes is of order 1.
  const double of_rotor = psi(as_rotor);
  CHECK(of_rotor == Approx(psi(as_body)).epsilon(1e-8));
  std::string still = as_rotor;
  still.replace(still.find("spin_rad_per_s = 25"), 19, "spin_rad_per_s = 0 ");
  CHECK(std::abs(psi(still) / of_rotor - 1) > 0.1);
}
