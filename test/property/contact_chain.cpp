// Derivatives of contacts with a plane in the plane, by the chain rule, against those of duals.
#include <fmt/format.h>

#include <catch2/catch.hpp>
#include <random>

#include "costate/base/error.h"
#include "costate/element/force/contact_laws.h"
#include "costate/element/gap_element.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "property/element_checks.h"

using namespace costate;
using test::Vector;

namespace {

/// A point of a bar, a free one, an arc with rolling resistance, where it may of a material, and several points with
/// shares; `law` is of each.
std::shared_ptr<const Mechanism> contacts(const std::string& law) {
  return make_problem(Scene::parse(fmt::format(R"([body.disc]
x_m = 0
y_m = 0.3
angle_rad = 0.2
mass_kg = 1
inertia_kg_m2 = 0.1
[point.A]
x_m = -1
y_m = 1
[point.B]
x_m = -1.5
y_m = 1.2
[bar.rod]
from = "A"
to = "B"
mass_kg = 1
[point.P]
on = "disc"
x_m = 0.3
y_m = -0.2
[point.Q]
on = "disc"
x_m = -0.25
y_m = -0.1
[point.M]
on = "rod"
x_m = 0.2
y_m = 0.1
[contact.point]
point = "M"
ground_angle_rad = 0.1
ground_height_m = -0.3
stiffness_N_per_m_n = 3e3
{0}
[contact.free]
point = "A"
ground_angle_rad = -0.2
stiffness_N_per_m_n = 3e3
energy_lost = true
{0}
[contact.arc]
point = "P"
radius_m = 0.15
rolling_resistance_m = 0.02
ground_angle_rad = 0.3
{1}
energy_lost = true
{0}
[contact.patch]
points = ["P", "Q"]
shares = [0.3, 0.7]
ground_height_m = 0.1
stiffness_N_per_m_n = 3e3
energy_lost = true
{0}
[start]
given = ["disc.x", "disc.y", "disc.angle", "A.x", "A.y", "B.x"]
)",
                                               law,
                                               law.find("\"hertz\"") == std::string::npos
                                                   ? "stiffness_N_per_m_n = 3e3"
                                                   : "youngs_modulus_Pa = 1e4\npoisson_ratio = 0.3"),
                                   "contacts.toml"))
      .mechanism;
}

/// The keys of a law and a friction, all that it knows.
std::string keys_of(const std::string& law, const std::string& friction) {
  std::string keys = fmt::format("law = \"{}\"\n", law);
  if (friction != "none") keys += fmt::format("friction = \"{}\"\nfriction_coefficient = 0.6\n", friction);
  for (const char* key : {"restitution = 0.4\n", "damping_N_s_per_m = 30.0\n", "transition_velocity_m_per_s = 0.5\n",
                          "dead_velocity_m_per_s = 0.01\n", "static_coefficient = 0.8\n", "decay_s_per_m = 3.0\n",
                          "bristle_stiffness_per_m = 20.0\n", "bristle_damping_s_per_m = 0.3\n"}) {
    try {
      contacts(keys + key);
      keys += key;
    } catch (const Error&) {  // not this key, or not yet all that are needed
    }
  }
  return keys;
}

}  // namespace

TEST_CASE("contact: derivatives by the chain rule are those of duals", "[contact]") {
  std::mt19937 random(3);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(random); };
  int touching = 0;
  for (const char* law : kNormalLawNames)
    for (const char* friction : kFrictionModelNames) {
      CAPTURE(law, friction);
      const auto m = contacts(keys_of(law, friction));
      for (const auto& force : m->forces()) {
        CAPTURE(force->path());
        const auto n = static_cast<Eigen::Index>(force->coordinates().size()),
                   nz = static_cast<Eigen::Index>(force->states());
        test::Local s;
        s.p.resize(static_cast<Eigen::Index>(force->numbers().size()));
        for (Eigen::Index k = 0; k < s.p.size(); ++k)
          s.p[k] = m->base_numbers()[static_cast<std::size_t>(force->numbers()[static_cast<std::size_t>(k)])];
        const auto& gaps = dynamic_cast<const GapElement&>(*force);
        for (int round = 0; round < 4; ++round) {
          s.q = Vector::NullaryExpr(n, [&](Eigen::Index) { return uniform(-0.7, 0.3); });
          s.v = Vector::NullaryExpr(n, [&](Eigen::Index) { return uniform(-1, 1); });
          s.z = Vector::NullaryExpr(nz, [&](Eigen::Index) { return uniform(0.05, 0.1); });
          touching += gaps.gap_motion(0, s.view()).gap < 0;
          const auto blocks = [&](bool hand) {
            return test::ForceBlocks(n, nz, [&](ForcePartials out) {
              hand ? force->calc_partials(s.view(), out) : force->Force::calc_partials(s.view(), out);
            });
          };
          const auto chain = blocks(true), dual = blocks(false);
          // Rounding, of terms that cancel.
          constexpr double tolerance = 1e-12;
          test::require_equal("Q_q", chain.Q_q, dual.Q_q, tolerance);
          test::require_equal("Q_v", chain.Q_v, dual.Q_v, tolerance);
          test::require_equal("Q_z", chain.Q_z, dual.Q_z, tolerance);
          test::require_equal("f_q", chain.f_q, dual.f_q, tolerance);
          test::require_equal("f_v", chain.f_v, dual.f_v, tolerance);
          test::require_equal("f_z", chain.f_z, dual.f_z, tolerance);
          const Vector w_Q = test::weights(n, 1), w_f = test::weights(nz, 2);
          std::vector<int> numbers;
          for (int k = 0; k < s.p.size(); ++k) numbers.push_back(k);
          Vector sums = Vector::Zero(s.p.size()), expected = sums;
          force->add_number_gradient(s.view(), w_Q.data(), w_f.data(), numbers.data(), static_cast<int>(s.p.size()),
                                     sums.data());
          for (const int k : numbers) {
            Vector by = Vector::Zero(n + nz);
            force->Force::calc_number_partial(s.view(), k, by.data(), by.data() + n);
            expected[k] = w_Q.dot(by.head(n)) + w_f.dot(by.tail(nz));
          }
          test::require_equal("weighted sums by the numbers", sums, expected, tolerance);
        }
      }
    }
  CHECK(touching > 500);
}
