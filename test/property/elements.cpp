// Every registered kind of element at random states: through its example scene, and every element between two
// points for every pair of sorts of points.
#include <set>

#include "costate/kind/body/bar.h"
#include "costate/kind/body/body.h"
#include "costate/kind/body/mass.h"
#include "costate/kind/body/natural_body.h"
#include "costate/kind/body/point.h"
#include "costate/kind/body/rigid_body.h"
#include "costate/kind/force/force.h"
#include "costate/kind/force/maxwell.h"
#include "costate/kind/force/spring.h"
#include "costate/kind/joint/angle.h"
#include "costate/kind/joint/coordinate.h"
#include "costate/kind/joint/distance.h"
#include "costate/kind/joint/driver.h"
#include "costate/kind/joint/fixed.h"
#include "costate/kind/joint/hinge.h"
#include "costate/kind/joint/prismatic.h"
#include "costate/kind/joint/revolute.h"
#include "costate/kind/joint/sliding_joint.h"
#include "costate/kind/joint/spherical.h"
#include "costate/kind/joint/tie_rod.h"
#include "costate/kind/joint/two_lines.h"
#include "costate/mechanism/derivative_check.h"
#include "examples.h"

using namespace costate;
using namespace costate::test;

namespace {

Local localize(const Element& e, const Mechanism& m, const State& s, int row, int rows, int state, int states) {
  Local l;
  l.t = s.t;
  const auto pick = [&](const Vector& from) {
    Vector r(static_cast<Eigen::Index>(e.coordinates().size()));
    for (Eigen::Index i = 0; i < r.size(); ++i) r[i] = from[e.coordinates()[static_cast<std::size_t>(i)]];
    return r;
  };
  l.q = pick(s.q);
  l.v = pick(s.v);
  l.a = pick(s.a);
  l.lambda = s.lambda.segment(row, rows);
  l.z = s.z.segment(state, states);
  l.p.resize(static_cast<Eigen::Index>(e.numbers().size()));
  for (std::size_t i = 0; i < e.numbers().size(); ++i)
    l.p[static_cast<Eigen::Index>(i)] = m.numbers()[e.numbers()[i]].value;
  return l;
}

/// Checks every element of a mechanism at a state; returns how many measures it has on plain numbers.
int check_elements(const Mechanism& m, const State& s) {
  int plain = 0;
  const auto visit = [&](const auto& e, int row, int rows, int state, int states) {
    INFO("element " << e.path());
    const Local local = localize(e, m, s, row, rows, state, states);
    check(e, local);
    plain += check_measures(e, local);
  };
  for (const auto& e : m.bodies()) visit(*e, 0, 0, 0, 0);
  for (std::size_t k = 0; k < m.constraints().size(); ++k)
    visit(*m.constraints()[k], m.row_offsets()[k], m.constraints()[k]->rows(), 0, 0);
  for (std::size_t k = 0; k < m.forces().size(); ++k)
    visit(*m.forces()[k], 0, 0, m.state_offsets()[k], m.forces()[k]->states());
  return plain;
}

/// A point of each sort, none near another.
std::vector<std::string> add_points(MechanismBuilder& builder) {
  add_ground_point(builder, "ground", 0.1, -0.2);
  add_ground_point(builder, "support", 3.1, 0.3);
  add_free_point(builder, "free", {1.1, 0.4});
  add_free_point(builder, "end", {2.0, 1.1});
  add_free_point(builder, "other", {-0.9, 1.5});
  BodyOptions plate{1.5, 0.3, 0.1, -0.05, -1.2, -0.7, 0.4};
  add_body(builder, "plate", plate);
  plate.x_m = 2.2;
  plate.y_m = -1.3;
  add_body(builder, "disc", plate);
  add_bar(builder, "first", "ground", "other", {1.0});
  add_bar(builder, "middle", "free", "end", {2.0, 1.2, 0.5, 0.1});
  add_bar(builder, "last", "end", "support", {1.0});
  add_attached_point(builder, "on_plate", "plate", 0.3, 0.5);
  add_attached_point(builder, "on_disc", "disc", -0.4, 0.2);
  add_attached_point(builder, "on_first", "first", 0.7, -0.3);
  add_attached_point(builder, "on_middle", "middle", 0.4, 0.6);
  add_attached_point(builder, "on_last", "last", 0.5, 0.4);
  return {"ground", "free", "on_plate", "on_disc", "on_first", "on_middle", "on_last"};
}

}  // namespace

TEST_CASE("what users' elements are held against at the start refuses none of ours") {
  for_each_example([](const Scene& scene, const Assembly&, const State&) {
    CHECK_NOTHROW(check_derivatives(*scene.mechanism(), ElementsChecked::all));
  });
}

TEST_CASE("every element's blocks by hand equal dual numbers, and these equal differences") {
  std::set<std::string> not_by_hand;
  int plain = 0;
  for_each_example([&](const Scene& scene, const Assembly&, const State& s) {
    const Mechanism& m = *scene.mechanism();
    const auto note = [&](const auto& list) {
      for (const auto& e : list)
        if (!e->by_hand()) not_by_hand.insert(e->kind());
    };
    note(m.bodies());
    note(m.constraints());
    note(m.forces());
    plain += check_elements(m, s);
  });
  CHECK(plain > 100);  // measures on plain numbers, of bodies, springs, bushings and tyres
  std::string list;
  for (const auto& kind : not_by_hand) list += " " + kind;
  WARN("Kinds with blocks that are not by hand yet:" << (list.empty() ? " none" : list));
}

TEST_CASE("the same between every two sorts of points") {
  MechanismBuilder builder;
  builder.set_gravity(0.4, -9.81);
  const auto points = add_points(builder);
  for (const auto& a : points)
    for (const auto& b : points) {
      if (a == b) continue;
      const std::string name = a + "-" + b;
      INFO(name);
      add_revolute(builder, name, {a, b});
      add_distance(builder, name, a, b, 1.3);
      add_distance_driver(builder, name, a, b, sine_law(1.2, 0.3, 2.0, 0.1));
      add_angle(builder, name, a, b, {});
      add_spring(builder, name, a, b, {100, 0.8, 3, 1, polynomial_law({0, 0, 0, 50}), {}});
      add_maxwell(builder, name, a, b, {80, 0.8, 12, 0.05});
      const auto& c = a == "ground" || b == "ground" ? points[2] : points[0];
      for (const auto& d : points) {
        if (d == a || d == c) continue;
        add_parallel(builder, name + "-" + d, {a, b}, {c, d});
        add_perpendicular(builder, name + "-" + d, {a, b}, {c, d});
        if (d != b) add_slot(builder, name + "-" + d, d, {a, b});
      }
    }
  add_prismatic(builder, "ground-body", {"ground", "on_plate"}, {0.3, 0.1});
  add_prismatic(builder, "body-ground", {"on_plate", "ground"}, {0.3, 0.1});
  add_prismatic(builder, "body-body", {"on_plate", "on_disc"}, {0.3, 0.1});
  for (const auto& a : points)
    if (a != "ground") add_force(builder, a, a, sine_law(1, 2, 3, 0.4), 5);
  const auto mechanism = builder.build();
  State start;
  start.q.resize(mechanism->coordinate_count());
  for (int i = 0; i < mechanism->coordinate_count(); ++i)
    start.q[i] = mechanism->numbers()[mechanism->coordinates()[i].position_number].value;
  Random random(7);
  for (int k = 0; k < 2; ++k)
    check_elements(*mechanism, random_state(*mechanism, start.q, Vector::Zero(mechanism->state_count()), random));
}

TEST_CASE("the same between every two sorts of points of space") {
  MechanismBuilder builder;
  builder.set_gravity(0.4, -9.81, 1.7);
  RigidBodyOptions body{1.5, {0.3, 0.4, 0.35, 0.02, -0.05, 0.01}, {0.1, -0.05, 0.2}};
  body.position_m = {-1.2, -0.7, 0.4};
  body.euler = euler_parameters({1, 2, -0.5}, 1.1);
  add_rigid_body(builder, "plate", body);
  body.position_m = {2.2, -1.3, 0.8};
  body.euler = euler_parameters({-0.3, 0.4, 1}, -2.3);
  add_rigid_body(builder, "disc", body);
  body.position_m = {0.2, 1.3, -0.8};
  body.euler = euler_parameters({0.3, -0.4, 1}, 0.7);
  add_natural_body(builder, "block", body);
  body.position_m = {-0.6, 0.4, 1.8};
  body.euler = euler_parameters({1, 0.4, 0.1}, -1.9);
  add_natural_body(builder, "beam", body);
  add_spatial_ground_point(builder, "ground", {0.1, -0.2, 0.3});
  add_spatial_free_point(builder, "free", {0.7, 0.9, -0.4});
  add_mass(builder, "free", "free", 0.7);
  add_spatial_point(builder, "on_plate", "plate", {0.3, 0.5, -0.2});
  add_spatial_point(builder, "on_disc", "disc", {-0.4, 0.2, 0.6});
  add_spatial_point(builder, "on_block", "block", {0.1, -0.3, 0.2});
  add_spatial_point(builder, "on_beam", "beam", {-0.2, 0.4, 0.3});
  add_own_coordinate(builder, "rack", "m", 0.1, 0);
  const std::vector<std::string> points = {"ground", "free", "on_plate", "on_disc", "on_block", "on_beam"};
  for (const auto& a : points)
    if (a != "ground" && a != "free") add_mass(builder, a, a, 0.4);
  JointAxes axes{{0.2, 1.0, -0.3}, {0.9, 0.1, 0.4}};
  axes.normal_first = {1, 0, 0};
  axes.normal_second = {0, 1, 0.2};
  for (const auto& a : points)
    for (const auto& b : points) {
      if (a == b) continue;
      const std::string name = a + "-" + b;
      add_distance(builder, name, a, b, 1.3);
      add_spring(builder, name, a, b, {100, 0.8, 3, 1, polynomial_law({0, 0, 0, 50}), {}});
      add_maxwell(builder, name, a, b, {80, 0.8, 12, 0.05});
      add_distance_driver(builder, name, a, b, sine_law(1.2, 0.3, 2.0, 0.1));
      add_spherical(builder, name, {a, b});
      if (a == "ground" || a == "on_plate") {
        TieRodOptions rod;
        rod.from = a;
        rod.to = b;
        rod.slide = "rack";
        rod.direction = {0.1, 1, 0.2};
        add_tie_rod(builder, name, rod);
      }
      if (a == "free" || b == "free") {
        // No direction is fixed to a free point.
        CHECK_THROWS_WITH(add_hinge(builder, name + "-refused", {a, b}, axes),
                          Catch::Contains("'free' is a free point"));
        continue;
      }
      add_hinge(builder, name, {a, b}, axes, JointCoordinate{name + "-hinge"});
      add_universal(builder, name, {a, b}, axes);
      add_cylindrical(builder, name, {a, b}, axes, {JointCoordinate{name}, JointCoordinate{name}});
      add_translational(builder, name, {a, b}, axes, JointCoordinate{name + "-slide"});
      add_planar(builder, name, {a, b}, axes);
      add_fixed(builder, name, {a, b});
    }
  const auto mechanism = builder.build();
  State start;
  start.q.resize(mechanism->coordinate_count());
  for (int i = 0; i < mechanism->coordinate_count(); ++i)
    start.q[i] = mechanism->numbers()[mechanism->coordinates()[i].position_number].value;
  Random random(11);
  for (int k = 0; k < 3; ++k)
    check_elements(*mechanism, random_state(*mechanism, start.q, Vector::Zero(mechanism->state_count()), random));
}
