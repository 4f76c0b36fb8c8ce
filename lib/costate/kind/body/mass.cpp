#include "costate/kind/body/mass.h"

#include "costate/base/error.h"
#include "costate/element/body/natural_body.h"
#include "costate/element/body/planar_body.h"
#include "costate/element/body/point_mass.h"
#include "costate/element/body/rigid_body.h"
#include "costate/kind/lookup.h"
#include "costate/scene/scene_kind.h"

namespace costate {

namespace {
/// The number of a moment of inertia that is none.
int without_inertia(MechanismBuilder& builder, const std::string& path) {
  const int none = builder.add_number(path + ".inertia_kg_m2", 0);
  builder.fix_number(none, "a mass at a point has no moment of inertia.");
  return none;
}

/// At a free point, or on a body: then its own inertia is zero and its centre of mass the point.
void add_spatial_mass(MechanismBuilder& builder, const std::string& name, const std::string& point, double mass_kg) {
  const std::string path = "mass." + name;
  const SpatialPoint& p = builder.spatial_point(point);
  if (p.kind() == SpatialPoint::Kind::ground)
    throw ModelError(path + ".point",
                     "A mass sits on a free point or on a rigid body, but '" + point + "' is on the ground.");
  std::vector<int> numbers = {builder.add_number(path + ".mass_kg", mass_kg, NumberRule::non_negative)};
  if (p.kind() == SpatialPoint::Kind::free) {
    for (const int g : builder.spatial_gravity_numbers()) numbers.push_back(g);
    builder.add(std::make_unique<PointMass>(name, p.coordinates(), numbers));
    return;
  }
  numbers.insert(numbers.end(), 6, without_inertia(builder, path));
  numbers.insert(numbers.end(), p.numbers().begin(), p.numbers().end());
  for (const int g : builder.spatial_gravity_numbers()) numbers.push_back(g);
  if (p.kind() == SpatialPoint::Kind::on_natural_body)
    builder.add(std::make_unique<NaturalBody>("mass", name, p.coordinates(), numbers, NaturalBody::Reports::nothing));
  else
    builder.add(std::make_unique<RigidBody>("mass", name, p.coordinates(), numbers, RigidBody::Reports::nothing));
}
}  // namespace

void add_mass(MechanismBuilder& builder, const std::string& name, const std::string& point, double mass_kg) {
  if (builder.has_spatial_point(point)) return add_spatial_mass(builder, name, point, mass_kg);
  const std::string path = "mass." + name;
  const PlanarPoint& p = find_point(builder, path + ".point", point);
  const bool on_body = p.kind() == PlanarPoint::Kind::on_body;
  if (p.kind() != PlanarPoint::Kind::free && !on_body)
    throw ModelError(path + ".point", "A mass sits on a free point or on a body, but '" + point +
                                          "' is on the ground or on a bar. Join a free point to it with "
                                          "[revolute.*], or put the mass into the bar.");
  std::vector<int> numbers = {builder.add_number(path + ".mass_kg", mass_kg, NumberRule::non_negative)};
  if (on_body) {
    numbers.push_back(without_inertia(builder, path));
    numbers.insert(numbers.end(), p.numbers().begin(), p.numbers().end());
  }
  for (const int g : builder.gravity_numbers()) numbers.push_back(g);
  if (on_body)
    builder.add(std::make_unique<PlanarBody>("mass", name, p.coordinates(), numbers));
  else
    builder.add(std::make_unique<PointMass>(name, p.coordinates(), numbers));
}

namespace {

const RegisterSceneKind mass_registered({
    .name = "mass",
    .phase = ScenePhase::elements,
    .summary = "a mass concentrated at a free point or at a point of a body",
    .example = R"(
[gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0

[point.P]
x_m = 0.6
y_m = -0.8

[bar.string]
from = "A"
to = "P"
mass_kg = 0

[mass.bob]
point = "P"
mass_kg = 1.5

[start]
given = ["P.x"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const std::string point = table.text("point");
          add_mass(builder, name, point, table.value("mass_kg"));
        },
});

}  // namespace

}  // namespace costate
