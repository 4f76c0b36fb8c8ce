// The way back of a session: the adjoint problem over its segment.
#include <cmath>

#include "costate/integrator/sundials_session.h"

namespace costate {

template <class Api>
void SundialsSession<Api>::solve_backward(AdjointState& mu, const AdjointSize& expected,
                                          std::vector<double>& gradient) {
  if (t_ <= options_.t_start) return;  // two events at once: nothing between them
  const int n = system_.size(), np = system_.parameter_count(), size = static_cast<int>(names_back().size());
  back_ = std::make_unique<Backward>();
  Backward& b = *back_;
  for (Vector* v : {&b.y, &b.yp, &b.atol}) *v = Vector(size, context_);
  b.q = Vector(np, context_);
  b.atol_q = Vector(np, context_);
  std::copy(mu.mu.begin(), mu.mu.end(), b.y.data());
  std::copy(mu.mup.begin(), mu.mup.end(), b.yp.data());
  const double scale = set_adjoint_tolerances(system_.unknowns(), mu.mu, expected, options_.rtol,
                                              Api::implicit ? kUnweighted : options_.rtol, b.atol.data());
  set_gradient_tolerances(system_, y(), scale, options_.rtol, b.atol_q.data());

  create_backward();
  b.memory = Api::backward_memory(memory_, b.which);
  check(Api::set_user_data_back(memory_, b.which, self()), "the user's data of the adjoint");
  check(Api::set_tolerances_back(memory_, b.which, options_.rtol, b.atol), "the adjoint's tolerances");
  check(Api::set_max_steps_back(memory_, b.which, options_.max_steps), "the adjoint's limit of steps");
  if (options_.max_step_s > 0)
    check(Api::set_max_step_back(memory_, b.which, options_.max_step_s), "the adjoint's largest step");
  b.newton = std::make_unique<NewtonOperator>(context_, guard_, [this](double* x) { solve_newton_back(x); });
  check(Api::set_linear_solver_back(memory_, b.which, b.newton->solver(), b.newton->matrix()),
        "the adjoint's Newton operator");
  set_backward_matrix();
  if (np > 0) {
    check(Api::init_quadrature_back(memory_, b.which, backward_quadrature_function(), b.q),
          "the gradient's quadrature");
    check(Api::set_quadrature_tolerances_back(memory_, b.which, options_.rtol, b.atol_q), "the gradient's tolerances");
    check(Api::set_quadrature_error_control_back(memory_, b.which, SUNTRUE), "the gradient's error control");
  }
  read_checkpoints();
  Api::capture_messages(b.memory, message_);
  const int flag = Api::solve_back(memory_, options_.t_start);
  if (flag < 0) fail(true, flag, "could not continue the backward (adjoint) run");
  double reached = 0;
  check(Api::get_back(memory_, b.which, &reached, b.y, b.yp), "the adjoint");
  if (np > 0) {
    check(Api::get_quadrature_back(memory_, b.which, &reached, b.q), "the gradient");
    for (int j = 0; j < np; ++j) gradient[static_cast<std::size_t>(j)] += b.q.data()[j];
  }
  std::copy(b.y.data(), b.y.data() + n, mu.mu.begin());
  if (Api::implicit) std::copy(b.yp.data(), b.yp.data() + n, mu.mup.begin());
  Counters& c = counters_;
  Api::steps(b.memory, &c.backward_steps);
  Api::evaluations(b.memory, &c.backward_residuals);
  Api::newton_iterations(b.memory, &c.backward_newton_iterations);
  Api::error_test_failures(b.memory, &c.backward_error_test_failures);
  Api::convergence_failures(b.memory, &c.backward_convergence_failures);
  c.backward_jacobians = newton_setups_back_;
  c.factorizations = system_.factorizations();
  c.position_iterations = system_.position_iterations();
}

template <class Api>
void SundialsSession<Api>::read_checkpoints() {
  checkpoint_times_.clear();
  if (!plan_) return;
  std::vector<typename Api::CheckpointRecord> records(static_cast<std::size_t>(counters_.checkpoints) + 1);
  check(Api::checkpoints(memory_, records.data()), "the checkpoints");
  for (const auto& r : records) checkpoint_times_.push_back(r.t0);
  std::sort(checkpoint_times_.begin(), checkpoint_times_.end());
  if (!Api::implicit) return;
  // IDAS chooses its first step without an evaluation.
  const double first = t_ - plan_->limit(system_, t_, y(), true);
  if (std::isfinite(first) && !(options_.max_step_s > 0 && options_.max_step_s < first))
    check(Api::set_max_step_back(memory_, back_->which, first), "the adjoint's first step's bound");
}

template <class Api>
void SundialsSession<Api>::look_back(double t, const double* y) {
  if (!plan_) return;
  // At a checkpoint, but for rounding, it has to stop there.
  const double near = 1e-13 * (std::abs(t) + std::abs(t_ - options_.t_start));
  const auto above = std::upper_bound(checkpoint_times_.begin(), checkpoint_times_.end(), t + near);
  const double floor = above == checkpoint_times_.begin() ? options_.t_start : *(above - 1);
  const double end = floor >= t - near ? floor : std::max(floor, plan_->limit(system_, t, y, true));
  if (Api::implicit) Api::set_max_step(back_->memory, std::max(0.0, options_.max_step_s));
  Api::set_stop_time(back_->memory, end);
}

template void SundialsSession<IdaApi>::solve_backward(AdjointState&, const AdjointSize&, std::vector<double>&);
template void SundialsSession<IdaApi>::read_checkpoints();
template void SundialsSession<IdaApi>::look_back(double, const double*);
template void SundialsSession<CvodeApi>::solve_backward(AdjointState&, const AdjointSize&, std::vector<double>&);
template void SundialsSession<CvodeApi>::read_checkpoints();
template void SundialsSession<CvodeApi>::look_back(double, const double*);

}  // namespace costate
