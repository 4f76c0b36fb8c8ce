#include "costate/adjoint/maggi_blocks.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/analysis/mechanism_size.h"
#include "costate/assembly/reaction_rates.h"
#include "costate/assembly/rolling_rows.h"
#include "costate/assembly/sliding_terms.h"
#include "costate/assembly/slip_directions.h"
#include "costate/base/error.h"
#include "costate/level/maggi_choice.h"

namespace costate {

Eigen::MatrixXd times(const SparsePattern& A, const std::vector<double>& values, const Eigen::MatrixXd& x) {
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(A.rows, x.cols());
  if (y.size() > 0)
    for (Eigen::Index j = 0; j < x.cols(); ++j) add_product(A, values.data(), 1, x.col(j).data(), y.col(j).data());
  return y;
}

Eigen::MatrixXd transposed_times(const SparsePattern& A, const std::vector<double>& values, const Eigen::MatrixXd& x) {
  Eigen::MatrixXd y = Eigen::MatrixXd::Zero(A.cols, x.cols());
  if (y.size() > 0)
    for (Eigen::Index j = 0; j < x.cols(); ++j)
      add_transposed_product(A, values.data(), 1, x.col(j).data(), y.col(j).data());
  return y;
}

MaggiBlocks::MaggiBlocks(Assembly& assembly)
    : assembly_(assembly),
      n_(assembly.n()),
      m_(assembly.m()),
      f_(open_freedoms(assembly)),
      nz_(assembly.nz()),
      charts_(assembly, f_),
      switched_(find_switched_rows(assembly)) {}

bool MaggiBlocks::has_rows(int chart, const double* z) {
  if (switched_.empty()) return true;
  assembly_.switch_rows(z);
  return rows_there(assembly_, switched_).same_modes(charts_[chart].rows);
}

int MaggiBlocks::best_chart(const StateView& at) {
  const double* q = at.q;
  if (weight_.empty()) {
    // Lengths count as they are, angles with the size of the mechanism.
    const auto& coordinates = assembly_.mechanism().coordinates();
    double low = std::numeric_limits<double>::infinity(), high = -low;
    for (int i = 0; i < n_; ++i) {
      if (coordinates[i].unit != "m") continue;
      low = std::min(low, q[i]);
      high = std::max(high, q[i]);
    }
    const double rounding = 1e-14 * extent_of(assembly_, Eigen::Map<const Eigen::VectorXd>(q, n_)).value_or(1),
                 size = high - low > rounding ? high - low : 1;
    for (int i = 0; i < n_; ++i) weight_.push_back(coordinates[i].unit == "m" ? 1 : size);
  }
  MaggiRows rows;
  assembly_.calc_jacobian(at);
  if (!switched_.empty()) {
    rows = rows_there(assembly_, switched_);
    find_dependent_rows(assembly_, switched_, rows);
  }
  return charts_.find_best(rows, weight_);
}

double MaggiBlocks::chart_ratio(int chart, const StateView& s) {
  const double infinite = std::numeric_limits<double>::infinity();
  if (!has_rows(chart, s.z)) return infinite;
  assembly_.calc_jacobian(s);
  const auto ratio_of = [&](MaggiChart& X, const double* values) {
    if (!X.factor(values)) return infinite;
    const double ratio = worst_ratio(X.independent(), null_space(X).data(), weight_);
    return std::isfinite(ratio) ? ratio : infinite;
  };
  const MaggiCharts::Chart& c = charts_[chart];
  const double ratio = ratio_of(*c.rates, assembly_.phi_q.data());
  if (!c.forces) return ratio;
  calc_reaction_rows(assembly_, reactions_);
  return std::max(ratio, ratio_of(*c.forces, reactions_.data()));
}

Eigen::MatrixXd MaggiBlocks::null_space(MaggiChart& X) const {
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(X.rows(), f_);
  b.bottomRows(f_).setIdentity();
  if (f_ > 0) X.solve(b.data(), f_);
  return b.topRows(n_);
}

Eigen::MatrixXd MaggiBlocks::times_S(MaggiChart& X, const Eigen::MatrixXd& c) {
  Eigen::MatrixXd b = Eigen::MatrixXd::Zero(X.rows(), c.cols());
  b.topRows(c.rows()) = c;
  if (c.cols() > 0) X.solve(b.data(), static_cast<int>(c.cols()));
  return b;
}

Eigen::MatrixXd MaggiBlocks::times_S(const Eigen::MatrixXd& c) { return times_S(*now().rates, c).topRows(n_); }

void MaggiBlocks::singular(const char* what) const {
  throw SolverError(
      fmt::format("The hand-derived equations of Maggi are not determined at t = {:.9g} s: {}", t_, what));
}

void MaggiBlocks::evaluate(const StateView& s) {
  t_ = s.t;
  q_ = Eigen::Map<const Eigen::VectorXd>(s.q, n_);
  v_ = Eigen::Map<const Eigen::VectorXd>(s.v, n_);
  z_ = Eigen::Map<const Eigen::VectorXd>(s.z, nz_);
  a_.setZero(n_);
  lambda_.setZero(m_);
  assembly_.calc_dynamics(state());
  MaggiChart& X = *now().rates;
  if (slides()) calc_reaction_rows(assembly_, reactions_);
  if (!X.factor(assembly_.phi_q.data()) || (slides() && !reactions().factor(reactions_.data())))
    singular(
        "the independent coordinates in use are singular there, and no others serve for the whole step. Ask "
        "for "
        "a tighter rtol, so that steps are shorter; the mechanism may pass a singular configuration.");
  const SparsePattern &square = assembly_.square(), &jacobian = assembly_.jacobian();

  // (5.1), (5.2): a = R ydd + S c, c = -bias; My ydd = R^T (Q - M S c); lambda = -S^T (M a - Q).
  R = null_space(X);
  Rr = slides() ? null_space(reactions()) : R;
  const Eigen::MatrixXd MR = times(square, assembly_.M, R);
  My = Rr.transpose() * MR;
  const auto free = static_cast<Eigen::Index>(independent().size());
  for (Eigen::Index i = free; i < f_; ++i) My(i, i) = 1;  // of places, which stay
  if (slides())
    slip_factor_.compute(My);
  else
    mass_factor_.compute(My);
  if (!slides() && mass_factor_.info() != Eigen::Success)
    singular(
        "a motion that the constraints allow moves no mass. Give the bodies that it moves mass, or constrain "
        "it.");
  const Eigen::Map<const Eigen::VectorXd> Q(assembly_.Q.data(), n_), bias(assembly_.bias.data(), m_);
  a_ = times_S(-bias);
  a_ += R * solve_mass(Rr.transpose() * (Q - times(square, assembly_.M, a_)));
  Eigen::VectorXd h = Eigen::VectorXd::Zero(std::max(n_, X.rows()));
  h.head(n_) = times(square, assembly_.M, a_) - Q;
  reactions().solve_transposed(h.data());
  lambda_ = -h.head(m_);
  add_friction_multipliers(assembly_, lambda_.data());
  if (X.redundant()) normal_ = Eigen::Map<const Eigen::VectorXd>(X.normal_solution(), n_);
  assembly_.calc_partials(state());
  add_slip_forces(assembly_, state(), slip_q_, slip_v_);

  // (5.9)
  Rp = R;
  for (Eigen::Index i = free; i < f_; ++i)
    if (const int row = places()[static_cast<std::size_t>(i - free)]; !assembly_.holds_position(row))
      Rp.col(i) = times_S(Eigen::VectorXd::Unit(m_, row));
  D = times_S(-times(jacobian, assembly_.phid_q, Rp));
  E = 2 * (places().empty() ? D : times_S(-times(jacobian, assembly_.phid_q, R)));
  A = times_S(-times(jacobian, assembly_.phidd_q, Rp) - 2 * times(jacobian, assembly_.phid_q, D));
  Cy = Rr.transpose() * (times(square, assembly_.C, R) + times(square, assembly_.M, E));
  Ky =
      Rr.transpose() * (times(square, assembly_.K, Rp) + times(square, assembly_.C, D) + times(square, assembly_.M, A));
  Qz = transposed_times(assembly_.force_state(), assembly_.Q_z, Rr).transpose();
  Zv = times(assembly_.state_force(), assembly_.f_v, R);
  Zq = times(assembly_.state_force(), assembly_.f_q, Rp) + times(assembly_.state_force(), assembly_.f_v, D);
}

StateView MaggiBlocks::state() const {
  StateView s;
  s.t = t_;
  s.q = q_.data();
  s.v = v_.data();
  s.a = a_.data();
  s.lambda = lambda_.data();
  s.z = z_.data();
  return s;
}

void MaggiBlocks::evaluate_rates() {
  R1 = 0.5 * E;
  R2 = A;
  R2.rightCols(static_cast<Eigen::Index>(places().size())).setZero();
  Rr1 = R1;
  Rr2 = R2;
  if (!slides()) return;
  std::vector<double> along1, along2;
  if (calc_reaction_rates(assembly_, state(), along1, along2)) {
    // J' of spheres that would roll if they did not slide
    add_rolling_rates(assembly_, state(), along1);
    assembly_.calc_dynamics(state());
    assembly_.calc_partials(state());
    add_slip_forces(assembly_, state(), slip_q_, slip_v_);
  }
  // R_r' = -S_r Phi_r' R_r,  R_r'' = -S_r (Phi_r'' R_r + 2 Phi_r' R_r')
  std::vector<double> rows1 = assembly_.phid_q, rows2 = assembly_.phidd_q;
  add_friction_rows(assembly_, along1, rows1);
  add_friction_rows(assembly_, along2, rows2);
  add_turning_friction(assembly_, state(), rows1);
  const SparsePattern& jacobian = assembly_.jacobian();
  Rr1 = times_S(reactions(), -times(jacobian, rows1, Rr)).topRows(n_);
  Rr2 = times_S(reactions(), -times(jacobian, rows2, Rr) - 2 * times(jacobian, rows1, Rr1)).topRows(n_);
}

void MaggiBlocks::evaluate_parameters(const Assembly::ParameterColumns& c) {
  const SparsePattern &square = assembly_.square(), &jacobian = assembly_.jacobian(), &rates = assembly_.state_force();
  Nr = times_S(-c.phi);
  Vr = times_S(-c.phid - times(jacobian, assembly_.phid_q, Nr));
  Ar = times_S(-c.phidd - times(jacobian, assembly_.phidd_q, Nr) - 2 * times(jacobian, assembly_.phid_q, Vr));
  Lr.setZero(m_, c.F.cols());
  for (const Assembly::SlidingRow& r : assembly_.sliding_rows()) Lr.row(r.along) = c.phidd.row(r.along);
  F = c.F;
  if (slides()) F += transposed_times(jacobian, assembly_.reaction_jacobian(), Lr);
  Fy = Rr.transpose() *
       (F + times(square, assembly_.K, Nr) + times(square, assembly_.C, Vr) + times(square, assembly_.M, Ar));
  Zr = c.f + times(rates, assembly_.f_q, Nr) + times(rates, assembly_.f_v, Vr);
}

Eigen::MatrixXd MaggiBlocks::multiplier_change(const Eigen::MatrixXd& dR1) {
  MaggiChart& X = reactions();
  Eigen::MatrixXd out(m_, dR1.cols());
  Eigen::VectorXd h(std::max(n_, X.rows()));
  for (Eigen::Index j = 0; j < dR1.cols(); ++j) {
    h.setZero();
    h.head(n_) = dR1.col(j);
    X.solve_transposed(h.data());
    out.col(j) = -h.head(m_);
    add_friction_multipliers(assembly_, out.col(j).data());
  }
  return out;
}

Eigen::MatrixXd MaggiBlocks::friction_change(const Eigen::MatrixXd& dq, const Eigen::MatrixXd& dv) const {
  if (slip_q_.empty()) return Lr;
  return Lr + times(assembly_.jacobian(), slip_q_, dq) + times(assembly_.jacobian(), slip_v_, dv);
}

void MaggiBlocks::add_null_weight(const Eigen::VectorXd& y, Eigen::VectorXd& q, Eigen::VectorXd& rho) {
  if (!now().rates->redundant() || y.isZero(0)) return;
  const Eigen::VectorXd null = y - times(assembly_.jacobian(), assembly_.phi_q, times_S(y));
  // null^T (Phi_q u)_q = u^T (Phi_q^T null)_q
  std::vector<double> hessian(assembly_.square().row.size(), 0);
  assembly_.calc_hessian(state(), null.data(), hessian);
  q -= transposed_times(assembly_.square(), hessian, normal_);
  // (Phi_q u)_rho = Phid_rho at v = u less that at v = 0.
  const Eigen::VectorXd rest = Eigen::VectorXd::Zero(n_);
  Assembly::ParameterWeights w;
  w.row_phid = null.data();
  StateView s = state();
  s.v = normal_.data();
  assembly_.add_parameter_gradient(s, w, -1, rho.data());
  s.v = rest.data();
  assembly_.add_parameter_gradient(s, w, 1, rho.data());
}

// With x = S g_l^T: ga = g_a - x^T M, gv = g_v - x^T C, gq = g_q - x^T K, gz = g_z + x^T Q_z, gr = g_rho -
// x^T F_rho; then gydd = ga R, gyd = gv R + ga E, gy = gq R + gv D + ga A, and gr + gq Nr + gv Vr + ga Ar.
MaggiBlocks::Reduced MaggiBlocks::reduce(const ScalarGradient& g, bool with_parameters) {
  Eigen::VectorXd q = g.q, v = g.v, a = g.a;
  Reduced r;
  r.z = g.z;
  r.rho = g.rho;
  if (!g.lambda.isZero(0)) {
    const SparsePattern& square = assembly_.square();
    Eigen::VectorXd weights = g.lambda;
    pull_friction_multipliers(assembly_, weights.data());
    const Eigen::VectorXd x = times_S(reactions(), weights).topRows(n_);
    a -= transposed_times(square, assembly_.M, x);
    v -= transposed_times(square, assembly_.C, x);
    q -= transposed_times(square, assembly_.K, x);
    r.z += transposed_times(assembly_.force_state(), assembly_.Q_z, x);
    if (with_parameters) r.rho += Lr.transpose() * g.lambda - F.transpose() * x;
    add_null_weight(g.lambda, q, r.rho);
    if (!slip_q_.empty()) {
      q += transposed_times(assembly_.jacobian(), slip_q_, g.lambda);
      v += transposed_times(assembly_.jacobian(), slip_v_, g.lambda);
    }
  }
  r.ydd = R.transpose() * a;
  r.yd = R.transpose() * v + E.transpose() * a;
  r.y = Rp.transpose() * q + D.transpose() * v + A.transpose() * a;
  if (with_parameters) r.rho += Nr.transpose() * q + Vr.transpose() * v + Ar.transpose() * a;
  return r;
}

MaggiBlocks::Reduced MaggiBlocks::reduce_and_eliminate(const ScalarGradient& g) {
  Reduced r = reduce(g, true);
  const Eigen::VectorXd tau = solve_mass_transposed(r.ydd);
  r.y -= Ky.transpose() * tau;
  r.yd -= Cy.transpose() * tau;
  r.z += Qz.transpose() * tau;
  r.rho -= Fy.transpose() * tau;
  r.ydd.setZero();
  return r;
}

// [u; p] with Phi_q u = g, M u + Phi_q^T p = h: u = S g + R y, My y = R^T (h - M S g), p = S^T (h - M u).
void MaggiBlocks::solve_impulses(double* b) {
  const SparsePattern& square = assembly_.square();
  Eigen::Map<Eigen::VectorXd> h(b, n_), g(b + n_, m_);
  Eigen::VectorXd u = times_S(g);
  u += R * solve_mass(R.transpose() * (h - times(square, assembly_.M, u)));
  const Eigen::VectorXd p = -multiplier_change(h - times(square, assembly_.M, u));
  h = u;
  g = p;
}

long MaggiBlocks::factorizations() const { return charts_.factorizations(); }

}  // namespace costate
