#include "costate/kind/contact/contact_pair.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/element/force/contact_pair.h"
#include "costate/kind/lookup.h"
#include "costate/scene/key_meaning.h"
#include "costate/scene/scene_kind.h"

namespace costate {

namespace {

template <class Point>
void add_between(MechanismBuilder& builder, const std::string& name, const Point& a, const Point& b,
                 const ContactPairOptions& o) {
  const std::string path = "contact_pair." + name;
  if (a.coordinates().empty() && b.coordinates().empty())
    throw ModelError(path + ".other", "Both points are on the ground: one of them has to move.");
  if (a.coordinates() == b.coordinates())
    throw ModelError(path + ".other",
                     fmt::format("'{}' and '{}' are on one body: name points of two.", a.name(), b.name()));
  typename ContactPair<Point>::Options options;
  options.law = normal_law(path + ".law", o.law);
  options.friction = friction_model(path + ".friction", o.friction);
  options.material = o.youngs_modulus_Pa > 0;
  options.both = options.material && o.other_youngs_modulus_Pa > 0;
  options.energy = o.energy_lost;
  constexpr bool space = ContactPair<Point>::dim == 3;
  if (space && has_bristles(options.friction))
    throw ModelError(
        path + ".friction",
        fmt::format("Bristles of '{}' would have to be carried along with the normal, which turns: between "
                    "bodies in space take a model without.",
                    o.friction));
  if (options.friction != FrictionModel::none)
    for (const auto& [key, point, radius] :
         {std::tuple(".point", &a, o.radius_m), std::tuple(".other", &b, o.other_radius_m)})
      if (radius > 0 && point->kind() != Point::Kind::on_body && point->kind() != Point::Kind::ground)
        throw ModelError(
            path + key,
            "'" + point->name() +
                "' is on no [rigid_body.*], whose turning friction on a radius needs (that of a "
                "[natural_body.*] it does not know): put it on one, or leave out the radius or the friction.");
  ContactNumbers numbers(builder, path);
  numbers.add_normal_law(o);
  numbers.add_friction(o);
  // A radius of zero stays: a point has no other.
  numbers.add("radius_m", o.radius_m, NumberRule::non_negative, o.radius_m > 0);
  numbers.add("other_radius_m", o.other_radius_m, NumberRule::non_negative, o.other_radius_m > 0);
  numbers.add_start(o, touch_is_event(options.law, options.friction));
  numbers.add_materials(o, "other_");
  builder.add(std::make_unique<ContactPair<Point>>(name, a, b, options, numbers.all()));
}

}  // namespace

void add_contact_pair(MechanismBuilder& builder, const std::string& name, const std::string& point,
                      const std::string& other, const ContactPairOptions& o) {
  const std::string path = "contact_pair." + name;
  check_materials(path, o, "other_", o.radius_m > 0 && o.other_radius_m > 0);
  if (!(o.radius_m + o.other_radius_m > 0))
    throw ModelError(path + ".radius_m", "Two points never touch: give one of them a radius.");
  if (builder.has_spatial_point(point) || builder.has_spatial_point(other)) {
    for (const auto& [key, at] : {std::pair(".point", point), std::pair(".other", other)})
      if (!builder.has_spatial_point(at))
        throw ModelError(path + key, fmt::format("There is no point '{}' of space.", at));
    return add_between(builder, name, builder.spatial_point(point), builder.spatial_point(other), o);
  }
  add_between(builder, name, find_point(builder, path + ".point", point), find_point(builder, path + ".other", other),
              o);
}

namespace {

const RegisterSceneKind contact_pair_registered({
    .name = "contact_pair",
    .phase = ScenePhase::elements,
    .summary = "compliant contact of two circles or two spheres with each other, with friction",
    .example = R"(
[body.ball]
x_m = 0
y_m = 0
vx_m_per_s = 0.6
angular_velocity_rad_per_s = 3
mass_kg = 1.5
inertia_kg_m2 = 0.006

[body.disc]
x_m = 0.247
y_m = 0.02
vx_m_per_s = -0.4
vy_m_per_s = 0.1
mass_kg = 0.8
inertia_kg_m2 = 0.009

[point.C]
on = "ball"
x_m = 0
y_m = 0

[point.D]
on = "disc"
x_m = 0
y_m = 0

[contact_pair.blow]
point = "C"
radius_m = 0.1
other = "D"
other_radius_m = 0.15
law = "hunt-crossley"
stiffness_N_per_m_n = 2e4
restitution = 0.7
friction = "stribeck"
friction_coefficient = 0.3
static_coefficient = 0.4
transition_velocity_m_per_s = 0.05
approach_speed_m_per_s = 0.9

[start]
given = ["ball.x", "ball.y", "ball.angle", "disc.x", "disc.y", "disc.angle"]
)",
    .add =
        [](const std::string& name, SceneTable& table, MechanismBuilder& builder) {
          ContactPairOptions o;
          const std::string point = table.text("point");
          o.radius_m = table.value("radius_m", NumberRule::non_negative, 0);
          const std::string other = table.text("other");
          o.other_radius_m = table.value("other_radius_m", NumberRule::non_negative, 0);
          read_normal_law(table, "other_", o);
          read_friction(table, o);
          if (touch_is_event(normal_law("", o.law), friction_model("", o.friction)))
            o.approach_speed_m_per_s =
                table.value("approach_speed_m_per_s", NumberRule::non_negative, o.approach_speed_m_per_s);
          o.energy_lost = table.flag("energy_lost", false);
          add_contact_pair(builder, name, point, other, o);
        },
});

const KindKeys contact_pair_keys("contact_pair",
                                 {{"point", "name of the centre of a circle or a sphere, or of a point"},
                                  {"radius_m", "about it; 0: the point itself"},
                                  {"other", "name of the other centre, on another body or the ground"},
                                  {"other_radius_m", "about that"},
                                  {"law", "of the normal force"},
                                  {"stiffness_N_per_m_n", "K of F = K d^n, d the penetration"},
                                  {"youngs_modulus_Pa", "in its place: K is Hertz's, of two spheres"},
                                  {"poisson_ratio", "of the first"},
                                  {"other_youngs_modulus_Pa", "of the other; by default it is rigid"},
                                  {"other_poisson_ratio", "of the other"},
                                  {"exponent", "n; the linear law has 1"},
                                  {"damping_N_s_per_m", "of kelvin-voigt"},
                                  {"restitution",
                                   "speed after by speed before, of laws that have one; what comes out of compliant "
                                   "ones is (17.4), more than a small one"},
                                  {"approach_speed_m_per_s", "of a contact that is closed at the start"},
                                  {"friction", "its model; dahl and lugre in the plane only"},
                                  {"friction_coefficient", "of sliding"},
                                  {"static_coefficient", "of sticking; by default that of sliding"},
                                  {"transition_velocity_m_per_s", "where friction is fully there"},
                                  {"dead_velocity_m_per_s", "ambrosio: below it there is none"},
                                  {"decay_s_per_m", "bengisu-akay: of the way from sticking to sliding"},
                                  {"bristle_stiffness_per_m",
                                   "dahl, lugre: the normal force times this is a stiffness"},
                                  {"bristle_damping_s_per_m", "lugre: the normal force times this is a damping"},
                                  {"energy_lost", "whether the energy lost in it so far is integrated, as an output"}},
                                 R"(
[contact_pair.viscous]
point = "C"
radius_m = 0.1
other = "D"
other_radius_m = 0.15
law = "kelvin-voigt"
stiffness_N_per_m_n = 2e4
damping_N_s_per_m = 10
friction = "lugre"
friction_coefficient = 0.4

[contact_pair.ramp]
point = "C"
radius_m = 0.1
other = "D"
other_radius_m = 0.15
stiffness_N_per_m_n = 2e4
restitution = 0.5
friction = "ambrosio"
friction_coefficient = 0.4
energy_lost = true

[contact_pair.rubber]
point = "C"
radius_m = 0.1
other = "D"
other_radius_m = 0.15
youngs_modulus_Pa = 1e7
poisson_ratio = 0.45
other_youngs_modulus_Pa = 1e9
restitution = 0.5

[contact_pair.decaying]
point = "C"
radius_m = 0.1
other = "D"
other_radius_m = 0.15
stiffness_N_per_m_n = 2e4
restitution = 0.5
friction = "bengisu-akay"
friction_coefficient = 0.4
)");

}  // namespace

}  // namespace costate
