// Costs at samples within a run: the sum over measured times t_k of weight ((y(t_k) - d_k)/sigma_k)^2. In a scene's
// cost such a sum stands among the terminal terms, where it refuses to be evaluated: a method that does not know of it
// cannot leave it out in silence. Those that do go to the times one after the other (separate_samples).
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "costate/objective/objective.h"

namespace costate {

/// What the samples hold: one measured channel.
struct SampleData {
  std::string path;  // "cost.samples[0]"
  std::vector<double> times, values, sigmas;
};

class SampledCost final : public CostTerm {
 public:
  SampledCost(std::shared_ptr<const Output> output, SampleData data, int weight_number)
      : output_(std::move(output)), data_(std::move(data)), weight_(weight_number) {}

  const Output& output() const { return *output_; }
  const SampleData& data() const { return data_; }
  int weight_number() const { return weight_; }

  // The residual sqrt(weight) (y - d_k)/sigma_k of sample k.
  double residual(std::size_t k, const StateView& s, Assembly& assembly) const;
  void add_residual_gradient(std::size_t k, const StateView& s, Assembly& assembly, double factor,
                             ScalarGradient& g) const;

  // Throw CapabilityError.
  double value(const StateView& s, Assembly& assembly) const override;
  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const override;
  double change(const StateView& s, Assembly& assembly, const Variation& d) const override;
  bool needs_accelerations() const override { return output_->needs_accelerations(); }

 private:
  std::shared_ptr<const Output> output_;
  SampleData data_;
  int weight_;
};

/// But for rounding of what is converted from other units.
bool is_same_time(double a, double b);

/// Whether a cost has samples.
bool has_samples(const Objective& objective);

/// Which part of a cost is in force: the whole of what is no sample, all samples of one time, or one residual.
struct SampleGate {
  std::ptrdiff_t time = -1, residual = -1;
};

/// All samples of a cost as one terminal term: zero while the gate is shut, else the sum of squares at the open time,
/// or one of its residuals itself.
class SampleTerm final : public CostTerm {
 public:
  SampleTerm(std::vector<std::shared_ptr<const SampledCost>> costs, double t_start, double t_end);

  /// Without repetition, in order; what differs by rounding, from each other or from the run's ends, is one time.
  const std::vector<double>& times() const { return times_; }
  struct Sample {
    std::size_t cost, k;
  };
  /// The samples at time i.
  const std::vector<Sample>& at(std::size_t i) const { return samples_[i]; }
  const std::vector<std::shared_ptr<const SampledCost>>& costs() const { return costs_; }
  std::shared_ptr<SampleGate> gate() const { return gate_; }

  double value(const StateView& s, Assembly& assembly) const override;
  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const override;
  double change(const StateView&, Assembly&, const Variation&) const override { return 0; }
  bool needs_accelerations() const override;

 private:
  template <class Visit>
  void for_each_open(const Visit& visit) const;
  std::vector<std::shared_ptr<const SampledCost>> costs_;
  std::vector<double> times_;
  std::vector<std::vector<Sample>> samples_;  // an entry a time
  std::shared_ptr<SampleGate> gate_;
};

/// Opens the gate while it lives.
class OpenSample {
 public:
  OpenSample(const SampleTerm& term, std::size_t time, std::ptrdiff_t residual = -1) : gate_(term.gate()) {
    *gate_ = {static_cast<std::ptrdiff_t>(time), residual};
  }
  ~OpenSample() { *gate_ = {}; }
  OpenSample(const OpenSample&) = delete;
  OpenSample& operator=(const OpenSample&) = delete;

 private:
  std::shared_ptr<SampleGate> gate_;
};

/// A cost with samples as systems can carry it: all samples in one SampleTerm, all other terms shut while it is open.
/// A cost without is returned as it is.
Objective separate_samples(const Objective& objective, double t_start, double t_end);
/// The term of a cost that has been separated, or null.
const SampleTerm* sample_term(const Objective& objective);

/// The term behind a gate and a weight, or the term itself.
const CostTerm& ungated(const CostTerm& term);
class WeightedTerm;
/// The weighted term that this is, perhaps behind a gate, or null.
const WeightedTerm* weighted_term(const CostTerm& term);

}  // namespace costate
