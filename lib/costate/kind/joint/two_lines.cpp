#include "costate/kind/joint/two_lines.h"

#include "costate/base/error.h"
#include "costate/element/constraint/two_vectors.h"
#include "costate/kind/lookup.h"
#include "costate/scene/scene_kind.h"

namespace costate {

namespace {
void add_two_lines(MechanismBuilder& builder, const std::string& kind, const std::string& name,
                   TwoVectorConstraint::Condition condition, const PointPair& first, const PointPair& second) {
  const std::string path = kind + "." + name;
  const PlanarVector u = find_pair(builder, path, "first", first), w = find_pair(builder, path, "second", second);
  builder.add(std::make_unique<TwoVectorConstraint>(kind, name, condition, u, w));
}
}  // namespace

void add_parallel(MechanismBuilder& builder, const std::string& name, const PointPair& first, const PointPair& second) {
  add_two_lines(builder, "parallel", name, TwoVectorConstraint::Condition::parallel, first, second);
}

void add_perpendicular(MechanismBuilder& builder, const std::string& name, const PointPair& first,
                       const PointPair& second) {
  add_two_lines(builder, "perpendicular", name, TwoVectorConstraint::Condition::perpendicular, first, second);
}

void add_slot(MechanismBuilder& builder, const std::string& name, const std::string& point, const PointPair& line) {
  const std::string path = "slot." + name;
  const PlanarVector u = find_pair(builder, path, "line", line);
  const PlanarPoint& p = find_point(builder, path + ".point", point);
  if (point == line.first || point == line.second)
    throw ModelError(path + ".point", "'" + point + "' is one of the points of the line itself.");
  builder.add(std::make_unique<TwoVectorConstraint>("slot", name, TwoVectorConstraint::Condition::parallel, u,
                                                    PlanarVector(u.from(), p)));
}

namespace {

// Two bodies with a few points each: the stage of the examples below.
const std::string stage = R"(
[gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0

[point.B]
ground = true
x_m = 1
y_m = 0.2

[body.plate]
x_m = 0.5
y_m = 0.4
angle_rad = 0.3
mass_kg = 2
inertia_kg_m2 = 0.4
center_x_m = 0.1

[body.block]
x_m = 1.2
y_m = 0.9
angle_rad = 0.1
angular_velocity_rad_per_s = 0.5
mass_kg = 1
inertia_kg_m2 = 0.2

[point.left]
on = "plate"
x_m = -0.3
y_m = 0.1

[point.right]
on = "plate"
x_m = 0.4
y_m = 0.2

[point.low]
on = "block"
x_m = 0.1
y_m = -0.2

[point.high]
on = "block"
x_m = -0.1
y_m = 0.3

[start]
given = ["plate.x", "plate.y", "block.x", "block.y", "block.angle"]
)";

template <void (*add_lines)(MechanismBuilder&, const std::string&, const PointPair&, const PointPair&)>
void add_read_lines(const std::string& name, SceneTable& table, MechanismBuilder& builder) {
  const PointPair first = table.text_pair("first"), second = table.text_pair("second");
  add_lines(builder, name, first, second);
}

const RegisterSceneKind parallel({
    .name = "parallel",
    .phase = ScenePhase::elements,
    .summary = "two lines stay parallel",
    .example = stage + R"(
[parallel.lines]
first = ["left", "right"]
second = ["A", "low"]
)",
    .add = add_read_lines<add_parallel>,
});

const RegisterSceneKind perpendicular({
    .name = "perpendicular",
    .phase = ScenePhase::elements,
    .summary = "two lines stay perpendicular",
    .example = stage + R"(
[perpendicular.lines]
first = ["left", "right"]
second = ["low", "high"]
)",
    .add = add_read_lines<add_perpendicular>,
});

const RegisterSceneKind slot({
    .name = "slot",
    .phase = ScenePhase::elements,
    .summary = "a point stays on the line through two others",
    .example = R"(
[gravity]
y_m_per_s2 = -9.81

[point.A]
ground = true
x_m = 0
y_m = 0

[point.B]
ground = true
x_m = 1
y_m = 0.2

[point.P]
x_m = 0.6
y_m = 0.1

[body.arm]
x_m = 0.3
y_m = 0.9
angle_rad = 0.3
mass_kg = 2
inertia_kg_m2 = 0.4

[point.left]
on = "arm"
x_m = -0.3
y_m = -0.1

[point.right]
on = "arm"
x_m = 0.4
y_m = 0.2

[point.Q]
x_m = 0.5
y_m = 1.0

[bar.rod]
from = "P"
to = "Q"
mass_kg = 1

[slot.rail]
point = "P"
line = ["A", "B"]

[slot.groove]
point = "Q"
line = ["left", "right"]

[start]
given = ["P.x", "arm.x", "arm.y", "arm.angle"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          const std::string point = table.text("point");
          add_slot(builder, name, point, table.text_pair("line"));
        },
});

}  // namespace

}  // namespace costate
