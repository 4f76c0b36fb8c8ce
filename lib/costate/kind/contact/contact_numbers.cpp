#include "costate/kind/contact/contact_numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/kind/lookup.h"

namespace costate {

namespace {

constexpr auto kPositive = NumberRule::positive, kNotNegative = NumberRule::non_negative;

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

/// Whether it knows a coefficient of sticking.
bool has_two(FrictionModel f) {
  return f == FrictionModel::bengisu_akay || f == FrictionModel::stribeck || f == FrictionModel::brown_mcphee ||
         f == FrictionModel::lugre;
}

}  // namespace

NormalLaw normal_law(const std::string& subject, const std::string& name) {
  return law_of<NormalLaw>(subject, name, kNormalLawNames);
}
FrictionModel friction_model(const std::string& subject, const std::string& name) {
  return law_of<FrictionModel>(subject, name, kFrictionModelNames);
}

void read_normal_law(SceneTable& table, const std::string& other, ContactLawOptions& o) {
  o.law = table.one_of("law", list(kNormalLawNames), o.law);
  if (table.has("youngs_modulus_Pa")) {
    o.youngs_modulus_Pa = table.value("youngs_modulus_Pa", kPositive);
    o.poisson_ratio = table.value("poisson_ratio", kNotNegative, o.poisson_ratio);
    o.other_youngs_modulus_Pa = table.find_value(other + "youngs_modulus_Pa", kPositive).value_or(0);
    if (o.other_youngs_modulus_Pa > 0)
      o.other_poisson_ratio = table.value(other + "poisson_ratio", kNotNegative, o.other_poisson_ratio);
  } else {
    o.stiffness_N_per_m_n = table.value("stiffness_N_per_m_n", kPositive);
    if (o.law != "linear") o.exponent = table.value("exponent", kPositive, o.exponent);
  }
  const NormalLaw law = normal_law("", o.law);
  if (law == NormalLaw::kelvin_voigt)
    o.damping_N_s_per_m = table.value("damping_N_s_per_m", kNotNegative);
  else if (latches(law))
    o.restitution = table.value("restitution", kPositive);
}

void read_friction(SceneTable& table, ContactLawOptions& o) {
  using F = FrictionModel;
  o.friction = table.one_of("friction", list(kFrictionModelNames), o.friction);
  const F friction = friction_model("", o.friction);
  if (friction != F::none) {
    o.friction_coefficient = table.value("friction_coefficient", kNotNegative);
    if (friction != F::dahl)
      o.transition_velocity_m_per_s =
          table.value("transition_velocity_m_per_s", kPositive, o.transition_velocity_m_per_s);
  }
  if (has_two(friction)) o.static_coefficient = table.find_value("static_coefficient", kNotNegative).value_or(-1);
  if (friction == F::ambrosio) o.dead_velocity_m_per_s = table.value("dead_velocity_m_per_s", kNotNegative, 0);
  if (friction == F::bengisu_akay) o.decay_s_per_m = table.value("decay_s_per_m", kNotNegative, o.decay_s_per_m);
  if (has_bristles(friction))
    o.bristle_stiffness_per_m = table.value("bristle_stiffness_per_m", kPositive, o.bristle_stiffness_per_m);
  if (friction == F::lugre) o.bristle_damping_s_per_m = table.value("bristle_damping_s_per_m", kNotNegative, 0);
}

void check_sticking(const std::string& path, double sliding, double sticking) {
  if (sticking < sliding)
    throw ModelError(path + ".static_coefficient",
                     fmt::format("The static coefficient of friction must not be less than that of sliding, found {} "
                                 "and {}.",
                                 sticking, sliding));
}

void ContactNumbers::add(const std::string& key, double value, NumberRule rule, bool used) {
  numbers_.push_back(builder_.add_number(path_ + "." + key, value, used ? rule : NumberRule::any));
  if (!used) builder_.fix_number(numbers_.back(), "the law of this contact has no such number.");
}

void ContactNumbers::add_normal_law(const ContactLawOptions& o) {
  const NormalLaw law = normal_law(path_ + ".law", o.law);
  const bool linear = law == NormalLaw::linear, voigt = law == NormalLaw::kelvin_voigt;
  const bool restitution = latches(law) && !voigt, material = o.youngs_modulus_Pa > 0;
  add("stiffness_N_per_m_n", material ? 1 : o.stiffness_N_per_m_n, kPositive, !material);
  // Hertz's stiffness is one of the exponent 3/2.
  add("exponent", linear ? 1 : material ? 1.5 : o.exponent, kPositive, !linear && !material);
  add("restitution", o.restitution, kPositive, restitution);
  add("damping_N_s_per_m", o.damping_N_s_per_m, kNotNegative, voigt);
  if (restitution && o.restitution > 1)
    throw ModelError(path_ + ".restitution",
                     fmt::format("A coefficient of restitution is at most 1, found {}.", o.restitution));
  if (!linear && o.exponent < 1)
    throw ModelError(path_ + ".exponent", fmt::format("An exponent is at least 1, found {}.", o.exponent));
}

void ContactNumbers::add_friction(const ContactLawOptions& o) {
  using F = FrictionModel;
  const F friction = friction_model(path_ + ".friction", o.friction);
  const bool some = friction != F::none, two = has_two(friction);
  const double sticking = o.static_coefficient < 0 ? o.friction_coefficient : o.static_coefficient;
  if (two) check_sticking(path_, o.friction_coefficient, sticking);
  add("friction_coefficient", o.friction_coefficient, has_bristles(friction) ? kPositive : kNotNegative, some);
  if (two && o.static_coefficient < 0)
    repeat();
  else
    add("static_coefficient", sticking, kNotNegative, two);
  add("transition_velocity_m_per_s", o.transition_velocity_m_per_s, kPositive, some && friction != F::dahl);
  add("dead_velocity_m_per_s", o.dead_velocity_m_per_s, kNotNegative, friction == F::ambrosio);
  if (friction == F::ambrosio && o.dead_velocity_m_per_s >= o.transition_velocity_m_per_s)
    throw ModelError(path_ + ".dead_velocity_m_per_s",
                     fmt::format("The ramp must begin below the transition velocity of {} m/s, found {}.",
                                 o.transition_velocity_m_per_s, o.dead_velocity_m_per_s));
  add("decay_s_per_m", o.decay_s_per_m, kNotNegative, friction == F::bengisu_akay);
  add("bristle_stiffness_per_m", o.bristle_stiffness_per_m, kPositive, has_bristles(friction));
  add("bristle_damping_s_per_m", o.bristle_damping_s_per_m, kNotNegative, friction == F::lugre);
}

void ContactNumbers::add_start(const ContactLawOptions& o, bool latches) {
  add("approach_speed_m_per_s", o.approach_speed_m_per_s, kNotNegative, latches);
  numbers_.push_back(builder_.add_number(path_ + ".bristles_at_start_m", 0));
  builder_.fix_number(numbers_.back(), "bristles start undeflected, and nothing is lost at the start.");
}

void ContactNumbers::add_materials(const ContactLawOptions& o, const std::string& other) {
  const bool material = o.youngs_modulus_Pa > 0, both = material && o.other_youngs_modulus_Pa > 0;
  add("youngs_modulus_Pa", material ? o.youngs_modulus_Pa : 1, kPositive, material);
  add("poisson_ratio", o.poisson_ratio, kNotNegative, material);
  add(other + "youngs_modulus_Pa", both ? o.other_youngs_modulus_Pa : 1, kPositive, both);
  add(other + "poisson_ratio", o.other_poisson_ratio, kNotNegative, both);
}

void tell_of_wall(const std::string& path, double x, double height, double angle) {
  constexpr double kUpright = 1e-9;
  if (height != 0 && x == 0 && std::abs(std::cos(angle)) <= kUpright)
    notice(fmt::format(
        "{}: The ground is a wall, of which ground_height_m = {:g} moves nothing: it stands at ground_x_m, which is 0.",
        path, height));
}

void check_materials(const std::string& path, const ContactLawOptions& o, const std::string& other, bool round) {
  if (o.youngs_modulus_Pa > 0) {
    if (!round)
      throw ModelError(path + ".youngs_modulus_Pa",
                       "Hertz's stiffness is that of what has a radius: give 'radius_m', or 'stiffness_N_per_m_n'.");
    if (o.law == "linear") throw ModelError(path + ".law", "Hertz's stiffness is not of a linear law.");
  }
  for (const auto& [key, ratio] : {std::pair(std::string(".poisson_ratio"), o.poisson_ratio),
                                   std::pair("." + other + "poisson_ratio", o.other_poisson_ratio)})
    if (!(ratio >= 0 && ratio <= 0.5))
      throw ModelError(path + key, fmt::format("Poisson's ratio is between 0 and 0.5, found {}.", ratio));
}

}  // namespace costate
