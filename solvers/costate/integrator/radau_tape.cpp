#include "costate/integrator/radau_tape.h"

#include <algorithm>

namespace costate {

namespace {
// Entries of the factors an unknown. With fewer a factorization takes no longer than the one or two solutions more that
// the step's own factors take, whose Jacobian is that of the middle of the step and not the mean of its stages.
constexpr double kWorthKeeping = 10;
}  // namespace

RadauTape::RadauTape(DaeSystem& system, const RadauScheme& scheme, double bytes, long segment_steps,
                     std::vector<double> atol)
    : StepTape(bytes, segment_steps),
      system_(system),
      scheme_(scheme),
      n_(system.size()),
      atol_(std::move(atol)),
      bytes_left_(bytes) {
  set_budget(stage_entries());
}

void RadauTape::keep_factors(const RadauStep& of) {
  if (bytes_left_ <= 0) return;
  Factors f{of.matrix(), {}};
  const std::size_t size = f.of->saved_size();
  if (static_cast<double>(size) < kWorthKeeping * static_cast<double>(stage_entries())) {
    bytes_left_ = 0;
    return;
  }
  bytes_left_ -= static_cast<double>(sizeof(double) * (size + stage_entries()) + sizeof(Step) + sizeof(Factors));
  if (bytes_left_ <= 0) {
    factors_.clear();
    return;
  }
  f.numbers = std::make_unique_for_overwrite<double[]>(size);
  f.of->save(f.numbers.get());
  factors_.push_back(std::move(f));
}

void RadauTape::keep_stages(Step& step, const RadauStep& of) const {
  if (!step.at) step.at = std::make_unique_for_overwrite<double[]>(stage_entries());
  for (int i = 0; i < scheme_.stages; ++i) std::copy_n(of.stage(i), n_, step.at.get() + i * n_);
}

void RadauTape::add_step(const RadauStep& taken) {
  if (begins_segments()) {
    factors_.clear();
    bytes_left_ = 0;
    for (long k = 0; k < steps(); ++k)
      if (!is_checkpoint(k)) step(k).at.reset();
  }
  Step s{taken.t(), taken.h(), taken.t_end(), system_.mode(), 0, {}, {}};
  if (!in_segments() || is_checkpoint(steps())) keep_stages(s, taken);
  if (in_segments())
    bytes_left_ = 0;
  else
    keep_factors(taken);
  add(std::move(s));
}

RadauStages RadauTape::bring_back(long k) {
  if (!step(k).at) {
    if (!repeated_)
      repeated_ = std::make_unique<RadauStep>(
          scheme_, system_, false, atol_,
          [this](double t, const double* y, const double* yp, double* r) { system_.residual(t, y, yp, r); });
    const long first = checkpoint_of(k);
    system_.use_mode(step(first).mode);
    repeated_->resume(stages_of(step(first)));
    for (long j = first + 1; j <= k; ++j) {
      Step& s = step(j);
      system_.use_mode(s.mode);
      if (const auto* y = jumped_to(j))
        repeated_->begin(s.t, y->data());
      else if (j > first + 1)
        repeated_->go_on();
      repeated_->attempt(s.h, s.t_end);
      keep_stages(s, *repeated_);
    }
  }
  drop_behind(k);
  system_.use_mode(step(k).mode);
  RadauStages stages = stages_of(step(k));
  if (const auto at = static_cast<std::size_t>(k); at < factors_.size()) {
    factors_.resize(at + 1);  // those behind it have served
    stages.matrix = factors_[at].of.get();
    stages.factors = factors_[at].numbers.get();
  }
  return stages;
}

}  // namespace costate
