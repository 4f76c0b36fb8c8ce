#include "costate/integrator/radau_tape.h"

#include <algorithm>

namespace costate {

RadauTape::RadauTape(DaeSystem& system, const RadauScheme& scheme, double bytes, long segment_steps,
                     std::vector<double> atol)
    : StepTape(bytes, segment_steps), system_(system), scheme_(scheme), n_(system.size()), atol_(std::move(atol)) {
  set_budget(stage_entries());
}

void RadauTape::keep_stages(Step& step, const RadauStep& of) const {
  if (!step.at) step.at = std::make_unique_for_overwrite<double[]>(stage_entries());
  for (int i = 0; i < scheme_.stages; ++i) std::copy_n(of.stage(i), n_, step.at.get() + i * n_);
}

void RadauTape::add_step(const RadauStep& taken) {
  if (begins_segments())
    for (long k = 0; k < steps(); ++k)
      if (!is_checkpoint(k)) step(k).at.reset();
  Step s{taken.t(), taken.h(), taken.t_end(), system_.mode(), 0, {}, {}};
  if (!in_segments() || is_checkpoint(steps())) keep_stages(s, taken);
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
  return stages_of(step(k));
}

}  // namespace costate
