#include "costate/candidate/candidate_blocks.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <limits>

#include "costate/adjoint/gradient_rate.h"
#include "costate/assembly/path_rates.h"
#include "costate/base/error.h"
#include "costate/formulation/formulation.h"
#include "costate/level/maggi_names.h"
#include "costate/linear/to_dense.h"

namespace costate {

Stabilization candidate_stabilization(const std::string& formulation, const std::shared_ptr<const Mechanism>& mechanism,
                                      const FormulationOptions& o) {
  if (const auto& make = find_formulation(formulation).candidate_stabilization) return make(mechanism, o);
  std::vector<std::string> possible;
  for (const auto& f : formulations())
    if (f.candidate_stabilization) possible.push_back(f.name);
  throw CapabilityError(fmt::format("A candidate adjoint cannot be written for formulation '{}'; possible are {}.",
                                    formulation, fmt::join(possible, ", ")));
}

namespace {

Eigen::VectorXd copy(const double* x, int count) {
  return count > 0 ? Eigen::VectorXd(Eigen::Map<const Eigen::VectorXd>(x, count)) : Eigen::VectorXd();
}

}  // namespace

CandidateBlocks::CandidateBlocks(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                                 Objective objective, const std::string& formulation, const FormulationOptions& options)
    : assembly_(mechanism, std::move(parameters)),
      objective_(std::move(objective)),
      level_(assembly_, candidate_stabilization(formulation, mechanism, options)),
      reduced_(find_formulation(formulation).constraints == ConstraintForm::independent),
      second_order_(find_formulation(formulation).adjoint_order == 2),
      maggi_(assembly_) {}

void CandidateBlocks::set_parameters(const double* rho) { assembly_.set_parameters(rho); }

std::vector<double> CandidateBlocks::plan(const std::vector<double>& times, const Motion& motion) {
  plan_.clear();
  std::vector<double> changes, y(static_cast<std::size_t>(2 * assembly_.n() + assembly_.nz()) + 1);
  if (!reduced_) return changes;
  StateView s;
  s.q = y.data();
  s.v = s.q + assembly_.n();
  s.z = s.v + assembly_.n();
  int chart = -1;
  for (const double t : times) {
    motion(t, y.data());
    s.t = t;
    if (chart >= 0 && maggi_.chart_ratio(chart, s) <= kWorstMaggiRatio) continue;
    const int best = maggi_.best_chart(s);
    if (chart >= 0 && best != chart) {
      plan_.push_back({t, chart});
      changes.push_back(t);
    }
    chart = best;
  }
  plan_.push_back({std::numeric_limits<double>::infinity(), chart});
  return changes;
}

int CandidateBlocks::chart(double t) const {
  if (plan_.empty()) return 0;
  std::size_t i = 0;
  while (plan_[i].end <= t) ++i;
  return plan_[i].chart;
}

AdjointBlocks CandidateBlocks::at(double t, const Motion& motion, int chart) {
  AdjointBlocks b;
  const int n = b.n = assembly_.n(), m = b.m = assembly_.m(), nz = b.nz = assembly_.nz();
  b.np = assembly_.np();
  std::vector<double> y(static_cast<std::size_t>(2 * n + nz) + 1);
  motion(t, y.data());
  StateView s;
  s.t = t;
  s.q = y.data();
  s.v = y.data() + n;
  s.z = y.data() + 2 * n;
  if (reduced_) {
    if (plan_.empty()) plan({t}, motion);
    maggi_.use_chart(plan_.size() == 1 ? plan_[0].chart : chart);
    maggi_.evaluate(s);
    b.a = copy(maggi_.state().a, n);
    b.lambda = copy(maggi_.state().lambda, m);
  } else {
    level_.solve(s);
    b.a = copy(level_.a(), n);
    b.lambda = copy(level_.lambda(), m);
  }
  b.t = t;
  b.q = copy(s.q, n);
  b.v = copy(s.v, n);
  b.z = copy(s.z, nz);
  b.rho = copy(assembly_.rho().data(), b.np);
  const Stabilization& st = level_.stabilization();
  b.xi = st.xi;
  b.omega = st.omega;
  b.inverse_alpha = st.inverse_alpha;
  const double c1 = st.by_rate(), c0 = st.by_value();

  s.a = b.a.data();
  s.lambda = b.lambda.data();
  Assembly::ParameterColumns columns, none;
  assembly_.resize(none);
  // The constituents of K and F_rho: without a and lambda, -Q_q alone remains.
  const Eigen::VectorXd zero_a = Eigen::VectorXd::Zero(n), zero_lambda = Eigen::VectorXd::Zero(m);
  StateView rest = s;
  rest.a = zero_a.data();
  rest.lambda = zero_lambda.data();
  assembly_.calc_partials(rest);
  b.Q_q = -to_dense(assembly_.square(), assembly_.K.data());
  assembly_.calc_parameter_columns(rest, none);
  b.Q_rho = -none.F;
  rest.lambda = b.lambda.data();
  assembly_.calc_parameter_columns(rest, none);
  b.Phi_lambda_rho = none.F + b.Q_rho;
  std::vector<double> hessian;
  assembly_.calc_hessian(s, b.lambda.data(), hessian);
  b.Phi_lambda_q = to_dense(assembly_.square(), hessian.data());

  assembly_.calc_partials(s);
  assembly_.calc_parameter_columns(s, columns);
  b.M = to_dense(assembly_.square(), assembly_.M.data());
  b.K = to_dense(assembly_.square(), assembly_.K.data());
  b.C = to_dense(assembly_.square(), assembly_.C.data());
  b.Q_v = -b.C;
  b.Ma_q = b.K - b.Phi_lambda_q + b.Q_q;
  b.Phi_q = to_dense(assembly_.jacobian(), assembly_.phi_q.data());
  b.Phid_q = to_dense(assembly_.jacobian(), assembly_.phid_q.data());
  b.Phidd_q = to_dense(assembly_.jacobian(), assembly_.phidd_q.data());
  b.R2_q = b.Phidd_q + c1 * b.Phid_q + c0 * b.Phi_q;
  b.R2_v = 2 * b.Phid_q + c1 * b.Phi_q;
  b.Q_z = to_dense(assembly_.force_state(), assembly_.Q_z.data());
  b.f_q = to_dense(assembly_.state_force(), assembly_.f_q.data());
  b.f_v = to_dense(assembly_.state_force(), assembly_.f_v.data());
  b.f_z = to_dense(assembly_.state_state(), assembly_.f_z.data());
  b.F_rho = columns.F;
  b.Ma_rho = columns.F - b.Phi_lambda_rho + b.Q_rho;
  b.Phi_rho = columns.phi;
  b.Phid_rho = columns.phid;
  b.Phidd_rho = columns.phidd;
  b.R2_rho = b.Phidd_rho + c1 * b.Phid_rho + c0 * b.Phi_rho;
  b.f_rho = columns.f;
  // What is zero but for rounding of the differences above is zero.
  const auto clean = [](Eigen::MatrixXd& x, const Eigen::MatrixXd& a, const Eigen::MatrixXd& c,
                        const Eigen::MatrixXd& d) {
    for (Eigen::Index j = 0; j < x.cols(); ++j)
      for (Eigen::Index i = 0; i < x.rows(); ++i)
        if (std::abs(x(i, j)) <= 1e-14 * (std::abs(a(i, j)) + std::abs(c(i, j)) + std::abs(d(i, j)))) x(i, j) = 0;
  };
  clean(b.Ma_q, b.K, b.Phi_lambda_q, b.Q_q);
  clean(b.Phi_lambda_rho, none.F, b.Q_rho, b.Q_rho);
  clean(b.Ma_rho, b.F_rho, b.Phi_lambda_rho, b.Q_rho);

  ScalarGradient g;
  g.resize(assembly_);
  g.set_zero();
  objective_.add_running_gradient(s, assembly_, g);
  b.g_q = g.q;
  b.g_v = g.v;
  b.g_a = g.a;
  b.g_lambda = g.lambda;
  b.g_z = g.z;
  b.g_rho = g.rho;
  g.set_zero();
  objective_.add_terminal_gradient(s, assembly_, g);
  b.w_q = g.q;
  b.w_v = g.v;
  b.w_a = g.a;
  b.w_lambda = g.lambda;
  b.w_z = g.z;
  b.w_rho = g.rho;
  if (reduced_) add_reduced(b, columns);
  if (second_order_) add_second_order(b, s);
  return b;
}

void CandidateBlocks::add_reduced(AdjointBlocks& b, const Assembly::ParameterColumns& columns) {
  MaggiBlocks& x = maggi_;
  x.evaluate_parameters(columns);
  b.f = x.freedoms();
  b.B.setZero(b.f, b.n);
  for (int i = 0; i < b.f; ++i) b.B(i, x.independent()[static_cast<std::size_t>(i)]) = 1;
  b.R = x.R;
  b.S = x.times_S(Eigen::MatrixXd::Identity(b.m, b.m));
  b.D = x.D;
  b.E = 2 * x.D;
  b.A = x.A;
  b.My = x.My;
  b.Cy = x.Cy;
  b.Ky = x.Ky;
  b.Qy_z = x.Qz;
  b.f_yd = x.Zv;
  b.f_y = x.Zq;
  b.N_rho = x.Nr;
  b.V_rho = x.Vr;
  b.A_rho = x.Ar;
  b.Fy = x.Fy;
  b.fy_rho = x.Zr;
  x.add_null_weight(b.g_lambda, b.g_q, b.g_rho);
  x.add_null_weight(b.w_lambda, b.w_q, b.w_rho);
}

void CandidateBlocks::add_second_order(AdjointBlocks& b, const StateView& s) {
  if (objective_.running_needs_accelerations())
    throw CapabilityError(
        "An adjoint of second order needs derivatives of the accelerations where the running cost depends on "
        "accelerations or reactions; write the candidate for a first-order formulation.");
  PathRates rates;
  calc_path_rates(assembly_, s, rates);
  const Eigen::MatrixXd M1 = to_dense(assembly_.square(), rates.M_dot.data()),
                        M2 = to_dense(assembly_.square(), rates.M_ddot.data()),
                        C1 = to_dense(assembly_.square(), rates.C_dot.data());
  b.f_v_dot = to_dense(assembly_.state_force(), rates.f_v_dot.data());
  ScalarGradient rate;
  rate.resize(assembly_);
  calc_running_gradient_rate(objective_, assembly_, s, rate);
  b.g_v_dot = rate.v;
  if (!reduced_) {
    const double al = 1 / b.inverse_alpha, c1 = 2 * b.xi * b.omega;
    const Eigen::MatrixXd J = b.Phi_q, Jt = J.transpose(), J1t = b.Phid_q.transpose();
    const Eigen::MatrixXd mixed = Jt * b.Phid_q, curved = Jt * b.Phidd_q;
    b.Mb = b.M + al * Jt * J;
    b.Mb_dot = M1 + al * (mixed + mixed.transpose());
    b.Mb_ddot = M2 + al * (curved + curved.transpose() + 2 * J1t * b.Phid_q);
    b.Cb = b.C + al * Jt * b.R2_v;
    b.Cb_dot = C1 + al * (J1t * b.R2_v + 2 * curved + c1 * mixed);
    b.Kb = b.K + al * Jt * b.R2_q;
    b.Rb = b.F_rho + al * Jt * b.R2_rho;
    return;
  }
  // (5.11)
  const Eigen::MatrixXd Rt = b.R.transpose(), Dt = b.D.transpose(), At = b.A.transpose();
  const Eigen::MatrixXd RMD = Rt * b.M * b.D, RM1D = Rt * M1 * b.D, RMA = Rt * b.M * b.A;
  b.My_dot = Rt * M1 * b.R + RMD + RMD.transpose();
  b.My_ddot = Rt * M2 * b.R + 2 * (RM1D + RM1D.transpose() + Dt * b.M * b.D) + RMA + RMA.transpose();
  b.Cy_dot = Dt * (b.C * b.R + 2 * b.M * b.D) + Rt * (C1 * b.R + b.C * b.D) + 2 * RM1D + 2 * RMA;
  b.f_yd_dot = b.f_v_dot * b.R + b.f_v * b.D;
  b.g_y = Rt * b.g_q + Dt * b.g_v;
  b.g_yd = Rt * b.g_v;
  b.g_yd_dot = Dt * b.g_v + Rt * b.g_v_dot;
}

AdjointBlocks CandidateBlocks::with_rates(double t, const Motion& motion) {
  AdjointBlocks b = at(t, motion);
  b.M_dot.setZero(b.n, b.n);
  StateView s;
  s.t = t;
  s.q = b.q.data();
  s.v = b.v.data();
  s.z = b.z.data();
  Eigen::VectorXd unit = Eigen::VectorXd::Zero(b.n);
  for (int j = 0; j < b.n; ++j) {
    unit[j] = 1;
    assembly_.add_mass_rate_product(s, unit.data(), b.M_dot.col(j).data());
    unit[j] = 0;
  }
  if (reduced_) return b;
  ScalarGradient rate;
  rate.resize(assembly_);
  level_.solve(s);
  level_.linearize();
  calc_running_gradient_rate(objective_, assembly_, level_, rate);
  b.g_a_dot = rate.a;
  b.g_lambda_dot = rate.lambda;
  return b;
}

}  // namespace costate
