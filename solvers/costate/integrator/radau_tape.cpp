#include "costate/integrator/radau_tape.h"

#include <algorithm>

namespace costate {

RadauTape::RadauTape(DaeSystem& system, const RadauScheme& scheme, double bytes, long segment_steps,
                     std::vector<double> atol)
    : system_(system), scheme_(scheme), n_(system.size()), segment_(segment_steps), atol_(std::move(atol)) {
  const double stages = static_cast<double>(sizeof(double)) * n_ * scheme.stages;
  budget_ = static_cast<std::size_t>(std::max(2.0, bytes / (stages + sizeof(Step) + 2 * sizeof(void*))));
}

void RadauTape::keep_stages(Step& step, const RadauStep& of) const {
  const std::size_t entries = static_cast<std::size_t>(n_) * static_cast<std::size_t>(scheme_.stages);
  if (!step.at) step.at = std::make_unique_for_overwrite<double[]>(entries);
  for (int i = 0; i < scheme_.stages; ++i) std::copy_n(of.stage(i), n_, step.at.get() + i * n_);
}

void RadauTape::add_step(const RadauStep& step) {
  if (segment_ == 0 && steps_.size() >= budget_) {
    segment_ = static_cast<long>(std::max<std::size_t>(1, budget_ / 2));
    for (std::size_t k = 0; k < steps_.size(); ++k)
      if (!is_checkpoint(k)) steps_[k].at.reset();
  }
  Step s{step.t(), step.h(), step.t_end(), system_.mode(), jumps_.size(), {}};
  if (segment_ == 0 || is_checkpoint(steps_.size())) keep_stages(s, step);
  steps_.push_back(std::move(s));
}

void RadauTape::add_jump(const Jump& jump, std::vector<double> y_after) {
  jumps_.push_back({jump, std::move(y_after)});
}

std::size_t RadauTape::jumps_end(long k) const {
  return k + 1 < steps() ? steps_[static_cast<std::size_t>(k) + 1].jumps : jumps_.size();
}

RadauStages RadauTape::bring_back(long k) {
  const auto stages_of = [&](const Step& s) { return RadauStages{s.t, s.h, s.t_end, s.at.get(), n_}; };
  Step& wanted = steps_[static_cast<std::size_t>(k)];
  if (!wanted.at) {
    if (!repeated_)
      repeated_ = std::make_unique<RadauStep>(
          scheme_, system_, false, atol_,
          [this](double t, const double* y, const double* yp, double* r) { system_.residual(t, y, yp, r); });
    const long first = k / segment_ * segment_;
    system_.use_mode(steps_[static_cast<std::size_t>(first)].mode);
    repeated_->resume(stages_of(steps_[static_cast<std::size_t>(first)]));
    for (long j = first + 1; j <= k; ++j) {
      Step& s = steps_[static_cast<std::size_t>(j)];
      system_.use_mode(s.mode);
      if (jumps_end(j - 1) > jumps_begin(j - 1))
        repeated_->begin(s.t, jumps_[s.jumps - 1].y_after.data());
      else if (j > first + 1)
        repeated_->go_on();
      repeated_->attempt(s.h, s.t_end);
      keep_stages(s, *repeated_);
    }
  }
  // Those behind it have served.
  if (k + 1 < steps()) steps_[static_cast<std::size_t>(k) + 1].at.reset();
  system_.use_mode(wanted.mode);
  return stages_of(wanted);
}

}  // namespace costate
