#include "costate/kind/joint/revolute.h"

#include "costate/base/error.h"
#include "costate/element/constraint/coincidence.h"
#include "costate/kind/lookup.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_revolute(MechanismBuilder& builder, const std::string& name,
                  const std::pair<std::string, std::string>& points) {
  if (is_spatial(builder, points.first, points.second))
    throw ModelError("revolute." + name + ".points",
                     "A pin joins points of the plane. In space use [hinge.*], which has an axis, or [spherical.*].");
  builder.add(std::make_unique<CoincidenceConstraint>("revolute", name,
                                                      find_pair(builder, "revolute." + name, "points", points)));
}

namespace {

const RegisterSceneKind revolute_registered({
    .name = "revolute",
    .phase = ScenePhase::elements,
    .summary = "a pin: two points coincide",
    .example = R"(
[gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0

[body.arm]
x_m = 0
y_m = 0.5
angle_rad = 0.3
mass_kg = 2
inertia_kg_m2 = 0.4

[body.hand]
x_m = 0.5
y_m = 1.2
angle_rad = -0.2
angular_velocity_rad_per_s = 1
mass_kg = 1
inertia_kg_m2 = 0.1
center_x_m = 0.2

[point.foot]
on = "arm"
x_m = -0.1
y_m = -0.5

[point.wrist]
on = "arm"
x_m = 0.1
y_m = 0.6

[point.palm]
on = "hand"
x_m = -0.2
y_m = 0.05

[revolute.base]
points = ["A", "foot"]

[revolute.joint]
points = ["wrist", "palm"]

[start]
given = ["arm.angle", "hand.angle"]
)",
    .add = [](const std::string& name, SceneTable& table,
              MechanismBuilder& builder) { add_revolute(builder, name, table.text_pair("points")); },
});

}  // namespace

}  // namespace costate
