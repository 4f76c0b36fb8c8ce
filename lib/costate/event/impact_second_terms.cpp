// Second derivatives of an impact, lib/README.md (13.16). With multipliers (a, b, c) of its equations
//   Gamma = w^T u + w_p^T p - a^T (M u + Phi_q^T P - J^T p) - b^T (Phi_q u - P/alpha) - c^T (laws of the rows in force)
// is stationary in (u, P, p) and in (a, b, c), so that the derivatives of w^T u + w_p^T p are Gamma's by q, v, t and
// rho alone, and change by those of it along (d, du, dP, dp, da, db, dc). The laws: J_i u + f_i J_i v- of what is held,
// p_t + s mu p_n of what slides, p_n - g of what is given. Poisson's law is two of them, u = u1(q, v) + u2(q, v + u1, e
// p1).
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <vector>

#include "costate/event/impact.h"
#include "costate/event/impulse_terms.h"
#include "costate/event/motion_events.h"

namespace costate {

namespace {

using Eigen::Index;
using Eigen::VectorXd;

/// r_i(q, p) of one contact's row on straight lines.
class RowOnLine {
 public:
  RowOnLine(const ImpactRow& row, const Assembly& assembly, const StateView& s) : row_(row) {
    for (const int c : row.force->coordinates()) q.emplace_back(s.q[c]);
    for (const int number : row.force->numbers()) p.emplace_back(assembly.numbers()[static_cast<std::size_t>(number)]);
  }
  /// Along c y + e d; y of the coordinates alone.
  void follow(double c, const VectorXd& y, double e, const Variation& d) {
    const auto &at = row_.force->coordinates(), &numbers = row_.force->numbers();
    for (std::size_t i = 0; i < q.size(); ++i) q[i].v.c1 = c * y[at[i]] + e * d.q[at[i]];
    for (std::size_t i = 0; i < p.size(); ++i) p[i].v.c1 = e * d.numbers[numbers[i]];
  }
  PathDual value() const {
    MeasureArguments x;
    x.q = q.data();
    x.p = p.data();
    return row_.contact->row(row_.row, x);
  }
  Taylor2 seeded(PathDual& x) const {
    x.d[0] = Taylor2(1.0);
    const Taylor2 by = value().d[0];
    x.d[0] = Taylor2();
    return by;
  }
  /// How far d goes against a length of 1.
  double length(const Variation& d) const {
    double largest = 0;
    for (const int c : row_.force->coordinates()) largest = std::max(largest, std::abs(d.q[c]));
    for (const int number : row_.force->numbers()) largest = std::max(largest, std::abs(d.numbers[number]));
    return largest;
  }

  std::vector<PathDual> q, p;

 private:
  const ImpactRow& row_;
};

}  // namespace

bool Impact::has_second_derivatives() const {
  return std::all_of(active_.begin(), active_.end(), [&](const ActiveRow& a) { return a.component == 0; });
}

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

  const auto holds = [&](Index i) { return active_[static_cast<std::size_t>(i)].law == ActiveRow::Law::held; };
  const auto slides = [&](Index i) { return active_[static_cast<std::size_t>(i)].law == ActiveRow::Law::slides; };
  const auto of = [&](Index i) -> const Row& { return row_of(active_[static_cast<std::size_t>(i)]); };
  const auto number_of = [&](Index i, int k) { return of(i).of.force->numbers()[static_cast<std::size_t>(k)]; };
  const auto friction_number = [&](Index i) { return number_of(i, of(i).of.contact->friction_number()); };
  const auto gap_of = [&](Index i) { return i - static_cast<Index>(active_[static_cast<std::size_t>(i)].from_gap()); };
  const auto direction = [&](Index i) { return active_[static_cast<std::size_t>(i)].direction; };
  // dJ of each row, and the multipliers' changes: the same equations, as dM a + dPhi_q^T b + c dJ, dPhi_q a and what
  // impulses are multiplied by change.
  std::vector<VectorXd> dJ;
  std::vector<double> ds(s.size(), 0);
  c.change = VectorXd::Zero(rows);
  const VectorXd none = VectorXd::Zero(std::max(n, m));
  subtract_mass_change(assembly_, before_, d, a.value, ds.data());
  subtract_row_change(assembly_, before_, d, a.value, 0, ds.data() + n, &b.value, ds.data());
  for (Index i = 0; i < rows; ++i) {
    RowOnLine r(of(i).of, assembly_, before_);
    r.follow(0, none, 1, d);
    VectorXd& change = dJ.emplace_back(static_cast<Index>(r.q.size()));
    const auto& at = of(i).of.force->coordinates();
    for (std::size_t l = 0; l < r.q.size(); ++l) {
      const double by = change[static_cast<Index>(l)] = r.seeded(r.q[l]).c1;
      c.change[i] += by * a.value[at[l]];
      if (holds(i)) ds[static_cast<std::size_t>(at[l])] -= c.value[i] * by;
    }
    if (slides(i)) c.change[gap_of(i)] -= c.value[i] * direction(i) * d.numbers[friction_number(i)];
  }
  solve_bordered_transposed(ds, c.change);
  a.change = Eigen::Map<const VectorXd>(ds.data(), n);
  b.change = Eigen::Map<const VectorXd>(ds.data() + n, m);
  if (by_given) *by_given = c.change;

  ImpulseDerivatives out{w_q, gradient};
  add_mass_terms(assembly_, before_, d, a, u, out);
  add_row_terms(assembly_, before_, d, P, a, 0, out);
  add_row_terms(assembly_, before_, d, b, u, 0, out);
  for (Index i = 0; i < rows; ++i) {
    const Row& row = of(i);
    const auto& at = row.of.force->coordinates();
    const double factor = row.factor;
    if (slides(i)) {
      const Index gap = gap_of(i);
      add_number(assembly_, friction_number(i),
                 -direction(i) * (c.change[i] * p.value[gap] + c.value[i] * p.change[gap]), out.rho);
    }
    // p a - c (u + f v), what J is multiplied by, and its change.
    VectorXd y = p.value[i] * a.value, dy = p.change[i] * a.value + p.value[i] * a.change;
    if (holds(i)) {
      const int number = number_of(i, row.of.contact->restitution_number());
      const double dfactor = row.of.bounces ? d.numbers[number] : 0;
      const Eigen::Map<const VectorXd> v(before_.v, n), dv(d.v, n);
      y -= c.value[i] * (u.value + factor * v);
      dy -= c.change[i] * (u.value + factor * v) + c.value[i] * (u.change + factor * dv + dfactor * v);
      double by_e = 0;
      for (std::size_t l = 0; l < at.size(); ++l) {
        const double J = row.J[l], change = dJ[static_cast<std::size_t>(i)][static_cast<Index>(l)];
        w_v[at[l]] -= (c.change[i] * factor + c.value[i] * dfactor) * J + c.value[i] * factor * change;
        by_e -= (c.change[i] * J + c.value[i] * change) * v[at[l]] + c.value[i] * J * dv[at[l]];
      }
      if (row.of.bounces) add_number(assembly_, number, by_e, out.rho);
    }
    // J y = r' along y: its change along d is a mixed derivative, a quarter of what r'' along y + d and y - d differ
    // by.
    RowOnLine r(row.of, assembly_, before_);
    double size = 0;
    for (const int k : at) size = std::max(size, std::abs(y[k]));
    const double length = r.length(d), scale = size > 0 && length > 0 ? size / length : 0;
    const auto change = [&](PathDual& x) {
      r.follow(1, dy, 0, d);
      double sum = r.seeded(x).c1;
      if (scale == 0) return sum;
      r.follow(1, y, scale, d);
      const double sides = r.seeded(x).c2;
      r.follow(1, y, -scale, d);
      return sum + (sides - r.seeded(x).c2) / (4 * scale);
    };
    for (std::size_t l = 0; l < at.size(); ++l) out.q[at[l]] += change(r.q[l]);
    for (std::size_t k = 0; k < r.p.size(); ++k)
      if (varies(assembly_, row.of.force->numbers()[k]))
        add_number(assembly_, row.of.force->numbers()[k], change(r.p[k]), out.rho);
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
