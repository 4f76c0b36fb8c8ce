#include "touches.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "scene_writer.h"

namespace costate::adversary {

namespace {

const char* const kLaws[] = {"linear",   "hertz",        "hunt-crossley", "herbert-mcwhannell",
                             "lee-wang", "gonthier",     "flores",        "lankarani-nikravesh",
                             "hu-guo",   "kelvin-voigt", "zhiying-qishao"};
const char* const kFrictions[] = {"none",     "coulomb",      "threlfall", "ambrosio", "bengisu-akay",
                                  "stribeck", "brown-mcphee", "dahl",      "lugre",    "lugre"};

class TouchScene final : SceneWriter {
 public:
  explicit TouchScene(std::uint64_t seed) : SceneWriter(seed * 0x9E3779B97F4A7C15ull + 41) {}

  KindScene write() {
    slope_ = chance(0.5) ? 0 : uniform(-0.3, 0.3);
    text_ = "[gravity]\ny_m_per_s2 = -9.81\n";
    const int bodies = chance(0.3) ? 2 : 1;
    for (int b = 0; b < bodies; ++b) add_body(b);
    if (bodies == 2 && chance(0.6))
      text_ += fmt::format(
          "[spring.S]\nfrom = \"H0\"\nto = \"H1\"\nstiffness_N_per_m = {:.5g}\nnatural_length_m = {:.4f}\n"
          "damping_N_s_per_m = {:.4g}\n",
          uniform(20, 300), uniform(0.6, 1.4), uniform(0, 5));
    const double t_end = uniform(0.1, 1.2);
    add_costs(bodies);
    choose_parameters();
    return finish("touches", t_end, "1e-8");
  }

 private:
  template <std::size_t N>
  const char* one_of(const char* const (&list)[N]) {
    return list[engine_() % N];
  }

  /// One body with one contact or two below it, so high that the lower one is as far from the ground as it is to start.
  void add_body(int b) {
    const double mass = std::pow(10, uniform(-1, 1)), angle = chance(0.4) ? 0 : uniform(-0.4, 0.4), x = 1.5 * b;
    const int contacts = chance(0.4) ? 2 : 1;
    struct Foot {
      double x, y, radius;
    } foot[2];
    const double radius = chance(0.4) ? uniform(0.02, 0.3) : 0;
    double lowest = HUGE_VAL;  // of gaps, with the body's point at the origin of the ground
    for (int c = 0; c < contacts; ++c) {
      foot[c] = {contacts == 1 ? uniform(-0.2, 0.2) : (c == 0 ? -0.3 : 0.3), uniform(-0.25, -0.05), radius};
      const double px = x + foot[c].x * std::cos(angle) - foot[c].y * std::sin(angle),
                   py = foot[c].x * std::sin(angle) + foot[c].y * std::cos(angle);
      lowest = std::min(lowest, py * std::cos(slope_) - px * std::sin(slope_) - radius);
    }
    const char* law = one_of(kLaws);
    const char* friction = one_of(kFrictions);
    const double stiffness = std::pow(10, uniform(3, 5.5)) * mass;
    const double begin = uniform(0, 1);
    // Falling; in touch with nothing to press, or with the penetration of rest.
    const bool falls = begin < 0.6, just = !falls && begin < 0.75;
    const double gap = falls ? std::pow(10, uniform(-3, -0.5)) : just ? 0 : -std::pow(9.81 * mass / stiffness, 1 / 1.5);
    const double y = (gap - lowest) / std::cos(slope_);
    const double speed = falls && chance(0.5) ? uniform(-2, 0) : 0;
    text_ += fmt::format(
        "[body.B{}]\nx_m = {:.6g}\ny_m = {:.17g}\nangle_rad = {:.17g}\nvx_m_per_s = {:.4g}\nvy_m_per_s = {:.4g}\n"
        "angular_velocity_rad_per_s = {:.4g}\nmass_kg = {:.5g}\ninertia_kg_m2 = {:.5g}\n",
        b, x, y, angle, chance(0.3) ? 0 : uniform(-2, 2), speed, chance(0.4) ? 0 : uniform(-4, 4), mass,
        mass * uniform(0.01, 0.15));
    text_ += fmt::format("[point.H{0}]\non = \"B{0}\"\nx_m = 0\ny_m = 0\n", b);
    parameters_.push_back(fmt::format("body.B{}.mass_kg", b));
    parameters_.push_back(fmt::format("body.B{}.inertia_kg_m2", b));
    if (falls) parameters_.push_back(fmt::format("body.B{}.y_m", b));
    for (int c = 0; c < contacts; ++c) {
      const std::string name = fmt::format("P{}{}", b, c), path = "contact." + name;
      text_ += fmt::format("[point.{}]\non = \"B{}\"\nx_m = {:.17g}\ny_m = {:.17g}\n", name, b, foot[c].x, foot[c].y);
      text_ += fmt::format("[{}]\npoint = \"{}\"\nlaw = \"{}\"\n", path, name, law);
      if (std::string(law) == "linear")
        text_ += fmt::format("stiffness_N_per_m_n = {:.5g}\n", 0.03 * stiffness);
      else
        text_ += fmt::format("stiffness_N_per_m_n = {:.5g}\nexponent = 1.5\n", stiffness);
      parameters_.push_back(path + ".stiffness_N_per_m_n");
      if (std::string(law) == "kelvin-voigt") {
        text_ += fmt::format("damping_N_s_per_m = {:.4g}\n", mass * std::pow(10, uniform(0, 2)));
        parameters_.push_back(path + ".damping_N_s_per_m");
      } else if (std::string(law) != "linear" && std::string(law) != "hertz") {
        text_ += fmt::format("restitution = {:.3f}\n", uniform(0.05, 0.95));
        parameters_.push_back(path + ".restitution");
      }
      if (radius > 0) text_ += fmt::format("radius_m = {:.17g}\n", radius);
      if (slope_ != 0) text_ += fmt::format("ground_angle_rad = {:.17g}\n", slope_);
      if (!falls) text_ += fmt::format("approach_speed_m_per_s = {:.3f}\n", uniform(0.05, 1));
      add_friction(friction, path);
    }
  }

  void add_friction(const std::string& friction, const std::string& path) {
    if (friction == "none") return;
    text_ += fmt::format("friction = \"{}\"\nfriction_coefficient = {:.3f}\n", friction, uniform(0.05, 1));
    parameters_.push_back(path + ".friction_coefficient");
    if (friction == "dahl" || friction == "lugre") {
      text_ += fmt::format("bristle_stiffness_per_m = {:.4g}\n", std::pow(10, uniform(2, 4)));
      parameters_.push_back(path + ".bristle_stiffness_per_m");
      if (friction == "lugre") text_ += fmt::format("bristle_damping_s_per_m = {:.3g}\n", uniform(0, 2));
    } else {
      text_ += fmt::format("transition_velocity_m_per_s = {:.3g}\n", std::pow(10, uniform(-2.5, -0.5)));
    }
    if (friction != "dahl" && friction != "lugre" && friction != "coulomb" && chance(0.5))
      text_ += fmt::format("static_coefficient = {:.3f}\n", uniform(1, 1.3));
  }

  void add_costs(int bodies) {
    const char* const outputs[] = {"x", "y", "angle"};
    for (int k = chance(0.5) ? 1 : 2; k > 0; --k) {
      const bool terminal = chance(0.4);
      text_ += fmt::format("[[cost.{}]]\nkind = \"{}\"\noutput = \"B{}.{}\"\ntarget = {:.3f}\n",
                           terminal ? "terminal" : "running", chance(0.7) ? "square" : "value",
                           engine_() % static_cast<unsigned>(bodies), one_of(outputs), uniform(-0.5, 0.5));
    }
  }

  double slope_ = 0;
};

}  // namespace

KindScene random_touch_scene(std::uint64_t seed) { return TouchScene(seed).write(); }

}  // namespace costate::adversary
