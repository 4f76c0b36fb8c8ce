// Forces between bodies of space against rigid-body mechanics done here with rotation matrices: what they do
// to each body, as a force and a moment.
#include <fmt/format.h>

#include <Eigen/Geometry>
#include <catch2/catch.hpp>
#include <map>

#include "costate/scene/scene.h"

using namespace costate;
using Catch::Matchers::Contains;
using Eigen::Matrix3d;
using Eigen::Vector3d;
using Eigen::VectorXd;

namespace {

// Rounding of forces below 1e3 N with arms of 1 m.
constexpr double kRounding = 1e-11;

struct Wrench {
  Vector3d force = Vector3d::Zero(), moment = Vector3d::Zero();  // the moment about the global origin
};

/// A scene at its first positions and velocities.
class Still {
 public:
  explicit Still(const std::string& text) : scene_(Scene::parse(text, "s.toml")), m_(*scene_.mechanism()) {
    const auto n = m_.base_numbers();
    q_.resize(m_.coordinate_count());
    v_.resize(m_.coordinate_count());
    for (int i = 0; i < m_.coordinate_count(); ++i) {
      q_[i] = n[m_.coordinates()[i].position_number];
      v_[i] = n[m_.coordinates()[i].velocity_number];
    }
  }
  /// The generalized force of one element at time t.
  VectorXd generalized(const std::string& element, double t = 0) const {
    const auto* f = dynamic_cast<const Force*>(m_.find_element(element));
    REQUIRE(f);
    const auto numbers = m_.base_numbers();
    std::vector<double> q, v, p, Q(f->coordinates().size());
    for (const int i : f->coordinates()) {
      q.push_back(q_[i]);
      v.push_back(v_[i]);
    }
    for (const int k : f->numbers()) p.push_back(numbers[k]);
    LocalState s;
    s.t = t;
    s.q = q.data();
    s.v = v.data();
    s.p = p.data();
    f->calc_force(s, Q.data(), nullptr);
    VectorXd r = VectorXd::Zero(m_.coordinate_count());
    for (std::size_t i = 0; i < Q.size(); ++i) r[f->coordinates()[i]] += Q[i];
    return r;
  }
  /// What an element does to a rigid body: Q_r is the force, Q_e = 2 E^T M the moment about the reference
  /// point.
  Wrench wrench(const std::string& element, const std::string& body, double t = 0) const {
    const VectorXd Q = generalized(element, t);
    const int k = m_.coordinate(body + ".x");
    const Eigen::Vector4d e = q_.segment<4>(k + 3), Qe = Q.segment<4>(k + 3);
    Eigen::Matrix<double, 3, 4> E;
    E << -e[1], e[0], -e[3], e[2], -e[2], e[3], e[0], -e[1], -e[3], -e[2], e[1], e[0];
    Wrench w;
    w.force = Q.segment<3>(k);
    w.moment = E * Qe / 2 + position(body).cross(w.force);
    return w;
  }
  Vector3d position(const std::string& body) const { return q_.segment<3>(m_.coordinate(body + ".x")); }
  Matrix3d rotation(const std::string& body) const {
    const int k = m_.coordinate(body + ".e0");
    return Eigen::Quaterniond(q_[k], q_[k + 1], q_[k + 2], q_[k + 3]).toRotationMatrix();
  }

 private:
  Scene scene_;
  const Mechanism& m_;
  VectorXd q_, v_;
};

void require_equal(const Vector3d& found, const Vector3d& expected, double tolerance = kRounding) {
  INFO("found " << found.transpose() << ", expected " << expected.transpose());
  REQUIRE((found - expected).norm() <= tolerance);
}

std::string rigid_body(const std::string& name, const std::string& pose) {
  return "[rigid_body." + name + "]\n" + pose + R"(
mass_kg = 3
inertia_xx_kg_m2 = 0.2
inertia_yy_kg_m2 = 0.3
inertia_zz_kg_m2 = 0.25
)";
}
const std::string two_bodies =
    rigid_body("first",
               "x_m = 0.3\ny_m = -0.2\nz_m = 1.1\nrotation_axis = [1, 2, -1]\nangle_rad = 0.8\n"
               "vx_m_per_s = 0.4\nomega_y_rad_per_s = 1.5") +
    rigid_body("second",
               "x_m = -0.5\ny_m = 0.6\nz_m = 0.4\nrotation_axis = [0, 1, 3]\nangle_rad = -1.3\n"
               "vz_m_per_s = -0.7\nomega_x_rad_per_s = 0.9") +
    R"([point.a]
on = "first"
x_m = 0.1
y_m = 0.4
z_m = -0.2
[point.b]
on = "second"
x_m = -0.3
y_m = 0.2
z_m = 0.5
[point.floor]
ground = true
x_m = 0
y_m = 0
z_m = 0
)";
const std::string given = "[start]\ngiven = [\"first\", \"second\"]\n";
const Vector3d at_a(0.1, 0.4, -0.2), at_b(-0.3, 0.2, 0.5);

}  // namespace

TEST_CASE("spatial forces between two bodies leave momentum and angular momentum alone", "[spatial]") {
  const std::string spring_keys = "stiffness_N_per_m = 400\nnatural_length_m = 0.2\ndamping_N_s_per_m = 30\n";
  const std::map<std::string, std::string> elements = {
      {"spring.S", "[spring.S]\nfrom = \"a\"\nto = \"b\"\n" + spring_keys},
      {"axis_spring.S", "[axis_spring.S]\nfrom = \"a\"\nto = \"b\"\naxis = [1, -2, 0.5]\n" + spring_keys},
      {"bushing.S", R"([bushing.S]
from = "a"
to = "b"
rotation_axis_from = [0, 1, 2]
angle_from_rad = 0.5
stiffness_N_per_m = [300, 200, 100]
stiffness_N_m_per_rad = [20, 30, 40]
damping_N_s_per_m = [3, 4, 5]
damping_N_m_s_per_rad = [0.3, 0.2, 0.1]
preload_N = [1, 2, 3]
preload_N_m = [-1, 2, 3]
)"},
      {"friction.S",
       "[friction.S]\nfrom = \"a\"\nto = \"b\"\naxis = [1, -2, 0.5]\nnormal_force_N = 100\n"
       "static_coefficient = 0.4\ndynamic_coefficient = 0.3\ntransition_velocity_m_per_s = 0.5\n"},
      {"couple.S", "[couple.S]\nbodies = [\"first\", \"second\"]\nframe = \"body\"\nx_N_m = 3\nz_N_m = -2\n"}};
  for (const auto& [name, text] : elements) {
    INFO(name);
    const Still s(two_bodies + text + given);
    const Wrench first = s.wrench(name, "first"), second = s.wrench(name, "second");
    require_equal(first.force, -second.force);
    require_equal(first.moment, -second.moment);
    REQUIRE(second.force.norm() + second.moment.norm() > 1);
  }
}

TEST_CASE("axis spring: along the axis of the first body, at the second point", "[spatial]") {
  const Still s(two_bodies + R"([axis_spring.S]
from = "a"
to = "b"
axis = [1, -2, 0.5]
stiffness_N_per_m = 400
natural_length_m = -0.2
preload_N = 7
)" + given);
  const Vector3d u = s.rotation("first") * Vector3d(1, -2, 0.5).normalized();
  const Vector3d b = s.position("second") + s.rotation("second") * at_b,
                 a = s.position("first") + s.rotation("first") * at_a;
  const double force = 400 * (u.dot(b - a) + 0.2) + 7;
  const Wrench second = s.wrench("axis_spring.S", "second");
  require_equal(second.force, -force * u);
  require_equal(second.moment, b.cross(-force * u));
}

TEST_CASE("bushing: about one axis the moment is stiffness times angle, for every angle", "[spatial]") {
  // 0.05 rad by the series, the others in closed form; 3.1 rad is near the half turn where it ends.
  for (const double angle : {0.05, -0.4, 1.0, 2.0, 3.1}) {
    INFO("angle " << angle);
    const Still s(rigid_body("body", "x_m = 0\ny_m = 0\nz_m = 0\nrotation_axis = [1, 2, 2]\nangle_rad = " +
                                         std::to_string(angle)) +
                  R"([point.center]
on = "body"
x_m = 0
y_m = 0
z_m = 0
[point.floor]
ground = true
x_m = 0.02
y_m = 0
z_m = -0.03
[bushing.B]
from = "floor"
to = "center"
stiffness_N_per_m = [500, 600, 700]
stiffness_N_m_per_rad = [40, 40, 40]
[start]
given = ["body"]
)");
    const Wrench w = s.wrench("bushing.B", "body");
    require_equal(w.moment, -40 * angle * Vector3d(1, 2, 2) / 3, 1e-10);
    require_equal(w.force, Vector3d(500 * 0.02, 0, -700 * 0.03));
  }
}

TEST_CASE("bushing: with unequal stiffnesses the work of a small turn is the change of energy", "[spatial]") {
  // The rotation vector of a turn about z after one about x, by Eigen; energy differences against the moment.
  const auto text = [](double z) {
    const Eigen::Quaterniond e = Eigen::AngleAxisd(z, Vector3d::UnitZ()) * Eigen::AngleAxisd(1.1, Vector3d::UnitX());
    return rigid_body("body", fmt::format("x_m = 0\ny_m = 0\nz_m = 0\ne0 = {}\ne1 = {}\ne2 = {}\ne3 = {}", e.w(), e.x(),
                                          e.y(), e.z())) +
           R"([point.center]
on = "body"
x_m = 0
y_m = 0
z_m = 0
[point.floor]
ground = true
x_m = 0
y_m = 0
z_m = 0
[bushing.B]
from = "floor"
to = "center"
stiffness_N_m_per_rad = [40, 25, 90]
[start]
given = ["body"]
)";
  };
  const auto energy = [](double z) {
    const Eigen::AngleAxisd r(Eigen::AngleAxisd(z, Vector3d::UnitZ()) * Eigen::AngleAxisd(1.1, Vector3d::UnitX()));
    const Vector3d theta = r.angle() * r.axis();
    return 0.5 * (40 * theta[0] * theta[0] + 25 * theta[1] * theta[1] + 90 * theta[2] * theta[2]);
  };
  // h = 1e-4: truncation 1e-8 of the third derivative (below 100), rounding 1e-14 / h.
  const double z = 0.6, h = 1e-4;
  CHECK(Still(text(z)).wrench("bushing.B", "body").moment[2] ==
        Approx(-(energy(z + h) - energy(z - h)) / (2 * h)).margin(2e-6));
}

TEST_CASE("bushing: a half turn is refused", "[spatial]") {
  const Still s(rigid_body("body", "x_m = 0\ny_m = 0\nz_m = 0\ne0 = 0\ne1 = 1\ne2 = 0\ne3 = 0") +
                R"([point.center]
on = "body"
x_m = 0
y_m = 0
z_m = 0
[point.floor]
ground = true
x_m = 0
y_m = 0
z_m = 0
[bushing.B]
from = "floor"
to = "center"
stiffness_N_m_per_rad = [1, 1, 1]
[start]
given = ["body"]
)");
  CHECK_THROWS_WITH(s.wrench("bushing.B", "body"), Contains("bushing.B") && Contains("half a turn"));
}

TEST_CASE("forces and couples on a body: global or turning with it", "[spatial]") {
  const Still s(two_bodies + R"([force.fixed]
point = "a"
frame = "body"
x_N = 2
z_N = { kind = "polynomial", coefficients = [1, 3] }
[force.ground]
point = "a"
y_N = 5
[couple.fixed]
body = "first"
frame = "body"
y_N_m = 4
[couple.ground]
body = "first"
x_N_m = 6
)" + given);
  const Matrix3d A = s.rotation("first");
  const Vector3d a = s.position("first") + A * at_a, f = A * Vector3d(2, 0, 1 + 3 * 0.7);
  require_equal(s.wrench("force.fixed", "first", 0.7).force, f);
  require_equal(s.wrench("force.fixed", "first", 0.7).moment, a.cross(f));
  require_equal(s.wrench("force.ground", "first").moment, a.cross(Vector3d(0, 5, 0)));
  require_equal(s.wrench("couple.fixed", "first").moment, A * Vector3d(0, 4, 0));
  require_equal(s.wrench("couple.ground", "first").moment, Vector3d(6, 0, 0));
  require_equal(s.wrench("couple.ground", "first").force, Vector3d::Zero());
}

TEST_CASE("drag: against the velocity through the air", "[spatial]") {
  const Still s(two_bodies + R"([drag.air]
point = "a"
drag_coefficient = 0.4
area_m2 = 1.5
wind_x_m_per_s = -8
wind_z_m_per_s = 3
smoothing_m_per_s = 0.001
)" + given);
  const Matrix3d A = s.rotation("first");
  const Vector3d w = Vector3d(0.4, 0, 0) + A * Vector3d(0, 1.5, 0).cross(at_a) - Vector3d(-8, 0, 3);
  // Smoothing adds (w0 / w)^2 / 2 = 1e-8 of the force.
  require_equal(s.wrench("drag.air", "first").force, -0.5 * 1.2 * 0.4 * 1.5 * w.norm() * w, 1e-6);
}

TEST_CASE("mistakes in spatial forces", "[spatial]") {
  const auto refused = [](const std::string& text, const std::string& message) {
    CAPTURE(text);
    CHECK_THROWS_WITH(Scene::parse(two_bodies + text + given, "s.toml"), Contains(message));
  };
  refused("[force.F]\npoint = \"floor\"\nx_N = 1\n", "'floor' is on the ground");
  refused("[force.F]\npoint = \"a\"\n", "needs 'x_N', 'y_N' or 'z_N'");
  refused("[force.F]\npoint = \"a\"\nx_N = 1\nframe = \"bdy\"\n", "Did you mean 'body'?");
  refused("[couple.C]\nbody = \"frist\"\nx_N_m = 1\n", "Did you mean 'first'?");
  refused("[couple.C]\nbodies = [\"first\", \"first\"]\nx_N_m = 1\n", "must differ");
  refused("[bushing.B]\nfrom = \"a\"\nto = \"a\"\n", "must differ");
  refused("[bushing.B]\nfrom = \"a\"\nto = \"b\"\nstiffness_N_per_m = [1, 2]\n", "must hold x, y, z, found 2");
  refused("[bushing.B]\nfrom = \"a\"\nto = \"b\"\nangle_to_rad = 1\n", "needs 'rotation_axis_to'");
  refused("[axis_spring.S]\nfrom = \"a\"\nto = \"b\"\naxis = [0, 0, 0]\n",
          "'axis' in [axis_spring.S] must not be zero");
  refused("[axis_spring.S]\nfrom = \"a\"\nto = \"c\"\naxis = [0, 0, 1]\n", "There is no spatial point 'c'");
  refused("[drag.D]\npoint = \"a\"\ndrag_coefficient = 1\narea_m2 = 1\nsmoothing_m_per_s = 0\n", "must be positive");
  refused("[friction.F]\nnormal_force_N = 1\nstatic_coefficient = 1\ntransition_velocity_m_per_s = 1\n",
          "needs what it acts on");
  refused(
      "[friction.F]\nnormal_force_N = \"spring.S.preload_N\"\nstatic_coefficient = 1\n"
      "transition_velocity_m_per_s = 1\ncoordinate = \"first.x\"\n",
      "There is no number 'spring.S.preload_N'");
  refused(
      "[friction.F]\nnormal_force_N = 1\nstatic_coefficient = 1\ndynamic_coefficient = 2\n"
      "transition_velocity_m_per_s = 1\ncoordinate = \"first.x\"\n",
      "must not be less than the dynamic one");
  refused(
      "[friction.F]\nnormal_force_N = 1\nstatic_coefficient = 1\ntransition_velocity_m_per_s = 1\n"
      "coordinate = \"first.e1\"\n",
      "'first.e1' is measured in 1");
}
