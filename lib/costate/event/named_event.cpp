#include "costate/event/named_event.h"

#include <fmt/format.h>

#include <limits>

#include "costate/base/error.h"
#include "costate/element/unilateral_force.h"
#include "costate/mechanism/coordinate_parts.h"
#include "costate/objective/local_output.h"

namespace costate {

namespace {

std::vector<NamedEvent> events_of(const Mechanism& m) {
  std::vector<NamedEvent> r;
  for (std::size_t f = 0; f < m.forces().size(); ++f) {
    const Force* force = m.forces()[f].get();
    const auto* guarded = dynamic_cast<const GuardedForce*>(force);
    if (!guarded) continue;
    for (int k = 0; k < guarded->guard_count(); ++k)
      r.push_back({force->path() + " " + guarded->guard_name(k), force, guarded, k, m.state_offsets()[f],
                   guarded->guard_direction(k), static_cast<int>(r.size())});
  }
  return r;
}

class GuardOutput final : public LocalOutput {
 public:
  explicit GuardOutput(const NamedEvent& e)
      : LocalOutput(e.name, "", e.force->coordinates(), e.force->numbers(), 0, 0, e.first_state, e.force->states()),
        event_(e) {}

 protected:
  PathDual evaluate(const MeasureArguments& x) const override {
    // The gap of a rigid contact that is closed is zero but for rounding.
    if (const auto* contact = dynamic_cast<const UnilateralForce*>(event_.guarded);
        contact && contact->guard_kind(event_.k) == UnilateralForce::Guard::touch && contact->closed_state() >= 0 &&
        x.z[contact->closed_state()].v.c0 > 0.5)
      return PathDual(std::numeric_limits<double>::quiet_NaN());
    return event_.guarded->guard(event_.k, x);
  }

 private:
  NamedEvent event_;
};

class OutputBehind final : public LocalOutput {
 public:
  OutputBehind(const NamedEvent& e, int i)
      : LocalOutput("z." + e.force->path() + "." + e.force->state_name(i), e.force->state_unit(i),
                    e.force->coordinates(), e.force->numbers(), 0, 0, e.first_state, e.force->states()),
        event_(e),
        i_(static_cast<std::size_t>(i)) {}

 protected:
  PathDual evaluate(const MeasureArguments& x) const override {
    std::vector<PathDual> behind(static_cast<std::size_t>(event_.force->states()));
    event_.guarded->transition(event_.k, x, behind.data());
    return behind[i_];
  }

 private:
  NamedEvent event_;
  std::size_t i_;
};

}  // namespace

std::vector<std::string> event_names(const Mechanism& mechanism) {
  std::vector<std::string> r;
  for (const auto& e : events_of(mechanism)) r.push_back(e.name);
  return r;
}

NamedEvent find_event(const Mechanism& mechanism, const std::string& name) {
  std::string plain = name;
  if (const std::size_t colon = plain.find(": "); colon != std::string::npos) plain.erase(colon, 1);
  for (const auto& e : events_of(mechanism))
    if (e.name == plain) return e;
  const std::vector<std::string> known = event_names(mechanism);
  throw ModelError(
      "", known.empty() ? fmt::format("There is no event '{}': nothing in this scene has events (contacts that touch "
                                      "and let go, of laws that latch something there).",
                                      name)
                        : fmt::format("There is no event '{}'.{}", name, suggestion(plain, known)));
}

std::string kink_of_coincident(const Mechanism& mechanism, const std::string& first, const std::string& second) {
  const NamedEvent a = find_event(mechanism, first), b = find_event(mechanism, second);
  if (a.force == b.force) return {};
  const std::vector<int> parts = coordinate_parts(mechanism);
  const auto part_of = [&](const NamedEvent& x) {
    return parts[static_cast<std::size_t>(x.force->coordinates().front())];
  };
  if (part_of(a) != part_of(b)) return {};
  const auto decides = [](const NamedEvent& x, const NamedEvent& y) {
    return x.guarded->force_jumps(x.k) && y.guarded->latches_speed(y.k);
  };
  if (!decides(a, b) && !decides(b, a)) return {};
  return fmt::format(
      "'{}' and '{}' happen in one instant, in which a force or a speed jumps and a speed counts: psi has another "
      "slope on "
      "either side, as one or the other comes first, and derivatives are those of one side",
      a.name, b.name);
}

std::unique_ptr<Output> make_guard_output(const NamedEvent& event) { return std::make_unique<GuardOutput>(event); }
std::unique_ptr<Output> make_output_behind(const NamedEvent& event, int i) {
  return std::make_unique<OutputBehind>(event, i);
}

}  // namespace costate
