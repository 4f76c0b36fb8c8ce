#include "costate/tradeoff/trade_probe.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "costate/base/error.h"
#include "costate/integrator/run_end.h"
#include "costate/integrator/simulate.h"
#include "costate/objective/all_outputs.h"
#include "costate/sensitivity/method.h"
#include "costate/tradeoff/stopwatch.h"

namespace costate {

namespace {
constexpr std::size_t kLooksAtAmounts = 8;  // along a motion
}

TradeProbe::TradeProbe(const Problem& problem, const std::vector<double>& rho, const std::vector<std::string>& outputs,
                       int samples, const std::vector<std::string>& besides)
    : problem_(problem), rho_(rho), counted_(outputs.size()) {
  problem_.solver.confirm = false;  // that is a second run
  const Mechanism& m = *problem_.mechanism;
  outputs_ = make_outputs(m, outputs);
  for (auto& output : make_outputs(m, besides)) outputs_.push_back(std::move(output));
  kinetic_ = make_output(m, "energy.kinetic");
  energy_ = make_output(m, "energy.total");
  assembly_ = std::make_unique<Assembly>(problem_.mechanism, problem_.parameters);
  assembly_->set_parameters(rho_.data());
  const double t0 = problem_.solver.t_start, t1 = until_its_end(problem_, rho_).solver.t_end;
  for (int i = 0; i < samples; ++i) times_.push_back(t0 + (t1 - t0) * (i + 0.381966) / samples);
}

Problem TradeProbe::prepared(const Combination& c, double rtol, double step_s) const {
  Problem p = problem_;
  p.formulation = c.formulation;
  p.solver.integrator = c.integrator;
  p.solver.step_s = step_s;
  if (rtol > 0) p.solver.set_rtol(rtol);
  return p;
}

void TradeProbe::look_at_amounts(TradeMotion& motion, const MechanismState& s, Assembly& assembly) const {
  ScalarGradient g;
  g.resize(assembly);
  motion.amounts.resize(outputs_.size(), 0);
  for (std::size_t o = 0; o < outputs_.size(); ++o) {
    // Of an output that depends on a few coordinates only their entries are cleared and looked at: there may be as many
    // outputs as coordinates.
    std::optional<std::vector<int>> few = outputs_[o]->depends_on();
    if (few) {
      std::sort(few->begin(), few->end());
      few->erase(std::unique(few->begin(), few->end()), few->end());
      for (const int i : *few) g.q[i] = g.v[i] = 0;
    } else {
      g.set_zero();
    }
    try {
      outputs_[o]->add_gradient(s, assembly, 1, g);
    } catch (const CapabilityError&) {  // of outputs without derivatives
      continue;
    }
    double amount = 0;
    const auto add = [&](Eigen::Index i) { amount += std::abs(g.q[i] * s.q[i]) + std::abs(g.v[i] * s.v[i]); };
    if (few)
      for (const int i : *few) add(i);
    else
      for (Eigen::Index i = 0; i < g.q.size(); ++i) add(i);
    motion.amounts[o] = std::max(motion.amounts[o], amount);
  }
}

void TradeProbe::look(TradeMotion& motion, const MechanismState& s, System& system) const {
  if (motion.outputs.size() % std::max<std::size_t>(1, times_.size() / kLooksAtAmounts) == 0)
    look_at_amounts(motion, s, system.assembly());
  std::vector<double> values;
  for (const auto& o : outputs_) values.push_back(o->value(s, system.assembly()));
  motion.outputs.push_back(std::move(values));
  motion.kinetic.push_back(kinetic_->value(s, system.assembly()));
  motion.energy.push_back(energy_->value(s, system.assembly()));
  const std::lock_guard lock(*looks_);
  Assembly& a = *assembly_;
  motion.lowest.resize(static_cast<std::size_t>(a.n()), HUGE_VAL);
  motion.highest.resize(static_cast<std::size_t>(a.n()), -HUGE_VAL);
  for (std::size_t i = 0; i < motion.lowest.size(); ++i) {
    motion.lowest[i] = std::min(motion.lowest[i], s.q[i]);
    motion.highest[i] = std::max(motion.highest[i], s.q[i]);
  }
  a.calc_constraints(s);
  std::vector<double> rate = a.phi_t;
  add_product(a.jacobian(), a.phi_q.data(), 1, s.v, rate.data());
  for (const double x : a.phi) motion.position_drift = std::max(motion.position_drift, std::abs(x));
  for (const double x : rate) motion.velocity_drift = std::max(motion.velocity_drift, std::abs(x));
  const Objective& o = system.objective();
  double g = 0;
  for (const auto& term : o.running) g += std::abs(term->value(s, system.assembly()));
  const double span = times_.size() > 1 ? times_[1] - times_[0] : 0;
  motion.cost_amount += g * span;
  if (motion.outputs.size() == times_.size())
    for (const auto& term : o.terminal) motion.cost_amount += std::abs(term->value(s, system.assembly()));
}

TradeValues TradeProbe::run(const Combination& c, double rtol, double step_s, GradientResult* result,
                            const Recording* recording, const RunBudget* budget) const {
  const Problem p = prepared(c, rtol, step_s);
  return run(budget ? watched(p, *budget) : p, c.method, result, recording);
}

TradeValues TradeProbe::run(const Problem& p, const std::string& method, GradientResult* result,
                            const Recording* recording) const {
  TradeValues v;
  const double begin = processor_time_s();
  GradientResult r;
  if (!method.empty()) {
    r = costate::gradient(p, method, rho_);
    v.gradient = r.gradient;
  } else {
    TradeMotion motion;
    std::vector<double> times = times_;
    if (recording) times.insert(times.end(), recording->times.begin(), recording->times.end());
    std::sort(times.begin(), times.end());
    times.erase(std::unique(times.begin(), times.end()), times.end());
    const auto among = [](const std::vector<double>& sorted, double t) {
      return std::binary_search(sorted.begin(), sorted.end(), t);
    };
    r = GradientResult(simulate(p, rho_, times, [&](const MechanismState& state, System& system) {
      // What is at neither's times is the end of a run that has ended early.
      const bool ours = among(times_, state.t), theirs = recording && among(recording->times, state.t);
      if (ours || !theirs) look(motion, state, system);
      if (recording && (theirs || !ours)) recording->sink(state, system);
    }));
    // A run that ends a little earlier than the reference's hands out its end instead.
    motion.outputs.resize(times_.size(),
                          motion.outputs.empty() ? std::vector<double>(outputs_.size(), 0.0) : motion.outputs.back());
    v.motion = std::move(motion);
  }
  v.psi = r.psi;
  v.counters = r.counters;
  v.time_s = processor_time_s() - begin;
  if (result) *result = std::move(r);
  return v;
}

void TradeProbe::repeat(const Combination& c, double rtol, double step_s) const {
  const Problem p = prepared(c, rtol, step_s);
  if (c.method.empty())
    simulate(p, rho_);
  else
    costate::gradient(p, c.method, rho_);
}

}  // namespace costate
