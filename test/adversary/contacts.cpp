#include "contacts.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/objective/output.h"
#include "costate/problem/scene_problem.h"

namespace costate::adversary {

namespace {

constexpr double kRtol = 1e-9;
// Energies and gaps are off by what the integrator is, in a second of many impacts some 1e3 rtol.
constexpr double kAllowed = 1e-6;

std::string one_line(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text.substr(0, 300);
}

}  // namespace

std::string random_contact_scene(std::uint64_t seed) {
  std::mt19937_64 engine(seed * 131 + 7);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine); };
  const auto one_of = [&](auto... x) {
    const double list[] = {static_cast<double>(x)...};
    return list[engine() % (sizeof(list) / sizeof(list[0]))];
  };
  const int contacts = 1 + static_cast<int>(engine() % 5),
            bodies = std::min(contacts, 1 + static_cast<int>(engine() % 3));
  const double slope = one_of(0, 0, 0.1, -0.3), mu = one_of(0, 0.2, 0.5, 1.0), e = one_of(0, 0, 0.3, 0.8);
  const bool poisson = engine() % 2 == 0;
  std::string text = "[gravity]\ny_m_per_s2 = -9.81\n", given;
  std::vector<int> on(static_cast<std::size_t>(bodies), 0);
  for (int b = 0; b < bodies; ++b) {
    const double mass = uniform(0.5, 3);
    text += fmt::format(
        "[body.B{}]\nx_m = {:.6g}\ny_m = {:.6g}\nangle_rad = {:.6g}\nvx_m_per_s = {:.6g}\nvy_m_per_s = {:.6g}\n"
        "angular_velocity_rad_per_s = {:.6g}\nmass_kg = {:.6g}\ninertia_kg_m2 = {:.6g}\n",
        b, 1.5 * b, 1.2 + uniform(0, 0.4), uniform(-0.5, 0.5), uniform(-2, 2), uniform(-2, 0), uniform(-4, 4), mass,
        mass * uniform(0.02, 0.15));
    given += fmt::format("{}\"B{}.x\", \"B{}.y\", \"B{}.angle\"", b > 0 ? ", " : "", b, b, b);
    text += fmt::format("[point.C{0}]\non = \"B{0}\"\nx_m = 0\ny_m = 0\n", b);
    if (b > 0 && engine() % 2 == 0)
      text += fmt::format(
          "[spring.S{0}]\nfrom = \"C{1}\"\nto = \"C{0}\"\nstiffness_N_per_m = {2:.6g}\n"
          "natural_length_m = {3:.6g}\n",
          b, b - 1, uniform(20, 200), uniform(1, 1.6));
  }
  for (int c = 0; c < contacts; ++c) {
    const int b = c % bodies, k = on[static_cast<std::size_t>(b)]++;
    const bool round = engine() % 4 == 0;
    text += fmt::format(
        "[point.P{0}]\non = \"B{1}\"\nx_m = {2:.6g}\ny_m = {3:.6g}\n[contact.P{0}]\nkind = \"rigid\"\npoint = "
        "\"P{0}\"\n"
        "ground_angle_rad = {4}\n",
        c, b, (k % 2 == 0 ? -1 : 1) * uniform(0.1, 0.4), k < 2 ? uniform(-0.3, -0.1) : uniform(0.1, 0.3), slope);
    if (round) text += fmt::format("radius_m = {:.6g}\n", uniform(0.02, 0.1));
    if (e > 0)
      text += fmt::format("restitution = {}\nclosing_speed_m_per_s = 0.05\nrestitution_law = \"{}\"\n", e,
                          poisson ? "poisson" : "newton");
    if (mu > 0) text += fmt::format("friction = \"coulomb\"\nfriction_coefficient = {}\n", mu);
  }
  return text + fmt::format("[start]\ngiven = [{}]\n[run]\nt_end_s = 1.5\nrtol = {}\nmethod = \"cvodes-adjoint\"\n",
                            given, kRtol);
}

std::string random_struck_scene(std::uint64_t seed) {
  std::string text = random_contact_scene(seed);
  const std::string keys = "method = \"cvodes-adjoint\"\n";
  // Of half a second behind the first impacts differences still tell something.
  const std::string end = "t_end_s = 1.5";
  text.replace(text.find(end), end.size(), "t_end_s = 0.9");
  text.replace(text.find(keys), keys.size(),
               "parameters = [\"mass\", \"inertia\", \"slope\", \"x\", \"gravity\", \"speed\"" +
                   std::string(text.find("friction_coefficient") != std::string::npos ? ", \"friction\"" : "") +
                   (text.find("restitution =") != std::string::npos ? ", \"restitution\"" : "") + "]\n" + keys);
  std::string slopes, frictions, restitutions;
  for (int c = 0; text.find(fmt::format("[contact.P{}]", c)) != std::string::npos; ++c) {
    const char* comma = c > 0 ? ", " : "";
    slopes += fmt::format("{}\"contact.P{}.ground_angle_rad\"", comma, c);
    frictions += fmt::format("{}\"contact.P{}.friction_coefficient\"", comma, c);
    restitutions += fmt::format("{}\"contact.P{}.restitution\"", comma, c);
  }
  text += fmt::format(R"([parameter.mass]
number = "body.B0.mass_kg"
[parameter.inertia]
number = "body.B0.inertia_kg_m2"
[parameter.slope]
numbers = [{}]
[parameter.x]
number = "point.P0.x_m"
[parameter.gravity]
number = "gravity.y_m_per_s2"
[parameter.speed]
number = "body.B0.angular_velocity_rad_per_s"
)",
                      slopes);
  if (text.find("\"friction\"") != std::string::npos)
    text += fmt::format("[parameter.friction]\nnumbers = [{}]\n", frictions);
  if (text.find("\"restitution\"") != std::string::npos)
    text += fmt::format("[parameter.restitution]\nnumbers = [{}]\n", restitutions);
  return text +
         "[[cost.terminal]]\nkind = \"value\"\noutput = \"B0.angle\"\n[[cost.terminal]]\nkind = \"square\"\noutput = "
         "\"B0.x\"\n[[cost.running]]\nkind = \"square\"\noutput = \"B0.angle_dot\"\nweight = 0.1\n";
}

Finding run_contacts(const std::string& text, const std::string& formulation) {
  Finding f;
  f.run = formulation + " x simulate";
  std::string reached;
  try {
    Problem p = make_problem(Scene::parse(text, "contacts.toml"));
    p.formulation = formulation;
    take_notices();
    const auto energy = make_output(*p.mechanism, "energy.total");
    std::vector<std::unique_ptr<Output>> gaps, slips, frictions;
    for (const auto& force : p.mechanism->forces())
      if (const std::string path = force->path(); path.rfind("contact.", 0) == 0) {
        gaps.push_back(make_output(*p.mechanism, path.substr(8) + ".gap"));
        slips.push_back(make_output(*p.mechanism, path.substr(8) + ".slip_velocity"));
        frictions.push_back(make_output(*p.mechanism, path.substr(8) + ".friction_force"));
      }
    double last = NAN, size = 0, created = 0, depth = 0, pushed = 0;
    std::vector<double> times;
    for (int i = 0; i <= 600; ++i) times.push_back(p.solver.t_end * i / 600);
    const Simulation s = simulate(p, p.parameters.values(), times, [&](const MechanismState& x, System& system) {
      const double now = energy->value(x, system.assembly());
      size = std::max(size, std::abs(now));
      if (!std::isnan(last)) created = std::max(created, now - last);
      last = now;
      const auto value = [&](const Output& output) { return output.value(x, system.assembly()); };
      for (std::size_t i = 0; i < gaps.size(); ++i) {
        depth = std::max(depth, -value(*gaps[i]));
        // Friction takes power: what it gives is of the size of drift.
        pushed = std::max(pushed, value(*frictions[i]) * value(*slips[i]));
      }
      reached = fmt::format("{:.6g}", x.t);
    });
    for (const RunEvent& event : s.events) created = std::max(created, -event.energy_lost);
    f.error = std::max({created / std::max(size, 1.0), depth, pushed / std::max(size, 1.0)});
    f.outcome = f.error <= kAllowed && !std::isnan(last) ? Outcome::agreed : Outcome::wrong;
    f.message = fmt::format("{} events, created {:.1e} J of {:.1e}, depth {:.1e} m, friction gives {:.1e} W",
                            s.events.size(), created, size, depth, pushed);
    take_notices();
  } catch (const Error& error) {
    const std::string what = error.what();
    f.message = one_line(what);
    // What goes no further names the contact; anything else is a failure in silence.
    const bool named = what.find("contact.") != std::string::npos;
    f.outcome = !named                                         ? Outcome::wrong
                : dynamic_cast<const CapabilityError*>(&error) ? Outcome::refused
                                                               : Outcome::failed;
  }
  return f;
}

}  // namespace costate::adversary
