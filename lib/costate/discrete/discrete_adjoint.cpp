#include "costate/discrete/discrete_adjoint.h"

namespace costate {

DiscreteAdjoint::DiscreteAdjoint(DiscreteScheme& scheme)
    : scheme_(scheme), assembly_(scheme.assembly()), n_(assembly_.n()), m_(assembly_.m()), nz_(assembly_.nz()) {
  hessian_.assign(assembly_.square().row.size(), 0.0);
  cost_.resize(assembly_);
  clear();
}

void DiscreteAdjoint::clear() {
  for (auto* x : {&q_, &v_, &a_, &alpha_}) x->setZero(n_);
  for (auto* x : {&z_, &f_, &y_}) x->setZero(nz_);
  lambda_.setZero(m_);
  s_.setZero(n_ + nz_ + m_);
  w_.setZero(n_ + nz_ + m_);
  gradient_.assign(static_cast<std::size_t>(assembly_.np()), 0.0);
  outer_.assign(assembly_.square().row.size(), 0.0);
  sum_.setZero(n_);
}

void DiscreteAdjoint::add_cost(double weight, bool terminal) {
  const Objective& objective = scheme_.objective();
  if (terminal ? objective.terminal.empty() : objective.running.empty()) return;
  cost_.set_zero();
  if (terminal)
    objective.add_terminal_gradient(scheme_.state(), assembly_, cost_);
  else
    objective.add_running_gradient(scheme_.state(), assembly_, cost_);
  q_ += weight * cost_.q;
  v_ += weight * cost_.v;
  z_ += weight * cost_.z;
  a_ += weight * cost_.a;
  lambda_ += weight * cost_.lambda;
  for (int j = 0; j < assembly_.np(); ++j) gradient_[j] += weight * cost_.rho[j];
}

void DiscreteAdjoint::step_back(bool factored) {
  const StepCoefficients& c = scheme_.coefficients();
  const StateView end = scheme_.state();
  if (factored)
    assembly_.calc_jacobian(end);
  else
    scheme_.factor_projection_here();
  sigma_ = scheme_.slips_here().no_bars();
  assembly_.calc_partials(end);
  // 4
  a_ += c.new_a * alpha_;
  f_ += c.new_f * y_;
  accelerations_back();
  velocities_back();
  add_end_parameters(w_.data() + n_ + nz_);
  stage_back(factored);
  // The bars of the last state; q_, v_, z_ are those of q_g, v_g, z_g.
  a_ = c.old_a * alpha_ + c.q_a * q_ + c.v_a * v_;
  alpha_ = c.old_alpha * alpha_ + c.q_alpha * q_ + c.v_alpha * v_;
  f_ = c.old_f * y_ + c.z_f * z_;
  y_ = c.old_y * y_ + c.z_y * z_;
  v_ += c.h * q_;
  lambda_.setZero();
}

void DiscreteAdjoint::subtract_rows(const Eigen::VectorXd& s) {
  const double *s1 = s.data(), *sz = s1 + n_;
  add_transposed_product(assembly_.square(), assembly_.K.data(), -1, s1, q_.data());
  add_transposed_product(assembly_.square(), assembly_.C.data(), -1, s1, v_.data());
  if (nz_ == 0) return;
  add_transposed_product(assembly_.force_state(), assembly_.Q_z.data(), 1, s1, z_.data());
  add_transposed_product(assembly_.state_force(), assembly_.f_q.data(), 1, sz, q_.data());
  add_transposed_product(assembly_.state_force(), assembly_.f_v.data(), 1, sz, v_.data());
  add_transposed_product(assembly_.state_state(), assembly_.f_z.data(), 1, sz, z_.data());
}

void DiscreteAdjoint::add_outer(const double* s1, const double* a) {
  if (!assembly_.varies_constant_bodies()) return;
  const SparsePattern& p = assembly_.square();
  for (int j = 0; j < n_; ++j)
    for (auto k = p.column_start[j]; k < p.column_start[j + 1]; ++k) outer_[k] += s1[p.row[k]] * a[j];
}

/// 3, with the end state's derivative blocks in the assembly.
void DiscreteAdjoint::accelerations_back() {
  s_.head(n_) = a_;
  s_.segment(n_, nz_) = f_;
  s_.tail(m_) = lambda_;
  scheme_.matrices().solve_projection_transposed(s_.data());
  const double* s2 = s_.data() + n_ + nz_;
  const StateView end = scheme_.state();
  const StepSlips& slips = scheme_.stage_rows().slips();
  slips.clear_rows(assembly_);
  slips.take_turns(s2, end.lambda, sigma_, gradient_.data());
  subtract_rows(s_);
  add_transposed_product(assembly_.jacobian(), assembly_.phidd_q.data(), -1, s2, q_.data());
  add_transposed_product(assembly_.jacobian(), assembly_.phid_q.data(), -2, s2, v_.data());
  if (const std::vector<double>* rolls = scheme_.rolling_rates(end))
    add_transposed_product(assembly_.jacobian(), rolls->data(), -1, s2, v_.data());
}

/// 2, with the same blocks: v_ becomes the bar of v*.
void DiscreteAdjoint::velocities_back() {
  const StepRecord& r = scheme_.record();
  w_.head(n_) = v_;
  w_.tail(nz_ + m_).setZero();
  scheme_.matrices().solve_velocities_transposed(w_.data());
  const double *s1 = w_.data(), *s2 = s1 + n_ + nz_;
  const StateView end = scheme_.state();
  assembly_.calc_projection_hessian(end, r.u, r.eta, hessian_);
  add_transposed_product(assembly_.square(), hessian_.data(), -1, s1, q_.data());
  add_transposed_product(assembly_.jacobian(), assembly_.phid_q.data(), -1, s2, q_.data());
  add_transposed_product(assembly_.jacobian(), assembly_.phi_q.data(), -1, s2, v_.data());
  const StepSlips& slips = scheme_.stage_rows().slips();
  for (const Assembly::SlidingRow& at : assembly_.sliding_rows())
    for (const auto& [column, factor] : assembly_.number_columns()[static_cast<std::size_t>(at.number)])
      if (!slips.has(at.along))
        gradient_[static_cast<std::size_t>(column)] += factor * s2[at.along] * at.direction * r.eta[at.normal];
  slips.take_projected(assembly_, end, r.u, r.eta, s2, q_.data(), sigma_, gradient_.data());
  add_outer(s1, r.u);
  assembly_.add_projection_gradient(end, r.u, r.eta, s1, -1, gradient_.data(), false);
}

/// The parameters in 3 and in the rows of 2, all at the end state.
void DiscreteAdjoint::add_end_parameters(const double* velocity_rows) {
  Assembly::ParameterWeights w;
  w.force = s_.data();
  w.state = s_.data() + n_;
  w.row = s_.data() + n_ + nz_;
  const StepSlips& slips = scheme_.stage_rows().slips();
  std::vector<double> others;
  if (slips.any()) w.row = (others = slips.without(w.row, m_)).data();
  w.c2 = 1;
  w.row_phid = velocity_rows;
  w.constant_bodies = false;
  add_outer(s_.data(), scheme_.record().a);
  sum_ += s_.head(n_);
  assembly_.add_parameter_gradient(scheme_.state(), w, -1, gradient_.data());
}

/// 1: q_, v_, z_ become the bars of q_g, v_g, z_g.
void DiscreteAdjoint::stage_back(bool factored) {
  const StepCoefficients& c = scheme_.coefficients();
  const StateView stage = scheme_.stage();
  if (factored)
    scheme_.calc_stage_partials(stage);
  else
    scheme_.factor_stage_here();
  StageRows& rows = scheme_.stage_rows();
  s_.tail(m_).setZero();
  rows.slips().give_turns(sigma_, q_.data(), v_.data(), s_.data() + n_ + nz_, gradient_.data());
  s_.head(n_) = c.B * q_ + c.G * v_;
  s_.segment(n_, nz_) = c.G_z * z_;
  scheme_.matrices().solve_step_transposed(s_.data());
  subtract_rows(s_);
  const double* s2 = s_.data() + n_ + nz_;
  add_transposed_product(assembly_.jacobian(), rows.by_q().data(), -1, s2, q_.data());
  if (rows.keep_rates()) add_transposed_product(assembly_.jacobian(), rows.by_v().data(), -1, s2, v_.data());
  Assembly::ParameterWeights w;
  w.force = s_.data();
  w.state = s_.data() + n_;
  rows.weigh(assembly_, c, s2, w);
  rows.slips().add_gradient(s2, -1, gradient_.data());
  w.constant_bodies = false;
  add_outer(s_.data(), stage.a);
  sum_ += s_.head(n_);
  assembly_.add_parameter_gradient(stage, w, -1, gradient_.data());
}

/// 3 where no step leads.
void DiscreteAdjoint::accelerations_anew_back(const StateView& s, double* friction_before) {
  const StepSlips& slips = scheme_.slips_here();
  sigma_ = slips.no_bars();
  assembly_.calc_partials(s);
  a_ += alpha_;
  f_ += y_;
  accelerations_back();
  slips.give_turns(sigma_, q_.data(), v_.data(), friction_before, gradient_.data());
  add_end_parameters(nullptr);
}

double DiscreteAdjoint::begin_anew_back() {
  const StateView s = scheme_.state();
  scheme_.factor_projection_here();
  Eigen::VectorXd friction_before = Eigen::VectorXd::Zero(m_);
  accelerations_anew_back(s, friction_before.data());
  calc_time_partials(assembly_, s, time_);
  double by_time = 0;
  for (int i = 0; i < n_; ++i) by_time -= s_[i] * time_.force[static_cast<std::size_t>(i)];
  for (int i = 0; i < nz_; ++i) by_time += s_[n_ + i] * time_.state[static_cast<std::size_t>(i)];
  for (int i = 0; i < m_; ++i) by_time -= s_[n_ + nz_ + i] * time_.phidd[static_cast<std::size_t>(i)];
  forget_rates();
  lambda_ = friction_before;
  return by_time;
}

void DiscreteAdjoint::forget_rates() {
  for (auto* x : {&a_, &alpha_, &lambda_, &f_, &y_}) x->setZero();
}

double DiscreteAdjoint::change(const std::function<double(double* bars, double* gradient)>& visit) {
  Eigen::VectorXd bars(2 * n_ + nz_);
  bars << q_, v_, z_;
  const double r = visit(bars.data(), gradient_.data());
  q_ = bars.head(n_);
  v_ = bars.segment(n_, n_);
  z_ = bars.tail(nz_);
  return r;
}

double DiscreteAdjoint::along(const StepColumn& c) const {
  return q_.dot(c.q) + v_.dot(c.v) + z_.dot(c.z) + a_.dot(c.a) + lambda_.dot(c.lambda) + f_.dot(c.f) +
         alpha_.dot(c.alpha) + y_.dot(c.y);
}

void DiscreteAdjoint::add(double c, const ScalarGradient& w) {
  q_ += c * w.q;
  v_ += c * w.v;
  z_ += c * w.z;
  a_ += c * w.a;
  lambda_ += c * w.lambda;
  for (int j = 0; j < assembly_.np(); ++j) gradient_[static_cast<std::size_t>(j)] += c * w.rho[j];
}

void DiscreteAdjoint::add_parameters(double c, const std::vector<double>& by) {
  for (std::size_t j = 0; j < gradient_.size(); ++j) gradient_[j] += c * by[j];
}

const std::vector<double>& DiscreteAdjoint::finish(bool factored) {
  const StateView s = scheme_.state();
  if (!factored) scheme_.factor_projection_here();
  accelerations_anew_back(s, nullptr);
  assembly_.add_constant_body_gradient(outer_.data(), sum_.data(), -1, gradient_.data());
  add_start_gradient(assembly_, scheme_.start_time(), scheme_.start_state(), q_.data(), v_.data(), z_.data(),
                     gradient_.data());
  return gradient_;
}

}  // namespace costate
