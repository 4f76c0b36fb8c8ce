#include "costate/analysis/travelled_laws.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/element/law/hidden_jumps.h"

namespace costate {

namespace {

std::vector<double> local_numbers(const Element& e, const std::vector<double>& all) {
  std::vector<double> p;
  for (const int n : e.numbers()) p.push_back(all[static_cast<std::size_t>(n)]);
  return p;
}

/// Whether nobody knows where it might jump.
bool is_searched(const ScalarLaw& law, const double* p) {
  LawPlaces places;
  places.from = -HUGE_VAL;
  places.to = HUGE_VAL;
  add_law_places(law, p, places);
  return places.search;
}

std::string passes(const std::string& law, const char* what, const HiddenJump& j) {
  return fmt::format(
      "The motion passes x = {:.6g}, where the {} '{}' jumps from {:.6g} to {:.6g}, as its formula does not show. What "
      "the instant depends on is in no derivative. Lead over the jump within a width (a law of the kind 'steps', "
      "tanh(u/w) for abs(u)/u); the method 'differences' tells what psi does.",
      j.x, what, law, j.left, j.right);
}

}  // namespace

void TravelledLaws::Range::add(double x) {
  if (!std::isfinite(x)) return;
  from = std::min(from, x);
  to = std::max(to, x);
}

TravelledLaws::TravelledLaws(const Mechanism& mechanism) {
  const std::vector<double> numbers = mechanism.base_numbers();
  for (const auto& force : mechanism.forces()) {
    const auto* owner = dynamic_cast<const MotionLawElement*>(force.get());
    if (!owner) continue;
    const std::vector<double> p = local_numbers(*force, numbers);
    std::vector<MotionLaw> laws;
    owner->add_motion_laws(laws);
    for (const MotionLaw& law : laws)
      if (law.followed() && is_searched(*law.law, p.data() + law.first)) laws_.push_back({force.get(), owner, law});
    const auto* course = dynamic_cast<const CourseElement*>(force.get());
    for (int i = 0; course && i < course->tracks(); ++i) {
      bool searched = false;
      Course told([&](const ScalarLaw& law, const double* own, double, double) {
        searched = searched || is_searched(law, own);
      });
      course->add_track(i, p.data(), told);
      if (searched) tracks_.push_back({force.get(), course, i});
    }
  }
}

void TravelledLaws::look(const StateView& s, const Assembly& assembly) {
  for (Law& of : laws_) try {
      const LocalState local = gathered_.of(*of.force, s, assembly.numbers());
      const GapMotion m = of.owner->deformation(local);
      of.range.add(of.law.of_rate ? m.rate : m.gap - local.p[of.law.origin]);
    } catch (const Error&) {  // nowhere along it
    }
  for (Track& of : tracks_)
    of.range.add(of.owner->track_place(of.index, gathered_.of(*of.force, s, assembly.numbers())).at);
}

std::optional<std::string> TravelledLaws::met(const Assembly& assembly) const {
  for (const Law& of : laws_) {
    const std::vector<double> p = local_numbers(*of.force, assembly.numbers());
    const std::string name = fmt::format("{}.{}", of.force->path(), of.law.key);
    const HiddenJumps hidden(*of.law.law, p.data() + of.law.first, of.range.from, of.range.to);
    for (const JumpOf jump : {JumpOf::value, JumpOf::slope}) {
      if (jump == JumpOf::slope && !of.law.by_slope) continue;
      const auto found = hidden.of(jump);
      if (!found.empty()) return passes(name, jump == JumpOf::value ? "law" : "slope of the law", found[0]);
    }
  }
  std::optional<std::string> met;
  for (const Track& of : tracks_) {
    const std::vector<double> p = local_numbers(*of.force, assembly.numbers());
    Course told([&](const ScalarLaw& law, const double* own, double shift, double rate) {
      const HiddenJumps hidden(law, own, of.range.from, of.range.to, shift, rate);
      for (const JumpOf jump : {JumpOf::value, JumpOf::slope})
        for (const HiddenJump& j : hidden.of(jump))
          if (!met) met = passes(of.force->path(), jump == JumpOf::value ? "law under" : "slope of the law under", j);
    });
    if (of.range.from < of.range.to) of.owner->add_track(of.index, p.data(), told);
    if (met) return met;
  }
  return met;
}

}  // namespace costate
