// Impacts of several contacts in space with Coulomb friction, and what the contacts do behind them: against an
// independent program, closed forms, the plane's scenes, mirrored and turned scenes, and differences of whole motions.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "costate/sensitivity/method.h"
#include "property/ways_compared.h"
#include "support/cases.h"
#include "support/with_words.h"

using namespace costate;
using costate::test::event_names;
using costate::test::with_words;

namespace {

struct BoxStart {
  double z, yaw, tilt;  // turned by the tilt about its y, then by the yaw about the vertical
  double vx, vy, vz;
  double wx, wy, wz;  // of its own frame
};

const char* box_scene = R"(
[gravity]
z_m_per_s2 = -9.81
[rigid_body.box]
x_m = 0
y_m = 0
z_m = Z
e0 = E0
e1 = E1
e2 = E2
e3 = E3
mass_kg = 2
inertia_xx_kg_m2 = 0.03
inertia_yy_kg_m2 = 0.05
inertia_zz_kg_m2 = 0.06
vx_m_per_s = VX
vy_m_per_s = VY
vz_m_per_s = VZ
omega_x_rad_per_s = WX
omega_y_rad_per_s = WY
omega_z_rad_per_s = WZ
[start]
given = ["box"]
[run]
t_end_s = END
rtol = 1e-11
formulation = "index1"
parameters = ["rigid_body.box.mass_kg", "rigid_body.box.inertia_xx_kg_m2", "rigid_body.box.vx_m_per_s", "rigid_body.box.omega_x_rad_per_s", "contact.c0.friction_coefficient", "point.p1.x_m"]
[[cost.terminal]]
kind = "value"
output = "box.x"
[[cost.terminal]]
kind = "value"
output = "box.y"
weight = 2
[[cost.terminal]]
kind = "value"
output = "box.z"
weight = -1
[[cost.terminal]]
kind = "value"
output = "box.omega_x"
weight = 0.02
[[cost.terminal]]
kind = "value"
output = "box.omega_z"
weight = 0.05
)";

/// A box of 0.4 x 0.3 x 0.2 m with contacts at `count` of its lower corners: two of the edge at x = 0.2, then the other
/// two.
Problem make_box(const BoxStart& s, int count, const std::string& contact, double end, const std::string& more = "") {
  const auto number = [](double x) { return fmt::format("{:.17g}", x); };
  const double cz = std::cos(s.yaw / 2), sz = std::sin(s.yaw / 2), cy = std::cos(s.tilt / 2), sy = std::sin(s.tilt / 2);
  std::string scene = with_words(box_scene, {{"E0", number(cz * cy)},
                                             {"E1", number(-sz * sy)},
                                             {"E2", number(cz * sy)},
                                             {"E3", number(sz * cy)},
                                             {"VX", number(s.vx)},
                                             {"VY", number(s.vy)},
                                             {"VZ", number(s.vz)},
                                             {"WX", number(s.wx)},
                                             {"WY", number(s.wy)},
                                             {"WZ", number(s.wz)},
                                             {"END", number(end)},
                                             {"= Z", "= " + number(s.z)}});
  const double corners[4][2] = {{0.2, 0.15}, {0.2, -0.15}, {-0.2, 0.15}, {-0.2, -0.15}};
  for (int i = 0; i < count; ++i)
    scene += fmt::format(
        "[point.p{0}]\non = \"box\"\nx_m = {1}\ny_m = {2}\nz_m = -0.1\n"
        "[contact.c{0}]\nkind = \"rigid\"\npoint = \"p{0}\"\nfriction = \"coulomb\"\n{3}\n",
        i, corners[i][0], corners[i][1], contact);
  return make_problem(Scene::parse(scene + more, "box.toml"));
}

/// Velocities of the centre and angular velocities of the box's frame at the end of a run.
std::vector<double> velocities_at_end(const Problem& p, double end, std::vector<std::string>* events = nullptr) {
  std::vector<double> out;
  const Simulation r = simulate(p, p.parameters.values(), {end}, [&](const MechanismState& s, System&) {
    const double *q = s.q + 3, *d = s.v + 3;
    out = {s.v[0],
           s.v[1],
           s.v[2],
           2 * (-q[1] * d[0] + q[0] * d[1] + q[3] * d[2] - q[2] * d[3]),
           2 * (-q[2] * d[0] - q[3] * d[1] + q[0] * d[2] + q[1] * d[3]),
           2 * (-q[3] * d[0] + q[2] * d[1] - q[1] * d[2] + q[0] * d[3])};
  });
  if (events) *events = event_names(r.events);
  return out;
}

}  // namespace

// The edge of a box that is tilted by 0.3 strikes after 0.3 s, both corners at once. By a program of its own (numpy):
// W = J M^-1 J^T of both corners, and Gauss and Seidel's iteration on p_n >= 0, |p_t| <= mu p_n until nothing changes,
// of v_n + e v_n- and v_t, that gives v+ = v- + M^-1 J^T p. In turn both slide, three times without restitution; both
// slide; both stick; both slide. What is read 1e-9 s behind is off by g 1e-9.
TEST_CASE("contacts together in space: an edge strikes, by an independent program", "[events]") {
  struct {
    double friction, restitution, vx, vy, wy, after[6];
  } const cases[] = {
      {0.1,
       0,
       0.5,
       0.3,
       0,
       {0.362966269214548, 0.235592045721865, -1.42884584066184, 0.00910054395443325, -8.84650582777602,
        -0.0294195845650709}},
      {0.3,
       0,
       -0.6,
       0.8,
       1,
       {-0.83268230585169, 0.350348924173471, -1.23339128475818, 0.350234048834392, -7.63637537236858,
        -1.13221146657201}},
      {0.6,
       0,
       0.5,
       0.3,
       -1,
       {-0.545275489773991, -0.192080938201349, -1.01747773454359, 0.0357696178758853, -6.29957581995191,
        -0.115633450399128}},
      {0.3,
       0.5,
       -0.6,
       0.8,
       1,
       {-1.11281143178315, 0.207961234357036, -0.320527573455154, 0.391672133818496, -11.595096420453,
        -1.26616953012386}},
      {1.5, 0.5, 0.5, 0.3, 0, {-1.1845076130612, -0.500801786346005, 0.128278240957362, 0, -8.31637590368893, 0}},
      {0.5,
       0.5,
       0.5,
       -1,
       0,
       {-0.837345267041385, -0.87917764780318, -0.203513880212946, -0.435966903964168, -10.370621960201,
        1.40936248019546}}};
  const double g = 9.81, touch = 0.3, tilt = 0.3;
  const double below = 0.2 * std::sin(tilt) + 0.1 * std::cos(tilt);
  for (const auto& c : cases) {
    const BoxStart start{below + 0.5 * g * touch * touch, 0.4, tilt - c.wy * touch, c.vx, c.vy, 0, 0, c.wy, 0};
    const std::string contact = fmt::format("friction_coefficient = {}\nrestitution = {}\n{}", c.friction,
                                            c.restitution, c.restitution > 0 ? "closing_speed_m_per_s = 0" : "");
    for (const char* formulation : {"index1", "baumgarte", "augmented-lagrangian"}) {
      Problem p = make_box(start, 2, contact, touch + 1e-9);
      p.formulation = formulation;
      CAPTURE(c.friction, c.restitution, formulation);
      std::vector<std::string> events;
      const std::vector<double> after = velocities_at_end(p, touch + 1e-9, &events);
      CHECK(events.size() == 1);
      REQUIRE(after.size() == 6);
      for (std::size_t i = 0; i < 6; ++i) CHECK(std::abs(after[i] - c.after[i]) <= 2e-7);
    }
  }
}

// What the others cannot do alone is looked for with all of them: it was read from nothing, which ended the program. No
// way is found here, and that is said.
TEST_CASE("contacts together in space: corners whose rows depend on each other", "[events]") {
  for (const char* formulation : {"index1", "baumgarte"}) {
    CAPTURE(formulation);
    Problem p = problem_of_case("box_on_its_corners");
    p.formulation = formulation;
    CHECK_THROWS_AS(simulate(p, p.parameters.values()), Error);
  }
}
