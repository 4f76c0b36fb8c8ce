#include "costate/discrete/step_length.h"

namespace costate {

StepLength::StepLength(DiscreteScheme& scheme)
    : scheme_(scheme), assembly_(scheme.assembly()), n_(assembly_.n()), m_(assembly_.m()), nz_(assembly_.nz()) {
  right_.setZero(n_ + nz_ + m_, 2);
  hessian_.assign(assembly_.square().row.size(), 0.0);
}

StepColumn StepLength::of_instant() const {
  const StepRecord& r = scheme_.record();
  StepColumn c;
  c.q = Eigen::Map<const Eigen::VectorXd>(r.v, n_);
  c.v = Eigen::Map<const Eigen::VectorXd>(r.a, n_);
  c.z = Eigen::Map<const Eigen::VectorXd>(r.f, nz_);
  c.a = c.alpha = Eigen::VectorXd::Zero(n_);
  c.f = c.y = Eigen::VectorXd::Zero(nz_);
  c.lambda = Eigen::VectorXd::Zero(m_);
  return c;
}

void StepLength::put_force_rows() {
  right_.setZero();
  right_.col(1).head(n_) = -Eigen::Map<const Eigen::VectorXd>(time_.force.data(), n_);
  right_.col(1).segment(n_, nz_) = Eigen::Map<const Eigen::VectorXd>(time_.state.data(), nz_);
  for (int j = 0; j < 2; ++j) {
    const double *q = columns_[j].q.data(), *v = columns_[j].v.data(), *z = columns_[j].z.data();
    double *force = right_.col(j).data(), *state = force + n_;
    add_product(assembly_.square(), assembly_.K.data(), -1, q, force);
    add_product(assembly_.square(), assembly_.C.data(), -1, v, force);
    if (nz_ == 0) continue;
    add_product(assembly_.force_state(), assembly_.Q_z.data(), 1, z, force);
    add_product(assembly_.state_force(), assembly_.f_q.data(), 1, q, state);
    add_product(assembly_.state_force(), assembly_.f_v.data(), 1, v, state);
    add_product(assembly_.state_state(), assembly_.f_z.data(), 1, z, state);
  }
}

void StepLength::calc() {
  const StepCoefficients& c = scheme_.coefficients();
  const StepRecord &r = scheme_.record(), &begun = scheme_.beginning();
  const auto vector = [](const double* x, int count) { return Eigen::Map<const Eigen::VectorXd>(x, count); };
  const auto a_star = vector(r.x, n_), f_star = vector(r.x + n_, nz_);
  for (StepColumn& x : columns_) {
    x.q = vector(begun.v, n_) +
          2 / c.h * (c.q_alpha * vector(begun.alpha, n_) + c.q_a * vector(begun.a, n_) + c.B * a_star);
    x.v = (c.v_alpha * vector(begun.alpha, n_) + c.v_a * vector(begun.a, n_) + c.G * a_star) / c.h;
    x.z = (c.z_y * vector(begun.y, nz_) + c.z_f * vector(begun.f, nz_) + c.G_z * f_star) / c.h;
  }
  // 1
  const StateView stage = scheme_.stage();
  assembly_.calc_jacobian(stage);
  scheme_.calc_stage_partials(stage);
  calc_time_partials(assembly_, stage, time_);
  put_force_rows();
  right_.col(1).tail(m_) -= vector(time_.phi.data(), m_) / c.B;  // what keeps rates alone stands on ground at rest
  const StageRows& rows = scheme_.stage_rows();
  for (int j = 0; j < 2; ++j) {
    double* row = right_.col(j).data() + n_ + nz_;
    add_product(assembly_.jacobian(), rows.by_q().data(), -1, columns_[j].q.data(), row);
    add_product(assembly_.jacobian(), rows.by_v().data(), -1, columns_[j].v.data(), row);
  }
  scheme_.matrices().solve_step(right_.data(), 2);
  for (int j = 0; j < 2; ++j) {
    columns_[j].q += c.B * right_.col(j).head(n_);
    columns_[j].v += c.G * right_.col(j).head(n_);
    columns_[j].z += c.G_z * right_.col(j).segment(n_, nz_);
  }
  Eigen::MatrixXd turns;
  const auto sides = [&](Eigen::VectorXd StepColumn::*of) {
    Eigen::MatrixXd both(n_, 2);
    both << columns_[0].*of, columns_[1].*of;
    return both;
  };
  const StepSlips& slips = rows.slips();
  if (slips.any()) {
    const Eigen::MatrixXd multipliers = right_.bottomRows(m_);
    turns = slips.turns(sides(&StepColumn::q), sides(&StepColumn::v), &multipliers, false);
  }
  // 2
  const StateView end = scheme_.state();
  assembly_.calc_projection_hessian(end, r.u, r.eta, hessian_);
  assembly_.calc_partials(end);
  calc_time_partials(assembly_, end, time_);
  calc_reaction_time_partial(assembly_, end, r.eta, reaction_);
  right_.setZero();
  right_.col(1).head(n_) = -vector(reaction_.data(), n_);
  right_.col(1).tail(m_) = -vector(time_.phid.data(), m_);
  slips.clear_rows(assembly_);
  slips.subtract_projected(assembly_, end, r.u, r.eta, sides(&StepColumn::q), turns, false, right_.bottomRows(m_));
  for (int j = 0; j < 2; ++j) {
    double *force = right_.col(j).data(), *row = force + n_ + nz_;
    add_product(assembly_.square(), hessian_.data(), -1, columns_[j].q.data(), force);
    add_product(assembly_.jacobian(), assembly_.phid_q.data(), -1, columns_[j].q.data(), row);
    add_product(assembly_.jacobian(), assembly_.phi_q.data(), -1, columns_[j].v.data(), row);
  }
  scheme_.matrices().solve_velocities(right_.data(), 2);
  for (int j = 0; j < 2; ++j) columns_[j].v += right_.col(j).head(n_);
  // 3, 4
  put_force_rows();
  right_.col(1).tail(m_) -= vector(time_.phidd.data(), m_);
  slips.subtract_turns(turns, r.lambda, false, right_.bottomRows(m_));
  const std::vector<double>* rolls = scheme_.rolling_rates(end);
  for (int j = 0; j < 2; ++j) {
    double* row = right_.col(j).data() + n_ + nz_;
    add_product(assembly_.jacobian(), assembly_.phidd_q.data(), -1, columns_[j].q.data(), row);
    add_product(assembly_.jacobian(), assembly_.phid_q.data(), -2, columns_[j].v.data(), row);
    if (rolls) add_product(assembly_.jacobian(), rolls->data(), -1, columns_[j].v.data(), row);
  }
  scheme_.matrices().solve_projection(right_.data(), 2);
  for (int j = 0; j < 2; ++j) {
    columns_[j].a = right_.col(j).head(n_);
    columns_[j].f = right_.col(j).segment(n_, nz_);
    columns_[j].lambda = right_.col(j).tail(m_);
    columns_[j].alpha = c.new_a * columns_[j].a;
    columns_[j].y = c.new_f * columns_[j].f;
  }
}

}  // namespace costate
