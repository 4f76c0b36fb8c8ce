#include "costate/analysis/jump_watch.h"

#include <fmt/format.h>

#include <algorithm>

namespace costate {

JumpWatch::JumpWatch(const Mechanism& mechanism, bool fixed_steps) : fixed_steps_(fixed_steps) {
  for (const auto& force : mechanism.forces())
    if (const auto* places = dynamic_cast<const JumpingForce*>(force.get())) forces_.push_back({force.get(), places});
}

void JumpWatch::look(const StateView& s, const Assembly& assembly) {
  for (Jumping& of : forces_) {
    now_.clear();
    of.places->add_jump_places(gathered_.of(*of.force, s, assembly.numbers()), fixed_steps_, now_);
    of.told.resize(now_.size(), 0);
    for (std::size_t i = 0; i < now_.size(); ++i) {
      JumpPlace& place = now_[i];
      const bool first = of.before.size() != now_.size();
      const double before = first ? place.beyond : of.before[i].beyond;
      const bool rises = before <= 0 && place.beyond > 0, falls = before > 0 && place.beyond <= 0;
      const bool passed = (rises && place.direction >= 0) || (falls && place.direction <= 0);
      if (place.of_motion) {
        if ((passed || (first && place.beyond < 0)) && !of.told[i]) {
          of.told[i] = 1;
          told_.push_back(
              fmt::format("From t = {:.6g} s on '{}' {}. {}.", s.t, of.force->path(), place.what, place.advice));
        }
      } else if (passed && !(place.over > 0 && place.beyond < place.over) && !first_) {
        // It falls as the motion goes on: the larger of both sides.
        place.jump = std::max(place.jump, of.before[i].jump);
        if (place.jump > 0) first_ = Jump{s.t, of.force->path(), place};
      }
    }
    of.before = now_;
  }
}

std::optional<std::string> JumpWatch::met() const {
  if (!first_) return {};
  return fmt::format(
      "Near t = {:.6g} s '{}' {}: the force jumps by {:.3g} {}. What the instant depends on is in no derivative. {}; "
      "the "
      "method 'differences' tells what psi does.",
      first_->t, first_->force, first_->place.what, first_->place.jump, first_->place.unit, first_->place.advice);
}

}  // namespace costate
