#include "costate/adjoint/second_tangents.h"

#include <Eigen/LU>
#include <algorithm>
#include <numeric>

#include "costate/assembly/packed_state.h"
#include "costate/assembly/slip_directions.h"
#include "costate/linear/dense_block.h"

namespace costate {

namespace {
using Eigen::Map;
using Eigen::MatrixXd;
using Eigen::RowVectorXd;
using Eigen::VectorXd;
using Tangents = std::vector<MatrixXd>;
}  // namespace

Tangents tangent_rates(const Tangents& of, const Tangents& tangents) {
  const Eigen::Index N = of[0].rows() - 1, M = of[0].cols();
  MatrixXd S = MatrixXd::Zero(M, M);  // (S, drho)
  S.topRows(N) = tangents[0].topRows(N);
  S.bottomRightCorner(M - N, M - N).setIdentity();
  Tangents out{of[0] * S};
  for (std::size_t k = 1; k < tangents.size(); ++k)
    out.push_back(of[k] * S + of[0].leftCols(N) * tangents[k].topRows(N));
  return out;
}

void SecondStretchMap::pull(double* mu, double* dmu, double* gradient, double* products) const {
  const Eigen::Index N = X.rows(), np = X.cols() - N;
  const VectorXd behind = Map<VectorXd>(mu, N);
  const auto spread = [&](const VectorXd& pulled, double* weights, double* rho) {
    Map<VectorXd>(weights, N) = pulled.head(N);
    Map<VectorXd>(rho, np) += pulled.tail(np);
  };
  for (std::size_t k = 0; k < dX.size(); ++k) {
    double* own = dmu + static_cast<Eigen::Index>(k) * N;
    spread(X.transpose() * Map<VectorXd>(own, N) + dX[k].transpose() * behind + dc[k], own,
           products + static_cast<Eigen::Index>(k) * np);
  }
  spread(X.transpose() * behind + c, mu, gradient);
}

SecondTangents::SecondTangents(const HessianEquations& of, const Objective& objective)
    : assembly_(of.assembly().mechanism_ptr(), of.assembly().parameters()),
      level_(assembly_, of.stabilization()),
      all_(assembly_.mechanism_ptr(), assembly_.parameters(), {}, of.stabilization()),
      along_(assembly_.mechanism_ptr(), assembly_.parameters(), objective, of.stabilization()),
      n_(assembly_.n()),
      N_(of.state_size()),
      M_(N_ + of.parameter_count()),
      k_(of.directions()),
      combined_(MatrixXd::Zero(M_, k_)),
      unit_(MatrixXd::Identity(N_, M_)) {
  const double* rho = of.assembly().rho().data();
  assembly_.set_parameters(rho);
  for (HessianEquations* e : {&all_, &along_}) e->set_parameters(rho);
  MatrixXd parameters = MatrixXd::Zero(M_ - N_, M_);
  parameters.rightCols(M_ - N_).setIdentity();
  all_.set_directions(parameters);
  along_.set_directions(of.direction_columns());
  combined_.bottomRows(M_ - N_) = of.direction_columns();
}

void SecondTangents::rates(double t, const double* x, VectorXd& f, MatrixXd& A) {
  f.resize(N_);
  A.resize(N_, M_);
  all_.motion(t, x, unit_.data(), f.data(), A.data());
}

double SecondTangents::parts_of_slips(const double* x) const {
  return costate::parts_of_slips(all_.assembly(), x + n_);
}

// With L = g + w^T f at fixed w the change of L_x is what that of an adjoint of w has: w = e_i, less w = 0, gives row i
// of D f_x, w = 0 psi's.
void SecondTangents::changes(double t, const double* x, const MatrixXd& S, Tangents& all) {
  const int np = M_ - N_;
  all.assign(static_cast<std::size_t>(1 + k_), MatrixXd(N_ + 1, M_));
  VectorXd f, mup(N_), rho(np);
  MatrixXd A, dmup(N_, k_), drho(np, k_), cost(M_, k_), change(M_, k_);
  rates(t, x, f, A);
  const MatrixXd moved = along(S), none = MatrixXd::Zero(N_, k_);
  along_.evaluate(t, x, moved.data());
  for (MatrixXd& of : all) of.topRows(n_) = MatrixXd::Zero(n_, M_);
  all[0].topRows(N_) = A;
  for (int i = n_ - 1; i < N_; ++i) {
    const bool of_psi = i < n_;
    const VectorXd w = of_psi ? VectorXd(VectorXd::Zero(N_)) : VectorXd(VectorXd::Unit(N_, i));
    along_.adjoint(w.data(), none.data(), mup.data(), dmup.data(), rho.data(), drho.data());
    change << -dmup, drho;
    if (of_psi) {
      all[0].row(N_) << -mup.transpose(), rho.transpose();
      cost = change;
    } else {
      change -= cost;
    }
    for (int k = 0; k < k_; ++k) all[static_cast<std::size_t>(1 + k)].row(of_psi ? N_ : i) = change.col(k).transpose();
  }
}

Tangents SecondTangents::begin(const std::vector<double>& y) {
  combined_.topRows(N_) = Map<const MatrixXd>(y.data() + N_, N_, k_);
  Tangents tangents(static_cast<std::size_t>(1 + k_), MatrixXd::Zero(N_ + 1, M_));
  tangents[0].topLeftCorner(N_, N_).setIdentity();
  return tangents;
}

Tangents SecondTangents::begin(const HessianEquations::Event& event, const VectorXd& shifts) {
  Tangents tangents = begin(event.before);
  hold(event, tangents);
  // Accelerations are the same on either side, their derivatives are not: (13.17).
  const auto rates_at = [&](const std::vector<double>& x) {
    Tangents of;
    changes(event.t, x.data(), tangents[0], of);
    return tangent_rates(of, tangents)[0];
  };
  const MatrixXd jump = rates_at(event.before) - rates_at(event.after);
  for (int k = 0; k < k_; ++k) tangents[static_cast<std::size_t>(1 + k)] += shifts[k] * jump;
  return tangents;
}

// Before the event the rows along which it begins to slide were held: C (dx, drho) = 0 with C their (Phid_q, J, 0,
// Phid_rho), whatever the motion. Weights along C count nothing there, and columns may begin as those of the projection
//   dv -= B (J B)^-1 C (dx, drho),   B = J^T of this motion, for those beside it, too,
// which have no slip: others would have 1/|w|^2 in their changes. What the event sets depends on nothing before it.
void SecondTangents::hold(const HessianEquations::Event& event, Tangents& tangents) {
  const int m = assembly_.m();
  MatrixXd& first = tangents[0];
  for (int i = 2 * n_; i < N_; ++i)
    if (event.before[static_cast<std::size_t>(i)] != event.after[static_cast<std::size_t>(i)]) first(i, i) = 0;
  const auto rows_there = [&](const std::vector<double>& x) {
    level_.solve(packed_view(event.t, x.data(), n_));
    std::vector<char> there(static_cast<std::size_t>(m));
    for (int r = 0; r < m; ++r) there[static_cast<std::size_t>(r)] = assembly_.is_there(r);
    return there;
  };
  const std::vector<char> after = rows_there(event.after), before = rows_there(event.before);
  level_.linearize();
  const StateView s = level_.state();
  Assembly::ParameterColumns columns;
  assembly_.calc_parameter_columns(s, columns);
  std::vector<int> held;
  for (int r = 0; r < m; ++r)
    if (before[static_cast<std::size_t>(r)] && !after[static_cast<std::size_t>(r)]) held.push_back(r);
  const auto count = static_cast<Eigen::Index>(held.size());
  std::vector<int> all(static_cast<std::size_t>(n_));
  std::iota(all.begin(), all.end(), 0);
  const auto rows_of = [&](const std::vector<double>& values) {
    return dense_block(assembly_.jacobian(), values.data(), held, all);
  };
  MatrixXd C(count, M_), dC = MatrixXd::Zero(count, M_);
  C << rows_of(assembly_.phid_q), rows_of(assembly_.phi_q), MatrixXd::Zero(count, N_ - 2 * n_),
      columns.phid(held, Eigen::all);
  const MatrixXd J = C.middleCols(n_, n_), B = J.transpose(), G = B * (J * B).inverse();
  first.middleRows(n_, n_) -= G * C;
  const std::vector<double> rest(static_cast<std::size_t>(n_ + m), 0);
  std::vector<double> numbers, weights(static_cast<std::size_t>(m), 0);
  ScalarGradient change;
  change.resize(assembly_);
  for (int k = 0; k < k_; ++k) {
    const double* moved = combined_.col(k).data();
    calc_number_changes(assembly_, moved + N_, numbers);
    const Variation d{0, moved, moved + n_, rest.data(), rest.data(), moved + 2 * n_, numbers.data()};
    for (Eigen::Index i = 0; i < count; ++i) {
      double& weight = weights[static_cast<std::size_t>(held[static_cast<std::size_t>(i)])];
      weight = 1;
      TermWeights w;
      w.phid = weights.data();
      change.set_zero();
      add_gradient_change(assembly_, s, d, w,
                          {change.q.data(), change.v.data(), change.a.data(), change.lambda.data(), change.z.data(),
                           change.rho.data()});
      weight = 0;
      dC.row(i) << change.q.transpose(), change.v.transpose(), RowVectorXd::Zero(N_ - 2 * n_), change.rho.transpose();
    }
    tangents[static_cast<std::size_t>(1 + k)].middleRows(n_, n_) = -G * (dC - dC.middleCols(n_, n_) * G * C);
  }
}

SecondStretchMap SecondTangents::map(const Tangents& tangents) const {
  SecondStretchMap map{tangents[0].topRows(N_), tangents[0].row(N_).transpose(), {}, {}};
  for (std::size_t k = 1; k < tangents.size(); ++k) {
    map.dX.emplace_back(tangents[k].topRows(N_));
    map.dc.emplace_back(tangents[k].row(N_).transpose());
  }
  return map;
}

}  // namespace costate
