// The events of a run as text, their times to the digits that are known.
#pragma once

#include <string>

#include "costate/tradeoff/accurate_run.h"
#include "digits.h"

namespace costate::app {

/// What the times of events may be off by [s]: by the run's own tolerance, or as two runs to an accuracy have it (null:
/// there are none).
double times_uncertainty(const SolverOptions& solver, const Precision& precision, const AccurateRun* accurate);

/// "  2 events: contact.left: touch at 0.317647 s, ..." and what ended the run.
std::string events_text(const Simulation& r, double uncertainty);

}  // namespace costate::app
