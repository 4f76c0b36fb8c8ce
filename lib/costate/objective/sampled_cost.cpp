#include "costate/objective/sampled_cost.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>

#include "costate/base/error.h"
#include "costate/objective/weighted_cost.h"

namespace costate {

namespace {

[[noreturn]] void refuse(const std::string& path) {
  throw CapabilityError(
      fmt::format("{}: samples within a run are summed by simulate, by the gradients of idas-adjoint, idas-forward, "
                  "cvodes-adjoint and cvodes-forward, by differences of such runs and by costate fit; hand-derived "
                  "methods, fixed steps, Hessian products, cycles, runs that end by an event and adjoints of users do "
                  "not take them.",
                  path));
}

/// Any other term: zero while a sample is looked at.
class GatedTerm final : public CostTerm {
 public:
  GatedTerm(std::shared_ptr<const CostTerm> term, std::shared_ptr<const SampleGate> gate)
      : term_(std::move(term)), gate_(std::move(gate)) {}
  const CostTerm& term() const { return *term_; }
  double value(const StateView& s, Assembly& assembly) const override { return open() ? term_->value(s, assembly) : 0; }
  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const override {
    if (open()) term_->add_gradient(s, assembly, factor, g);
  }
  bool needs_accelerations() const override { return term_->needs_accelerations(); }
  void add_gradient_change(const StateView& s, Assembly& assembly, const Variation& d,
                           ScalarGradient& g) const override {
    if (open()) term_->add_gradient_change(s, assembly, d, g);
  }
  double change(const StateView& s, Assembly& assembly, const Variation& d) const override {
    return open() ? term_->change(s, assembly, d) : 0;
  }

 private:
  bool open() const { return gate_->time < 0; }
  std::shared_ptr<const CostTerm> term_;
  std::shared_ptr<const SampleGate> gate_;
};

}  // namespace

double SampledCost::residual(std::size_t k, const StateView& s, Assembly& assembly) const {
  return std::sqrt(assembly.numbers()[static_cast<std::size_t>(weight_)]) *
         (output_->value(s, assembly) - data_.values[k]) / data_.sigmas[k];
}

void SampledCost::add_residual_gradient(std::size_t k, const StateView& s, Assembly& assembly, double factor,
                                        ScalarGradient& g) const {
  const double root = std::sqrt(assembly.numbers()[static_cast<std::size_t>(weight_)]);
  output_->add_gradient(s, assembly, factor * root / data_.sigmas[k], g);
  if (!assembly.number_columns()[static_cast<std::size_t>(weight_)].empty())
    g.add_number(assembly, weight_,
                 factor * (output_->value(s, assembly) - data_.values[k]) / (2 * root * data_.sigmas[k]));
}

double SampledCost::value(const StateView&, Assembly&) const { refuse(data_.path); }
void SampledCost::add_gradient(const StateView&, Assembly&, double, ScalarGradient&) const { refuse(data_.path); }
double SampledCost::change(const StateView&, Assembly&, const Variation&) const { refuse(data_.path); }

bool has_samples(const Objective& objective) {
  return std::any_of(objective.terminal.begin(), objective.terminal.end(), [](const auto& term) {
    return dynamic_cast<const SampledCost*>(term.get()) || dynamic_cast<const SampleTerm*>(term.get());
  });
}

bool is_same_time(double a, double b) { return std::abs(a - b) <= 1e-12 * std::max(std::abs(a), std::abs(b)); }

SampleTerm::SampleTerm(std::vector<std::shared_ptr<const SampledCost>> costs, double t_start, double t_end)
    : costs_(std::move(costs)), gate_(std::make_shared<SampleGate>()) {
  std::map<double, std::vector<Sample>> all;
  for (std::size_t c = 0; c < costs_.size(); ++c)
    for (std::size_t k = 0; k < costs_[c]->data().times.size(); ++k) {
      const double t = costs_[c]->data().times[k];
      all[is_same_time(t, t_end) ? t_end : is_same_time(t, t_start) ? t_start : t].push_back({c, k});
    }
  for (auto& [t, samples] : all) {
    // What differs by rounding, in seconds here and in milliseconds there, is one time.
    if (!times_.empty() && is_same_time(times_.back(), t)) {
      if (t == t_end) times_.back() = t;
      samples_.back().insert(samples_.back().end(), samples.begin(), samples.end());
      continue;
    }
    times_.push_back(t);
    samples_.push_back(std::move(samples));
  }
}

bool SampleTerm::needs_accelerations() const {
  return std::any_of(costs_.begin(), costs_.end(), [](const auto& c) { return c->needs_accelerations(); });
}

/// visit(cost, sample, whether its residual alone is meant).
template <class Visit>
void SampleTerm::for_each_open(const Visit& visit) const {
  if (gate_->time < 0) return;
  const auto& samples = samples_[static_cast<std::size_t>(gate_->time)];
  if (gate_->residual >= 0) {
    const Sample& s = samples[static_cast<std::size_t>(gate_->residual)];
    return visit(*costs_[s.cost], s.k, true);
  }
  for (const Sample& s : samples) visit(*costs_[s.cost], s.k, false);
}

double SampleTerm::value(const StateView& s, Assembly& assembly) const {
  double sum = 0;
  for_each_open([&](const SampledCost& cost, std::size_t k, bool alone) {
    const double r = cost.residual(k, s, assembly);
    sum += alone ? r : r * r;
  });
  return sum;
}

void SampleTerm::add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const {
  for_each_open([&](const SampledCost& cost, std::size_t k, bool alone) {
    cost.add_residual_gradient(k, s, assembly, alone ? factor : factor * 2 * cost.residual(k, s, assembly), g);
  });
}

Objective separate_samples(const Objective& objective, double t_start, double t_end) {
  std::vector<std::shared_ptr<const SampledCost>> costs;
  for (const auto& term : objective.terminal)
    if (auto cost = std::dynamic_pointer_cast<const SampledCost>(term)) costs.push_back(std::move(cost));
  if (costs.empty()) return objective;
  const auto samples = std::make_shared<SampleTerm>(std::move(costs), t_start, t_end);
  Objective o;
  for (const auto& term : objective.running) o.running.push_back(std::make_shared<GatedTerm>(term, samples->gate()));
  for (const auto& term : objective.terminal)
    if (!dynamic_cast<const SampledCost*>(term.get()))
      o.terminal.push_back(std::make_shared<GatedTerm>(term, samples->gate()));
  o.terminal.push_back(samples);
  return o;
}

const SampleTerm* sample_term(const Objective& objective) {
  for (const auto& term : objective.terminal)
    if (const auto* samples = dynamic_cast<const SampleTerm*>(term.get())) return samples;
  return nullptr;
}

const WeightedTerm* weighted_term(const CostTerm& term) {
  const auto* gated = dynamic_cast<const GatedTerm*>(&term);
  return dynamic_cast<const WeightedTerm*>(gated ? &gated->term() : &term);
}

const CostTerm& ungated(const CostTerm& term) {
  if (const auto* gated = dynamic_cast<const GatedTerm*>(&term)) return ungated(gated->term());
  if (const auto* weighted = dynamic_cast<const WeightedTerm*>(&term)) return weighted->term();
  return term;
}

}  // namespace costate
