#include "guide.h"

#include <algorithm>

namespace costate::app {

const std::vector<GuideEntry>& failure_guide() {
  static const std::vector<GuideEntry> guide = {
      {"no-cycle",
       {"No cycle was found", "A cycle is not determined", "not met where the search begins",
        "comes back to its coordinates", "eigenvalue problem of the multipliers", "another number of multipliers",
        "it has other multipliers", "at the section itself", "The cycle does not return",
        "so that the place is looked for"}},
      {"start-cannot-be-assembled",
       {"The start cannot be reached", "do not determine the configuration", "do not determine the motion",
        "independent constraint rows leave", "points half a turn away"}},
      {"no-equilibrium", {"No equilibrium "}},
      {"something-has-no-mass",
       {"has neither inertia nor", "moves no mass", "has no mass", "is lost in rounding beside the constraints"}},
      {"singular-position-passed", {"The mechanism passes a singular position at"}},
      {"step-leaves-its-branch", {"has left its branch"}},
      {"end-never-comes", {"The run ends by "}},
      {"search-leaves-the-scene", {"keep the search where there is a scene"}},
      {"event-is-grazed",
       {"is grazed", "has happened already", "rounds that 'settle' waits", "had not been seen to come",
        "This scene has events", "'ends_when'", "in the instant in which the run ends", "in the instant of an event"}},
      {"rigid-contact-goes-no-further",
       {"than determine who bears how much of their weight", "its bounces die out", "strike at the same time",
        "stop sliding at the same time", "would create an energy", "has several solutions", "has no solution",
        "no way to stick, to slide or to open", "grows beyond all bounds", "contacts change in one instant",
        "against the direction in which it began", "that it has just left",
        "of a sphere that rolls binds velocities alone", "do not share them out",
        "other rows that depend on each other: Maggi's", "derivative there.", "more than determine who bears",
        "slip in space"}},
      {"not-a-number",
       {"not a finite number", "is not finite", "are not finite", "the motion cannot be computed this way",
        "The derivative of psi with respect to '"}},
      {"newton-fails", {"CONV_FAIL", "Newton's iteration of step", "No step was found"}},
      {"step-gets-too-small",
       {"no longer gets on", "hardly gets on", "reached its limit of steps", "more than the limit of",
        "does not get beyond", "could not continue", "which is their limit"}},
      {"constraints-do-not-hold", {"The constraints no longer hold", "The constraints drift"}},
      {"law-with-a-kink-or-jump",
       {"has a kink", "' jumps from ", "The law of '", "opens a ", "at which the law of", "derivatives of forces jump",
        "pass through each other", "is in no derivative", "coincide, and parameter"}},
      {"fixed-step-passes-over-something",
       {"passes over what begins", "passes over a touch", "but no length of it ends there"}},
      {"reactions-are-open", {"does not determine the multipliers", "reactions that the motion does not determine"}},
      {"singular-matrix",
       {"depend on the others", " is singular", " are singular", "not determined at", " s are not determined."}},
      {"few-digits", {"no digit of psi", "known to few digits", "tight enough for a reference"}},
      {"adjoint-grows", {"grows without bound", "solution is too rough"}},
      {"methods-disagree", {"disagree"}},
      {"too-little-memory", {"could not be repeated from a checkpoint", "not enough memory"}},
      {"eigenvalues-do-not-converge", {"Modes: the eigenvalues"}},
      {"solver-cannot-be-set-up", {" failed [", "could not be created", "could not create", "could not analyse"}},
  };
  return guide;
}

std::string guide_to(const std::string& message) {
  for (const GuideEntry& e : failure_guide())
    if (std::any_of(e.phrases.begin(), e.phrases.end(),
                    [&](const auto& phrase) { return message.find(phrase) != std::string::npos; }))
      return "apps/README.md#" + e.anchor;
  return {};
}

std::string with_guide(const std::string& message) {
  const std::string guide = guide_to(message);
  return guide.empty() ? message : message + " See " + guide + ".";
}

}  // namespace costate::app
