#include "rewritten.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"

namespace costate::app {

namespace {

// Starts are solved for to 1e-12, of guesses of their own; accelerations amplify that by what is stiff.
constexpr double kSameStart = 1e-8, kSameAcceleration = 1e-5;

struct Motion {
  double q = 0, v = 0, a = 0;
};

std::map<std::string, Motion> start_of(const Problem& problem, const std::vector<double>& rho) {
  std::map<std::string, Motion> all;
  Problem p = problem;
  p.objective = {};
  simulate(p, rho, {p.solver.t_start}, [&](const MechanismState& s, System& system) {
    const auto names = system.assembly().mechanism().coordinate_names();
    for (std::size_t i = 0; i < names.size(); ++i) all[names[i]] = {s.q[i], s.v[i], s.a[i]};
  });
  return all;
}

}  // namespace

Rewritten read_rewritten(const Setup& setup, const std::string& toml, const std::string& file,
                         const std::string& option, double psi_here) {
  const Scene scene = [&] {
    try {
      return Scene::parse(toml, file);
    } catch (const Error& e) {
      throw CapabilityError(fmt::format("{}: What would be written is no scene: {}", option, e.what()));
    }
  }();
  Rewritten r{setup.problem};
  const Problem own = make_problem(scene);
  r.problem.mechanism = own.mechanism;
  r.problem.parameters = {};
  r.problem.objective = own.objective;
  r.problem.ends_when = own.ends_when;
  r.psi = simulate(r.problem, {}).psi;
  // Each is right to some hundred times its tolerance.
  if (std::abs(r.psi - psi_here) > 1e3 * setup.problem.solver.rtol * std::max(std::abs(r.psi), std::abs(psi_here)))
    notice(fmt::format("psi of the scene that {} writes is {:.9g}, of this one {:.9g}: they are not the same.", option,
                       r.psi, psi_here));
  return r;
}

void check_same_start(const Setup& setup, const Rewritten& other, const std::string& option) {
  const auto here = start_of(setup.problem, setup.rho), there = start_of(other.problem, {});
  Motion largest;
  for (const auto& [name, x] : here) {
    largest.q = std::max(largest.q, std::abs(x.q));
    largest.v = std::max(largest.v, std::abs(x.v));
    largest.a = std::max(largest.a, std::abs(x.a));
  }
  for (const auto& [name, x] : here) {
    const auto at = there.find(name);
    if (at == there.end()) continue;
    for (const auto& [what, a, b, allowed] :
         {std::tuple("starts at", x.q, at->second.q, kSameStart * (1 + largest.q)),
          std::tuple("starts with the rate", x.v, at->second.v, kSameStart * (1 + largest.v)),
          std::tuple("starts with the acceleration", x.a, at->second.a, kSameAcceleration * (1 + largest.a))})
      if (!(std::abs(a - b) <= allowed))
        throw CapabilityError(fmt::format(
            "{}: What would be written is not the same mechanism: {} {} {:.9g} there and {:.9g} here. Something of it "
            "refers to the frame of a body that is welded to another one, or starts by guesses that do not fit "
            "together.",
            option, name, what, b, a));
  }
}

}  // namespace costate::app
