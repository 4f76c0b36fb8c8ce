#include "variants.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <random>

#include "support/paths.h"

namespace costate::accuracy {

namespace {

struct Family {
  const char* name;
  const char* file;
  int share;            // of twenty variants
  double spread;        // of parameters: factors from exp(-spread) to exp(spread)
  bool physical;        // masses, inertias, stiffnesses and dampings one by one, too
  const char* besides;  // tables behind the scene's own
  bool vehicle = false;
};

constexpr std::array<Family, 6> kFamilies = {{
    {"five-bar", "five_bar/five_bar.toml", 5, 0.15, true, ""},
    {"slider crank with friction", "slider_crank/slider_crank.toml", 5, 0.3, true,
     "[friction.guide]\ncoordinate = \"rod.x\"\nnormal_force_N = 1\nstatic_coefficient = 0.2\n"
     "dynamic_coefficient = 0.15\ntransition_velocity_m_per_s = 0.02\n"},
    {"Andrews", "andrews/andrews.toml", 5, 0.2, true, ""},
    {"walker", "walker/arc_feet.toml", 3, 0.05, false, ""},
    {"Iltis ride", "iltis/speed_bumps.toml", 1, 0.15, false, "", true},
    {"Iltis lane change", "iltis/double_lane_change.toml", 1, 0.15, false, "", true},
}};
constexpr int kShares = 20;
constexpr std::size_t kMostParameters = 6;

class Dice {
 public:
  explicit Dice(std::uint64_t number) : engine_(number * 2654435761u + 17) {}
  double uniform(double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine_); }
  double factor(double spread) { return std::exp(uniform(-spread, spread)); }
  std::size_t below(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(engine_); }
  std::mt19937_64& engine() { return engine_; }

 private:
  std::mt19937_64 engine_;
};

const Family& family_of(std::uint64_t number) {
  int left = static_cast<int>(number % kShares);
  for (const Family& f : kFamilies)
    if ((left -= f.share) < 0) return f;
  return kFamilies.back();
}

std::string set(const std::string& path, double value) { return fmt::format("{}={}", path, value); }

bool is_physical(const std::string& path) {
  for (const char* key : {".mass_kg", ".inertia_kg_m2", ".stiffness_N_per_m", ".damping_N_s_per_m"})
    if (path.ends_with(key)) return true;
  return false;
}

/// Starts, speeds and ends, by family.
std::vector<std::string> other_start(const std::string& family, const Scene& scene, Dice& dice) {
  const double end = scene.run.t_end_s;
  const auto ends = [&](double from, double to) { return set("run.t_end_s", end * dice.uniform(from, to)); };
  if (family == "five-bar")
    return {set("point.P2.x_m", 0.5 + dice.uniform(-0.25, 0.25)), set("point.P2.y_m", -2 + dice.uniform(-0.25, 0.25)),
            set("point.P2.vx_m_per_s", dice.uniform(-1, 1)), ends(0.5, 1.2)};
  if (family == "slider crank with friction")
    return {set("body.crank.angle_rad", dice.uniform(0.8, 2.2)),
            set("body.crank.angular_velocity_rad_per_s", dice.uniform(-2, 2)),
            set("friction.guide.normal_force_N", dice.factor(1)),
            set("friction.guide.transition_velocity_m_per_s", 0.02 * dice.factor(0.7)), ends(0.4, 1.2)};
  if (family == "Andrews") return {set("body.K1.angular_velocity_rad_per_s", dice.uniform(-20, 20)), ends(0.5, 1.2)};
  if (family == "walker") return {ends(0.15, 0.6)};
  if (family == "Iltis ride")
    return {set("rigid_body.chassis.vx_m_per_s", dice.uniform(4, 8)),
            set("road.ground.law.height_m", 0.025 * dice.factor(0.4)), ends(0.4, 0.7)};
  const double faster = dice.uniform(0.7, 1.05);
  std::vector<std::string> r = {set("rigid_body.chassis.vx_m_per_s", 22.222222222222222 * faster), ends(0.4, 0.9)};
  for (const auto& [wheel, spin] :
       {std::pair("FL", 60.9956), std::pair("FR", 60.9956), std::pair("RL", 61.081608), std::pair("RR", 61.081608)})
    r.push_back(set(fmt::format("rotor.wheel_{}.spin_rad_per_s", wheel), spin * faster));
  return r;
}

}  // namespace

bool is_vehicle(std::uint64_t number) { return family_of(number).vehicle; }

Variant draw_variant(std::uint64_t number) {
  Dice dice(number);
  const Family& f = family_of(number);
  const std::string file = std::string(COSTATE_SOURCE_DIR "/models/") + f.file;
  const auto cut = file.rfind('/') + 1;
  const std::string text = fmt::format("include = [\"{}\"]\n{}", file.substr(cut), f.besides);
  const std::string name = file.substr(0, cut) + "variant.toml";
  const Scene given = Scene::parse(text, name);
  std::vector<std::string> overrides = other_start(f.name, given, dice);
  if (f.physical)
    for (const Number& n : given.mechanism()->numbers())
      if (n.value != 0 && is_physical(n.path)) overrides.push_back(set(n.path, n.value * dice.factor(f.spread)));
  const Scene drawn = Scene::parse(text, name, overrides);
  const auto& mechanism = *drawn.mechanism();
  std::vector<std::string> names;
  for (const Parameter& p : mechanism.parameters()) names.push_back(p.name);
  const ParameterSelection all = mechanism.select(names);
  std::vector<double> rho;
  for (const Parameter& p : all.parameters)
    rho.push_back(std::clamp(p.value * dice.factor(f.spread), p.lower, p.upper));
  Variant v{f.name, drawn.with_parameters(all, rho), {}, f.vehicle};
  std::shuffle(names.begin(), names.end(), dice.engine());
  if (dice.below(3) != 0) {
    const std::size_t count = 1 + dice.below(std::min(kMostParameters, names.size()));
    v.parameters.assign(names.begin(), names.begin() + static_cast<long>(count));
  }
  return v;
}

}  // namespace costate::accuracy
