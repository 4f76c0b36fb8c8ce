#include "events_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/integrator/event_notices.h"

namespace costate::app {

double times_uncertainty(const SolverOptions& solver, const Precision& precision, const AccurateRun* accurate) {
  if (accurate && accurate->times_error) return *accurate->times_error;
  return kTimesOff * precision.relative * (solver.t_end - solver.t_start);
}

std::string events_text(const Simulation& r, double uncertainty) {
  const std::string end = r.end ? fmt::format("  ended at {:.9g} s by {}\n", r.end->t, r.end->name) : "";
  if (r.events.empty()) return end;
  constexpr std::size_t shown = 4;
  constexpr double kSixDigits = 1e-6;
  const auto time = [&](double t) {
    return uncertainty > kSixDigits * std::abs(t) ? known_digits(t, uncertainty) : fmt::format("{:.6g}", t);
  };
  std::string text = fmt::format("  {} event{}: ", r.events.size(), r.events.size() == 1 ? "" : "s");
  for (std::size_t i = 0; i < std::min(shown, r.events.size()); ++i)
    text += fmt::format("{}{} at {} s", i == 0 ? "" : ", ", r.events[i].name, time(r.events[i].t));
  if (r.events.size() > shown) text += ", ...";
  return text + "\n" + end;
}

}  // namespace costate::app
