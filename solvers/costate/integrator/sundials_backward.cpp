// The way back of a session: the adjoint problem over its segment.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/integrator/attempts_back.h"
#include "costate/integrator/sundials_session.h"

namespace costate {

namespace {
constexpr double kAtOnce = 1e-13;  // of the time
}

template <class Api>
void SundialsSession<Api>::solve_backward(AdjointState& mu, const AdjointSize& expected, std::vector<double>& gradient,
                                          const std::vector<AdjointStop>& stops) {
  // Not two events at once, with nothing but rounding between them, over which no integrator can be started.
  const double instant = kAtOnce * std::max(std::abs(t_), std::abs(options_.t_start)),
               start = options_.t_start + instant;
  auto stop = stops.begin();
  for (; stop != stops.end() && stop->t >= t_ - instant; ++stop) {
    stop->cross(mu, gradient);
    if (stop->to < stop->t) end_at(*stop);
  }
  if (t_ > start) {
    const int np = system_.parameter_count(), size = static_cast<int>(names_back().size());
    back_ = std::make_unique<Backward>();
    Backward& b = *back_;
    b.units = AdjointUnits(system_);
    for (Vector* v : {&b.y, &b.yp, &b.atol}) *v = Vector(size, context_);
    b.q = Vector(np, context_);
    b.atol_q = Vector(np, context_);
    steps_back_ = 0;
    std::copy(mu.mu.begin(), mu.mu.end(), b.y.data());
    std::copy(mu.mup.begin(), mu.mup.end(), b.yp.data());
    set_tolerances_back(mu, expected, y());
    kinks_back_ = std::any_of(stop, stops.end(), [](const AdjointStop& s) { return !s.y; });
    open_backward();
    const auto first_stop = stop;
    AttemptsBack attempts(system_.parameters(), options_, np > 0 ? attempts_back() : 1, {mu, gradient});
    do {
      AttemptsBack::Way way = attempts.begin();
      begin_attempt_back(attempts.number());
      if (attempts.number() > 0) begin_again_back(way.mu, expected);
      try {
        double at = t_;
        for (stop = first_stop; stop != stops.end() && stop->t > start;) {
          integrate_to(*stop, way.mu);
          const AdjointStop* last = nullptr;
          do {
            last = &*stop;
            last->cross(way.mu, way.gradient);
            at = last->to;
          } while (++stop != stops.end() && stop->t >= at - instant);
          if (at > start) restart_back(*last, way.mu, expected);
        }
        if (at > start) integrate_back(options_.t_start, way.mu);
      } catch (const SolverError&) {
        attempts.failed();
        continue;
      }
      for (int j = 0; j < np; ++j) way.gradient[static_cast<std::size_t>(j)] += b.q.data()[j];
      const Counters before = counters_;
      count_back();
      attempts.add(std::move(way), before, counters_);
    } while (attempts.again());
    mu = attempts.best().mu;
    gradient = attempts.best().gradient;
    counters_.backward_jacobians = newton_setups_back_;
    counters_.factorizations = system_.factorizations();
    counters_.position_iterations = system_.position_iterations();
  }
  for (; stop != stops.end(); ++stop) stop->cross(mu, gradient);
}

template <class Api>
void SundialsSession<Api>::end_at(const AdjointStop& stop) {
  t_ = stop.to;
  std::copy(stop.y, stop.y + system_.size(), y_.data());
  if constexpr (Api::implicit) std::copy(stop.yp, stop.yp + system_.size(), yp_.data());
}

template <class Api>
void SundialsSession<Api>::open_backward() {
  Backward& b = *back_;
  const int np = system_.parameter_count();
  create_backward();
  b.memory = Api::backward_memory(memory_, b.which);
  check(Api::set_user_data_back(memory_, b.which, self()), "the user's data of the adjoint");
  check(Api::set_tolerances_back(memory_, b.which, options_.rtol, b.atol), "the adjoint's tolerances");
  check(Api::set_max_steps_back(memory_, b.which, options_.max_steps), "the adjoint's limit of steps");
  check(Api::set_max_error_test_failures(b.memory, kMostFailedErrorTests), "the adjoint's limit of failed error tests");
  if (options_.max_step_s > 0)
    check(Api::set_max_step_back(memory_, b.which, options_.max_step_s), "the adjoint's largest step");
  b.newton = std::make_unique<NewtonOperator>(context_, guard_, [this](double* x) { solve_newton_back(x); });
  check(Api::set_linear_solver_back(memory_, b.which, b.newton->solver(), b.newton->matrix()),
        "the adjoint's Newton operator");
  set_backward_matrix();
  if (smooth_) choose_smooth_steps(back_->memory);
  if (np > 0) {
    check(Api::init_quadrature_back(memory_, b.which, backward_quadrature_function(), b.q),
          "the gradient's quadrature");
    check(Api::set_quadrature_tolerances_back(memory_, b.which, options_.rtol, b.atol_q), "the gradient's tolerances");
    check(Api::set_quadrature_error_control_back(memory_, b.which, SUNTRUE), "the gradient's error control");
  }
  read_checkpoints();
  Api::capture_messages(b.memory, message_);
}

template <class Api>
void SundialsSession<Api>::begin_again_back(const AdjointState& mu, const AdjointSize& expected) {
  Backward& b = *back_;
  std::fill(b.y.data(), b.y.data() + b.y.size(), 0.0);
  std::fill(b.q.data(), b.q.data() + b.q.size(), 0.0);
  restart_back({t_, t_, y(), yp(), {}}, mu, expected);
}

template <class Api>
void SundialsSession<Api>::set_tolerances_back(const AdjointState& mu, const AdjointSize& expected, const double* y) {
  Backward& b = *back_;
  const double scale = set_adjoint_tolerances(system_.unknowns(), b.units, mu.mu, expected, options_.rtol,
                                              Api::implicit ? kUnweighted : options_.rtol, b.atol.data());
  set_gradient_tolerances(system_, b.units, y, scale, expected.cost, options_.rtol, b.atol_q.data());
}

template <class Api>
void SundialsSession<Api>::integrate_to(const AdjointStop& stop, AdjointState& mu) {
  constexpr double none = -std::numeric_limits<double>::infinity();
  kink_back_ = stop.y ? none : stop.t;
  integrate_back(stop.t, mu);
  kink_back_ = none;
}

template <class Api>
void SundialsSession<Api>::integrate_back(double to, AdjointState& mu) {
  Backward& b = *back_;
  const int flag = Api::solve_back(memory_, to);
  if (flag < 0) fail(true, flag, "could not continue the backward (adjoint) run");
  double reached = 0;
  check(Api::get_back(memory_, b.which, &reached, b.y, b.yp), "the adjoint");
  if (system_.parameter_count() > 0)
    check(Api::quadrature_dky(b.memory, within_last_step(b.memory, reached), 0, b.q), "the gradient");
  const int n = system_.size();
  std::copy(b.y.data(), b.y.data() + n, mu.mu.begin());
  if (Api::implicit) std::copy(b.yp.data(), b.yp.data() + n, mu.mup.begin());
}

// The adjoint jumps: its integration begins anew, the gradient's integral goes on.
template <class Api>
void SundialsSession<Api>::restart_back(AdjointStop stop, const AdjointState& mu, const AdjointSize& expected) {
  Backward& b = *back_;
  Vector y(stop.y ? 0 : y_.size(), context_), yp(stop.y ? 0 : yp_.size(), context_);
  if (!stop.y) {
    check(Api::state_back(memory_, stop.to, y, yp), "the motion on the way back");
    stop.y = y.data();
    stop.yp = yp.data();
  }
  count_back();
  pace_back_ = {};
  std::copy(mu.mu.begin(), mu.mu.end(), b.y.data());
  std::copy(mu.mup.begin(), mu.mup.end(), b.yp.data());
  // As fine as for what the adjoint has been until here, at least as coarse as that.
  std::vector<double> before(b.atol.data(), b.atol.data() + system_.size()),
      before_q(b.atol_q.data(), b.atol_q.data() + system_.parameter_count());
  set_tolerances_back(mu, expected, stop.y);
  for (std::size_t i = 0; i < before.size(); ++i) b.atol.data()[i] = std::max(b.atol.data()[i], before[i]);
  for (std::size_t j = 0; j < before_q.size(); ++j) b.atol_q.data()[j] = std::max(b.atol_q.data()[j], before_q[j]);
  complete_backward(stop);
  check(Api::restart_back(memory_, b.which, stop.to, b.y, b.yp), "the adjoint behind a sample");
  check(Api::set_tolerances_back(memory_, b.which, options_.rtol, b.atol), "the adjoint's tolerances");
  if (system_.parameter_count() > 0) {
    check(Api::restart_quadrature_back(memory_, b.which, b.q), "the gradient's quadrature");
    check(Api::set_quadrature_tolerances_back(memory_, b.which, options_.rtol, b.atol_q), "the gradient's tolerances");
  }
  bound_first_step_back(stop.t, stop.y);
}

// SUNDIALS counts from a restart on.
template <class Api>
void SundialsSession<Api>::count_back() {
  const auto add = [&](auto read, long& count) {
    long more = 0;
    read(back_->memory, &more);
    count += more;
  };
  Counters& c = counters_;
  add(Api::steps, c.backward_steps);
  add(Api::evaluations, c.backward_residuals);
  add(Api::newton_iterations, c.backward_newton_iterations);
  add(Api::error_test_failures, c.backward_error_test_failures);
  add(Api::convergence_failures, c.backward_convergence_failures);
  steps_back_ += steps(back_->memory);
}

// An adjoint may be livelier than its motion, which is at rest perhaps, and then takes more steps, whose error test
// seldom fails. One that is driven by rounding has errors that no step makes smaller as it should.
template <class Api>
void SundialsSession<Api>::watch_noise_back(long taken) {
  constexpr long kTimes = 100, kLeast = 100, kFails = 10;
  if (taken < kTimes * std::max(start_.steps + counters_.steps, kLeast)) return;
  long failures = 0;
  Api::error_test_failures(back_->memory, &failures);
  if (failures * kFails < steps(back_->memory)) return;
  fail(
      true, Api::too_much_work,
      fmt::format("was ended: the way back (adjoint) has taken {} steps where the motion took {}, and their error test "
                  "fails again and again ({} times), as where the adjoint is driven by rounding (a cost that is "
                  "stationary along a motion at rest). A forward method or a discrete one has no such steps;",
                  taken, start_.steps + counters_.steps, failures));
}

template <class Api>
void SundialsSession<Api>::read_checkpoints() {
  checkpoint_times_.clear();
  if (!plan_back_ && !kinks_back_) return;
  std::vector<typename Api::CheckpointRecord> records(static_cast<std::size_t>(counters_.checkpoints) + 1);
  check(Api::checkpoints(memory_, records.data()), "the checkpoints");
  for (const auto& r : records) checkpoint_times_.push_back(r.t0);
  std::sort(checkpoint_times_.begin(), checkpoint_times_.end());
  bound_first_step_back(t_, y());
}

template <class Api>
void SundialsSession<Api>::bound_first_step_back(double t, const double* y) {
  if (!Api::implicit || !plan_back_) return;
  const double first = t - plan_back_->limit(system_, t, y, true);
  if (std::isfinite(first) && !(options_.max_step_s > 0 && options_.max_step_s < first))
    check(Api::set_max_step_back(memory_, back_->which, first), "the adjoint's first step's bound");
}

namespace {
/// Where the next step from t ends at the latest. Where far shorter ones follow it comes to their place by steps that
/// shrink: by formulas of many steps the first of them would have hardly an estimated error (segment.h).
double planned_back(const StepPlan& plan, System& system, double t, const double* y) {
  constexpr double kShrinks = 3;
  const double planned = plan.limit(system, t, y, true), way = t - planned;
  if (!std::isfinite(planned) || !(way > 0)) return planned;
  const double next = planned - plan.limit(system, planned, y, true);
  return next > 0 && way > kShrinks * next ? planned + way / kShrinks : planned;
}
}  // namespace

template <class Api>
void SundialsSession<Api>::look_back(double t, const double* y) {
  if (!plan_back_ && !kinks_back_) return;
  // At a checkpoint, but for rounding, it has to stop there.
  const double near = 1e-13 * (std::abs(t) + std::abs(t_ - options_.t_start));
  const auto above = std::upper_bound(checkpoint_times_.begin(), checkpoint_times_.end(), t + near);
  // Nor beyond a kink.
  const double start = above == checkpoint_times_.begin() ? options_.t_start : *(above - 1),
               floor = std::max(start, kink_back_),
               planned = plan_back_ ? planned_back(*plan_back_, system_, t, y) : floor,
               end = floor >= t - near ? floor : std::max(floor, planned);
  if (Api::implicit) Api::set_max_step(back_->memory, std::max(0.0, options_.max_step_s));
  Api::set_stop_time(back_->memory, end);
}

// What other files call, and what is too long to be inlined into it: the class as a whole is instantiated in another
// one.
template void SundialsSession<IdaApi>::solve_backward(AdjointState&, const AdjointSize&, std::vector<double>&,
                                                      const std::vector<AdjointStop>&);
template void SundialsSession<IdaApi>::end_at(const AdjointStop&);
template void SundialsSession<IdaApi>::open_backward();
template void SundialsSession<IdaApi>::begin_again_back(const AdjointState&, const AdjointSize&);
template void SundialsSession<IdaApi>::set_tolerances_back(const AdjointState&, const AdjointSize&, const double*);
template void SundialsSession<IdaApi>::integrate_to(const AdjointStop&, AdjointState&);
template void SundialsSession<IdaApi>::integrate_back(double, AdjointState&);
template void SundialsSession<IdaApi>::restart_back(AdjointStop, const AdjointState&, const AdjointSize&);
template void SundialsSession<IdaApi>::count_back();
template void SundialsSession<IdaApi>::watch_noise_back(long);
template void SundialsSession<IdaApi>::read_checkpoints();
template void SundialsSession<IdaApi>::bound_first_step_back(double, const double*);
template void SundialsSession<IdaApi>::look_back(double, const double*);
template void SundialsSession<CvodeApi>::solve_backward(AdjointState&, const AdjointSize&, std::vector<double>&,
                                                        const std::vector<AdjointStop>&);
template void SundialsSession<CvodeApi>::end_at(const AdjointStop&);
template void SundialsSession<CvodeApi>::open_backward();
template void SundialsSession<CvodeApi>::begin_again_back(const AdjointState&, const AdjointSize&);
template void SundialsSession<CvodeApi>::set_tolerances_back(const AdjointState&, const AdjointSize&, const double*);
template void SundialsSession<CvodeApi>::integrate_to(const AdjointStop&, AdjointState&);
template void SundialsSession<CvodeApi>::integrate_back(double, AdjointState&);
template void SundialsSession<CvodeApi>::restart_back(AdjointStop, const AdjointState&, const AdjointSize&);
template void SundialsSession<CvodeApi>::count_back();
template void SundialsSession<CvodeApi>::watch_noise_back(long);
template void SundialsSession<CvodeApi>::read_checkpoints();
template void SundialsSession<CvodeApi>::bound_first_step_back(double, const double*);
template void SundialsSession<CvodeApi>::look_back(double, const double*);

}  // namespace costate
