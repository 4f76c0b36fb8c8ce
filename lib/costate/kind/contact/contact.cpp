#include "costate/kind/contact/contact.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <type_traits>

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

bool turns(const ContactOptions& o) { return o.rolling_resistance_m > 0 || o.spinning_resistance_m > 0; }

std::vector<int> add_numbers(MechanismBuilder& builder, const std::string& path, const ContactOptions& o, NormalLaw law,
                             FrictionModel friction, std::size_t points, bool space) {
  constexpr auto positive = NumberRule::positive, not_negative = NumberRule::non_negative;
  std::vector<int> r;
  // A number that the chosen law does not hold keeps its place and is no parameter.
  const auto add = [&](const char* key, double value, NumberRule rule, bool used) {
    r.push_back(builder.add_number(path + "." + key, value, used ? rule : NumberRule::any));
    if (!used) builder.fix_number(r.back(), "the law of this contact has no such number.");
  };
  const bool linear = law == NormalLaw::linear, voigt = law == NormalLaw::kelvin_voigt;
  const bool restitution = latches(law) && !voigt;
  const bool material = o.youngs_modulus_Pa > 0;
  add("stiffness_N_per_m_n", material ? 1 : o.stiffness_N_per_m_n, positive, !material);
  // Hertz's stiffness is one of the exponent 3/2.
  add("exponent", linear ? 1 : material ? 1.5 : o.exponent, positive, !linear && !material);
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
  add("approach_speed_m_per_s", o.approach_speed_m_per_s, not_negative, latches(law) || !o.ahead_of.empty());
  r.push_back(builder.add_number(path + ".bristles_at_start_m", 0));
  builder.fix_number(r.back(), "bristles start undeflected, and nothing is lost at the start.");
  add("rolling_resistance_m", o.rolling_resistance_m, not_negative, turns(o));
  add("spinning_resistance_m", o.spinning_resistance_m, not_negative, turns(o) && space);
  add("turning_transition_rad_per_s", o.turning_transition_rad_per_s, positive, turns(o));
  add("youngs_modulus_Pa", material ? o.youngs_modulus_Pa : 1, positive, material);
  add("poisson_ratio", o.poisson_ratio, not_negative, material);
  const bool both = material && o.ground_youngs_modulus_Pa > 0;
  add("ground_youngs_modulus_Pa", both ? o.ground_youngs_modulus_Pa : 1, positive, both);
  add("ground_poisson_ratio", o.ground_poisson_ratio, not_negative, both);
  if (points > 1)
    for (std::size_t i = 0; i < points; ++i)
      r.push_back(
          builder.add_number(fmt::format("{}.shares[{}]", path, i), o.shares.empty() ? 1 : o.shares[i], not_negative));
  return r;
}

void check_sizes(const std::string& path, const ContactOptions& o, const std::vector<std::string>& points, bool space) {
  if (points.empty()) throw ModelError(path + ".points", "A contact needs a point.");
  if (!o.shares.empty() && o.shares.size() != points.size())
    throw ModelError(path + ".shares",
                     fmt::format("One share a point is expected: {}, found {}.", points.size(), o.shares.size()));
  if (!o.shares.empty() && points.size() == 1)
    throw ModelError(path + ".shares", "A single point takes all: leave this out.");
  if (o.youngs_modulus_Pa > 0) {
    if (o.radius_m <= 0)
      throw ModelError(path + ".youngs_modulus_Pa",
                       "Hertz's stiffness is that of what has a radius: give 'radius_m', or 'stiffness_N_per_m_n'.");
    if (o.law == "linear") throw ModelError(path + ".law", "Hertz's stiffness is not of a linear law.");
  }
  for (const auto& [key, ratio] :
       {std::pair(".poisson_ratio", o.poisson_ratio), std::pair(".ground_poisson_ratio", o.ground_poisson_ratio)})
    if (!(ratio >= 0 && ratio <= 0.5))
      throw ModelError(path + key, fmt::format("Poisson's ratio is between 0 and 0.5, found {}.", ratio));
  if (o.radius_m <= 0 && turns(o))
    throw ModelError(path + (o.rolling_resistance_m > 0 ? ".rolling_resistance_m" : ".spinning_resistance_m"),
                     "Only what has a radius rolls: give 'radius_m', or leave this out.");
  if (o.spinning_resistance_m > 0 && !space)
    throw ModelError(path + ".spinning_resistance_m", "Nothing of the plane spins about its normal: leave this out.");
}

template <class Point>
void add_at(MechanismBuilder& builder, const std::string& name, const std::vector<Point>& points,
            const std::optional<Point>& ahead_of, const ContactOptions& o) {
  const std::string path = "contact." + name;
  for (std::size_t i = 0; i < points.size(); ++i) {
    const Point& point = points[i];
    const std::string key = points.size() == 1 ? ".point" : fmt::format(".points[{}]", i);
    if (point.kind() == Point::Kind::ground)
      throw ModelError(path + key, "'" + point.name() + "' is on the ground itself.");
    if (points.size() > 1 &&
        (point.kind() != Point::Kind::on_body || point.coordinates() != points.front().coordinates()))
      throw ModelError(path + key,
                       fmt::format("The points of one contact are on one rigid body; '{}' is not on that of "
                                   "'{}'. Write a contact for each.",
                                   point.name(), points.front().name()));
    if (o.radius_m > 0 && point.kind() != Point::Kind::on_body)
      throw ModelError(path + ".radius_m",
                       "'" + point.name() +
                           "' is on no rigid body, whose turning the radius needs: an arc or a sphere "
                           "belongs to one.");
    if (ahead_of && !ahead_of->coordinates().empty() && ahead_of->coordinates() == point.coordinates())
      throw ModelError(path + ".ahead_of", fmt::format("'{}' is on the body of '{}' itself: name a point of another "
                                                       "one, or of the ground.",
                                                       ahead_of->name(), point.name()));
  }
  typename Contact<Point>::Options options;
  options.law = law_of<NormalLaw>(path + ".law", o.law, kNormalLawNames);
  options.friction = law_of<FrictionModel>(path + ".friction", o.friction, kFrictionModelNames);
  options.round = o.radius_m > 0;
  options.rolling = turns(o);
  options.energy = o.energy_lost;
  using Material = typename Contact<Point>::Material;
  options.material = o.youngs_modulus_Pa <= 0          ? Material::none
                     : o.ground_youngs_modulus_Pa <= 0 ? Material::body
                                                       : Material::both;
  constexpr bool space = ContactSurface<Point>::dim == 3;
  const std::vector<int> numbers = add_numbers(builder, path, o, options.law, options.friction, points.size(), space);
  auto contact = std::make_unique<Contact<Point>>(name, points, ahead_of ? &*ahead_of : nullptr, options, numbers);
  if (contact->states() > kMaxLocal)
    throw ModelError(path + ".points", fmt::format("Contacts of {} points with this law and friction have {} states, "
                                                   "more than {}: write them as several contacts.",
                                                   points.size(), contact->states(), kMaxLocal));
  builder.add(std::move(contact));
}

}  // namespace

void add_contact(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& points,
                 const ContactOptions& o) {
  const std::string path = "contact." + name;
  const bool space = !points.empty() && builder.has_spatial_point(points.front());
  check_sizes(path, o, points, space);
  const auto key = [&](std::size_t i) {
    return path + (points.size() == 1 ? ".point" : fmt::format(".points[{}]", i));
  };
  const auto add = [&](auto find) {
    using Point = std::decay_t<decltype(find(std::string(), std::string()))>;
    std::vector<Point> of;
    for (std::size_t i = 0; i < points.size(); ++i) of.push_back(find(key(i), points[i]));
    std::optional<Point> ahead;
    if (!o.ahead_of.empty()) ahead = find(path + ".ahead_of", o.ahead_of);
    add_at<Point>(builder, name, of, ahead, o);
  };
  if (space)
    add([&](const std::string& subject, const std::string& point) {
      if (!builder.has_spatial_point(point))
        throw ModelError(subject, fmt::format("There is no point '{}' of space.", point));
      return builder.spatial_point(point);
    });
  else
    add([&](const std::string& subject, const std::string& point) { return find_point(builder, subject, point); });
}

namespace {

const RegisterSceneKind contact_registered({
    .name = "contact",
    .phase = ScenePhase::elements,
    .summary = "compliant contact of points, arcs or spheres with the ground, with friction",
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
          ContactOptions o;
          std::vector<std::string> points = table.texts("points", false);
          if (points.empty()) points = {table.text("point")};
          o.law = table.one_of("law", list(kNormalLawNames), o.law);
          if (table.has("youngs_modulus_Pa")) {
            o.youngs_modulus_Pa = table.value("youngs_modulus_Pa", positive);
            o.poisson_ratio = table.value("poisson_ratio", not_negative, o.poisson_ratio);
            o.ground_youngs_modulus_Pa = table.find_value("ground_youngs_modulus_Pa", positive).value_or(0);
            if (o.ground_youngs_modulus_Pa > 0)
              o.ground_poisson_ratio = table.value("ground_poisson_ratio", not_negative, o.ground_poisson_ratio);
          } else {
            o.stiffness_N_per_m_n = table.value("stiffness_N_per_m_n", positive);
            if (o.law != "linear") o.exponent = table.value("exponent", positive, o.exponent);
          }
          const auto law = law_of<NormalLaw>("", o.law, kNormalLawNames);
          if (law == NormalLaw::kelvin_voigt)
            o.damping_N_s_per_m = table.value("damping_N_s_per_m", not_negative);
          else if (latches(law))
            o.restitution = table.value("restitution", positive);
          o.ahead_of = table.text("ahead_of", "");
          if (latches(law) || !o.ahead_of.empty())
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
          if (o.radius_m > 0) {
            o.rolling_resistance_m = table.value("rolling_resistance_m", not_negative, 0);
            o.spinning_resistance_m = table.value("spinning_resistance_m", not_negative, 0);
            if (turns(o))
              o.turning_transition_rad_per_s =
                  table.value("turning_transition_rad_per_s", positive, o.turning_transition_rad_per_s);
          }
          if (points.size() > 1 && table.has("shares")) o.shares = table.values("shares", not_negative);
          o.energy_lost = table.flag("energy_lost", false);
          add_contact(builder, name, points, o);
        },
});

}  // namespace

}  // namespace costate
