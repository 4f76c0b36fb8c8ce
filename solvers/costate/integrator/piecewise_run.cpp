#include "costate/integrator/piecewise_run.h"

#include <utility>

#include "costate/integrator/session_counters.h"

namespace costate {

PiecewiseRun::PiecewiseRun(OdeSystem& system, SolverOptions options, Monitor monitor,
                           std::shared_ptr<const StepPlan> plan, std::vector<double> ends)
    : system_(system),
      options_(std::move(options)),
      monitor_(std::move(monitor)),
      plan_(std::move(plan)),
      ends_(std::move(ends)) {}

std::unique_ptr<CvodeSession> PiecewiseRun::begun(const SegmentStart& start) {
  auto session = std::make_unique<CvodeSession>(system_, options_, monitor_, start);
  session->follow(plan_);
  return session;
}

void PiecewiseRun::count(CvodeSession& session) {
  session.read_forward_counters();
  add_session(counters_, session.counters());
}

std::vector<double> PiecewiseRun::run(Trajectory* motion,
                                      const std::function<double(std::size_t k, double* y)>& cross) {
  const double t_end = options_.t_end;
  SegmentStart start;
  for (std::size_t k = 0; k <= ends_.size(); ++k) {
    options_.t_end = k < ends_.size() ? ends_[k] : t_end;
    std::unique_ptr<CvodeSession> session;
    if (k == 0) {
      session = std::make_unique<CvodeSession>(system_, options_, monitor_, StartDerivative::none);
      session->follow(plan_);
    } else {
      session = begun(start);
    }
    while (!session->advance_segment(options_.t_end, motion)) {
      Jump jump;
      start = {};
      session->jump(jump, start);
      count(*session);
      session = begun(start);
    }
    count(*session);
    start = {};
    start.t = options_.t_end;
    start.restart = true;
    start.steps = counters_.steps;
    start.y.assign(session->y(), session->y() + system_.size());
    if (k < ends_.size()) start.t = cross(k, start.y.data());
  }
  options_.t_end = t_end;
  return start.y;
}

}  // namespace costate
