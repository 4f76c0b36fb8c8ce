// Rows that come and go with the states of forces (element/switched_rows.h), and those along which contacts slide.
#include "costate/assembly/assembly.h"

namespace costate {

void Assembly::switch_rows(const double* z) {
  bool changed = false;
  for (const Switch& at : switches_) {
    const bool there = z[at.state] > 0.5;
    const double along = there && at.sliding_state >= 0 ? z[at.sliding_state] : 0;
    const int slides = along > 0.5 ? 1 : along < -0.5 ? -1 : 0;
    Slots& slots = constraints_[at.constraint];
    if (slots.there == there && slots.slides == slides) continue;
    changed = true;
    slots.there = there;
    slots.slides = slides;
    for (int r = 0; r < mechanism_->constraints()[at.constraint]->rows(); ++r)
      row_there_[static_cast<std::size_t>(slots.row_offset + r)] = there && !(r >= 1 && slides != 0);
  }
  if (!changed) return;
  dynamics_at_ = jacobian_at_ = partials_at_ = 0;  // of other rows
  sliding_.clear();
  for (const Switch& at : switches_) {
    const Slots& slots = constraints_[at.constraint];
    if (slots.slides == 0) continue;
    for (int r = 1; r < mechanism_->constraints()[at.constraint]->rows(); ++r)
      sliding_.push_back({slots.row_offset, slots.row_offset + r, at.friction, static_cast<double>(slots.slides)});
  }
}

void Assembly::part_sliding_rows() {
  if (sliding_.empty()) return;
  reaction_q_ = phi_q;
  for (const SlidingRow& r : sliding_) {
    const auto row = static_cast<std::size_t>(r.along);
    phi[row] = phi_t[row] = bias[row] = 0;
    for (std::size_t k = 0; k < phi_q.size(); ++k)
      if (jacobian_.row[k] == r.along) phi_q[k] = 0;
  }
}

}  // namespace costate
