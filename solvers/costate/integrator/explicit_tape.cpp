#include "costate/integrator/explicit_tape.h"

#include <algorithm>

namespace costate {

ExplicitTape::ExplicitTape(OdeSystem& system, const ExplicitScheme& scheme, double bytes, long segment_steps)
    : system_(system), scheme_(scheme), n_(system.size()), bytes_(bytes), segment_(segment_steps) {
  set_budget();
}

void ExplicitTape::set_budget() {
  const std::size_t entries = stage_entries() + record_ * static_cast<std::size_t>(scheme_.stages);
  const double of_step = static_cast<double>(sizeof(double) * entries + sizeof(Step) + 2 * sizeof(void*));
  budget_ = static_cast<std::size_t>(std::max(2.0, bytes_ / of_step));
}

void ExplicitTape::keep_records_of(ExplicitStep& step) {
  const auto* adjoint = dynamic_cast<const StageAdjoint*>(&system_);
  if (!adjoint || segment_ > 0) return;
  step.keep([this, adjoint](int stage) {
    if (segment_ > 0) return;
    if (record_ == 0) {
      record_ = adjoint->record_size();
      if (record_ == 0) return;
      records_.assign(record_ * (static_cast<std::size_t>(scheme_.stages) + 1), 0);
      set_budget();
    }
    adjoint->keep_record(records_.data() + static_cast<std::size_t>(stage) * record_, record_);
  });
}

void ExplicitTape::keep_stages(Step& step, const ExplicitStep& of, bool records) const {
  const std::size_t entries = stage_entries(),
                    behind = records ? record_ * static_cast<std::size_t>(scheme_.stages) : 0;
  if (!step.at) step.at = std::make_unique_for_overwrite<double[]>(entries + behind);
  for (int i = 0; i < scheme_.stages; ++i) std::copy(of.stage(i), of.stage(i) + n_, step.at.get() + i * n_);
  std::copy_n(records_.data(), behind, step.at.get() + entries);
}

void ExplicitTape::add_step(const ExplicitStep& step) {
  Step s{step.t(), step.h(), step.t_end(), system_.mode(), jumps_.size(), {}, {}};
  if (segment_ == 0 && steps_.size() >= budget_) keep_checkpoints_only();
  if (segment_ == 0)
    keep_stages(s, step, true);
  else if (steps() % segment_ == 0)
    s.y.assign(step.start(), step.start() + n_);
  // The evaluation at its end is the first one of the next step.
  if (record_ > 0) std::copy_n(records_.end() - static_cast<std::ptrdiff_t>(record_), record_, records_.begin());
  steps_.push_back(std::move(s));
}

void ExplicitTape::keep_checkpoints_only() {
  segment_ = static_cast<long>(std::max<std::size_t>(1, budget_ / 2));
  for (std::size_t k = 0; k < steps_.size(); ++k) {
    Step& s = steps_[k];
    if (static_cast<long>(k) % segment_ == 0) s.y.assign(s.at.get(), s.at.get() + n_);
    s.at.reset();
  }
}

void ExplicitTape::add_jump(const Jump& jump, std::vector<double> y_after) {
  jumps_.push_back({jump, std::move(y_after)});
}

std::size_t ExplicitTape::jumps_end(long k) const {
  return k + 1 < steps() ? steps_[static_cast<std::size_t>(k) + 1].jumps : jumps_.size();
}

ExplicitStages ExplicitTape::bring_back(long k) {
  Step& wanted = steps_[static_cast<std::size_t>(k)];
  if (!wanted.at) {
    if (!repeated_)
      repeated_ = std::make_unique<ExplicitStep>(
          scheme_, n_, false, [this](double t, const double* y, double* f, bool) { system_.rhs(t, y, f); });
    const long first = k / segment_ * segment_;
    std::vector<double> y = steps_[static_cast<std::size_t>(first)].y;
    for (long j = first; j <= k; ++j) {
      Step& s = steps_[static_cast<std::size_t>(j)];
      if (j > first && jumps_end(j - 1) > jumps_begin(j - 1)) y = jumps_[s.jumps - 1].y_after;
      system_.use_mode(s.mode);
      repeated_->repeat(s.t, y.data(), s.h, s.t_end);
      keep_stages(s, *repeated_, false);
      std::copy(repeated_->end(), repeated_->end() + n_, y.begin());
    }
  }
  // Those behind it have served.
  if (k + 1 < steps()) steps_[static_cast<std::size_t>(k) + 1].at.reset();
  system_.use_mode(wanted.mode);
  ExplicitStages stages{wanted.t, wanted.h, wanted.t_end, wanted.at.get(), n_};
  if (segment_ == 0 && record_ > 0) {
    stages.records = wanted.at.get() + stage_entries();
    stages.record = record_;
  }
  return stages;
}

}  // namespace costate
