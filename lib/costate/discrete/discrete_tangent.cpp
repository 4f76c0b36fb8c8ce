#include "costate/discrete/discrete_tangent.h"

namespace costate {

DiscreteTangent::DiscreteTangent(DiscreteScheme& scheme)
    : scheme_(scheme),
      assembly_(scheme.assembly()),
      n_(assembly_.n()),
      m_(assembly_.m()),
      nz_(assembly_.nz()),
      np_(assembly_.np()) {
  for (auto* x : {&q_, &v_, &a_, &alpha_}) x->setZero(n_, np_);
  for (auto* x : {&z_, &f_, &y_}) x->setZero(nz_, np_);
  lambda_.setZero(m_, np_);
  right_.setZero(n_ + nz_ + m_, np_);
  hessian_.assign(assembly_.square().row.size(), 0.0);
  cost_.resize(assembly_);
}

void DiscreteTangent::start() {
  const Start& s = scheme_.start_state();
  q_ = s.q_rho;
  v_ = s.v_rho;
  z_ = s.z_rho;
  find_accelerations();
  alpha_ = a_;
  y_ = f_;
}

void DiscreteTangent::step() {
  const StepCoefficients& c = scheme_.coefficients();
  // What the last state gives: q_, v_, z_ become q_g, v_g, z_g.
  q_ += c.h * v_ + c.q_alpha * alpha_ + c.q_a * a_;
  v_ += c.v_alpha * alpha_ + c.v_a * a_;
  z_ += c.z_y * y_ + c.z_f * f_;
  alpha_ = c.old_alpha * alpha_ + c.old_a * a_;
  y_ = c.old_y * y_ + c.old_f * f_;
  stage();
  project_velocities();
  find_accelerations();
  alpha_ += c.new_a * a_;
  y_ += c.new_f * f_;
}

/// 1: on return q_, v_, z_ belong to the stage.
void DiscreteTangent::stage() {
  const StepCoefficients& c = scheme_.coefficients();
  const StateView s = scheme_.stage();
  assembly_.calc_jacobian(s);
  scheme_.calc_stage_partials(s);
  assembly_.calc_parameter_columns(s, columns_);
  right_.topRows(n_) = -columns_.F;
  right_.middleRows(n_, nz_) = columns_.f;
  right_.bottomRows(m_).setZero();
  const StageRows& rows = scheme_.stage_rows();
  for (int j = 0; j < np_; ++j) {
    const double *q = q_.col(j).data(), *v = v_.col(j).data(), *z = z_.col(j).data();
    double *force = right_.col(j).data(), *state = force + n_, *row = state + nz_;
    add_product(assembly_.square(), assembly_.K.data(), -1, q, force);
    add_product(assembly_.square(), assembly_.C.data(), -1, v, force);
    rows.subtract_columns(assembly_, c, columns_, j, row);
    add_product(assembly_.jacobian(), rows.by_q().data(), -1, q, row);
    if (rows.keep_rates()) add_product(assembly_.jacobian(), rows.by_v().data(), -1, v, row);
    if (nz_ == 0) continue;
    add_product(assembly_.force_state(), assembly_.Q_z.data(), 1, z, force);
    add_product(assembly_.state_force(), assembly_.f_q.data(), 1, q, state);
    add_product(assembly_.state_force(), assembly_.f_v.data(), 1, v, state);
    add_product(assembly_.state_state(), assembly_.f_z.data(), 1, z, state);
  }
  if (np_ > 0) scheme_.matrices().solve_step(right_.data(), np_);
  q_ += c.B * right_.topRows(n_);
  v_ += c.G * right_.topRows(n_);
  z_ += c.G_z * right_.middleRows(n_, nz_);
  if (!rows.slips().any()) return;
  const Eigen::MatrixXd multipliers = right_.bottomRows(m_);
  turns_ = rows.slips().turns(q_, v_, &multipliers, true);
}

/// 2: v_ becomes the derivative of the projected velocities. Leaves the end state's derivative blocks in the assembly.
void DiscreteTangent::project_velocities() {
  const StateView s = scheme_.state();
  const StepRecord& r = scheme_.record();
  assembly_.calc_projection_hessian(s, r.u, r.eta, hessian_);
  Eigen::MatrixXd& V_rho = columns_.F;
  assembly_.calc_projection_columns(s, r.u, r.eta, V_rho);
  right_.topRows(n_) = -V_rho;
  assembly_.calc_partials(s);
  assembly_.calc_parameter_columns(s, columns_);
  right_.middleRows(n_, nz_).setZero();
  right_.bottomRows(m_) = -columns_.phid;
  const StepSlips& slips = scheme_.stage_rows().slips();
  for (const Assembly::SlidingRow& at : assembly_.sliding_rows())
    for (const auto& [column, factor] : assembly_.number_columns()[static_cast<std::size_t>(at.number)])
      if (!slips.has(at.along)) right_(n_ + nz_ + at.along, column) += factor * at.direction * r.eta[at.normal];
  slips.subtract_projected(assembly_, s, r.u, r.eta, q_, turns_, true, right_.bottomRows(m_));
  for (int j = 0; j < np_; ++j) {
    double *force = right_.col(j).data(), *row = force + n_ + nz_;
    add_product(assembly_.square(), hessian_.data(), -1, q_.col(j).data(), force);
    add_product(assembly_.jacobian(), assembly_.phid_q.data(), -1, q_.col(j).data(), row);
    add_product(assembly_.jacobian(), assembly_.phi_q.data(), -1, v_.col(j).data(), row);
  }
  if (np_ > 0) scheme_.matrices().solve_velocities(right_.data(), np_);
  v_ += right_.topRows(n_);
}

/// 3
void DiscreteTangent::find_accelerations(const Eigen::RowVectorXd* dt) {
  const StateView s = scheme_.state();
  if (scheme_.index() == 0 || dt) {  // otherwise project_velocities() has evaluated them
    assembly_.calc_partials(s);
    assembly_.calc_parameter_columns(s, columns_);
    if (const StepSlips& slips = scheme_.slips_here(); slips.any())
      turns_ = slips.turns(q_, v_, dt ? &lambda_ : nullptr, true);
  }
  const StepSlips& slips = scheme_.stage_rows().slips();
  slips.clear_rows(assembly_, &columns_);
  right_.topRows(n_) = -columns_.F;
  right_.middleRows(n_, nz_) = columns_.f;
  right_.bottomRows(m_) = -columns_.phidd;
  slips.subtract_turns(turns_, s.lambda, true, right_.bottomRows(m_));
  const std::vector<double>* rolls = scheme_.rolling_rates(s);
  if (dt) {
    calc_time_partials(assembly_, s, time_);
    right_.topRows(n_) -= Eigen::Map<const Eigen::VectorXd>(time_.force.data(), n_) * *dt;
    right_.middleRows(n_, nz_) += Eigen::Map<const Eigen::VectorXd>(time_.state.data(), nz_) * *dt;
    right_.bottomRows(m_) -= Eigen::Map<const Eigen::VectorXd>(time_.phidd.data(), m_) * *dt;
  }
  for (int j = 0; j < np_; ++j) {
    const double *q = q_.col(j).data(), *v = v_.col(j).data(), *z = z_.col(j).data();
    double *force = right_.col(j).data(), *state = force + n_, *row = state + nz_;
    add_product(assembly_.square(), assembly_.K.data(), -1, q, force);
    add_product(assembly_.square(), assembly_.C.data(), -1, v, force);
    add_product(assembly_.jacobian(), assembly_.phidd_q.data(), -1, q, row);
    add_product(assembly_.jacobian(), assembly_.phid_q.data(), -2, v, row);
    if (rolls) add_product(assembly_.jacobian(), rolls->data(), -1, v, row);
    if (nz_ == 0) continue;
    add_product(assembly_.force_state(), assembly_.Q_z.data(), 1, z, force);
    add_product(assembly_.state_force(), assembly_.f_q.data(), 1, q, state);
    add_product(assembly_.state_force(), assembly_.f_v.data(), 1, v, state);
    add_product(assembly_.state_state(), assembly_.f_z.data(), 1, z, state);
  }
  if (np_ > 0) scheme_.matrices().solve_projection(right_.data(), np_);
  a_ = right_.topRows(n_);
  f_ = right_.middleRows(n_, nz_);
  lambda_ = right_.bottomRows(m_);
}

void DiscreteTangent::add(const StepColumn& column, const Eigen::RowVectorXd& dt) {
  q_ += column.q * dt;
  v_ += column.v * dt;
  z_ += column.z * dt;
  a_ += column.a * dt;
  lambda_ += column.lambda * dt;
  f_ += column.f * dt;
  alpha_ += column.alpha * dt;
  y_ += column.y * dt;
}

void DiscreteTangent::change(const std::function<void(double* const* columns, int count)>& visit) {
  Eigen::MatrixXd all(2 * n_ + nz_, np_);
  all << q_, v_, z_;
  std::vector<double*> columns;
  for (int j = 0; j < np_; ++j) columns.push_back(all.col(j).data());
  visit(columns.data(), np_);
  q_ = all.topRows(n_);
  v_ = all.middleRows(n_, n_);
  z_ = all.bottomRows(nz_);
}

void DiscreteTangent::begin_anew(const Eigen::RowVectorXd& dt) {
  find_accelerations(&dt);
  alpha_ = a_;
  y_ = f_;
}

Eigen::RowVectorXd DiscreteTangent::along(const ScalarGradient& w) const {
  return w.q.transpose() * q_ + w.v.transpose() * v_ + w.z.transpose() * z_ + w.a.transpose() * a_ +
         w.lambda.transpose() * lambda_ + w.rho.transpose();
}

void DiscreteTangent::add_cost(double weight, double* gradient, bool terminal) {
  const Objective& objective = scheme_.objective();
  if (terminal ? objective.terminal.empty() : objective.running.empty()) return;
  cost_.set_zero();
  if (terminal)
    objective.add_terminal_gradient(scheme_.state(), assembly_, cost_);
  else
    objective.add_running_gradient(scheme_.state(), assembly_, cost_);
  for (int j = 0; j < np_; ++j)
    gradient[j] += weight * (cost_.q.dot(q_.col(j)) + cost_.v.dot(v_.col(j)) + cost_.z.dot(z_.col(j)) +
                             cost_.a.dot(a_.col(j)) + cost_.lambda.dot(lambda_.col(j)) + cost_.rho[j]);
}

}  // namespace costate
