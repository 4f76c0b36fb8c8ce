// Where a contact rests (assembly/rest_region.h) it does nothing, and its gap stays as far open as the region says.
#include <catch2/catch.hpp>
#include <cmath>
#include <random>

#include "costate/assembly/assembly.h"
#include "costate/element/gap_element.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"

using namespace costate;

namespace {

// Points of every kind: of bodies with and without a lever, of bars, free ones, several of a body; round ones; laws
// with a latch, with bristles, with neither.
constexpr const char* kPlane = R"([body.disc]
x_m = 0
y_m = 2
angle_rad = 0.2
mass_kg = 1
inertia_kg_m2 = 0.1
[point.A]
x_m = -1
y_m = 3
[point.B]
x_m = -1.5
y_m = 3.2
[bar.rod]
from = "A"
to = "B"
mass_kg = 1
[point.G]
x_m = -3
y_m = 2
ground = true
[bar.arm]
from = "G"
to = "B"
mass_kg = 1
[point.C]
on = "disc"
x_m = 0
y_m = 0
[point.P]
on = "disc"
x_m = 0.6
y_m = -0.8
[point.Q]
on = "disc"
x_m = -0.25
y_m = -0.1
[point.M]
on = "rod"
x_m = 0.2
y_m = 0.4
[point.N]
on = "arm"
x_m = 0.2
y_m = -0.4
[contact.bar]
law = "hertz"
point = "M"
ground_angle_rad = 0.4
stiffness_N_per_m_n = 3e3
[contact.arm]
point = "N"
law = "kelvin-voigt"
stiffness_N_per_m_n = 3e3
damping_N_s_per_m = 10.0
[contact.free]
law = "hertz"
point = "A"
ground_angle_rad = -0.2
stiffness_N_per_m_n = 3e3
energy_lost = true
[contact.centre]
law = "hertz"
point = "C"
radius_m = 0.3
stiffness_N_per_m_n = 3e3
[contact.arc]
law = "hertz"
point = "P"
radius_m = 0.15
ground_angle_rad = 0.3
stiffness_N_per_m_n = 3e3
friction = "dahl"
friction_coefficient = 0.4
bristle_stiffness_per_m = 20.0
[contact.patch]
law = "hertz"
points = ["P", "Q"]
shares = [0.3, 0.7]
ground_height_m = 0.1
stiffness_N_per_m_n = 3e3
[contact.latched]
point = "Q"
law = "flores"
restitution = 0.5
stiffness_N_per_m_n = 3e3
[start]
given = ["disc.x", "disc.y", "disc.angle", "A.x", "A.y"]
)";

constexpr const char* kSpace = R"([gravity]
z_m_per_s2 = -1
[rigid_body.ball]
x_m = 0
y_m = 0
z_m = 2
mass_kg = 1
inertia_xx_kg_m2 = 0.1
inertia_yy_kg_m2 = 0.1
inertia_zz_kg_m2 = 0.1
[point.P]
on = "ball"
x_m = 0.5
y_m = 0.3
z_m = -0.2
[point.C]
on = "ball"
x_m = 0
y_m = 0
z_m = 0
[contact.lever]
law = "hertz"
point = "P"
radius_m = 0.1
ground_angle_rad = 0.3
stiffness_N_per_m_n = 3e3
[contact.centre]
law = "hertz"
point = "C"
stiffness_N_per_m_n = 3e3
[start]
given = ["ball"]
)";

struct Walk {
  Eigen::VectorXd q, v, z;
  StateView view() const { return {.t = 0, .q = q.data(), .v = v.data(), .z = z.data()}; }
};

/// Of bodies in space: four Euler parameters, as far from |e| = 1 as an integrator may leave them.
void normalize_turns(const Mechanism& m, Eigen::VectorXd& q) {
  for (const auto& body : m.bodies())
    if (body->coordinates().size() == 7) {
      double square = 0;
      for (int i = 3; i < 7; ++i) square += q[body->coordinates()[i]] * q[body->coordinates()[i]];
      for (int i = 3; i < 7; ++i) q[body->coordinates()[i]] *= 1.001 / std::sqrt(square);
    }
}

void walk(const char* scene) {
  const auto m = make_problem(Scene::parse(scene, "contacts.toml")).mechanism;
  std::mt19937 random(5);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  Assembly assembly(m, {}), other(m, {});
  Walk at{Eigen::VectorXd::Zero(m->coordinate_count()), Eigen::VectorXd::Zero(m->coordinate_count()),
          Eigen::VectorXd::Zero(m->state_count())};
  std::vector<RestRegion> regions;
  for (std::size_t f = 0; f < m->forces().size(); ++f) {
    REQUIRE(m->forces()[f]->may_rest());
    regions.emplace_back(*m->forces()[f], m->state_offsets()[f]);
  }
  std::vector<int> rested(regions.size()), acted(regions.size());
  for (int step = 0; step < 4000; ++step) {
    // From far away down to the ground, and through it, by steps of all lengths; now and then somewhere else.
    const double length = std::pow(10.0, uniform(-4, 0));
    for (Eigen::Index i = 0; i < at.q.size(); ++i) {
      at.q[i] = step % 100 == 0 ? uniform(-3, 3) : at.q[i] + length * uniform(-1, 1);
      at.v[i] = uniform(-1, 1);
    }
    normalize_turns(*m, at.q);
    // Whether a touch has been latched; bristles.
    for (Eigen::Index i = 0; i < at.z.size(); ++i) at.z[i] = step % 7 < 4 ? 0 : uniform(0, 0.1);

    Eigen::VectorXd Q = Eigen::VectorXd::Zero(at.q.size()), zdot = Eigen::VectorXd::Zero(at.z.size());
    for (const auto& body : m->bodies()) {
      double own[kMaxLocal] = {};
      body->calc_force(other.gather(*body, 0, at.view()), own);
      for (std::size_t i = 0; i < body->coordinates().size(); ++i) Q[body->coordinates()[i]] += own[i];
    }
    for (std::size_t f = 0; f < regions.size(); ++f) {
      const Force& force = *m->forces()[f];
      CAPTURE(step, force.path());
      const LocalState local = other.gather(force, 0, at.view());
      double own[kMaxLocal] = {}, rate[kMaxLocal] = {};
      force.calc_force(local, own, rate);
      bool acts = false;
      for (double x : own) acts = acts || x != 0;
      for (double x : rate) acts = acts || x != 0;
      for (std::size_t i = 0; i < force.coordinates().size(); ++i) Q[force.coordinates()[i]] += own[i];
      for (int i = 0; i < force.states(); ++i) zdot[m->state_offsets()[f] + i] += rate[i];
      RestRegion& region = regions[f];
      if (!region.holds(at.q.data(), at.z.data()) && !(region.is_due() && region.find(local))) {
        acted[f] += acts;
        continue;
      }
      ++rested[f];
      CHECK_FALSE(acts);
      const auto& gaps = dynamic_cast<const GapElement&>(force);
      for (int i = 0; i < gaps.gap_count() && std::isfinite(region.distance()); ++i)
        CHECK(gaps.gap_motion(i, local).gap >= region.distance() - region.way(at.q.data()) - 1e-12);
    }
    assembly.calc_dynamics(at.view());
    const Eigen::Map<const Eigen::VectorXd> all(assembly.Q.data(), Q.size());
    CHECK((all - Q).lpNorm<Eigen::Infinity>() <= 1e-13 * (1 + Q.lpNorm<Eigen::Infinity>()));
    for (Eigen::Index i = 0; i < zdot.size(); ++i) CHECK(assembly.zdot[static_cast<std::size_t>(i)] == zdot[i]);
    // The blocks of a force that acts are there; those of one that rests are zero, and nothing else is left out.
    Assembly fresh(m, {});
    const Eigen::VectorXd a = Eigen::VectorXd::Zero(Q.size()), lambda = Eigen::VectorXd::Zero(m->row_count());
    StateView s = at.view();
    s.a = a.data();
    s.lambda = lambda.data();
    if (step % 10 != 0) continue;
    fresh.calc_partials(s);
    assembly.calc_partials(s);
    CHECK(assembly.K == fresh.K);
    CHECK(assembly.C == fresh.C);
    CHECK(assembly.f_q == fresh.f_q);
    CHECK(assembly.f_z == fresh.f_z);
  }
  for (std::size_t f = 0; f < regions.size(); ++f) {
    CAPTURE(m->forces()[f]->path());
    CHECK(rested[f] > 200);
    CHECK(acted[f] > 200);
  }
}

}  // namespace

TEST_CASE("rest: a contact does nothing within its region, and is felt outside", "[contact]") {
  walk(kPlane);
  walk(kSpace);
}
