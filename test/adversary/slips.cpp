#include "slips.h"

#include <fmt/format.h>

#include <cmath>
#include <string>
#include <vector>

#include "scene_writer.h"

namespace costate::adversary {

namespace {

class SlipScene final : SceneWriter {
 public:
  explicit SlipScene(std::uint64_t seed) : SceneWriter(seed * 0x9E3779B97F4A7C15ull + 83) {}

  KindScene write() {
    const double dice = uniform(0, 1);
    text_ = fmt::format("[gravity]\n{}_m_per_s2 = -9.81\n", dice < 0.4 ? "y" : "z");
    if (dice < 0.4)
      add_body_of_plane();
    else if (dice < 0.7)
      add_point_in_space();
    else
      add_body_in_space();
    choose_parameters();
    return finish("slips", uniform(0.2, 0.6), "1e-9");
  }

 private:
  void add_body_of_plane() {
    const double angle = uniform(-0.5, 0.5), px = uniform(-0.2, 0.2), py = uniform(-0.25, -0.05),
                 lowest = px * std::sin(angle) + py * std::cos(angle);
    text_ += fmt::format(
        "[body.B]\nx_m = 0\ny_m = {:.17g}\nangle_rad = {:.17g}\nvx_m_per_s = {:.4g}\nangular_velocity_rad_per_s = "
        "{:.4g}\nmass_kg = {:.4g}\ninertia_kg_m2 = {:.4g}\n[point.P]\non = \"B\"\nx_m = {:.17g}\ny_m = {:.17g}\n",
        uniform(0.02, 0.2) - lowest, angle, uniform(-2, 2), uniform(-3, 3), uniform(0.5, 3), uniform(0.01, 0.1), px,
        py);
    parameters_ = {"body.B.mass_kg", "body.B.inertia_kg_m2", "body.B.vx_m_per_s"};
    add_contact(false, "");
    add_spring("x_m = {:.4f}\ny_m = {:.4f}\n");
    text_ += "[start]\ngiven = [\"B.x\", \"B.y\", \"B.angle\"]\n";
    add_costs({"B.x", "B.angle", "B.y"});
  }

  void add_point_in_space() {
    const bool closed = chance(0.6);
    text_ += fmt::format(
        "[point.P]\nx_m = 0\ny_m = 0\nz_m = {:.4f}\nvx_m_per_s = {:.4g}\nvy_m_per_s = {:.4g}\n[mass.P]\npoint = "
        "\"P\"\nmass_kg = {:.4g}\n",
        closed ? 0 : uniform(0.02, 0.2), uniform(-2, 2), uniform(-2, 2), uniform(0.5, 3));
    parameters_ = {"mass.P.mass_kg", "point.P.vx_m_per_s"};
    add_contact(closed, "closed = true\nsliding = \"forward\"\n");
    add_spring("x_m = {:.4f}\ny_m = {:.4f}\nz_m = {:.4f}\n");
    text_ += closed ? "[start]\ngiven = [\"P.x\", \"P.y\"]\n" : "[start]\ngiven = [\"P.x\", \"P.y\", \"P.z\"]\n";
    add_costs({"P.x", "P.y"});
  }

  void add_body_in_space() {
    double e[4], size = 0;
    for (double& x : e) x = uniform(-0.5, 0.5);
    e[0] = uniform(0.5, 1);
    for (const double x : e) size += x * x;
    text_ += fmt::format("[rigid_body.B]\nx_m = 0\ny_m = 0\nz_m = {:.4f}\n", uniform(0.25, 0.4));
    for (int i = 0; i < 4; ++i) text_ += fmt::format("e{} = {:.17g}\n", i, e[i] / std::sqrt(size));
    text_ += fmt::format(
        "mass_kg = {:.4g}\ninertia_xx_kg_m2 = 0.012\ninertia_yy_kg_m2 = 0.015\ninertia_zz_kg_m2 = 0.02\nvx_m_per_s = "
        "{:.4g}\nvy_m_per_s = {:.4g}\nomega_x_rad_per_s = {:.4g}\nomega_y_rad_per_s = {:.4g}\n[point.P]\non = "
        "\"B\"\nx_m = {:.4f}\ny_m = {:.4f}\nz_m = -0.1\n",
        uniform(0.5, 2), uniform(-1, 1), uniform(-1, 1), uniform(-3, 3), uniform(-3, 3), uniform(-0.1, 0.1),
        uniform(-0.1, 0.1));
    parameters_ = {"rigid_body.B.mass_kg", "rigid_body.B.inertia_yy_kg_m2", "rigid_body.B.vx_m_per_s"};
    add_contact(false, "");
    add_spring("x_m = {:.4f}\ny_m = {:.4f}\nz_m = {:.4f}\n");
    text_ += "[start]\ngiven = [\"B\"]\n";
    add_costs({"B.x", "B.y", "B.z"});
  }

  void add_contact(bool closed, const char* closed_keys) {
    text_ += fmt::format(
        "[contact.C]\nkind = \"rigid\"\npoint = \"P\"\nground_angle_rad = {:.4f}\nfriction = "
        "\"coulomb\"\nfriction_coefficient = {:.4f}\n{}",
        closed || chance(0.7) ? uniform(-0.3, 0.3) : 0, uniform(0.1, 0.7), closed ? closed_keys : "");
    parameters_.emplace_back("contact.C.friction_coefficient");
    parameters_.emplace_back("contact.C.ground_angle_rad");
    if (closed || chance(0.5)) return;
    text_ += fmt::format("restitution = {:.3f}\n", uniform(0.1, 0.8));
    parameters_.emplace_back("contact.C.restitution");
  }

  void add_spring(const char* place) {
    text_ += "[point.A]\nground = true\n" +
             fmt::format(fmt::runtime(place), uniform(-0.5, 0.5), uniform(0.2, 0.6), uniform(0.3, 0.8));
    text_ += fmt::format(
        "[spring.S]\nfrom = \"P\"\nto = \"A\"\nstiffness_N_per_m = {:.4g}\nnatural_length_m = "
        "{:.4f}\ndamping_N_s_per_m = {:.4g}\n",
        uniform(1, 20), uniform(0.2, 0.6), uniform(0, 0.3));
    parameters_.emplace_back("spring.S.stiffness_N_per_m");
  }

  void add_costs(const std::vector<std::string>& outputs) {
    text_ += fmt::format("[[cost.terminal]]\nkind = \"value\"\noutput = \"{}\"\n", outputs[engine_() % outputs.size()]);
    if (chance(0.6))
      text_ += fmt::format("[[cost.running]]\nkind = \"square\"\noutput = \"{}\"\ntarget = {:.3f}\n",
                           outputs[engine_() % outputs.size()], uniform(-0.5, 0.5));
  }
};

/// A point that rests on a slope: two forces along it, or another point by a spring, have it slide and stop.
class RestScene final : SceneWriter {
 public:
  explicit RestScene(std::uint64_t seed) : SceneWriter(seed * 0x9E3779B97F4A7C15ull + 97) {}

  KindScene write() {
    const double mass = uniform(0.5, 2), friction = uniform(0.25, 0.7), held = mass * friction * 9.81;
    text_ = fmt::format(
        "[gravity]\nz_m_per_s2 = -9.81\n[point.P]\nx_m = 0\ny_m = 0\nz_m = 0\n[mass.P]\npoint = \"P\"\nmass_kg = "
        "{:.17g}\n[contact.C]\nkind = \"rigid\"\npoint = \"P\"\nclosed = true\nalong_m = 0\nacross_m = 0\nfriction = "
        "\"coulomb\"\nfriction_coefficient = {:.17g}\nground_angle_rad = {:.4f}\n",
        mass, friction, uniform(-0.2, 0.2));
    parameters_ = {"mass.P.mass_kg", "contact.C.friction_coefficient", "contact.C.ground_angle_rad"};
    if (chance(0.6))
      push(held);
    else
      pull(held);
    text_ += fmt::format(
        "[[cost.terminal]]\nkind = \"value\"\noutput = \"P.{}\"\n[[cost.running]]\nkind = \"square\"\noutput = "
        "\"{}\"\n",
        chance(0.5) ? "x" : "y", chance(0.5) ? "P.x" : "C.friction_force");
    choose_parameters();
    return finish("rests", uniform(0.5, 1.5), "1e-9");
  }

 private:
  void push(double held) {
    text_ += fmt::format(
        "[force.F]\npoint = \"P\"\nk = {:.17g}\nw = {:.4f}\nformula_x_N = \"k*sin(w*t)\"\nformula_y_N = "
        "\"{:.4f}*k*sin({:.4f}*w*t)\"\n[start]\ngiven = []\n",
        held * uniform(0.9, 2.5), uniform(2, 8), uniform(0.02, 0.9), uniform(0.3, 2.2));
    parameters_.insert(parameters_.end(), {"force.F.k", "force.F.w"});
  }

  void pull(double held) {
    text_ += fmt::format(
        "[point.Q]\nx_m = 0.9\ny_m = 0\nz_m = 0.3\nvx_m_per_s = {:.4f}\nvy_m_per_s = {:.4f}\n[mass.Q]\npoint = "
        "\"Q\"\nmass_kg = {:.4f}\n[spring.S]\nfrom = \"P\"\nto = \"Q\"\nstiffness_N_per_m = {:.17g}\n"
        "damping_N_s_per_m = 0.2\nnatural_length_m = 0.95\n[point.N]\nground = true\nx_m = 0.8\ny_m = 0\nz_m = 2\n"
        "[spring.H]\nfrom = \"N\"\nto = \"Q\"\nstiffness_N_per_m = 40\nnatural_length_m = 1.4\n[start]\ngiven = "
        "[\"Q.x\", \"Q.y\", \"Q.z\"]\n",
        uniform(0.5, 2), uniform(-1.5, 1.5), uniform(0.8, 2), held * uniform(4, 12));
    parameters_.insert(parameters_.end(), {"mass.Q.mass_kg", "point.Q.vx_m_per_s", "spring.S.stiffness_N_per_m"});
  }
};

}  // namespace

KindScene random_rest_scene(std::uint64_t seed) { return RestScene(seed).write(); }

KindScene random_slip_scene(std::uint64_t seed) { return SlipScene(seed).write(); }

}  // namespace costate::adversary
