#include "costate/kind/contact/contact.h"

#include <fmt/format.h>

#include <algorithm>

#include "costate/base/error.h"
#include "costate/element/force/contact.h"
#include "costate/kind/lookup.h"
#include "costate/scene/scene_kind.h"

namespace costate {

namespace {

template <std::size_t N>
std::vector<std::string> list(const std::array<const char*, N>& names) {
  return {names.begin(), names.end()};
}

template <class Law, std::size_t N>
Law law_of(const std::string& subject, const std::string& name, const std::array<const char*, N>& names) {
  const auto at = std::find(names.begin(), names.end(), name);
  if (at == names.end())
    throw ModelError(subject, fmt::format("There is no law '{}'.{}", name, suggestion(name, list(names))));
  return static_cast<Law>(at - names.begin());
}

std::vector<int> add_numbers(MechanismBuilder& builder, const std::string& path, const ContactOptions& o, NormalLaw law,
                             FrictionModel friction) {
  constexpr auto positive = NumberRule::positive, not_negative = NumberRule::non_negative;
  std::vector<int> r;
  // A number that the chosen law does not hold keeps its place and is no parameter.
  const auto add = [&](const char* key, double value, NumberRule rule, bool used) {
    r.push_back(builder.add_number(path + "." + key, value, used ? rule : NumberRule::any));
    if (!used) builder.fix_number(r.back(), "the law of this contact has no such number.");
  };
  const bool linear = law == NormalLaw::linear, voigt = law == NormalLaw::kelvin_voigt;
  const bool restitution = latches(law) && !voigt;
  add("stiffness_N_per_m_n", o.stiffness_N_per_m_n, positive, true);
  add("exponent", linear ? 1 : o.exponent, positive, !linear);
  add("restitution", o.restitution, positive, restitution);
  add("damping_N_s_per_m", o.damping_N_s_per_m, not_negative, voigt);
  if (restitution && o.restitution > 1)
    throw ModelError(path + ".restitution",
                     fmt::format("A coefficient of restitution is at most 1, found {}.", o.restitution));
  if (!linear && o.exponent < 1)
    throw ModelError(path + ".exponent", fmt::format("An exponent is at least 1, found {}.", o.exponent));
  using F = FrictionModel;
  const bool some = friction != F::none;
  const bool two =
      friction == F::bengisu_akay || friction == F::stribeck || friction == F::brown_mcphee || friction == F::lugre;
  const double sticking = o.static_coefficient < 0 ? o.friction_coefficient : o.static_coefficient;
  if (two && sticking < o.friction_coefficient)
    throw ModelError(path + ".static_coefficient",
                     fmt::format("The static coefficient of friction must not be less than that of sliding, found {} "
                                 "and {}.",
                                 sticking, o.friction_coefficient));
  add("friction_coefficient", o.friction_coefficient, has_bristles(friction) ? positive : not_negative, some);
  if (two && o.static_coefficient < 0)
    r.push_back(r.back());
  else
    add("static_coefficient", sticking, not_negative, two);
  add("transition_velocity_m_per_s", o.transition_velocity_m_per_s, positive, some && friction != F::dahl);
  add("dead_velocity_m_per_s", o.dead_velocity_m_per_s, not_negative, friction == F::ambrosio);
  if (friction == F::ambrosio && o.dead_velocity_m_per_s >= o.transition_velocity_m_per_s)
    throw ModelError(path + ".dead_velocity_m_per_s",
                     fmt::format("The ramp must begin below the transition velocity of {} m/s, found {}.",
                                 o.transition_velocity_m_per_s, o.dead_velocity_m_per_s));
  add("decay_s_per_m", o.decay_s_per_m, not_negative, friction == F::bengisu_akay);
  add("bristle_stiffness_per_m", o.bristle_stiffness_per_m, positive, has_bristles(friction));
  add("bristle_damping_s_per_m", o.bristle_damping_s_per_m, not_negative, friction == F::lugre);
  add("ground_height_m", o.ground_height_m, NumberRule::any, true);
  add("ground_angle_rad", o.ground_angle_rad, NumberRule::any, true);
  add("radius_m", o.radius_m, not_negative, o.radius_m > 0);
  add("approach_speed_m_per_s", o.approach_speed_m_per_s, not_negative, latches(law));
  r.push_back(builder.add_number(path + ".bristles_at_start_m", 0));
  builder.fix_number(r.back(), "bristles start undeflected.");
  return r;
}

template <class Point>
void add_at(MechanismBuilder& builder, const std::string& name, const Point& point, const ContactOptions& o) {
  const std::string path = "contact." + name;
  if (point.kind() == Point::Kind::ground)
    throw ModelError(path + ".point", "'" + point.name() + "' is on the ground itself.");
  if (o.radius_m > 0 && point.kind() != Point::Kind::on_body)
    throw ModelError(path + ".radius_m",
                     "'" + point.name() +
                         "' is on no rigid body, whose turning the radius needs: an arc or a sphere "
                         "belongs to one.");
  const auto law = law_of<NormalLaw>(path + ".law", o.law, kNormalLawNames);
  const auto friction = law_of<FrictionModel>(path + ".friction", o.friction, kFrictionModelNames);
  const std::vector<int> numbers = add_numbers(builder, path, o, law, friction);
  builder.add(std::make_unique<Contact<Point>>(name, point, law, friction, o.radius_m > 0, numbers));
}

}  // namespace

void add_contact(MechanismBuilder& builder, const std::string& name, const std::string& point,
                 const ContactOptions& o) {
  if (builder.has_spatial_point(point)) return add_at(builder, name, builder.spatial_point(point), o);
  add_at(builder, name, find_point(builder, "contact." + name + ".point", point), o);
}

namespace {

const RegisterSceneKind contact_registered({
    .name = "contact",
    .phase = ScenePhase::elements,
    .summary = "compliant contact of a point, an arc or a sphere with the ground, with friction",
    .example = R"(
[gravity]
y_m_per_s2 = -9.81

[body.ball]
x_m = 0
y_m = 0.098
vx_m_per_s = 0.4
vy_m_per_s = -0.3
angular_velocity_rad_per_s = 2
mass_kg = 1.5
inertia_kg_m2 = 0.006

[point.C]
on = "ball"
x_m = 0
y_m = 0

[contact.floor]
point = "C"
law = "hunt-crossley"
stiffness_N_per_m_n = 2e4
restitution = 0.7
radius_m = 0.1
ground_angle_rad = -0.05
friction = "stribeck"
friction_coefficient = 0.4
static_coefficient = 0.5
transition_velocity_m_per_s = 0.05
approach_speed_m_per_s = 0.31

[start]
given = ["ball.x", "ball.y", "ball.angle"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          constexpr auto positive = NumberRule::positive, not_negative = NumberRule::non_negative;
          const std::string point = table.text("point");
          ContactOptions o;
          o.law = table.one_of("law", list(kNormalLawNames), o.law);
          o.stiffness_N_per_m_n = table.value("stiffness_N_per_m_n", positive);
          if (o.law != "linear") o.exponent = table.value("exponent", positive, o.exponent);
          const auto law = law_of<NormalLaw>("", o.law, kNormalLawNames);
          if (law == NormalLaw::kelvin_voigt)
            o.damping_N_s_per_m = table.value("damping_N_s_per_m", not_negative);
          else if (latches(law))
            o.restitution = table.value("restitution", positive);
          if (latches(law))
            o.approach_speed_m_per_s = table.value("approach_speed_m_per_s", not_negative, o.approach_speed_m_per_s);
          o.friction = table.one_of("friction", list(kFrictionModelNames), o.friction);
          const auto friction = law_of<FrictionModel>("", o.friction, kFrictionModelNames);
          using F = FrictionModel;
          if (friction != F::none) {
            o.friction_coefficient = table.value("friction_coefficient", not_negative);
            if (friction != F::dahl)
              o.transition_velocity_m_per_s =
                  table.value("transition_velocity_m_per_s", positive, o.transition_velocity_m_per_s);
          }
          if (friction == F::bengisu_akay || friction == F::stribeck || friction == F::brown_mcphee ||
              friction == F::lugre)
            o.static_coefficient = table.find_value("static_coefficient", not_negative).value_or(-1);
          if (friction == F::ambrosio) o.dead_velocity_m_per_s = table.value("dead_velocity_m_per_s", not_negative, 0);
          if (friction == F::bengisu_akay)
            o.decay_s_per_m = table.value("decay_s_per_m", not_negative, o.decay_s_per_m);
          if (has_bristles(friction))
            o.bristle_stiffness_per_m = table.value("bristle_stiffness_per_m", positive, o.bristle_stiffness_per_m);
          if (friction == F::lugre) o.bristle_damping_s_per_m = table.value("bristle_damping_s_per_m", not_negative, 0);
          o.ground_height_m = table.value("ground_height_m", NumberRule::any, 0);
          o.ground_angle_rad = table.value("ground_angle_rad", NumberRule::any, 0);
          o.radius_m = table.value("radius_m", not_negative, 0);
          add_contact(builder, name, point, o);
        },
});

}  // namespace

}  // namespace costate
