// A run of CVODES in pieces that end at given times, each smooth: between them its caller may change the unknowns. Of
// jumps and events of the system itself segmented_run.h takes care.
#pragma once

#include <cstddef>
#include <functional>
#include <memory>
#include <vector>

#include "costate/integrator/cvode_session.h"

namespace costate {

class PiecewiseRun {
 public:
  /// `ends`: of all pieces but the last, in order; the last ends with the run.
  PiecewiseRun(OdeSystem& system, SolverOptions options, Monitor monitor, std::shared_ptr<const StepPlan> plan,
               std::vector<double> ends);

  /// The unknowns at the end. `motion` (or null) is what it stores; `cross(k, y)` carries them over from piece k to the
  /// next, and gives the time at which that begins.
  std::vector<double> run(Trajectory* motion, const std::function<double(std::size_t k, double* y)>& cross);
  const Counters& counters() const { return counters_; }

 private:
  std::unique_ptr<CvodeSession> begun(const SegmentStart& start);
  void count(CvodeSession& session);

  OdeSystem& system_;
  SolverOptions options_;
  Monitor monitor_;
  std::shared_ptr<const StepPlan> plan_;
  std::vector<double> ends_;
  Counters counters_;
};

}  // namespace costate
