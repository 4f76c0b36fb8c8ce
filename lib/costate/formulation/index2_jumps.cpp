// Jumps of the index-2 form, and what starts, jumps and ends share: columns and adjoints of (q, v, z) completed to all
// unknowns. lib/README.md (2).
#include <Eigen/Dense>
#include <algorithm>
#include <vector>

#include "costate/assembly/slip_directions.h"
#include "costate/formulation/index2_dae.h"
#include "costate/linear/to_dense.h"

namespace costate {

namespace {
/// Of a difference of vectors, relative to them: rounding, with room for the solution of a linear system.
constexpr double kRounding = 1e-12;

double largest(const Eigen::VectorXd& x) { return x.size() > 0 ? x.cwiseAbs().maxCoeff() : 0; }

}  // namespace

void Index2Dae::start(double t, double* y, double* yp, Eigen::MatrixXd* y_rho, Eigen::MatrixXd* yp_rho) {
  const Start s = state_.start(t, y_rho != nullptr, y, yp);
  if (!y_rho) return;
  const int np = assembly_.np();
  y_rho->setZero(size(), np);
  yp_rho->setZero(size(), np);
  y_rho->topRows(2 * n_ + nz_) << s.q_rho, s.v_rho, s.z_rho;
  std::vector<double*> columns, rates;
  for (int j = 0; j < np; ++j) {
    columns.push_back(y_rho->col(j).data());
    rates.push_back(yp_rho->col(j).data());
  }
  state_.complete_columns(columns.data(), rates.data(), np);
}

void Index2Dae::jump(double t, double* y, double* yp) {
  if (pending_event_ < 0) return state_.jump(t, segment_start(t), y, yp);
  events_->cross(pending_event_, view(t, y), y + n_, y + 2 * n_);
  state_.complete(t, y, yp);
}

void Index2Dae::jump_tangent(const Jump& jump, double* const* s, double* const* sp, int count) {
  std::vector<double> y = jump.y, yp = jump.yp;
  jump_cost_tangent_.clear();
  if (jump.event >= 0) {
    jump_cost_tangent_.assign(static_cast<std::size_t>(count), 0);
    const StateView before = view(jump.t, jump.y.data());
    events_->cross(jump.event, before, y.data() + n_, y.data() + 2 * n_);
    const auto minus = event_side(jump.t, jump.y.data()), plus = event_side(jump.t, y.data());
    events_->tangent(jump.event, before, minus, plus, s, count, jump_cost_tangent_.data());
    state_.complete(jump.t, y.data(), yp.data());
  } else {
    const auto moving = moving_time(
        jump, [&](double* after, double* rates) { state_.jump(jump.t, segment_start(jump.t), after, rates); });
    set_cost_tangent(moving);
    state_.jump_tangent(jump.t, segment_start(jump.t), y.data(), yp.data(), s, count, moving ? &*moving : nullptr);
  }
  for (int j = 0; j < count; ++j) {
    std::fill(s[j] + 2 * n_ + nz_, s[j] + size(), 0.0);
    std::fill(sp[j], sp[j] + size(), 0.0);
  }
  state_.complete_columns(s, sp, count);
}

// (mu_q, P, mu_z) are weights of (q, v, z), up to normals of the constraints, which the state on either side obeys.
void Index2Dae::jump_adjoint(const Jump& jump, double* mu, double* mup, double* gradient) {
  if (jump.event >= 0) {
    std::vector<double> after = jump.y;
    const StateView before = view(jump.t, jump.y.data());
    events_->cross(jump.event, before, after.data() + n_, after.data() + 2 * n_);
    const auto minus = event_side(jump.t, jump.y.data()), plus = event_side(jump.t, after.data());
    events_->adjoint(jump.event, before, minus, plus, mu, gradient);
  } else {
    const auto moving = moving_time(
        jump, [&](double* after, double* rates) { state_.jump(jump.t, segment_start(jump.t), after, rates); });
    state_.jump_adjoint(jump.t, segment_start(jump.t), jump.y.data(), mu, gradient, moving ? &*moving : nullptr);
  }
  const std::vector<double> w(mu, mu + 2 * n_ + nz_);
  adjoint_at(jump.t, jump.y.data(), w.data(), mu, mup, gradient);
}

void Index2Dae::adjoint_at(double t, const double* y, const double* w, double* mu, double* mup, double* gradient) {
  // What a cost says of accelerations is said of those of the equations: the integrator's own are not held to its
  // tolerance, and an adjoint that begins off its constraints ends the run back.
  level_.solve(view(t, y));
  const StateView s = level_.state();
  level_.linearize(s);
  complete_adjoint(s, Eigen::Map<const Eigen::VectorXd>(w, n_), Eigen::Map<const Eigen::VectorXd>(w + n_, n_),
                   w + 2 * n_, mu, mup, gradient);
}

void Index2Dae::complete_adjoint(const StateView& s, Eigen::VectorXd wq, Eigen::VectorXd wv, const double* wz,
                                 double* mu, double* mup, double* gradient) {
  std::fill(mu, mu + size(), 0.0);
  std::fill(mup, mup + size(), 0.0);
  Eigen::VectorXd kkt(n_ + m_);
  double *P = mu + n_, *mz = mu + 2 * n_, *m1 = mz + nz_;
  std::copy(wz, wz + nz_, mz);
  ScalarGradient& g = cost_gradient_;
  // (i) KKT [mu; eta_v] = [w^_v + g_a; g_l]
  cost_gradient_.set_zero();
  objective_.add_running_gradient(s, assembly_, cost_gradient_);
  kkt << wv + g.a, g.lambda;
  level_.solve_kkt_transposed(kkt.data());
  const Eigen::VectorXd eta_v = kkt.tail(m_);
  std::copy(kkt.data(), kkt.data() + n_, m1);
  // Of a contact that slides the row of friction has its adjoint from there; that of a rate is found by the first step.
  for (const Assembly::SlidingRow& r : assembly_.sliding_rows()) m1[n_ + r.along] = eta_v[r.along];
  // (Phi_q Phi_q^T) eta_q = Phi_q (w^_q - Phid_q^T eta_v): least squares, so that redundant rows do no harm.
  const double before_q = largest(wq);
  costate::add_transposed_product(assembly_.jacobian(), assembly_.phid_q.data(), -1, eta_v.data(), wq.data());
  const Eigen::MatrixXd J = to_dense(assembly_.jacobian(), kept_jacobian().data());
  Eigen::VectorXd eta_q(m_);
  if (m_ > 0) eta_q = J.transpose().completeOrthogonalDecomposition().solve(wq);
  const double size_q = std::max(before_q, largest(wq));
  // (iii) mu_q = w^_q - Phi_q^T eta_q - Phid_q^T eta_v, P = w^_v - Phi_q^T eta_v
  Eigen::VectorXd mu_q = wq, p_v = wv;
  costate::add_transposed_product(assembly_.jacobian(), kept_jacobian().data(), -1, eta_q.data(), mu_q.data());
  level_.add_jacobian_transposed(-1, eta_v.data(), p_v.data());
  // What rounding leaves where the constraints carry all of it would pass for the adjoint's size.
  const auto drop_rounding = [](Eigen::VectorXd& left, double before) {
    if (largest(left) <= kRounding * before) left.setZero();
  };
  drop_rounding(mu_q, size_q);
  drop_rounding(p_v, largest(wv));
  std::copy(mu_q.data(), mu_q.data() + n_, mu);
  std::copy(p_v.data(), p_v.data() + n_, P);
  Assembly::ParameterWeights w;
  w.row_phi = eta_q.data();
  w.row_phid = eta_v.data();
  assembly_.add_parameter_gradient(s, w, -1, gradient);
  // Derivatives from the differential rows with kappa = nu = 0; the first step finds kappa and nu.
  for (int i = 0; i < n_; ++i) {
    mup[i] = -g.q[i];
    mup[n_ + i] = -g.v[i] - mu[i];
  }
  for (int i = 0; i < nz_; ++i) mup[2 * n_ + i] = -g.z[i];
  costate::add_transposed_product(assembly_.square(), assembly_.K.data(), 1, m1, mup);
  costate::add_transposed_product(assembly_.square(), assembly_.C.data(), 1, m1, mup + n_);
  slip_partials(assembly_, s, slip_q_, slip_v_);
  add_slips_transposed(1, m1 + n_, mup, mup + n_);
  if (nz_ > 0) {
    costate::add_transposed_product(assembly_.force_state(), assembly_.Q_z.data(), -1, m1, mup + 2 * n_);
    costate::add_transposed_product(assembly_.state_force(), assembly_.f_q.data(), -1, mz, mup);
    costate::add_transposed_product(assembly_.state_force(), assembly_.f_v.data(), -1, mz, mup + n_);
    costate::add_transposed_product(assembly_.state_state(), assembly_.f_z.data(), -1, mz, mup + 2 * n_);
  }
}

}  // namespace costate
