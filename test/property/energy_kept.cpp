// The energy of elements that store some beside a spring's: that it is kept where nothing takes any.
#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"

using namespace costate;

namespace {

/// The largest change of energy.total from what it is at the start, over 101 samples, J.
double change_of_energy(const std::string& scene) {
  Problem p = make_problem(Scene::parse(scene, "energy.toml"));
  p.formulation = "baumgarte";
  p.solver.rtol = 1e-10;
  std::vector<double> times;
  for (int i = 0; i <= 100; ++i) times.push_back(p.solver.t_end * i / 100);
  double first = 0, most = 0;
  bool begun = false;
  simulate(p, p.parameters.values(), times, [&](const MechanismState& s, System& system) {
    const double e = system.assembly().potential_energy(s) + system.assembly().kinetic_energy(s);
    if (!begun) first = e;
    begun = true;
    most = std::max(most, std::abs(e - first));
  });
  return most;
}

const std::string kBob = R"toml([gravity]
y_m_per_s2 = -9.81
[point.O]
ground = true
x_m = 0
y_m = 0
[point.P]
x_m = 0.1
y_m = 1
[mass.m]
point = "P"
mass_kg = 2
[start]
given = ["P.x", "P.y"]
[run]
t_end_s = 1
[maxwell.s]
from = "O"
to = "P"
natural_length_m = 0.8
stiffness_N_per_m = 100
damping_N_s_per_m = 1e13
)toml";

}  // namespace

TEST_CASE("energy: what a spring in series with a damper holds is part of it") {
  // 24 J moved in and out of what was counted. A damper of 1e13 N s/m takes F^2/c = 1e-9 W; the rest is the run's own
  // error.
  CHECK(change_of_energy(kBob) < 1e-6);
}
