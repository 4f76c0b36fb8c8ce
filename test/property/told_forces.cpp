// What a force says of itself is what acts: on a point alone, the output against mass times acceleration less gravity.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/objective/output.h"
#include "costate/problem/scene_problem.h"

using namespace costate;

namespace {

struct OnePoint {
  const char *force, *output;
};

const OnePoint kForces[] = {
    {"[drag.f]\npoint = \"P\"\ndrag_coefficient = 0.9\narea_m2 = 2\nsmoothing_m_per_s = 0.5\nwind_x_m_per_s = 0.3",
     "f.force"},
    {"[spring.f]\nfrom = \"O\"\nto = \"P\"\nstiffness_N_per_m = 8\nnatural_length_m = 0.7\ndamping_N_s_per_m = 0.6",
     "f.force"},
    {"[actuator.f]\nfrom = \"O\"\nto = \"P\"\ntime_constant_s = 0.1\ncommand_N = { kind = \"sine\", amplitude = 3, "
     "angular_frequency_rad_per_s = 5 }",
     "f.force"},
    {"[maxwell.f]\nfrom = \"O\"\nto = \"P\"\nstiffness_N_per_m = 30\nnatural_length_m = 0.8\ndamping_N_s_per_m = 4",
     "f.force"},
    {"[friction.f]\nfrom = \"O\"\nto = \"P\"\nnormal_force_N = 4\nstatic_coefficient = "
     "0.5\ntransition_velocity_m_per_s = 0.1",
     "f.force"},
};

}  // namespace

TEST_CASE("told forces: what is said is what acts") {
  for (const OnePoint& of : kForces)
    for (const bool space : {false, true}) {
      const auto z = [&](const char* text) { return space ? text : ""; };
      const std::string text = fmt::format(
          "[gravity]\ny_m_per_s2 = -1.5\n[point.O]\nground = true\nx_m = -1\ny_m = 0.2\n{}\n[point.P]\nx_m = 0.1\n"
          "y_m = 0\n{}\nvx_m_per_s = 0.4\nvy_m_per_s = -0.1\n[mass.P]\npoint = \"P\"\nmass_kg = 0.7\n{}\n"
          "[start]\ngiven = [\"P.x\", \"P.y\"{}]\n[run]\nt_end_s = 1.5\nrtol = 1e-9\n",
          z("z_m = 0.3"), z("z_m = 0.1\nvz_m_per_s = 0.2"), of.force, z(", \"P.z\""));
      CAPTURE(text);
      Problem p = make_problem(Scene::parse(text, "s.toml"));
      const auto said = make_output(*p.mechanism, of.output);
      std::vector<std::unique_ptr<Output>> a;
      for (const char* axis : {"P.x_ddot", "P.y_ddot", "P.z_ddot"})
        if (space || axis[2] != 'z') a.push_back(make_output(*p.mechanism, axis));
      double largest = 0;
      simulate(p, {}, {0, 0.3, 0.77, 1.5}, [&](const MechanismState& x, System& system) {
        double square = 0;
        for (std::size_t k = 0; k < a.size(); ++k) {
          const double f = 0.7 * (a[k]->value(x, system.assembly()) + (k == 1 ? 1.5 : 0));
          square += f * f;
        }
        largest = std::max(largest, std::sqrt(square));
        // Accelerations are solved for at the sample: rounding of terms of some N.
        CHECK(std::abs(said->value(x, system.assembly())) == Approx(std::sqrt(square)).margin(1e-11));
      });
      CHECK(largest > 0.1);
      take_notices();
    }
}

TEST_CASE("told forces: drag at rest in still air") {
  const Problem p = make_problem(
      Scene::parse("[point.P]\nx_m = 0\ny_m = 0\n[mass.P]\npoint = \"P\"\nmass_kg = 1\n[drag.f]\npoint = \"P\"\n"
                   "drag_coefficient = 1\narea_m2 = 1\nsmoothing_m_per_s = 0.1\n[run]\nt_end_s = 1\n",
                   "s.toml"));
  const auto force = make_output(*p.mechanism, "f.force"), speed = make_output(*p.mechanism, "f.speed");
  simulate(p, {}, {0, 1}, [&](const MechanismState& x, System& system) {
    CHECK(force->value(x, system.assembly()) == 0);
    CHECK(speed->value(x, system.assembly()) == 0);
  });
}
