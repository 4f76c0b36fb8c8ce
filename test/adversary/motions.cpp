#include "motions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include "costate/analysis/undetermined_reactions.h"
#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/integrator/simulate.h"
#include "costate/objective/all_outputs.h"
#include "costate/problem/scene_problem.h"
#include "costate/tradeoff/motion_confirmation.h"

namespace costate::adversary {

namespace {

constexpr int kSamples = 23;
// What rtol 1e-8 claims of each output, as of psi; accelerations and reactions follow from positions and velocities.
// Where the motion makes much of small errors, kGrown times what it makes of the reference's tolerance; soft
// constraints may cost kSoft (as costate stress judges).
constexpr double kAllowed = 1e-4, kGrown = 100, kMost = 0.3, kSoft = 1e-2, kFixed = 100;
// Outputs that stay small against others of their unit (the rate of a spring along a bar) are rounding and drift.
constexpr double kSmall = 1e-2;
// What absolute tolerances leave of positions and velocities, in parts of the mechanism's length where that is below 1
// m: as of psi some 30 of them (solvers/costate/sensitivity/confirmation.cpp).
constexpr double kAbsolute = 30, kRtol = 1e-8, kReference = 1e-11;
// With what accelerations a stabilization of 10 rad/s answers these.
constexpr double kOmega = 10;
// Two references that differ by more do not judge.
constexpr double kSettled = 0.1 * kAllowed;

std::string reactions_apart(const std::string& unit, const std::string& name) {
  return name.rfind("lambda.", 0) == 0 ? "lambda " + unit : unit;
}

/// The largest sum of |y_q| and |y_v| of each output: what an absolute error of positions and velocities makes of it.
void add_slopes(const std::vector<std::unique_ptr<Output>>& outputs, const MechanismState& s, Assembly& assembly,
                std::vector<double>& slopes) {
  ScalarGradient g;
  g.resize(assembly);
  for (std::size_t o = 0; o < outputs.size(); ++o) try {
      g.set_zero();
      outputs[o]->add_gradient(s, assembly, 1, g);
      slopes[o] = std::max(slopes[o], g.q.lpNorm<1>() + g.v.lpNorm<1>());
    } catch (const CapabilityError&) {
      continue;
    }
}

/// The size that each output's errors are measured by.
std::vector<double> sizes(const Sampled& m) {
  std::vector<double> own(m.names.size(), 0);
  std::map<std::string, double> of_unit;
  for (std::size_t o = 0; o < own.size(); ++o) {
    for (const auto& at : m.values) own[o] = std::max(own[o], std::abs(at[o]));
    double& largest = of_unit[reactions_apart(m.units[o], m.names[o])];
    largest = std::max(largest, own[o]);
  }
  for (std::size_t o = 0; o < own.size(); ++o)
    own[o] = std::max(own[o], kSmall * of_unit[reactions_apart(m.units[o], m.names[o])]);
  const double absolute = kAbsolute * kRtol / kAllowed * std::min(1.0, of_unit["m"]);
  for (std::size_t o = 0; o < own.size(); ++o) {
    own[o] = std::max(own[o], absolute * m.slopes[o]);
    if (m.units[o] == "m/s^2") own[o] = std::max(own[o], kOmega * kOmega * absolute);
  }
  return own;
}

std::string joined(const std::vector<std::string>& sentences) {
  std::string r;
  for (const auto& s : sentences) r += s + " ";
  return r;
}

Problem problem_of(const std::string& scene, const std::string& formulation, const std::string& integrator,
                   double rtol) {
  Problem p = make_problem(Scene::parse(scene, "adversary.toml"));
  p.formulation = formulation;
  p.solver.integrator = integrator;
  p.solver.rtol = rtol;
  return p;
}

}  // namespace

Sampled sample(const std::string& scene, const std::string& formulation, const std::string& integrator, double rtol,
               int samples) {
  Sampled r;
  const Problem p = problem_of(scene, formulation, integrator, rtol);
  const auto outputs = make_all_outputs(*p.mechanism);
  for (const auto& o : outputs) {
    r.names.push_back(o->name());
    r.units.push_back(o->unit());
  }
  r.open.assign(outputs.size(), false);
  r.slopes.assign(outputs.size(), 0);
  // Not where laws have their corners.
  for (int i = 0; i < samples; ++i)
    r.times.push_back(p.solver.t_start + (p.solver.t_end - p.solver.t_start) *
                                             std::min(1.0, (i + 0.37 + 0.2 * std::sin(7.0 * i)) / (samples - 0.5)));
  r.times.back() = p.solver.t_end;
  take_notices();
  const Simulation run = simulate(p, p.parameters.values(), r.times, [&](const MechanismState& s, System& system) {
    std::vector<double> now;
    for (const auto& o : outputs) now.push_back(o->value(s, system.assembly()));
    r.values.push_back(now);
    add_slopes(outputs, s, system.assembly(), r.slopes);
    // Rows may become dependent on the way; a few looks tell.
    if (r.values.size() % 8 != 1 || system.assembly().m() == 0) return;
    Assembly assembly(p.mechanism, p.parameters);
    assembly.set_parameters(p.parameters.values().data());
    const auto map = [](const double* x, int n) { return Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(x, n)); };
    UndeterminedReactions open(assembly, s.t, map(s.q, assembly.n()), map(s.z, assembly.nz()));
    if (open.none()) return;
    for (std::size_t o = 0; o < outputs.size(); ++o)
      if (open.leaves_open(*outputs[o])) r.open[o] = true;
  });
  r.psi = run.psi;
  r.events = run.events.size();
  r.said = joined(take_notices());
  return r;
}

std::string said_by_confirmation(const std::string& scene, const std::string& formulation,
                                 const std::string& integrator, double rtol) {
  const Problem p = problem_of(scene, formulation, integrator, rtol);
  if (!motion_is_confirmed(p)) return "";
  const TradeProbe probe(p, p.parameters.values(), confirmed_outputs(p, {}), kSamples);
  const TradeValues values = probe.run(p, "");
  take_notices();
  confirm_motion(probe, p, values);
  return joined(take_notices());
}

std::vector<std::pair<std::string, std::string>> runs_of_motions() {
  std::vector<std::pair<std::string, std::string>> list;
  for (const Formulation& f : formulations())
    for (const Integrator* i : integrators_of(f)) list.emplace_back(f.name, i->name);
  return list;
}

std::vector<Finding> run_motions(const std::string& scene,
                                 const std::vector<std::pair<std::string, std::string>>& runs) {
  // Two references, of those that carry redundant rows where others do not get anywhere.
  const std::pair<const char*, const char*> first[] = {{"baumgarte", "cvodes"}, {"augmented-lagrangian", "cvodes"}},
                                            second[] = {{"maggi", "dop853"}, {"maggi", "radau5"}};
  const auto reference = [&](const auto& candidates) -> std::optional<Sampled> {
    for (const auto& [formulation, integrator] : candidates) try {
        return sample(scene, formulation, integrator, kReference, kSamples);
      } catch (const Error&) {
        continue;
      }
    return {};
  };
  const std::optional<Sampled> a = reference(first), b = reference(second);
  // What ten times its tolerance makes of the second one.
  const auto second_at = [&](double rtol) -> std::optional<Sampled> {
    for (const auto& [formulation, integrator] : second) try {
        return sample(scene, formulation, integrator, rtol, kSamples);
      } catch (const Error&) {
        continue;
      }
    return {};
  };
  const std::optional<Sampled> looser = second_at(10 * kReference);
  const bool both =
      a && b && looser && looser->values.size() == b->values.size() && a->values.size() == b->values.size();
  std::vector<double> size, unsure;
  double grown = 0;  // of a tolerance
  if (both) {
    size = sizes(*b);
    unsure.assign(size.size(), 0);
    for (std::size_t i = 0; i < a->values.size(); ++i)
      for (std::size_t o = 0; o < size.size(); ++o) {
        unsure[o] = std::max(unsure[o], std::abs(a->values[i][o] - b->values[i][o]));
        if (size[o] > 0)
          grown = std::max(grown, std::abs(looser->values[i][o] - b->values[i][o]) / (10 * kReference * size[o]));
      }
  }
  std::vector<Finding> list;
  for (const auto& [formulation, integrator] : runs)
    list.push_back(found(formulation + " x " + integrator, [&, &f = formulation, &on = integrator](Finding& x) {
      Sampled m = sample(scene, f, on, kRtol, kSamples);
      bool finite = std::isfinite(m.psi);
      for (const auto& at : m.values)
        for (const double y : at) finite = finite && std::isfinite(y);
      if (!both || !finite) {
        x.outcome = finite || !m.said.empty() ? Outcome::unjudged : Outcome::wrong;
        x.message = finite ? m.said : "a result that is not finite";
        return;
      }
      std::size_t judged = 0;
      std::string worst;
      for (std::size_t o = 0; o < size.size(); ++o) {
        if (m.open[o] || a->open[o] || b->open[o] || !(size[o] > 0) || !(unsure[o] <= kSettled * size[o])) continue;
        ++judged;
        for (std::size_t i = 0; i < m.values.size() && i < b->values.size(); ++i) {
          const double e = std::abs(m.values[i][o] - b->values[i][o]) / size[o];
          if (e <= x.error) continue;
          x.error = e;
          worst = fmt::format("{} = {:.9g} at {:.6g} s, right {:.9g} of {:.3g}", m.names[o], m.values[i][o], m.times[i],
                              b->values[i][o], size[o]);
        }
      }
      const bool soft = !find_formulation(f).exact_constraints();
      const double claimed = std::max({kAllowed, kGrown * grown * kRtol, soft ? kSoft : 0.0}),
                   allowed = std::min(kMost, has_fixed_steps(on) ? kFixed * claimed : claimed);
      if (judged > 0 && !(x.error <= allowed) && m.said.empty()) m.said = said_by_confirmation(scene, f, on, kRtol);
      x.outcome = judged == 0          ? Outcome::unjudged
                  : x.error <= allowed ? Outcome::agreed
                  : !m.said.empty()    ? Outcome::warned
                                       : Outcome::wrong;
      x.message = fmt::format("{} of {} judged; {}", judged, size.size(), x.error <= allowed ? "" : worst) +
                  (m.said.empty() ? "" : " warned: " + m.said);
    }));
  return list;
}

}  // namespace costate::adversary
