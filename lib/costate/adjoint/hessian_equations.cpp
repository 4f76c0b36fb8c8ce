#include "costate/adjoint/hessian_equations.h"

#include <Eigen/Dense>
#include <algorithm>

#include "costate/assembly/packed_state.h"
#include "costate/assembly/rolling_rows.h"
#include "costate/assembly/sliding_terms.h"
#include "costate/level/solved_end.h"

namespace costate {

HessianEquations::HessianEquations(std::shared_ptr<const Mechanism> mechanism, ParameterSelection parameters,
                                   Objective objective, Stabilization stabilization)
    : assembly_(std::move(mechanism), std::move(parameters)),
      objective_(std::move(objective)),
      level_(assembly_, stabilization),
      n_(assembly_.n()),
      m_(assembly_.m()),
      nz_(assembly_.nz()) {
  gradient_.resize(assembly_);
  change_.resize(assembly_);
  s_.assign(static_cast<std::size_t>(n_ + m_), 0);
  ds_ = s_;
  rows_.assign(static_cast<std::size_t>(3 * m_ + n_ + nz_), 0);
  set_directions(Eigen::MatrixXd(assembly_.np(), 0));
}

void HessianEquations::set_parameters(const double* rho) {
  assembly_.set_parameters(rho);
  start_.reset();
}

void HessianEquations::set_directions(const Eigen::MatrixXd& directions) {
  directions_ = directions;
  number_changes_.resize(static_cast<std::size_t>(directions.cols()));
  for (int k = 0; k < this->directions(); ++k)
    calc_number_changes(assembly_, directions_.col(k).data(), number_changes_[static_cast<std::size_t>(k)]);
  tangents_.setZero(state_size(), directions.cols());
  accelerations_.setZero(n_ + m_, directions.cols());
}

const Start& HessianEquations::start_point(double t) {
  if (!start_) start_ = std::make_unique<Start>(find_start(assembly_, t, true));
  return *start_;
}

void HessianEquations::start(double t, double* y, double* tangents) {
  const Start& s = start_point(t);
  Eigen::Map<Eigen::VectorXd> state(y, state_size());
  state << s.q, s.v, s.z;
  Eigen::Map<Eigen::MatrixXd> S(tangents, state_size(), directions());
  S << s.q_rho * directions_, s.v_rho * directions_, s.z_rho * directions_;
}

StateView HessianEquations::view(double t, const double* y) const { return packed_view(t, y, n_); }

void HessianEquations::solve_tangent(double t, const double* y, const double* tangents) {
  level_.solve(view(t, y));
  level_.linearize();
  if (directions() == 0) return;
  assembly_.calc_parameter_columns(level_.state(), columns_);
  tangents_ = Eigen::Map<const Eigen::MatrixXd>(tangents, state_size(), directions());
  along_.F.noalias() = columns_.F * directions_;
  along_.phi.noalias() = columns_.phi * directions_;
  along_.phid.noalias() = columns_.phid * directions_;
  along_.phidd.noalias() = columns_.phidd * directions_;
  along_.f.noalias() = columns_.f * directions_;
  tangent_columns_.clear();
  for (int k = 0; k < directions(); ++k) tangent_columns_.push_back(tangents_.col(k).data());
  level_.solve_tangent(tangent_columns_.data(), directions(), &along_, accelerations_.data());
}

void HessianEquations::motion(double t, const double* y, const double* tangents, double* yp, double* tangents_p) {
  solve_tangent(t, y, tangents);
  std::copy(y + n_, y + 2 * n_, yp);
  std::copy(level_.a(), level_.a() + n_, yp + n_);
  std::copy(assembly_.zdot.begin(), assembly_.zdot.end(), yp + 2 * n_);
  for (int k = 0; k < directions(); ++k) {
    const double* x = tangents_.col(k).data();
    double* xp = tangents_p + static_cast<std::ptrdiff_t>(k) * state_size();
    std::copy(x + n_, x + 2 * n_, xp);
    std::copy(accelerations_.col(k).data(), accelerations_.col(k).data() + n_, xp + n_);
    Eigen::Map<Eigen::VectorXd>(xp + 2 * n_, nz_) = along_.f.col(k);
    level_.add_state_rows(1, x, x + n_, x + 2 * n_, xp + 2 * n_);
  }
}

void HessianEquations::evaluate(double t, const double* y, const double* tangents) { solve_tangent(t, y, tangents); }

Variation HessianEquations::variation(int k) const {
  Variation d;
  d.q = tangents_.col(k).data();
  d.v = d.q + n_;
  d.z = d.q + 2 * n_;
  d.a = accelerations_.col(k).data();
  d.lambda = d.a + n_;
  d.numbers = number_changes_[static_cast<std::size_t>(k)].data();
  return d;
}

void HessianEquations::calc_change(bool terminal, int k, const double* s, const double* mu_z) {
  change_.set_zero();
  const StateView state = level_.state();
  const Variation d = variation(k);
  if (terminal)
    objective_.add_terminal_gradient_change(state, assembly_, d, change_);
  else
    objective_.add_running_gradient_change(state, assembly_, d, change_);
  add_equations_change(d, s, mu_z);
}

void HessianEquations::add_equations_change(const Variation& d, const double* s, const double* mu_z, double* by_time) {
  const StateView state = level_.state();
  const Stabilization& st = level_.stabilization();
  double *force = rows_.data(), *phi = force + n_, *phid = phi + m_, *phidd = phid + m_;
  for (int i = 0; i < n_; ++i) force[i] = -s[i];
  for (int i = 0; i < m_; ++i) {
    phidd[i] = assembly_.is_there(i) ? -s[n_ + i] : 0;
    phid[i] = st.by_rate() * phidd[i];
    phi[i] = assembly_.holds_position(i) ? st.by_value() * phidd[i] : 0;
  }
  TermWeights w;
  w.force = force;
  w.phidd = phidd;
  if (st.omega != 0) {
    w.phi = phi;
    w.phid = phid;
  }
  w.state = mu_z;
  const GradientTarget target{change_.q.data(), change_.v.data(),   change_.a.data(), change_.lambda.data(),
                              change_.z.data(), change_.rho.data(), by_time};
  add_gradient_change(assembly_, state, d, w, target);
  add_sliding_gradient_change(assembly_, state, d, s + n_, target);
}

void HessianEquations::add_transposed(double c, const double* s, const double* mu_z, double* out) const {
  level_.add_transposed(c, s, s + n_, mu_z, out, out + n_, out + 2 * n_);
}

void HessianEquations::end(double* mu, double* dmu, double* gradient, double* products) {
  const int N = state_size(), np = parameter_count();
  const auto assemble = [&](ScalarGradient& w, std::vector<double>& s, double* out, double* rho) {
    for (int j = 0; j < np; ++j) rho[j] += w.rho[j];
    std::fill(s.begin(), s.end(), 0.0);
    if (objective_.terminal_needs_accelerations()) {
      const Eigen::VectorXd t = eliminate_at_end(level_, assembly_, level_.state(), w, 1, rho);
      std::copy(t.data(), t.data() + n_ + m_, s.begin());
    }
    std::copy(w.q.data(), w.q.data() + n_, out);
    std::copy(w.v.data(), w.v.data() + n_, out + n_);
    std::copy(w.z.data(), w.z.data() + nz_, out + 2 * n_);
  };
  gradient_.set_zero();
  objective_.add_terminal_gradient(level_.state(), assembly_, gradient_);
  assemble(gradient_, s_, mu, gradient);
  for (int k = 0; k < directions(); ++k) {
    calc_change(true, k, s_.data(), nullptr);
    assemble(change_, ds_, dmu + static_cast<std::ptrdiff_t>(k) * N, products + static_cast<std::ptrdiff_t>(k) * np);
  }
  if (end_event_ && directions() > 0) move_end(mu, dmu, products);
}

void HessianEquations::solve_adjoint(const ScalarGradient& g, const double* x, std::vector<double>& s, double* xp,
                                     double* integrand) {
  for (int i = 0; i < n_; ++i) s[static_cast<std::size_t>(i)] = x[n_ + i] + g.a[i];
  std::copy(g.lambda.data(), g.lambda.data() + m_, s.begin() + n_);
  level_.solve_kkt_transposed(s.data());
  for (int i = 0; i < n_; ++i) {
    xp[i] = -g.q[i];
    xp[n_ + i] = -g.v[i] - x[i];
  }
  for (int i = 0; i < nz_; ++i) xp[2 * n_ + i] = -g.z[i];
  add_transposed(1, s.data(), x + 2 * n_, xp);
  std::copy(g.rho.data(), g.rho.data() + parameter_count(), integrand);
  assembly_.add_parameter_gradient(level_.state(), level_.stabilization().weights(s.data(), s.data() + n_, x + 2 * n_),
                                   -1, integrand);
}

void HessianEquations::adjoint(const double* mu, double* mup, double* integrand) {
  gradient_.set_zero();
  objective_.add_running_gradient(level_.state(), assembly_, gradient_);
  solve_adjoint(gradient_, mu, s_, mup, integrand);
}

void HessianEquations::adjoint(const double* mu, const double* dmu, double* mup, double* dmup, double* integrand,
                               double* product_integrands) {
  const int N = state_size(), np = parameter_count();
  adjoint(mu, mup, integrand);
  for (int k = 0; k < directions(); ++k) {
    const auto at = static_cast<std::ptrdiff_t>(k);
    calc_change(false, k, s_.data(), mu + 2 * n_);
    solve_adjoint(change_, dmu + at * N, ds_, dmup + at * N, product_integrands + at * np);
  }
}

void HessianEquations::solve_start_multipliers(const Start& start, const double* mu, double t, Eigen::VectorXd& x,
                                               Eigen::VectorXd& y) {
  // [Phi_q; B]^T [y; b] = mu_v, then [Phi_q; B]^T [x; .] = mu_q - Phid_q^T y - (B v)_q^T b, where B of the velocities
  // depends on q if a rate is given; with redundant rows the least solution. y keeps b. What sticks where it is has no
  // place.
  const auto& pattern = assembly_.jacobian();
  const auto transposed = [&](const std::vector<GivenStart>& given, const std::vector<int>& left_out) {
    Eigen::MatrixXd A = Eigen::MatrixXd::Zero(n_, m_ + static_cast<int>(given.size()));
    for (int j = 0; j < n_; ++j)
      for (auto e = pattern.column_start[j]; e < pattern.column_start[j + 1]; ++e)
        A(j, static_cast<int>(pattern.row[e])) += assembly_.phi_q[static_cast<std::size_t>(e)];
    for (const int row : left_out) A.col(row).setZero();
    for (std::size_t g = 0; g < given.size(); ++g) {
      if (given[g].coordinate >= 0) A(given[g].coordinate, m_ + static_cast<int>(g)) = 1;
      for (const auto& [i, j, factor] : given[g].terms) A(j, m_ + static_cast<int>(g)) += factor * start.q[i];
    }
    return Eigen::CompleteOrthogonalDecomposition<Eigen::MatrixXd>(A);
  };
  const Mechanism& m = assembly_.mechanism();
  const Eigen::Map<const Eigen::VectorXd> mu_q(mu, n_), mu_v(mu + n_, n_);
  if (start.rests)
    y = Eigen::VectorXd::Zero(m_ + static_cast<Eigen::Index>(m.given_velocities().size()));
  else
    y = transposed(m.given_velocities(), {}).solve(mu_v);
  Eigen::VectorXd right = mu_q;
  add_transposed_product(pattern, assembly_.phid_q.data(), -1, y.data(), right.data());
  for (std::size_t g = 0; g < m.given_velocities().size(); ++g)
    for (const auto& [i, j, factor] : m.given_velocities()[g].terms)
      right[i] -= factor * start.v[j] * y[m_ + static_cast<int>(g)];
  if (m.starts_at_equilibrium())
    solve_balance_multipliers(start, right, mu + 2 * n_, t, x);
  else
    x = transposed(m.given_positions(), rows_without_place(assembly_)).solve(right).head(m_);
}

void HessianEquations::begin(double t, const double* mu, const double* dmu, double* gradient, double* products) {
  const Start& start = start_point(t);
  const int N = state_size(), np = parameter_count();
  const auto pull = [&](const double* x, double* rho) {
    Eigen::Map<Eigen::VectorXd> out(rho, np);
    out += start.q_rho.transpose() * Eigen::Map<const Eigen::VectorXd>(x, n_);
    out += start.v_rho.transpose() * Eigen::Map<const Eigen::VectorXd>(x + n_, n_);
    out += start.z_rho.transpose() * Eigen::Map<const Eigen::VectorXd>(x + 2 * n_, nz_);
  };
  pull(mu, gradient);
  if (directions() == 0) return;
  const std::vector<double> rest(static_cast<std::size_t>(n_), 0.0), zero(static_cast<std::size_t>(m_), 0.0);
  StateView s = start.state(t);
  s.a = rest.data();
  s.lambda = zero.data();
  assembly_.calc_dynamics(s);
  assembly_.calc_partials(s);
  Eigen::VectorXd x, y;
  const bool balanced = assembly_.mechanism().starts_at_equilibrium();
  solve_start_multipliers(start, mu, t, x, y);
  if (balanced) {
    assembly_.calc_dynamics(s);
    assembly_.calc_partials(s);
  }
  x = -x;
  y = -y;
  TermWeights w;
  w.phi = x.data();
  w.phid = y.data();
  Eigen::MatrixXd dq = start.q_rho * directions_, dv = start.v_rho * directions_, dz = start.z_rho * directions_;
  Eigen::VectorXd moved(N);
  for (int k = 0; k < directions(); ++k) {
    Variation d;
    d.q = dq.col(k).data();
    d.v = dv.col(k).data();
    d.z = dz.col(k).data();
    d.a = rest.data();
    d.lambda = zero.data();
    d.numbers = number_changes_[static_cast<std::size_t>(k)].data();
    change_.set_zero();
    add_gradient_change(assembly_, s, d, w,
                        {change_.q.data(), change_.v.data(), change_.a.data(), change_.lambda.data(), change_.z.data(),
                         change_.rho.data()});
    for (std::size_t g = 0; g < assembly_.mechanism().given_velocities().size(); ++g)
      for (const auto& [i, j, factor] : assembly_.mechanism().given_velocities()[g].terms) {
        const double b = factor * y[m_ + static_cast<int>(g)];
        change_.q[i] += b * dv(j, k);
        change_.v[j] += b * dq(i, k);
      }
    double* out = products + static_cast<std::ptrdiff_t>(k) * np;
    moved = Eigen::Map<const Eigen::VectorXd>(dmu + static_cast<std::ptrdiff_t>(k) * N, N);
    moved.head(n_) += change_.q;
    moved.segment(n_, n_) += change_.v;
    if (balanced) add_balance_change(t, start, k, dq.col(k), dz.col(k), moved, out);
    pull(moved.data(), out);
    for (int j = 0; j < np; ++j) out[j] += change_.rho[j];
  }
}

}  // namespace costate
