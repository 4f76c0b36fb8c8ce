#include "costate/integrator/explicit_tape.h"

#include <algorithm>

namespace costate {

ExplicitTape::ExplicitTape(OdeSystem& system, const ExplicitScheme& scheme, double bytes, long segment_steps)
    : StepTape(bytes, segment_steps), system_(system), scheme_(scheme), n_(system.size()) {
  set_budget(stage_entries());
}

void ExplicitTape::keep_records_of(ExplicitStep& step) {
  const auto* adjoint = dynamic_cast<const StageAdjoint*>(&system_);
  if (!adjoint || in_segments()) return;
  step.keep([this, adjoint](int stage) {
    if (in_segments() || !records_fit_) return;
    if (record_ == 0) {
      record_ = adjoint->record_size();
      if (record_ == 0) return;
      records_.assign(record_entries() + record_, 0);
      set_budget(stage_entries() + record_entries());
    }
    adjoint->keep_record(records_.data() + static_cast<std::size_t>(stage) * record_, record_);
  });
}

void ExplicitTape::keep_stages(Step& step, const ExplicitStep& of, bool records) const {
  const std::size_t entries = stage_entries(), behind = records ? record_entries() : 0;
  if (!step.at) step.at = std::make_unique_for_overwrite<double[]>(entries + behind);
  for (int i = 0; i < scheme_.stages; ++i) std::copy(of.stage(i), of.stage(i) + n_, step.at.get() + i * n_);
  std::copy_n(records_.data(), behind, step.at.get() + entries);
}

void ExplicitTape::drop_records() {
  for (long k = 0; k < steps(); ++k) {
    std::unique_ptr<double[]>& at = step(k).at;
    auto stages = std::make_unique_for_overwrite<double[]>(stage_entries());
    std::copy_n(at.get(), stage_entries(), stages.get());
    at = std::move(stages);
  }
  records_fit_ = false;
  record_ = 0;
  set_budget(stage_entries());
}

void ExplicitTape::add_step(const ExplicitStep& taken) {
  if (record_ > 0 && full()) drop_records();
  if (begins_segments())
    for (long k = 0; k < steps(); ++k) {
      Step& s = step(k);
      if (is_checkpoint(k)) s.y.assign(s.at.get(), s.at.get() + n_);
      s.at.reset();
    }
  Step s{taken.t(), taken.h(), taken.t_end(), system_.mode(), 0, {}, {}};
  if (!in_segments())
    keep_stages(s, taken, true);
  else if (is_checkpoint(steps()))
    s.y.assign(taken.start(), taken.start() + n_);
  // The evaluation at its end is the first one of the next step.
  if (record_ > 0) std::copy_n(records_.end() - static_cast<std::ptrdiff_t>(record_), record_, records_.begin());
  add(std::move(s));
}

ExplicitStages ExplicitTape::bring_back(long k) {
  if (!step(k).at) {
    if (!repeated_)
      repeated_ = std::make_unique<ExplicitStep>(
          scheme_, n_, false, [this](double t, const double* y, double* f, bool) { system_.rhs(t, y, f); });
    const long first = checkpoint_of(k);
    std::vector<double> y = step(first).y;
    for (long j = first; j <= k; ++j) {
      Step& s = step(j);
      if (const auto* jumped = j > first ? jumped_to(j) : nullptr) y = *jumped;
      system_.use_mode(s.mode);
      repeated_->repeat(s.t, y.data(), s.h, s.t_end);
      keep_stages(s, *repeated_, false);
      std::copy(repeated_->end(), repeated_->end() + n_, y.begin());
    }
  }
  drop_behind(k);
  const Step& wanted = step(k);
  system_.use_mode(wanted.mode);
  ExplicitStages stages{wanted.t, wanted.h, wanted.t_end, wanted.at.get(), n_};
  if (!in_segments() && record_ > 0) {
    stages.records = wanted.at.get() + stage_entries();
    stages.record = record_;
  }
  return stages;
}

}  // namespace costate
