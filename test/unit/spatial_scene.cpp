// Scenes in space: what their start means, and what is said of mistakes in them.
#include <catch2/catch.hpp>

#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/kind/body/rigid_body.h"
#include "costate/scene/scene.h"

using namespace costate;
using Catch::Contains;

namespace {

const std::string body = R"([rigid_body.top]
x_m = 0
y_m = 0
z_m = 0
mass_kg = 2
inertia_xx_kg_m2 = 0.2
inertia_yy_kg_m2 = 0.3
inertia_zz_kg_m2 = 0.4
)";

const std::string points = R"([point.O]
ground = true
x_m = 0
y_m = 0
z_m = 0
[point.flat]
ground = true
x_m = 1
y_m = 0
[point.foot]
on = "top"
x_m = 0
y_m = 0
z_m = 0
[point.head]
on = "top"
x_m = 0
y_m = 0
z_m = 1
)";

std::string complaint(const std::string& text) {
  try {
    Scene::parse(text, "s.toml");
  } catch (const Error& e) {
    return e.what();
  }
  return "none";
}

}  // namespace

TEST_CASE("spatial scene: a body's name gives its pose and motion") {
  // Turned by angle about an axis, with the angular velocity in either frame: 2 G(p) pdot and 2 E(p) pdot.
  for (const std::string frame : {"", "global_"}) {
    const Scene scene =
        Scene::parse(body + "rotation_axis = [1, -2, 0.5]\nangle_rad = 2.2\nvz_m_per_s = 3\nomega_" + frame +
                         "x_rad_per_s = 1.5\nomega_" + frame + "y_rad_per_s = -0.5\n[start]\ngiven = [\"top\"]\n",
                     "s.toml");
    Assembly assembly(scene.mechanism(), scene.mechanism()->select({}));
    const Start start = find_start(assembly, 0, false);
    const auto p = euler_parameters({1, -2, 0.5}, 2.2);
    for (int i = 0; i < 4; ++i) CHECK(start.q[3 + i] == Approx(p[static_cast<std::size_t>(i)]).margin(1e-14));
    CHECK(start.v[2] == Approx(3).epsilon(1e-14));
    double omega[3];
    if (frame.empty())
      body_rate(start.q.data() + 3, start.v.data() + 3, omega);
    else
      global_rate(start.q.data() + 3, start.v.data() + 3, omega);
    const double expected[3] = {1.5, -0.5, 0};
    for (int i = 0; i < 3; ++i) CHECK(2 * omega[i] == Approx(expected[i]).margin(1e-14));
    // A rotation: A e_x keeps its length, and the axis is kept.
    const double axis[3] = {1, -2, 0.5};
    double turned[3];
    rotated(start.q.data() + 3, axis, turned);
    for (int i = 0; i < 3; ++i) CHECK(turned[i] == Approx(axis[i]).margin(1e-14));
  }
}

TEST_CASE("spatial scene: mistakes") {
  const std::string start = "[start]\ngiven = [\"top\"]\n";
  CHECK_THAT(complaint(body + "e0 = 1\ne1 = 1\ne2 = 0\ne3 = 0\n" + start),
             Contains("e0^2 + e1^2 + e2^2 + e3^2 = 1, found 2"));
  CHECK_THAT(complaint(body + "e0 = 1\n" + start), Contains("needs 'e1'"));
  CHECK_THAT(complaint(body + "rotation_axis = [0, 0, 0]\nangle_rad = 1\n" + start), Contains("must not be zero"));
  CHECK_THAT(complaint(body + "omega_x_rad_per_s = 1\nomega_global_y_rad_per_s = 1\n" + start),
             Contains("gives the angular velocity twice"));
  CHECK_THAT(complaint(body + "inertia_xy_kg_m2 = 0.3\n" + start), Contains("No body has this inertia tensor"));
  CHECK_THAT(complaint(body + "[start]\ngiven = [\"top.omega_x\"]\n"), Contains("given_velocities"));
  CHECK_THAT(complaint(body + "[point.P]\non = \"top\"\nx_m = 1\ny_m = 0\n" + start), Contains("needs 'z_m'"));
  CHECK_THAT(complaint(body + points +
                       "[point.P]\nx_m = 1\ny_m = 0\nz_m = 0\n[hinge.j]\npoints = [\"foot\", \"P\"]\n"
                       "axis_first = [0, 0, 1]\n" +
                       start),
             Contains("hinge.j.points[1]") && Contains("'P' is a free point"));
  CHECK_THAT(complaint(body + points +
                       "[hinge.j]\npoints = [\"O\", \"foot\"]\naxis_first = [0, 0, 1]\n"
                       "angle = \"a\"\nangle_rad = 3\n" +
                       start),
             Contains("more than a quarter of a turn from the first poses") && Contains("stand at 0 rad"));
  CHECK_THAT(complaint(body + points +
                       "[hinge.j]\npoints = [\"O\", \"foot\"]\naxis_first = [0, 0, 1]\n"
                       "axis_second = [0, 1, 0]\nangle = \"a\"\n" +
                       start),
             Contains("give 'normal_first' and 'normal_second'"));
  CHECK_THAT(complaint(body + points +
                       "[universal.j]\npoints = [\"O\", \"foot\"]\naxis_first = [0, 0, 1]\n"
                       "axis_second = [0, 1, 0]\nangle = \"a\"\n" +
                       start),
             Contains("Unknown key 'angle'"));
  CHECK_THAT(complaint(body + points + "[revolute.j]\npoints = [\"O\", \"foot\"]\n" + start),
             Contains("revolute.j.points") && Contains("In space use [hinge.*]"));
  CHECK_THAT(complaint(body + points + "[prismatic.j]\npoints = [\"O\", \"foot\"]\naxis_angle_rad = 1\n" + start),
             Contains("needs 'axis_first'"));
  CHECK_THAT(complaint(body + points +
                       "[hinge.j]\npoints = [\"O\", \"foot\"]\naxis_first = [0, 0, 1]\n"
                       "angle = \"a\"\n[rack_and_pinion.r]\nangle = \"a\"\ncoordinate = \"a.angle\"\n"
                       "radius_m = 1\n[start]\ngiven = []\n"),
             Contains("rack_and_pinion.r.coordinate") && Contains("a length in m; 'a.angle' is in rad"));
  CHECK_THAT(complaint(body + points +
                       "[hinge.j]\npoints = [\"O\", \"foot\"]\naxis_first = [0, 0, 1]\n"
                       "angle = \"a\"\n[gear.g]\nangles = [\"a\", \"b\"]\nratio = 2\n[start]\ngiven = []\n"),
             Contains("gear.g.angles[1]") && Contains("There is no body or angle 'b'"));
  CHECK_THAT(complaint(body + points + "[bar.b]\nfrom = \"O\"\nto = \"flat\"\nmass_kg = 1\n" + start),
             Contains("bar.b.from: Point 'O' is a point of space"));
  CHECK_THAT(complaint(body + points + "[spherical.j]\npoints = [\"flat\", \"foot\"]\n" + start),
             Contains("spherical.j.points[0]: Point 'flat' is a planar point"));
  CHECK_THAT(complaint(body + points + "[spherical.j]\npoints = [\"head\", \"foot\"]\n" + start),
             Contains("are fixed to the same body"));
  CHECK_THAT(complaint(body + points + "[spherical.j]\npoints = [\"O\", \"fot\"]\n" + start),
             Contains("There is no spatial point 'fot'. Did you mean 'foot'?"));
  CHECK_THAT(complaint(body + points +
                       "[translational.j]\npoints = [\"O\", \"foot\"]\naxis_first = [1, 0, 0]\n"
                       "axis_second = [0, 1, 0]\n" +
                       start),
             Contains("give 'normal_first' and 'normal_second'"));
  CHECK_THAT(complaint(body +
                       "rotation_axis = [1, 0, 0]\nangle_rad = 1\n[parameter.e]\nnumber = "
                       "\"rigid_body.top.e1\"\n" +
                       start),
             Contains("cannot vary: the scene turns the body by rotation_axis"));
}

TEST_CASE("spatial scene: a body in natural coordinates starts like one in Euler parameters") {
  const std::string keys =
      "rotation_axis = [1, -2, 0.5]\nangle_rad = 2.2\nvz_m_per_s = 3\nomega_global_x_rad_per_s = 1.5\n"
      "omega_global_y_rad_per_s = -0.5\n";
  const std::string place = "[point.P]\non = \"top\"\nx_m = 0.3\ny_m = -0.2\nz_m = 0.7\n";
  const auto start_of = [&](const std::string& kind) {
    std::string text = body;
    text.replace(0, text.find(']'), "[" + kind + ".top");
    return Scene::parse(text + keys + place + "[start]\ngiven = [\"top\"]\n", "s.toml");
  };
  const Scene euler = start_of("rigid_body"), natural = start_of("natural_body");
  Assembly a(euler.mechanism(), euler.mechanism()->select({})), b(natural.mechanism(), natural.mechanism()->select({}));
  const Start sa = find_start(a, 0, false), sb = find_start(b, 0, false);
  REQUIRE(size_t(sb.q.size()) == 12);
  const auto place_of = [](const Scene& scene, const Start& s, bool velocity) {
    const SpatialPoint& p = scene.mechanism()->spatial_point("P");
    const double numbers[] = {0.3, -0.2, 0.7};
    Eigen::Vector3d r;
    if (velocity)
      p.velocity(s.q.data(), s.v.data(), numbers, r.data());
    else
      p.position(s.q.data(), numbers, r.data());
    return r;
  };
  for (const bool velocity : {false, true})
    CHECK((place_of(euler, sa, velocity) - place_of(natural, sb, velocity)).norm() < 1e-13);
}

TEST_CASE("spatial scene: joint coordinates start where the first poses stand") {
  const Scene scene =
      Scene::parse(body + "rotation_axis = [0, 0, 1]\nangle_rad = 2.5\nomega_z_rad_per_s = 3\n" + points +
                       "[hinge.j]\npoints = [\"O\", \"foot\"]\naxis_first = [0, 0, 2]\nangle = \"a\"\n"
                       "[start]\ngiven = [\"top.e3\"]\ngiven_velocities = [\"top.omega_z\"]\n",
                   "s.toml");
  Assembly assembly(scene.mechanism(), scene.mechanism()->select({}));
  const Start start = find_start(assembly, 0, false);
  const int a = scene.mechanism()->coordinate("a.angle");
  CHECK(start.q[a] == Approx(2.5).epsilon(1e-14));
  CHECK(start.v[a] == Approx(3).epsilon(1e-13));
}
