// Second derivatives of an impact, lib/README.md (13.16). With multipliers (a, b, c) of its equations
//   Gamma = w^T u + w_p^T p - a^T (M u + Phi_q^T P - J^T p) - b^T (Phi_q u - P/alpha) - c^T (laws of the rows in force)
// is stationary in (u, P, p) and in (a, b, c), so that the derivatives of w^T u + w_p^T p are Gamma's by q, v, t and
// rho alone, and change by those of it along (d, du, dP, dp, da, db, dc). The laws: J_i u + f_i J_i v- of what is held,
// p_t + s mu p_n of what slides, with s(J v+) in space, p_n - g of what is given. Poisson's law is two of them, u =
// u1(q, v) + u2(q, v + u1, e p1).
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "costate/assembly/slip_turn.h"
#include "costate/event/impact.h"
#include "costate/event/impulse_terms.h"
#include "costate/event/motion_events.h"

namespace costate {

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

/// J y = r', of one contact's row r_i(q, p) along y, where the point moves along d.
class RowAlong {
 public:
  RowAlong(const ImpactRow& row, const Assembly& assembly, const StateView& s, const Variation& d) : row_(row), d_(d) {
    for (const int c : row.force->coordinates()) q.emplace_back(s.q[c]);
    for (const int number : row.force->numbers()) {
      p.emplace_back(assembly.numbers()[static_cast<std::size_t>(number)]);
      p.back().d[0] = PathDual(d.numbers[number]);
    }
  }
  /// Along the whole mechanism's y, which changes by dy.
  void follow(const VectorXd& y, const VectorXd& dy) {
    const auto& at = row_.force->coordinates();
    for (std::size_t i = 0; i < q.size(); ++i) set(i, y[at[i]], dy[at[i]]);
  }
  /// The change of J_l.
  double change_of_entry(std::size_t l) {
    for (std::size_t i = 0; i < q.size(); ++i) set(i, i == l ? 1 : 0, 0);
    return value().d[0].v.c1;
  }
  /// The change along d of (J y)_x, x one of q and p.
  double seeded(DirectedPathDual& x) const {
    x.v.d[0] = Taylor2(1.0);
    const double by = value().d[0].d[0].c1;
    x.v.d[0] = Taylor2();
    return by;
  }

  std::vector<DirectedPathDual> q, p;

 private:
  DirectedPathDual value() const { return row_.contact->row_directed(row_.row, q.data(), p.data()); }
  void set(std::size_t i, double rate, double change) {
    q[i].v.v.c1 = rate;
    q[i].d[0] = PathDual(Taylor2(d_.q[row_.force->coordinates()[i]], change, 0));
  }

  const ImpactRow& row_;
  const Variation& d_;
};

}  // namespace

double Impact::gradient_change(const double* w, const Variation& d, const VectorXd& drho, double* w_q, double* w_v,
                               double* gradient, const VectorXd* w_p, const VectorXd* given, VectorXd* by_given) {
  const int n = assembly_.n(), m = assembly_.m();
  const auto rows = static_cast<Index>(active_.size());
  Changing u{Eigen::Map<const VectorXd>(solution_.data(), n), VectorXd::Zero(n)},
      P{Eigen::Map<const VectorXd>(solution_.data() + n, m), {}}, p{VectorXd(rows), {}};
  for (Index i = 0; i < rows; ++i) p.value[i] = impulse(active_[static_cast<std::size_t>(i)].row);
  tangent(d.q, d.v, drho, d.t, u.change.data(), given, &p.change, &P.change);
  std::vector<double> s(static_cast<std::size_t>(n + m), 0);
  std::copy(w, w + n, s.begin());
  Changing a, b, c{w_p ? *w_p : VectorXd::Zero(rows), {}};
  solve_bordered_transposed(s, c.value);
  a.value = Eigen::Map<const VectorXd>(s.data(), n);
  b.value = Eigen::Map<const VectorXd>(s.data() + n, m);

  const auto slides = [&](Index i) { return active_[static_cast<std::size_t>(i)].law == ActiveRow::Law::slides; };
  const auto of = [&](Index i) -> const Row& { return row_of(active_[static_cast<std::size_t>(i)]); };
  const auto number_of = [&](Index i, int k) { return of(i).of.force->numbers()[static_cast<std::size_t>(k)]; };
  const auto friction_number = [&](Index i) { return number_of(i, of(i).of.contact->friction_number()); };
  const auto gap_of = [&](Index i) { return i - static_cast<Index>(active_[static_cast<std::size_t>(i)].from_gap()); };
  const auto direction = [&](Index i) { return active_[static_cast<std::size_t>(i)].direction; };
  const Eigen::Map<const VectorXd> v(before_.v, n), dv(d.v, n);
  std::vector<VectorXd> dJ;
  for (Index i = 0; i < rows; ++i) {
    RowAlong r(of(i).of, assembly_, before_, d);
    VectorXd& change = dJ.emplace_back(static_cast<Index>(r.q.size()));
    for (std::size_t l = 0; l < r.q.size(); ++l) change[static_cast<Index>(l)] = r.change_of_entry(l);
  }
  // Of slips in space s = w/|w| turns with w = J v+, and E = mu p_n (1 - s s^T)/|w| with it.
  VectorXd dw = VectorXd::Zero(rows), turns = dw;
  MatrixXd dE = MatrixXd::Zero(rows, rows);
  for (Index i = 0; i < rows; ++i) {
    if (active_[static_cast<std::size_t>(i)].component == 0) continue;
    const Row& row = of(i);
    const auto& at = row.of.force->coordinates();
    for (std::size_t l = 0; l < at.size(); ++l)
      dw[i] += dJ[static_cast<std::size_t>(i)][static_cast<Index>(l)] * (v[at[l]] + u.value[at[l]]) +
               row.J[l] * (dv[at[l]] + u.change[at[l]]);
  }
  for (Index i = 0; i < rows; ++i) {
    if (active_[static_cast<std::size_t>(i)].component != 1) continue;
    const double size = std::hypot(speed_after(active_[static_cast<std::size_t>(i)].row),
                                   speed_after(active_[static_cast<std::size_t>(i) + 1].row)),
                 mu = friction(of(i)), dmu = d.numbers[friction_number(i)], p_n = p.value[gap_of(i)];
    const SlipTurn at({direction(i), direction(i + 1)}, size);
    const Eigen::Vector2d change = dw.segment<2>(i);
    turns.segment<2>(i) = at.T * change;
    dE.block<2, 2>(i, i) = (dmu * p_n + mu * p.change[gap_of(i)]) * at.T + mu * p_n * at.change(change);
  }
  // The multipliers' changes: the same equations, as dM a + dPhi_q^T b + c dJ, dPhi_q a and what impulses are
  // multiplied by change. Rates of rows are multiplied by r = E^T c.
  std::vector<double> ds(s.size(), 0);
  c.change = VectorXd::Zero(rows);
  Changing r{speeds_.transpose() * c.value, {}};
  const VectorXd of_turns = dE.transpose() * c.value;
  subtract_mass_change(assembly_, before_, d, a.value, ds.data());
  subtract_row_change(assembly_, before_, d, a.value, 0, ds.data() + n, &b.value, ds.data());
  for (Index i = 0; i < rows; ++i) {
    const auto& at = of(i).of.force->coordinates();
    for (std::size_t l = 0; l < at.size(); ++l) {
      const double by = dJ[static_cast<std::size_t>(i)][static_cast<Index>(l)];
      c.change[i] += by * a.value[at[l]];
      ds[static_cast<std::size_t>(at[l])] -= r.value[i] * by + of_turns[i] * of(i).J[l];
    }
    if (slides(i))
      c.change[gap_of(i)] -= c.value[i] * (direction(i) * d.numbers[friction_number(i)] + turns[i] * friction(of(i)));
  }
  solve_bordered_transposed(ds, c.change);
  a.change = Eigen::Map<const VectorXd>(ds.data(), n);
  b.change = Eigen::Map<const VectorXd>(ds.data() + n, m);
  r.change = speeds_.transpose() * c.change + of_turns;
  if (by_given) *by_given = c.change;

  ImpulseDerivatives out{w_q, gradient};
  add_mass_terms(assembly_, before_, d, a, u, out);
  add_row_terms(assembly_, before_, d, P, a, 0, out);
  add_row_terms(assembly_, before_, d, b, u, 0, out);
  for (Index i = 0; i < rows; ++i) {
    const ActiveRow& active = active_[static_cast<std::size_t>(i)];
    const Row& row = of(i);
    const auto& at = row.of.force->coordinates();
    if (slides(i)) {
      const Index gap = gap_of(i);
      add_number(assembly_, friction_number(i),
                 -direction(i) * (c.change[i] * p.value[gap] + c.value[i] * p.change[gap]) -
                     turns[i] * c.value[i] * p.value[gap],
                 out.rho);
    }
    // p a - r (u + f v), what J is multiplied by, and its change.
    const int number = number_of(i, row.of.contact->restitution_number());
    const bool bounces = active.law == ActiveRow::Law::held && row.of.bounces;
    const double factor = speed_factor(active), dfactor = bounces ? d.numbers[number] : 0;
    const VectorXd y = p.value[i] * a.value - r.value[i] * (u.value + factor * v),
                   dy = p.change[i] * a.value + p.value[i] * a.change - r.change[i] * (u.value + factor * v) -
                        r.value[i] * (u.change + factor * dv + dfactor * v);
    double by_e = 0;
    for (std::size_t l = 0; l < at.size(); ++l) {
      const double J = row.J[l], change = dJ[static_cast<std::size_t>(i)][static_cast<Index>(l)];
      w_v[at[l]] -= (r.change[i] * factor + r.value[i] * dfactor) * J + r.value[i] * factor * change;
      by_e -= (r.change[i] * J + r.value[i] * change) * v[at[l]] + r.value[i] * J * dv[at[l]];
    }
    if (bounces) add_number(assembly_, number, by_e, out.rho);
    RowAlong along(row.of, assembly_, before_, d);
    along.follow(y, dy);
    for (std::size_t l = 0; l < at.size(); ++l) out.q[at[l]] += along.seeded(along.q[l]);
    for (std::size_t k = 0; k < along.p.size(); ++k)
      if (varies(assembly_, row.of.force->numbers()[k]))
        add_number(assembly_, row.of.force->numbers()[k], along.seeded(along.p[k]), out.rho);
  }
  return out.t;
}

double MotionEvents::impact_gradient_change(const double* w, const Variation& d, const VectorXd& drho, double* w_q,
                                            double* w_v, double* gradient) {
  if (!expands_) return impact_->gradient_change(w, d, drho, w_q, w_v, gradient);
  const Index n = assembly_.n(), of_compression = static_cast<Index>(impact_->active().size()),
              of_expansion = static_cast<Index>(expansion_->active().size());
  const std::vector<GivenBack> all = given_back();
  const auto restitution = [&](const GivenBack& g) { return assembly_.numbers()[static_cast<std::size_t>(g.number)]; };
  // The compression along d, and the expansion that it leads to.
  VectorXd dv = VectorXd::Zero(n), dp, dg = VectorXd::Zero(of_expansion);
  impact_->tangent(d.q, d.v, drho, d.t, dv.data(), nullptr, &dp);
  dv += Eigen::Map<const VectorXd>(d.v, n);
  for (const GivenBack& g : all)
    dg[g.of_expansion] = restitution(g) * dp[g.of_compression] + d.numbers[g.number] * g.impulse;
  Variation behind = d;
  behind.v = dv.data();
  // Its weights of the velocities between and of the impulses, and their changes.
  VectorXd q = VectorXd::Zero(n), weights = q, by_rho = VectorXd::Zero(assembly_.np()), y, dy, dweights = q;
  expansion_->adjoint(w, q.data(), weights.data(), by_rho.data(), nullptr, &y);
  double by_time = expansion_->gradient_change(w, behind, drho, w_q, dweights.data(), gradient, nullptr, &dg, &dy);
  VectorXd w_p = VectorXd::Zero(of_compression), dw_p = w_p;
  for (const GivenBack& g : all) {
    const double by = y[g.of_expansion], change = dy[g.of_expansion];
    w_p[g.of_compression] += restitution(g) * by;
    dw_p[g.of_compression] += restitution(g) * change + d.numbers[g.number] * by;
    add_number(assembly_, g.number, dp[g.of_compression] * by + g.impulse * change, gradient);
  }
  weights += Eigen::Map<const VectorXd>(w, n);
  Eigen::Map<VectorXd>(w_v, n) += dweights;
  by_time += impact_->gradient_change(weights.data(), d, drho, w_q, w_v, gradient, &w_p);
  return by_time + impact_->adjoint(dweights.data(), w_q, w_v, gradient, &dw_p);
}

}  // namespace costate
