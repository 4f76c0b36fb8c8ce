#include "costate/kind/force/latch.h"

#include "costate/base/error.h"
#include "costate/element/force/latch.h"
#include "costate/kind/lookup.h"
#include "costate/scene/key_meaning.h"
#include "costate/scene/scene_kind.h"

namespace costate {

void add_latch(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& angles,
               const LatchOptions& o) {
  const std::string path = "latch." + name;
  const std::vector<int> coordinates = find_angles(builder, path, angles);
  if (!o.release_ahead_of.empty() && o.release_point.empty())
    throw ModelError(path + ".release_ahead_of", "Only a 'release_point' is ahead of another one: name it as well.");
  const auto find = [&](const char* key, const std::string& point) {
    return point.empty() ? nullptr : &find_point(builder, path + key, point);
  };
  const PlanarPoint *release = find(".release_point", o.release_point),
                    *ahead = find(".release_ahead_of", o.release_ahead_of);
  if (release && release->coordinates().empty())
    throw ModelError(path + ".release_point", "'" + o.release_point + "' is on the ground itself.");
  std::vector<int> numbers;
  const auto add = [&](const char* key, double value, NumberRule rule, const char* fixed_because) {
    numbers.push_back(builder.add_number(path + key, value, rule));
    if (fixed_because) builder.fix_number(numbers.back(), fixed_because);
  };
  const char* never = release ? nullptr : "nothing lets this latch go.";
  add(".stiffness_N_m_per_rad", o.stiffness_N_m_per_rad, NumberRule::non_negative, nullptr);
  add(".damping_N_m_s_per_rad", o.damping_N_m_s_per_rad, NumberRule::non_negative, nullptr);
  add(".angle_rad", o.angle_rad, NumberRule::any, nullptr);
  add(".holds", o.holds ? 1 : 0, NumberRule::any, "it says in which mode the motion starts.");
  add(".ground_height_m", o.ground_height_m, NumberRule::any, never);
  add(".ground_angle_rad", o.ground_angle_rad, NumberRule::any, never);
  add(".release_radius_m", o.release_radius_m, NumberRule::non_negative, never);
  add(".ground_x_m", o.ground_x_m, NumberRule::any, never);
  builder.add(std::make_unique<Latch>(name, coordinates, o.from_above, release, ahead, numbers));
}

namespace {

const RegisterSceneKind latch_registered({
    .name = "latch",
    .phase = ScenePhase::elements,
    .summary = "a latch between two angles: it catches, holds, and is let go by a point that touches the ground",
    .example = R"(
[gravity]
y_m_per_s2 = -9.81

[body.thigh]
x_m = 0
y_m = 1
angle_rad = 0.1
mass_kg = 2
inertia_kg_m2 = 0.1

[body.shank]
x_m = 0.05
y_m = 0.5
angle_rad = 0.3
angular_velocity_rad_per_s = -2
mass_kg = 1
inertia_kg_m2 = 0.05

[point.foot]
on = "thigh"
x_m = 0.1
y_m = -0.3

[point.other]
on = "shank"
x_m = -0.1
y_m = 0.2

[latch.knee]
angles = ["thigh", "shank"]
stiffness_N_m_per_rad = 100
damping_N_m_s_per_rad = 2
angle_rad = 0.1
release_point = "foot"
release_ahead_of = "other"
release_radius_m = 0.02
ground_x_m = 0.3
ground_height_m = 0.05
ground_angle_rad = -0.02

[latch.stop]
angle = "shank"
closes = "from_below"
holds = true
stiffness_N_m_per_rad = 50

[start]
given = ["thigh.x", "thigh.y", "thigh.angle", "shank.x", "shank.y", "shank.angle"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          LatchOptions o;
          const std::vector<std::string> angles = read_angles(table);
          o.stiffness_N_m_per_rad = table.value("stiffness_N_m_per_rad", NumberRule::non_negative);
          o.damping_N_m_s_per_rad = table.value("damping_N_m_s_per_rad", NumberRule::non_negative, 0);
          o.angle_rad = table.value("angle_rad", NumberRule::any, 0);
          o.from_above = table.one_of("closes", {"from_above", "from_below"}, "from_above") == "from_above";
          o.holds = table.flag("holds", false);
          o.release_point = table.text("release_point", "");
          if (!o.release_point.empty()) {
            o.release_ahead_of = table.text("release_ahead_of", "");
            o.release_radius_m = table.value("release_radius_m", NumberRule::non_negative, 0);
            o.ground_x_m = table.value("ground_x_m", NumberRule::any, 0);
            o.ground_height_m = table.value("ground_height_m", NumberRule::any, 0);
            o.ground_angle_rad = table.value("ground_angle_rad", NumberRule::any, 0);
          }
          add_latch(builder, name, angles, o);
        },
});

const KindKeys latch_keys("latch",
                          {{"angle", "an angle against the ground"},
                           {"angles", "two angles: the second against the first"},
                           {"stiffness_N_m_per_rad", "of what holds"},
                           {"damping_N_m_s_per_rad", "of what holds"},
                           {"angle_rad", "where it catches, and what it holds"},
                           {"closes", "whether it catches an angle that falls there, or one that rises"},
                           {"holds", "whether it does so at the start"},
                           {"release_point", "name of a point that lets it go where it comes down to the ground"},
                           {"release_ahead_of",
                            "name of a point: only where the other is ahead of it along the ground"},
                           {"release_radius_m", "of an arc about the point that lets go"},
                           {"ground_x_m", "where the ground there has its height"},
                           {"ground_height_m", "of the ground there"},
                           {"ground_angle_rad", "by which it rises along x"}});

}  // namespace

}  // namespace costate
