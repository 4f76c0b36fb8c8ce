#include "locked.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "costate/integrator/integrators.h"
#include "motions.h"

namespace costate::adversary {

namespace {

// Linkages that hardly close, or hardly do not, are left out: near a position in line everything is sensitive.
constexpr double kClear = 0.02;
constexpr double kRtol = 1e-8;
// What rtol 1e-8 claims, of the lengths.
constexpr double kAllowed = 1e-4;

}  // namespace

double Crank::spare(double angle) const {
  const double b[2] = {crank * std::cos(angle), crank * std::sin(angle)};
  if (slider) return (coupler - std::abs(b[1] - ground)) / coupler;
  const double gap = std::hypot(ground - b[0], b[1]);
  return std::min(coupler + rocker - gap, gap - std::abs(coupler - rocker)) / coupler;
}

double Crank::least_spare() const {
  double least = HUGE_VAL;
  constexpr int kLooks = 4000;
  for (int i = 0; i <= kLooks; ++i) least = std::min(least, spare(from + (to - from) * i / kLooks));
  return least;
}

void Crank::end(double angle, double* xy) const {
  const double b[2] = {crank * std::cos(angle), crank * std::sin(angle)};
  if (slider) {
    xy[0] = b[0] + side * std::sqrt(coupler * coupler - (ground - b[1]) * (ground - b[1]));
    xy[1] = ground;
    return;
  }
  // Where the circles about the crank's end and the rocker's foot meet.
  const double d[2] = {ground - b[0], -b[1]}, gap = std::hypot(d[0], d[1]),
               along = (coupler * coupler - rocker * rocker + gap * gap) / (2 * gap),
               beside = side * std::sqrt(std::max(0.0, coupler * coupler - along * along));
  xy[0] = b[0] + (along * d[0] - beside * d[1]) / gap;
  xy[1] = b[1] + (along * d[1] + beside * d[0]) / gap;
}

Crank random_crank(std::uint64_t seed) {
  std::mt19937_64 engine(seed * 0x9E3779B97F4A7C15ull + 11);
  const auto uniform = [&](double a, double b) { return std::uniform_real_distribution<double>(a, b)(engine); };
  Crank c;
  for (int tries = 0; tries < 1000; ++tries) {
    c.slider = uniform(0, 1) < 0.3;
    c.crank = uniform(0.2, 1);
    c.coupler = uniform(0.4, 1.6);
    c.rocker = uniform(0.3, 1.4);
    c.ground = c.slider ? uniform(-0.6, 0.6) : uniform(0.5, 1.6);
    c.from = uniform(-3, 3);
    c.to = c.from + uniform(-9, 9);
    c.side = uniform(0, 1) < 0.5 ? 1 : -1;
    c.t_end = uniform(0.3, 2);
    if (c.spare(c.from) > 0.1 && std::abs(c.least_spare()) > kClear) break;
  }
  double end[2];
  c.end(c.from, end);
  const bool late = uniform(0, 1) < 0.5;  // the motor waits, and turns in a short time
  const double begin = late ? uniform(0, 0.8) * c.t_end : 0, finish = late ? begin + 0.15 * c.t_end : c.t_end;
  const std::string law =
      late
          ? fmt::format("{{ kind = \"smooth_step\", from = {:.17g}, to = {:.17g}, before = {:.17g}, after = {:.17g} }}",
                        begin, finish, c.from, c.to)
          : fmt::format("{{ kind = \"polynomial\", coefficients = [{:.17g}, {:.17g}] }}", c.from,
                        (c.to - c.from) / c.t_end);
  c.scene = fmt::format(
      "[gravity]\ny_m_per_s2 = {}\n[point.A]\nground = true\nx_m = 0\ny_m = 0\n[point.B]\nx_m = {:.17g}\ny_m = "
      "{:.17g}\n[point.C]\nx_m = {:.17g}\ny_m = {:.17g}\n[bar.crank]\nfrom = \"A\"\nto = \"B\"\nmass_kg = "
      "{:.6g}\nlength_m = {:.17g}\n[bar.coupler]\nfrom = \"B\"\nto = \"C\"\nmass_kg = {:.6g}\nlength_m = {:.17g}\n"
      "[angle.crank]\nbar = \"crank\"\n[driver.motor]\ncoordinate = \"crank.angle\"\nlaw = {}\n",
      uniform(0, 1) < 0.5 ? -9.81 : 0.0, c.crank * std::cos(c.from), c.crank * std::sin(c.from), end[0], end[1],
      uniform(0.2, 3), c.crank, uniform(0.2, 3), c.coupler, law);
  c.scene += c.slider ? fmt::format("[driver.guide]\ncoordinate = \"C.y\"\nlaw = {:.17g}\n", c.ground)
                      : fmt::format(
                            "[point.D]\nground = true\nx_m = {:.17g}\ny_m = 0\n[bar.rocker]\nfrom = \"D\"\nto "
                            "= \"C\"\nmass_kg = {:.6g}\nlength_m = {:.17g}\n",
                            c.ground, uniform(0.2, 3), c.rocker);
  c.scene += fmt::format("[[cost.terminal]]\nkind = \"value\"\noutput = \"C.x\"\n[run]\nt_end_s = {:.17g}\nrtol = {}\n",
                         c.t_end, kRtol);
  return c;
}

std::vector<Finding> run_crank(const Crank& c, const std::vector<std::pair<std::string, std::string>>& runs) {
  const double spare = c.least_spare();
  if (std::abs(spare) <= kClear || c.spare(c.from) <= 0) return {};
  std::vector<Finding> list;
  for (const auto& [formulation, integrator] : runs) {
    list.push_back(
        found(formulation + " x " + integrator, [&, &formulation = formulation, &integrator = integrator](Finding& f) {
          const Sampled m = sample(c.scene, formulation, integrator, kRtol, 5);
          const auto x = static_cast<std::size_t>(std::find(m.names.begin(), m.names.end(), "C.x") - m.names.begin()),
                     y = static_cast<std::size_t>(std::find(m.names.begin(), m.names.end(), "C.y") - m.names.begin());
          if (spare < 0) {
            f.outcome = m.said.empty() ? Outcome::wrong : Outcome::warned;
            f.message = fmt::format("the links miss each other by {:.3g} of the coupler; C ends at {:.6g}, {:.6g}. {}",
                                    -spare, m.values.back()[x], m.values.back()[y], m.said);
            return;
          }
          double end[2];
          c.end(c.to, end);
          f.error = std::hypot(m.values.back()[x] - end[0], m.values.back()[y] - end[1]) / c.coupler;
          const double allowed = has_fixed_steps(integrator) ? 100 * kAllowed : kAllowed;
          f.outcome = f.error <= allowed ? Outcome::agreed : !m.said.empty() ? Outcome::warned : Outcome::wrong;
          f.message = fmt::format("C ends at {:.9g}, {:.9g}, right {:.9g}, {:.9g}. {}", m.values.back()[x],
                                  m.values.back()[y], end[0], end[1], m.said);
        }));
    // What locks ends in an error or a warning; what does not has no reason to.
    Finding& f = list.back();
    if (spare > 0 && f.outcome == Outcome::failed) {
      f.outcome = Outcome::wrong;
      f.message = fmt::format("the links reach by {:.3g} of the coupler, and yet: {}", spare, f.message);
    }
  }
  return list;
}

}  // namespace costate::adversary
