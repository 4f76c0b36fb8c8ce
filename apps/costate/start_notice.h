// What is remarkable about a start, said also where the run from it fails: it may be the cause.
#pragma once

#include <utility>

#include "command.h"

namespace costate::app {

/// The remarks about the run's start as notices; none where there is no start.
void notice_start(const Setup& setup);

/// Setup::located with the remarks about the start where the run fails.
template <class F>
auto started(const Setup& setup, F&& run) {
  try {
    return setup.located(std::forward<F>(run));
  } catch (const SolverError&) {
    notice_start(setup);
    throw;
  }
}

}  // namespace costate::app
