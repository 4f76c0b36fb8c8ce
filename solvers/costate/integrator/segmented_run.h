// A run over a trajectory of one or more smooth segments (Jump in formulation/system.h): one session a segment, the state
// and its sensitivities carried across the jumps, the adjoint carried back. For systems without jumps it is its only
// session and nothing else. Outside it looks like a session.
#pragma once

#include <memory>

#include "costate/integrator/cvode_session.h"
#include "costate/integrator/ida_session.h"

namespace costate {

template <class Session, class SystemType>
class SegmentedRun {
 public:
  /// `more`: what the session's constructors take behind the start.
  template <class... More>
  SegmentedRun(SystemType& system, const SolverOptions& options, const Monitor& monitor, bool with_start_derivative,
               More... more)
      : system_(system), segmented_(system.may_jump()) {
    sessions_.push_back(std::make_unique<Session>(system, options, monitor, with_start_derivative, more...));
    t_start_ = options.t_start;
    make_session_ = [&system, options, monitor, more...](const SegmentStart& start) {
      return std::make_unique<Session>(system, options, monitor, start, more...);
    };
  }

  void enable_cost() {
    cost_ = true;
    session().enable_cost();
  }
  void enable_sensitivities() {
    sensitivities_ = true;
    session().enable_sensitivities();
  }
  /// Once the costs are enabled; the plan is that of each segment.
  void enable_adjoint(const CheckpointPlan& plan) {
    adjoint_ = true;
    plan_ = plan;
    session().enable_adjoint(plan);
  }

  void advance(double t) { segmented_ ? advance_segments(t) : session().advance(t); }
  void advance_with_checkpoints(double t) {
    segmented_ ? advance_segments(t) : session().advance_with_checkpoints(t);
    t_ = t;
  }

  /// The same, and stores the motion (q, v, z).
  void advance_recording(double t, Trajectory& trajectory) { advance_segments(t, &trajectory); }

  const double* y() { return session().y(); }
  double cost() { return session().cost(); }
  std::vector<double> sensitivity_gradient() { return session().sensitivity_gradient(); }

  /// Forward counters; to be called before solve_adjoint().
  void read_forward_counters() {
    for (auto& s : sessions_)
      if (s) s->read_forward_counters();
  }
  std::vector<double> solve_adjoint();
  Counters counters() const;

 private:
  Session& session() { return *sessions_.back(); }
  void advance_segments(double t, Trajectory* trajectory = nullptr);

  SystemType& system_;
  bool segmented_, cost_ = false, sensitivities_ = false, adjoint_ = false;
  double t_start_ = 0, t_ = 0;
  CheckpointPlan plan_;
  std::function<std::unique_ptr<Session>(const SegmentStart&)> make_session_;
  std::vector<std::unique_ptr<Session>> sessions_;  // all for an adjoint, else the last
  std::vector<Jump> jumps_;
  Counters past_;  // of sessions that are gone
};

using IdaRun = SegmentedRun<IdaSession, DaeSystem>;
using CvodeRun = SegmentedRun<CvodeSession, OdeSystem>;

extern template class SegmentedRun<IdaSession, DaeSystem>;
extern template class SegmentedRun<CvodeSession, OdeSystem>;

}  // namespace costate
