#include "costate/integrator/segmented_run.h"

#include <fmt/format.h>

#include <algorithm>

namespace costate {

namespace {

// A mechanism that changes its segment this often without getting on is stuck.
constexpr std::size_t kMostJumpsInARow = 1000;

/// Those of another session of the run.
void add(Counters& sum, const Counters& c) {
  // The system's own count on over all segments.
  const long factorizations = std::max(sum.factorizations, c.factorizations),
             position_iterations = std::max(sum.position_iterations, c.position_iterations);
  sum += c;
  sum.factorizations = factorizations;
  sum.position_iterations = position_iterations;
  sum.simulations = 1;
}

}  // namespace

template <class Session, class SystemType>
void SegmentedRun<Session, SystemType>::advance_segments(double t, Trajectory* trajectory) {
  std::size_t in_a_row = 0;
  double last = t_start_;
  while (!session().advance_segment(t, trajectory, after_step_)) {
    Jump jump;
    SegmentStart start;
    session().jump(jump, start);
    in_a_row = jump.t > last ? 0 : in_a_row + 1;
    last = jump.t;
    if (in_a_row > kMostJumpsInARow)
      throw SolverError(fmt::format("The run does not get beyond t = {:.9g} s: one segment follows another.", jump.t));
    if (jump.event >= 0) events_.push_back({jump.t, system_.event_name(jump.event)});
    links_.push_back({std::move(jump), start.restart});
    if (!adjoint_) {
      session().read_forward_counters();
      add(past_, session().counters());
      sessions_.clear();
    }
    sessions_.push_back(make_session_(start));
    session().follow(plan_of_steps_);
    if (cost_) session().enable_cost();
    if (sensitivities_) session().enable_sensitivities();
    if (adjoint_) session().enable_adjoint(plan_);
  }
}

template <class Session, class SystemType>
std::vector<double> SegmentedRun<Session, SystemType>::solve_adjoint() {
  std::vector<double> gradient(static_cast<std::size_t>(system_.parameter_count()), 0);
  AdjointScale scale;
  for (std::size_t k = 0; k < sessions_.size(); ++k)
    scale.add_segment(sessions_[k]->adjoint_scale(),
                      (k < links_.size() ? links_[k].jump.t : t_) - (k > 0 ? links_[k - 1].jump.t : t_start_));
  AdjointState mu = session().end_adjoint(gradient);
  invariant_.end(system_, t_start_, t_, session().y(), mu.mu.data());
  for (std::size_t k = sessions_.size(); k-- > 0;) {
    sessions_[k]->solve_backward(mu, scale.size(), gradient);
    if (k > 0 && !links_[k - 1].restart) Session::transfer_adjoint(system_, links_[k - 1].jump, mu, gradient);
  }
  sessions_.front()->add_start_gradient(mu, gradient);
  invariant_.start(system_, t_start_, start_y_.data(), mu.mu.data());
  return gradient;
}

template <class Session, class SystemType>
Counters SegmentedRun<Session, SystemType>::counters() const {
  Counters sum = past_;
  for (const auto& s : sessions_) add(sum, s->counters());
  sum.jumps = std::count_if(links_.begin(), links_.end(), [](const Link& l) { return !l.restart; });
  return sum;
}

template class SegmentedRun<IdaSession, DaeSystem>;
template class SegmentedRun<CvodeSession, OdeSystem>;

}  // namespace costate
