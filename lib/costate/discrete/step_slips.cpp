#include "costate/discrete/step_slips.h"

#include <Eigen/Dense>
#include <cmath>

#include "costate/assembly/slip_turn.h"

namespace costate {

namespace {
using Eigen::Index;
using Eigen::Matrix2d;
using Eigen::MatrixXd;
using Eigen::Vector2d;
using Eigen::VectorXd;

/// In steps: where w may vanish sooner.
constexpr double kSoon = 4;

Vector2d across(const Vector2d& x) { return {-x[1], x[0]}; }

/// The contact's slip at the velocities u, J u.
SlipOnLine slip_at(const Assembly& assembly, const StateView& s, const double* u, int normal) {
  StateView at = s;
  at.v = u;
  Variation still;
  still.q = still.v = u;
  return {assembly, at, still, normal};
}
}  // namespace

StepSlips::StepSlips(const Assembly& assembly) : possible_(may_slide_in_space(assembly)), np_(assembly.np()) {}

void StepSlips::look(const Assembly& assembly, const StateView& s, const StepCoefficients* c, bool partials) {
  slips_.clear();
  const auto& rows = assembly.sliding_rows();
  directions_.clear();
  pairs_.clear();
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (!slips_in_space(assembly, i)) {
      directions_.push_back(rows[i].direction);
      continue;
    }
    slips_.push_back(look_at(assembly, rows[i], s, c, partials));
    for (const double x : slips_.back().sigma) directions_.push_back(x);
    pairs_.push_back(slips_.back().kind);
    ++i;
  }
}

StepSlips::Slip StepSlips::look_at(const Assembly& assembly, const Assembly::SlidingRow& row, const StateView& s,
                                   const StepCoefficients* c, bool partials) const {
  Slip x;
  x.normal = row.normal;
  x.along = row.along;
  x.number = row.number;
  x.mu = assembly.numbers()[static_cast<std::size_t>(row.number)];
  Variation motion;
  motion.q = s.v;
  motion.v = s.a;
  SlipOnLine slip(assembly, s, motion, row.normal);
  x.slip = slip.w;
  x.slip_rate = slip.dw;
  const double speed = slip.w.norm();
  const Vector2d friction =
      s.lambda ? Vector2d(s.lambda[row.along], s.lambda[row.along + 1]) : Vector2d(Vector2d::Zero());
  const double size = friction.norm(), normal = s.lambda ? s.lambda[row.normal] : 0;
  x.sigma = speed > 0 ? Vector2d(slip.w / speed) : Vector2d::Zero();
  if (c && size > 0 && speed < kSoon * c->h * slip.dw.norm()) {
    x.kind = Kind::by_friction;
    x.sigma = friction / size;
  }
  for (const auto& [contact, sigma] : held_)
    if (c && contact == x.normal) {
      x.kind = Kind::held;
      x.sigma = sigma;
    }
  const Vector2d aside = across(x.sigma);
  if (x.kind == Kind::by_friction)
    x.rows = {-(size + x.mu * normal), aside.dot(slip.w) / c->G};
  else
    x.rows = -(friction + x.mu * normal * x.sigma);
  if (!partials) return x;
  x.row_by_slip = x.row_by_friction = x.sigma_by_slip = x.sigma_by_friction = Matrix2d::Zero();
  if (x.kind == Kind::by_friction) {
    x.sigma_by_friction = SlipTurn(x.sigma, size).T;
    x.row_by_friction.row(0) = -x.sigma.transpose();
    x.row_by_friction.row(1) = -x.sigma.dot(slip.w) / (c->G * size) * aside.transpose();
    x.row_by_slip.row(1) = aside.transpose() / c->G;
    x.row_by_normal = {-x.mu, 0};
    x.row_by_mu = {-normal, 0};
  } else {
    if (!c && x.normal == begun_)
      x.sigma_by_friction = SlipTurn(begun_friction_.normalized(), begun_friction_.norm()).T;
    else if (speed > 0 && x.kind != Kind::held)
      x.sigma_by_slip = SlipTurn(x.sigma, speed).T;
    x.row_by_friction = -Matrix2d::Identity();
    x.row_by_slip = -x.mu * normal * x.sigma_by_slip;
    x.row_by_normal = -x.mu * x.sigma;
    x.row_by_mu = -normal * x.sigma;
  }
  x.coordinates = slip.coordinates();
  x.slip_by = slip.partials(assembly);
  x.of_mu = assembly.number_columns()[static_cast<std::size_t>(row.number)];
  return x;
}

void StepSlips::begin_from_rest(int normal, const double* friction) {
  begun_ = friction ? normal : -1;
  if (friction) begun_friction_ = Vector2d(friction[0], friction[1]);
}

void StepSlips::hold_if_stopping(const Assembly& assembly, const StateView& s, double h) {
  held_.clear();
  look(assembly, s, nullptr);
  const bool stops = std::any_of(slips_.begin(), slips_.end(),
                                 [&](const Slip& x) { return x.slip.squaredNorm() < -x.slip.dot(x.slip_rate) * h; });
  if (!stops) return;
  for (const Slip& x : slips_) held_.emplace_back(x.normal, x.sigma);
}

void StepSlips::straighten(const Assembly& assembly, const StateView& s, double* v) const {
  const Vector2d none = Vector2d::Zero();
  for (const auto& [contact, sigma] : held_) {
    SlipOnLine slip = slip_at(assembly, s, s.v, contact);
    const Vector2d aside = across(sigma);
    const auto& c = slip.coordinates();
    VectorXd row(static_cast<Index>(c.size()));
    for (std::size_t j = 0; j < c.size(); ++j) row[static_cast<Index>(j)] = slip.by_velocity(j, none, aside);
    const double misses = aside.dot(slip.w) / row.squaredNorm();
    for (std::size_t j = 0; j < c.size(); ++j) v[c[j]] -= misses * row[static_cast<Index>(j)];
  }
}

void StepSlips::subtract_rows(double* out) const {
  for (const Slip& x : slips_)
    for (int k = 0; k < 2; ++k) out[x.along + k] = -x.rows[k];
}

void StepSlips::set_partials(const SparsePattern& pattern, std::vector<double>& by_q, std::vector<double>& by_v) const {
  for (const Slip& x : slips_) {
    const MatrixXd q = x.row_by_slip * x.slip_by.by_q, v = x.row_by_slip * x.slip_by.by_v;
    for (std::size_t j = 0; j < x.coordinates.size(); ++j)
      for (int k = 0; k < 2; ++k) {
        const auto at = static_cast<std::size_t>(pattern.find(x.along + k, x.coordinates[j]));
        by_q[at] = q(k, static_cast<Index>(j));
        by_v[at] = v(k, static_cast<Index>(j));
      }
  }
}

void StepSlips::subtract_columns(int j, double* out) const {
  for (const Slip& x : slips_) {
    Vector2d by = x.row_by_slip * x.slip_by.by_rho.col(j);
    for (const auto& [column, f] : x.of_mu)
      if (column == j) by += f * x.row_by_mu;
    for (int k = 0; k < 2; ++k) out[x.along + k] -= by[k];
  }
}

void StepSlips::add_gradient(const double* s2, double factor, double* gradient) const {
  for (const Slip& x : slips_) {
    const Vector2d weight(s2[x.along], s2[x.along + 1]);
    const VectorXd by = x.slip_by.by_rho.transpose() * (x.row_by_slip.transpose() * weight);
    for (int j = 0; j < np_; ++j) gradient[j] += factor * by[j];
    for (const auto& [column, f] : x.of_mu) gradient[column] += factor * f * x.row_by_mu.dot(weight);
  }
}

MatrixXd StepSlips::turns(const MatrixXd& q, const MatrixXd& v, const MatrixXd* lambda, bool parameters) const {
  MatrixXd all(2 * static_cast<Index>(slips_.size()), q.cols());
  for (std::size_t i = 0; i < slips_.size(); ++i) {
    const Slip& x = slips_[i];
    MatrixXd slip = x.slip_by.by_q * q(x.coordinates, Eigen::all) + x.slip_by.by_v * v(x.coordinates, Eigen::all);
    if (parameters) slip += x.slip_by.by_rho;
    auto turn = all.middleRows(2 * static_cast<Index>(i), 2);
    turn = x.sigma_by_slip * slip;
    if (lambda) turn += x.sigma_by_friction * lambda->middleRows(x.along, 2);
  }
  return all;
}

void StepSlips::subtract_turn(std::size_t i, const MatrixXd& turns, const double* lambda, bool parameters,
                              Eigen::Ref<MatrixXd> right) const {
  const Slip& x = slips_[i];
  right.middleRows(x.along, 2) += x.mu * lambda[x.normal] * turns.middleRows(2 * static_cast<Index>(i), 2);
  if (!parameters) return;
  for (const auto& [column, f] : x.of_mu) right.block<2, 1>(x.along, column) += f * lambda[x.normal] * x.sigma;
}

void StepSlips::take_turn(std::size_t i, const double* s2, const double* lambda, VectorXd& bars,
                          double* gradient) const {
  const Slip& x = slips_[i];
  const Vector2d weight(s2[x.along], s2[x.along + 1]);
  bars.segment<2>(2 * static_cast<Index>(i)) += x.mu * lambda[x.normal] * weight;
  for (const auto& [column, f] : x.of_mu) gradient[column] += f * lambda[x.normal] * x.sigma.dot(weight);
}

void StepSlips::subtract_turns(const MatrixXd& turns, const double* lambda, bool parameters,
                               Eigen::Ref<MatrixXd> right) const {
  for (std::size_t i = 0; i < slips_.size(); ++i) subtract_turn(i, turns, lambda, parameters, right);
}

void StepSlips::take_turns(const double* s2, const double* lambda, VectorXd& bars, double* gradient) const {
  for (std::size_t i = 0; i < slips_.size(); ++i) take_turn(i, s2, lambda, bars, gradient);
}

void StepSlips::subtract_projected(const Assembly& assembly, const StateView& s, const double* u, const double* eta,
                                   const MatrixXd& q, const MatrixXd& turns, bool parameters,
                                   Eigen::Ref<MatrixXd> right) const {
  for (std::size_t i = 0; i < slips_.size(); ++i) {
    const Slip& x = slips_[i];
    if (!x.kept()) {
      subtract_turn(i, turns, eta, parameters, right);
      continue;
    }
    const SlipOnLine::Partials kept = slip_at(assembly, s, u, x.normal).partials(assembly);
    right.middleRows(x.along, 2) -= kept.by_q * q(x.coordinates, Eigen::all);
    if (parameters) right.middleRows(x.along, 2) -= kept.by_rho;
  }
}

void StepSlips::take_projected(const Assembly& assembly, const StateView& s, const double* u, const double* eta,
                               const double* s2, double* q, VectorXd& bars, double* gradient) const {
  for (std::size_t i = 0; i < slips_.size(); ++i) {
    const Slip& x = slips_[i];
    if (!x.kept()) {
      take_turn(i, s2, eta, bars, gradient);
      continue;
    }
    const SlipOnLine::Partials kept = slip_at(assembly, s, u, x.normal).partials(assembly);
    const Vector2d weight(s2[x.along], s2[x.along + 1]);
    const VectorXd by_q = kept.by_q.transpose() * weight, by_rho = kept.by_rho.transpose() * weight;
    for (std::size_t j = 0; j < x.coordinates.size(); ++j) q[x.coordinates[j]] -= by_q[static_cast<Index>(j)];
    for (int j = 0; j < np_; ++j) gradient[j] -= by_rho[j];
  }
}

void StepSlips::give_turns(const VectorXd& bars, double* q, double* v, double* lambda, double* gradient) const {
  for (std::size_t i = 0; i < slips_.size(); ++i) {
    const Slip& x = slips_[i];
    const Vector2d bar = bars.segment<2>(2 * static_cast<Index>(i)), slip = x.sigma_by_slip.transpose() * bar,
                   friction = x.sigma_by_friction.transpose() * bar;
    const VectorXd by_q = x.slip_by.by_q.transpose() * slip, by_v = x.slip_by.by_v.transpose() * slip,
                   by_rho = x.slip_by.by_rho.transpose() * slip;
    for (std::size_t j = 0; j < x.coordinates.size(); ++j) {
      q[x.coordinates[j]] += by_q[static_cast<Index>(j)];
      v[x.coordinates[j]] += by_v[static_cast<Index>(j)];
    }
    for (int j = 0; j < np_; ++j) gradient[j] += by_rho[j];
    for (int k = 0; lambda && k < 2; ++k) lambda[x.along + k] += friction[k];
  }
}

void StepSlips::clear_rows(Assembly& assembly, Assembly::ParameterColumns* columns) const {
  for (const Slip& x : slips_)
    for (int k = 0; k < 2; ++k) {
      for (const int j : x.coordinates)
        assembly.phidd_q[static_cast<std::size_t>(assembly.jacobian().find(x.along + k, j))] = 0;
      if (columns) columns->phidd.row(x.along + k).setZero();
    }
}

std::vector<double> StepSlips::without(const double* s2, int m) const {
  std::vector<double> out(s2, s2 + m);
  for (const Slip& x : slips_) out[static_cast<std::size_t>(x.along)] = out[static_cast<std::size_t>(x.along) + 1] = 0;
  return out;
}

}  // namespace costate
