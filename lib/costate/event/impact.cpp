#include "costate/event/impact.h"

#include <fmt/format.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "costate/assembly/slip_turn.h"
#include "costate/base/error.h"
#include "costate/linear/shortest_solution.h"

namespace costate {

namespace {
// A speed along the ground behind an impact of this part of those before it has no direction.
constexpr double kNoSlip = 1e-9;
// Pivots this far apart: two solutions of an impact meet, or rows depend on each other.
constexpr double kFold = 1e-9;

int rank_of(const Eigen::MatrixXd& A) {
  Eigen::FullPivLU<Eigen::MatrixXd> lu(A.rowwise().normalized());
  lu.setThreshold(kFold);
  return static_cast<int>(lu.rank());
}

/// r_i at (q, p) with the first time derivatives qdot, and dual parts of the coordinate or number `seed`.
PathDual row_value(const ImpactRow& r, const std::vector<PathDual>& q, const std::vector<PathDual>& p) {
  MeasureArguments x;
  x.q = q.data();
  x.p = p.data();
  return r.contact->row(r.row, x);
}
}  // namespace

double Impact::factor(const ImpactRow& r) const {
  if (!r.bounces) return r.rests ? 0 : 1;
  const int number = r.force->numbers()[static_cast<std::size_t>(r.contact->restitution_number())];
  return 1 + assembly_.numbers()[static_cast<std::size_t>(number)];
}

void Impact::evaluate(Row& row, bool second) {
  const Force& force = *row.of.force;
  const auto& c = force.coordinates();
  const std::size_t k = c.size();
  std::vector<PathDual> q(k), p;
  for (std::size_t i = 0; i < k; ++i) q[i] = PathDual(before_.q[c[i]]);
  for (const int number : force.numbers()) p.emplace_back(assembly_.numbers()[static_cast<std::size_t>(number)]);
  row.factor = factor(row.of);
  if (!second) {
    row.J.assign(k, 0);
    for (std::size_t i = 0; i < k; ++i) {
      q[i].v.c1 = 1;
      row.J[i] = row_value(row.of, q, p).v.c1;
      q[i].v.c1 = 0;
    }
    return;
  }
  row.parameters.clear();
  for (std::size_t i = 0; i < p.size(); ++i)
    if (!assembly_.number_columns()[static_cast<std::size_t>(force.numbers()[i])].empty())
      row.parameters.push_back(static_cast<int>(i));
  row.H.setZero(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(k));
  row.J_p.setZero(static_cast<Eigen::Index>(k), static_cast<Eigen::Index>(row.parameters.size()));
  for (std::size_t l = 0; l < k; ++l) {  // along e_l: r' = J_l, whose derivatives by q and p are those of J_l
    q[l].v.c1 = 1;
    const auto at = static_cast<Eigen::Index>(l);
    for (std::size_t i = 0; i < k; ++i) {
      q[i].d[0] = Taylor2(1.0);
      row.H(static_cast<Eigen::Index>(i), at) = row_value(row.of, q, p).d[0].c1;
      q[i].d[0] = Taylor2();
    }
    for (std::size_t i = 0; i < row.parameters.size(); ++i) {
      PathDual& number = p[static_cast<std::size_t>(row.parameters[i])];
      number.d[0] = Taylor2(1.0);
      row.J_p(at, static_cast<Eigen::Index>(i)) = row_value(row.of, q, p).d[0].c1;
      number.d[0] = Taylor2();
    }
    q[l].v.c1 = 0;
  }
}

double Impact::along(const Row& row, const double* x) const {
  const auto& c = row.of.force->coordinates();
  double sum = 0;
  for (std::size_t i = 0; i < c.size(); ++i) sum += row.J[i] * x[c[i]];
  return sum;
}

void Impact::prepare(const StateView& before, std::vector<ImpactRow> rows) {
  const auto size = static_cast<std::size_t>(assembly_.n() + assembly_.m());
  before_ = before;
  rows_.clear();
  for (ImpactRow& r : rows) rows_.push_back({r, {}, {}, {}, {}, 1});
  balance_.prepare(before_);
  response_.assign(rows_.size(), std::vector<double>(size, 0));
  before_rate_.assign(rows_.size(), 0);
  W_.setZero(static_cast<Eigen::Index>(rows_.size()), static_cast<Eigen::Index>(rows_.size()));
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    evaluate(rows_[i], false);
    before_rate_[i] = along(rows_[i], before_.v);
    const auto& c = rows_[i].of.force->coordinates();
    for (std::size_t k = 0; k < c.size(); ++k) response_[i][static_cast<std::size_t>(c[k])] += rows_[i].J[k];
    balance_.solve(response_[i].data());
    for (std::size_t j = 0; j < rows_.size(); ++j) {
      if (rows_[j].J.empty()) evaluate(rows_[j], false);
      W_(static_cast<Eigen::Index>(j), static_cast<Eigen::Index>(i)) = along(rows_[j], response_[i].data());
    }
  }
}

double Impact::friction(const Row& row) const {
  const int number = row.of.force->numbers()[static_cast<std::size_t>(row.of.contact->friction_number())];
  return assembly_.numbers()[static_cast<std::size_t>(number)];
}

const std::vector<std::pair<int, double>>& Impact::friction_columns(const Row& row) const {
  const int number = row.of.force->numbers()[static_cast<std::size_t>(row.of.contact->friction_number())];
  return assembly_.number_columns()[static_cast<std::size_t>(number)];
}

Eigen::VectorXd Impact::row_scales() const {
  const double speeds_per_impulse = W_.size() > 0 ? W_.cwiseAbs().maxCoeff() : 0;
  Eigen::VectorXd scales = Eigen::VectorXd::Ones(static_cast<Eigen::Index>(active_.size()));
  for (std::size_t i = 0; i < active_.size(); ++i)
    if (active_[i].law != ActiveRow::Law::held && speeds_per_impulse > 0)
      scales[static_cast<Eigen::Index>(i)] = speeds_per_impulse;
  return scales;
}

void Impact::solve_bordered(std::vector<double>& b, Eigen::VectorXd& c) {
  balance_.solve(b.data());
  const auto k = static_cast<Eigen::Index>(active_.size());
  if (k == 0) return;
  Eigen::VectorXd rates(k);
  for (Eigen::Index i = 0; i < k; ++i) rates[i] = along(row_of(active_[static_cast<std::size_t>(i)]), b.data());
  const Eigen::VectorXd scales = row_scales();
  c = shortest_solution(scales.asDiagonal() * active_W_, scales.cwiseProduct(c - speeds_ * rates));
  for (Eigen::Index i = 0; i < k; ++i) {
    const auto& response = response_[static_cast<std::size_t>(active_[static_cast<std::size_t>(i)].row)];
    for (std::size_t j = 0; j < b.size(); ++j) b[j] += c[i] * response[j];
  }
}

void Impact::solve(const std::vector<ActiveRow>& active) {
  active_ = active;
  const auto k = static_cast<Eigen::Index>(active.size());
  active_W_.setZero(k, k);
  speeds_.setZero(k, k);
  Eigen::VectorXd c(k);
  for (Eigen::Index i = 0; i < k; ++i) {
    const ActiveRow& a = active[static_cast<std::size_t>(i)];
    const auto at = static_cast<std::size_t>(a.row);
    if (a.law == ActiveRow::Law::held) {
      c[i] = -rows_[at].factor * before_rate_[at];
      speeds_(i, i) = 1;
      for (Eigen::Index j = 0; j < k; ++j) active_W_(i, j) = W_(a.row, active[static_cast<std::size_t>(j)].row);
    } else {
      c[i] = a.given;
      active_W_(i, i) = 1;
      if (a.law == ActiveRow::Law::slides) {
        const auto gap = i - static_cast<Eigen::Index>(a.from_gap());
        active_W_(i, gap) = a.direction * friction(rows_[at]);
      }
    }
  }
  const auto n = static_cast<std::size_t>(assembly_.n());
  solution_.assign(n + static_cast<std::size_t>(assembly_.m()), 0);
  impulse_.assign(rows_.size(), 0);
  solve_bordered(solution_, c);
  for (Eigen::Index i = 0; i < k; ++i)
    impulse_[static_cast<std::size_t>(active[static_cast<std::size_t>(i)].row)] = c[i];
  after_.assign(before_.v, before_.v + n);
  for (std::size_t i = 0; i < n; ++i) after_[i] += solution_[i];
  after_rate_.assign(rows_.size(), 0);
  for (std::size_t i = 0; i < rows_.size(); ++i) after_rate_[i] = along(rows_[i], after_.data());
}

double Impact::energy_scale() const {
  double scale = 0;
  for (std::size_t i = 0; i < rows_.size(); ++i)
    scale += std::abs(impulse_[i]) * (std::abs(before_rate_[i]) + std::abs(after_rate_[i]));
  return scale;
}

double Impact::energy_lost() {
  double lost = 0;
  for (std::size_t i = 0; i < rows_.size(); ++i) lost -= 0.5 * impulse_[i] * (before_rate_[i] + after_rate_[i]);
  return lost;
}

void Impact::turn_slips() {
  int rank = 0;
  bool turned = false;
  for (std::size_t a = 0; a < active_.size(); ++a) {
    if (active_[a].component != 1) continue;
    if (!turned) rank = rank_of(active_W_);
    const auto i = static_cast<Eigen::Index>(a);
    const ActiveRow &along = active_[a], &across = active_[a + 1];
    const Eigen::Vector2d s(along.direction, across.direction), w(speed_after(along.row), speed_after(across.row));
    const double speed = w.norm(), before = std::hypot(speed_before(along.row), speed_before(across.row));
    if (!(speed > kNoSlip * std::max(before, std::abs(speed_before(active_[a - 1].row)))))
      throw SolverError(
          fmt::format("At t = {:.9g} s {} strikes and comes to rest along the ground just so: the "
                      "direction of its friction has no derivative there.",
                      before_.t, row_of(along).of.force->path()));
    const Eigen::Matrix2d turns = friction(row_of(along)) * impulse(active_[a - 1].row) * SlipTurn(s, speed).T;
    speeds_.block<2, 2>(i, i) = turns;
    for (Eigen::Index j = 0; j < active_W_.cols(); ++j) {
      const int other = active_[static_cast<std::size_t>(j)].row;
      active_W_.block<2, 1>(i, j) += turns * Eigen::Vector2d(W_(along.row, other), W_(across.row, other));
    }
    turned = true;
  }
  if (turned && rank_of(active_W_) < rank)
    throw SolverError(
        fmt::format("At t = {:.9g} s two directions to slide behind an impact of {} become one: neither "
                    "has a derivative there.",
                    before_.t, rows_.front().of.force->path()));
}

void Impact::linearize(bool columns) {
  turn_slips();
  const int n = assembly_.n(), m = assembly_.m();
  const std::vector<double> rest(static_cast<std::size_t>(std::max(n, m)), 0);
  for (const ActiveRow& a : active_) evaluate(rows_[static_cast<std::size_t>(a.row)], true);
  StateView s = before_;
  s.a = s.lambda = rest.data();
  Assembly::ParameterColumns c;
  // Phi_q u = 0 as the difference of Phidot behind the impact and before it.
  const auto side = [&](const double* v, double sign) {
    s.v = v;
    assembly_.calc_dynamics(s);
    assembly_.calc_partials(s);
    std::vector<double> rate = assembly_.bias;  // Phidot_t = bias - Phidot_q v
    add_product(assembly_.jacobian(), assembly_.phid_q.data(), -1, v, rate.data());
    for (std::size_t k = 0; k < phid_q_.size(); ++k) phid_q_[k] += sign * assembly_.phid_q[k];
    for (std::size_t k = 0; k < phid_t_.size(); ++k) phid_t_[k] += sign * rate[k];
    if (!columns) return;
    assembly_.calc_parameter_columns(s, c);
    phid_ += sign * c.phid;
  };
  phid_q_.assign(assembly_.phid_q.size(), 0);
  phid_t_.assign(static_cast<std::size_t>(m), 0);
  phid_.setZero(m, assembly_.np());
  side(before_.v, -1);
  side(after_.data(), 1);
  balance_.prepare(before_);
  const double *u = solution_.data(), *P = u + n;
  hessian_.resize(assembly_.square().row.size());
  assembly_.calc_projection_hessian(s, u, P, hessian_);
  if (!columns) return;
  force_.setZero(n, assembly_.np());
  assembly_.calc_projection_columns(s, u, P, force_);
}

void Impact::tangent(const double* dq, const double* dv, const Eigen::VectorXd& drho, double dt, double* du,
                     const Eigen::VectorXd* given, Eigen::VectorXd* dp, Eigen::VectorXd* dP) {
  const int n = assembly_.n(), m = assembly_.m();
  std::vector<double> b(static_cast<std::size_t>(n + m));
  for (int i = 0; i < n; ++i) b[static_cast<std::size_t>(i)] = -force_.row(i).dot(drho);
  for (int i = 0; i < m; ++i)
    b[static_cast<std::size_t>(n + i)] = -phid_.row(i).dot(drho) - dt * phid_t_[static_cast<std::size_t>(i)];
  add_product(assembly_.square(), hessian_.data(), -1, dq, b.data());
  add_product(assembly_.jacobian(), phid_q_.data(), -1, dq, b.data() + n);
  Eigen::VectorXd c = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(active_.size())), rates = c;
  for (std::size_t a = 0; a < active_.size(); ++a) {
    const auto at = static_cast<std::size_t>(active_[a].row);
    const Row& row = rows_[at];
    const auto& q = row.of.force->coordinates();
    const auto k = static_cast<Eigen::Index>(q.size());
    const double factor = speed_factor(active_[a]);
    Eigen::VectorXd along_q(k), x(k);
    for (Eigen::Index i = 0; i < k; ++i) {
      const auto g = static_cast<std::size_t>(q[static_cast<std::size_t>(i)]);
      along_q[i] = dq[g];
      x[i] = solution_[g] + factor * before_.v[g];
    }
    Eigen::VectorXd dJ = row.H.transpose() * along_q;
    double dfactor = 0;
    for (std::size_t p = 0; p < row.parameters.size(); ++p) {
      const int number = row.of.force->numbers()[static_cast<std::size_t>(row.parameters[p])];
      for (const auto& [column, f] : assembly_.number_columns()[static_cast<std::size_t>(number)]) {
        const double by = f * drho[column];
        if (by == 0) continue;
        dJ += by * row.J_p.col(static_cast<Eigen::Index>(p));
        if (row.of.bounces && row.parameters[p] == row.of.contact->restitution_number()) dfactor += by;
      }
    }
    for (Eigen::Index i = 0; i < k; ++i)
      b[static_cast<std::size_t>(q[static_cast<std::size_t>(i)])] += impulse_[at] * dJ[i];
    rates[static_cast<Eigen::Index>(a)] = dJ.dot(x) + factor * along(row, dv) + dfactor * before_rate_[at];
    double& by = c[static_cast<Eigen::Index>(a)];
    if (active_[a].law == ActiveRow::Law::slides) {
      for (const auto& [column, f] : friction_columns(row))
        by -= f * drho[column] * active_[a].direction * gap_impulse(a);
    } else if (active_[a].law == ActiveRow::Law::given && given) {
      by = (*given)[static_cast<Eigen::Index>(a)];
    }
  }
  c -= speeds_ * rates;
  solve_bordered(b, c);
  for (int i = 0; i < n; ++i) du[i] += b[static_cast<std::size_t>(i)];
  if (dp) *dp = c;
  if (dP) *dP = Eigen::Map<const Eigen::VectorXd>(b.data() + n, m);
}

void Impact::solve_bordered_transposed(std::vector<double>& s, Eigen::VectorXd& y) {
  // KKT x - J^T p = b, E J x + B p = c: KKT s + J^T E y = w, B^T y - J s = w_p.
  balance_.solve(s.data());
  const auto size = static_cast<Eigen::Index>(active_.size());
  for (Eigen::Index i = 0; i < size; ++i) y[i] += along(row_of(active_[static_cast<std::size_t>(i)]), s.data());
  const Eigen::VectorXd scales = row_scales();
  if (size > 0) y = scales.cwiseProduct(shortest_solution(active_W_.transpose() * scales.asDiagonal(), y));
  const Eigen::VectorXd of_rates = speeds_.transpose() * y;
  for (Eigen::Index i = 0; i < size; ++i) {
    const auto& response = response_[static_cast<std::size_t>(active_[static_cast<std::size_t>(i)].row)];
    for (std::size_t k = 0; k < s.size(); ++k) s[k] -= of_rates[i] * response[k];
  }
}

double Impact::adjoint(const double* w, double* w_q, double* w_v, double* gradient, const Eigen::VectorXd* w_p,
                       Eigen::VectorXd* by_given) {
  const int n = assembly_.n(), m = assembly_.m();
  std::vector<double> s(static_cast<std::size_t>(n + m), 0);
  std::copy(w, w + n, s.begin());
  Eigen::VectorXd y = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(active_.size()));
  if (w_p) y = *w_p;
  solve_bordered_transposed(s, y);
  const Eigen::VectorXd weights_of_rates = speeds_.transpose() * y;
  if (by_given) *by_given = y;
  add_transposed_product(assembly_.square(), hessian_.data(), -1, s.data(), w_q);
  add_transposed_product(assembly_.jacobian(), phid_q_.data(), -1, s.data() + n, w_q);
  double by_time = 0;
  for (int i = 0; i < m; ++i) by_time -= s[static_cast<std::size_t>(n + i)] * phid_t_[static_cast<std::size_t>(i)];
  for (std::size_t a = 0; a < active_.size(); ++a) {
    const auto at = static_cast<std::size_t>(active_[a].row);
    const Row& row = rows_[at];
    const auto& q = row.of.force->coordinates();
    const auto k = static_cast<Eigen::Index>(q.size());
    // Of J: the impulse's own force on s, and the rates of the row.
    const double weight = weights_of_rates[static_cast<Eigen::Index>(a)], factor = speed_factor(active_[a]);
    if (active_[a].law == ActiveRow::Law::slides)
      for (const auto& [column, f] : friction_columns(row))
        gradient[column] -= f * y[static_cast<Eigen::Index>(a)] * active_[a].direction * gap_impulse(a);
    Eigen::VectorXd of_J(k);
    for (Eigen::Index i = 0; i < k; ++i) {
      const auto g = static_cast<std::size_t>(q[static_cast<std::size_t>(i)]);
      of_J[i] = impulse_[at] * s[g] - weight * (solution_[g] + factor * before_.v[g]);
      w_v[g] -= weight * factor * row.J[static_cast<std::size_t>(i)];
    }
    const Eigen::VectorXd of_q = row.H * of_J;
    for (Eigen::Index i = 0; i < k; ++i) w_q[q[static_cast<std::size_t>(i)]] += of_q[i];
    for (std::size_t p = 0; p < row.parameters.size(); ++p) {
      double x = row.J_p.col(static_cast<Eigen::Index>(p)).dot(of_J);
      if (row.of.bounces && row.parameters[p] == row.of.contact->restitution_number()) x -= weight * before_rate_[at];
      const int number = row.of.force->numbers()[static_cast<std::size_t>(row.parameters[p])];
      for (const auto& [column, f] : assembly_.number_columns()[static_cast<std::size_t>(number)])
        gradient[column] += f * x;
    }
  }
  if (assembly_.np() == 0) return by_time;
  StateView x = before_;
  x.a = x.lambda = nullptr;
  Assembly::ParameterWeights weights;
  weights.row_phid = s.data() + n;
  assembly_.add_parameter_gradient(x, weights, 1, gradient);
  x.v = after_.data();
  assembly_.add_parameter_gradient(x, weights, -1, gradient);
  assembly_.add_projection_gradient(x, solution_.data(), solution_.data() + n, s.data(), -1, gradient);
  return by_time;
}

}  // namespace costate
