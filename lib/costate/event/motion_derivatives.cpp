// How tangents and adjoints cross the events of a mechanism: (17.2) and (17.3) of lib/README.md, at impacts with (19).
#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/element/law/motion_law.h"
#include "costate/event/contact_gap.h"
#include "costate/event/contact_ways.h"
#include "costate/event/crossing_rate.h"
#include "costate/event/motion_events.h"
#include "costate/event/spatial_slip.h"
#include "costate/linear/to_dense.h"

namespace costate {

namespace {
// Accelerations on both sides of an event at which forces do not jump agree to this part of them.
constexpr double kSameForces = 1e-5;
// Of times, of 1 s at least: nearer than that they are one.
constexpr double kSameInstant = 1e-10;
// What is left of a row beside those that it depends on, of the row.
constexpr double kSameRow = 1e-9;

/// Derivatives through impacts of one instant exist from one side only, if at all: which comes first decides.
template <class Contacts, class Contact>
void require_one_impact(const Contacts& contacts, const Contact* own, const StateView& s, const Assembly& assembly,
                        double speed, double length) {
  for (const auto& c : contacts) {
    if (&c == own || c.part != own->part || (c.closed_state >= 0 && s.z[c.closed_state] > 0.5)) continue;
    if (strikes_too(c, s, assembly, speed, length) > 0)
      throw SolverError(
          fmt::format("At t = {:.9g} s {} and {} strike at the same time: a gradient does not exist there, as which "
                      "of them comes first decides. Let one of them be later.",
                      s.t, own->force->path(), c.force->path()));
  }
}
}  // namespace

double MotionEvents::acceleration_by_forces(const StateView& s) {
  impact_->balance().prepare(s);
  assembly_.calc_force_amounts(s, amounts_);
  // A body's coordinates of one unit count with the largest inertia of them: an Euler parameter by itself may have
  // none.
  const Mechanism& mech = assembly_.mechanism();
  const auto inertia = [&](int j) {
    const auto at = assembly_.square().find(j, j);
    return at < 0 ? 0 : assembly_.M[static_cast<std::size_t>(at)];
  };
  const auto unit = [&](int j) -> const std::string& { return mech.coordinates()[static_cast<std::size_t>(j)].unit; };
  double largest = 0;
  for (const auto& body : mech.bodies())
    for (const int j : body->coordinates()) {
      double mass = inertia(j);
      for (const int k : body->coordinates())
        if (unit(k) == unit(j)) mass = std::max(mass, inertia(k));
      const auto at = static_cast<std::size_t>(j);
      if (mass > 0) largest = std::max(largest, levers_[at] * amounts_[at] / mass);
    }
  return largest;
}

bool MotionEvents::slides_as(const ContactOf& c, const std::vector<char>& others, const StateView& s) {
  impact_->balance().prepare(s);
  const SparsePattern& J = assembly_.jacobian();
  const Eigen::MatrixXd rows = to_dense(J, assembly_.reaction_jacobian().data()).transpose();
  std::vector<char> held(static_cast<std::size_t>(assembly_.m()), 0);
  for (int i = 0; i < assembly_.m(); ++i) held[static_cast<std::size_t>(i)] = assembly_.is_there(i) ? 1 : 0;
  // In space friction has its rows while a contact slides, too, where they hold nothing.
  for (const ContactOf& x : contacts_) {
    const bool among = others[static_cast<std::size_t>(&x - contacts_.data())] != 0 && &x != &c;
    if (among || &x == &c || (slides_in_space(x) && s.z[x.closed_state] > 0.5 && s.z[x.sliding_state] != 0))
      for (int k = 1; k < x.contact->row_count(); ++k) held[static_cast<std::size_t>(x.first_row + k)] = among ? 1 : 0;
  }
  std::vector<int> all;
  for (int i = 0; i < assembly_.m(); ++i)
    if (held[static_cast<std::size_t>(i)] != 0) all.push_back(i);
  const Eigen::MatrixXd A = rows(Eigen::all, all);
  const auto solver = A.completeOrthogonalDecomposition();
  for (int k = 1; k < c.contact->row_count(); ++k) {
    const Eigen::VectorXd b = rows.col(c.first_row + k);
    if (!((A * solver.solve(b) - b).norm() <= kSameRow * b.norm())) return false;
  }
  return true;
}

bool MotionEvents::has_impulse(int event) const {
  const ContactOf* c = contact_of(event);
  if (!c) return false;
  const auto guard = contact_guard(event);
  return guard == UnilateralForce::Guard::touch || (guard == UnilateralForce::Guard::stop && slides_in_space(*c));
}

bool MotionEvents::goes_on_smoothly(int event, const StateView& before, const Side& minus, const Side& plus) {
  using Guard = UnilateralForce::Guard;
  const ContactOf* own = contact_of(event);
  if (!own || contact_guard(event) == Guard::touch) return false;
  if (contact_guard(event) == Guard::stop) {
    const double acceleration = largest_of(minus.a.data());
    const std::vector<char> together = stopping(event, before);
    for (const ContactOf& c : contacts_)
      if (!together[static_cast<std::size_t>(&c - contacts_.data())] && c.part == own->part && c.sliding_state >= 0 &&
          before.z[c.closed_state] > 0.5 && before.z[c.sliding_state] != 0 && has_stopped(c, before, acceleration) &&
          !slides_as(c, together, before))
        throw SolverError(
            fmt::format("At t = {:.9g} s {} and {} stop sliding at the same time: a gradient does not "
                        "exist there, as which of them comes first decides.",
                        before.t, own->force->path(), c.force->path()));
    return false;
  }
  if (friction_falls(of(event))) return false;
  // A release, or where sliding begins: nothing jumps but the mode, as forces are the same on both sides.
  const auto [size, apart] = apart_of(minus.a, plus.a.data(), levers_);
  // At rest all accelerations are rounding, of what forces by themselves would make.
  if (apart > kSameForces * size && apart > kSameForces * acceleration_by_forces(before))
    throw SolverError(
        fmt::format("At t = {:.9g} s, at '{}', accelerations jump by {:.3g} of {:.3g}: contacts change in one instant, "
                    "or with a law of time that jumps, and no gradient is carried across. The method 'differences' "
                    "tells one where it exists.",
                    before.t, of(event).name, apart, size));
  return true;
}

void MotionEvents::linearize_impact(int event, const StateView& before, bool columns) {
  strike(event, before);
  if (contact_guard(event) == UnilateralForce::Guard::touch)
    require_one_impact(contacts_, contact_of(event), before, assembly_, -impact_->speed_before(0), length_);
  impact_->linearize(columns);
  if (expands_) expansion_->linearize(columns);
}

void MotionEvents::impact_tangent(const double* dq, const double* dv, const Eigen::VectorXd& drho, double dt,
                                  double* du) {
  if (!expands_) return impact_->tangent(dq, dv, drho, dt, du);
  const auto n = static_cast<std::size_t>(assembly_.n());
  Eigen::VectorXd dp;
  std::vector<double> behind(n, 0);
  impact_->tangent(dq, dv, drho, dt, behind.data(), nullptr, &dp);
  for (std::size_t i = 0; i < n; ++i) du[i] += behind[i];
  for (std::size_t i = 0; i < n; ++i) behind[i] += dv[i];
  Eigen::VectorXd given = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(expansion_->active().size()));
  for (const GivenBack& g : given_back()) {
    double& x = given[g.of_expansion];
    x = assembly_.numbers()[static_cast<std::size_t>(g.number)] * dp[g.of_compression];
    for (const auto& [column, f] : assembly_.number_columns()[static_cast<std::size_t>(g.number)])
      x += f * g.impulse * drho[column];
  }
  expansion_->tangent(dq, behind.data(), drho, dt, du, &given);
}

double MotionEvents::impact_adjoint(const double* w, double* w_q, double* w_v, double* gradient) {
  if (!expands_) return impact_->adjoint(w, w_q, w_v, gradient);
  const auto n = static_cast<std::size_t>(assembly_.n());
  // u = u1(q, v) + u2(q, v + u1, p1).
  std::vector<double> of_behind(n, 0);
  Eigen::VectorXd by_given, w_p = Eigen::VectorXd::Zero(static_cast<Eigen::Index>(impact_->active().size()));
  double by_time = expansion_->adjoint(w, w_q, of_behind.data(), gradient, nullptr, &by_given);
  for (const GivenBack& g : given_back()) {
    const double x = by_given[g.of_expansion];
    w_p[g.of_compression] += assembly_.numbers()[static_cast<std::size_t>(g.number)] * x;
    for (const auto& [column, f] : assembly_.number_columns()[static_cast<std::size_t>(g.number)])
      gradient[column] += f * g.impulse * x;
  }
  for (std::size_t i = 0; i < n; ++i) {
    w_v[i] += of_behind[i];
    of_behind[i] += w[i];
  }
  return by_time + impact_->adjoint(of_behind.data(), w_q, w_v, gradient, &w_p);
}

std::vector<MotionEvents::GivenBack> MotionEvents::given_back() const {
  std::vector<GivenBack> all;
  for (std::size_t a = 0; a < expansion_->active().size(); ++a) {
    if (expansion_->active()[a].law != ActiveRow::Law::given) continue;
    const int row = expansion_->active()[a].row;
    for (std::size_t b = 0; b < impact_->active().size(); ++b) {
      if (impact_->active()[b].row != row) continue;
      const ImpactRow& of = impact_->row(row);
      const int number = of.force->numbers()[static_cast<std::size_t>(of.contact->restitution_number())];
      all.push_back({static_cast<Eigen::Index>(a), static_cast<Eigen::Index>(b), number, impact_->impulse(row)});
    }
  }
  return all;
}

namespace {
/// Where the law of a ground that moves brings the event about by a jump, its instant is that of the law.
void require_own_instant(const Force& force, const std::string& event, double t, const std::vector<PathDual>& numbers) {
  const auto* owner = dynamic_cast<const MotionLawElement*>(&force);
  if (!owner) return;
  std::vector<double> p, times;
  for (const PathDual& x : numbers) p.push_back(x.v.c0);
  owner->add_force_jumps(p.data(), times);
  for (const double jump : times)
    if (std::abs(t - jump) <= kSameInstant * std::max(1.0, std::abs(t)))
      throw SolverError(fmt::format(
          "At t = {:.9g} s '{}' is brought about by the ground's law, which jumps then. What the instant depends "
          "on is in no derivative. Let the law be continuous (smooth_step); the method 'differences' tells "
          "what psi does.",
          t, event));
}
}  // namespace

void MotionEvents::linearize(const GuardOf& g, const StateView& before, const Side& minus, bool columns) {
  const int n = assembly_.n(), nz = assembly_.nz(), np = assembly_.np();
  const auto width = static_cast<std::size_t>(2 * n + nz);
  load(g, before);
  require_own_instant(*g.force, g.name, before.t, p_);
  h_x_.assign(width, 0);
  h_rho_.assign(static_cast<std::size_t>(np), 0);
  D_x_.assign(out_.size(), h_x_);
  D_rho_.assign(out_.size(), h_rho_);
  D_rate_.assign(out_.size(), 0);
  D_t_ = D_rate_;
  hdot_ = 0;
  double speed = 0;
  const auto seed = [&](PathDual& x, const auto& take) {
    const PathDual keep = x;
    x.d[0] = Taylor2(1.0);
    const PathDual h = g.guarded->guard(g.k, arguments());
    for (auto& o : out_) o = PathDual();
    g.guarded->transition(g.k, arguments(), out_.data());
    x = keep;
    take(h.d[0].c0);
  };
  // d/dx of the argument x_ that is entry `at` of (q, v, z), whose rate before the event is `rate`.
  const auto column = [&](PathDual& x, int at, double rate) {
    seed(x, [&](double h) {
      h_x_[static_cast<std::size_t>(at)] += h;
      hdot_ += h * rate;
      speed += std::abs(h * rate);
      for (std::size_t i = 0; i < out_.size(); ++i) {
        D_x_[i][static_cast<std::size_t>(at)] += out_[i].d[0].c0;
        D_rate_[i] += out_[i].d[0].c0 * rate;
      }
    });
  };
  const auto& c = g.force->coordinates();
  for (std::size_t i = 0; i < c.size(); ++i) {
    column(q_[i], c[i], before.v[c[i]]);
    column(v_[i], n + c[i], minus.a[static_cast<std::size_t>(c[i])]);
  }
  for (std::size_t i = 0; i < z_.size(); ++i) {
    const int at = g.first_state + static_cast<int>(i);
    column(z_[i], 2 * n + at, minus.zdot[static_cast<std::size_t>(at)]);
  }
  seed(t_, [&](double h) {
    h_t_ = h;
    hdot_ += h;
    speed += std::abs(h);
    for (std::size_t i = 0; i < out_.size(); ++i) D_rate_[i] += D_t_[i] = out_[i].d[0].c0;
  });
  // Of a guard that depends on multipliers their rates are not known here.
  if (!by_multipliers(g)) require_crossing(before.t, g.name, hdot_, speed);
  if (!columns) return;
  const auto& numbers = g.force->numbers();
  for (std::size_t k = 0; k < numbers.size(); ++k) {
    const auto& parameters = assembly_.number_columns()[static_cast<std::size_t>(numbers[k])];
    if (parameters.empty()) continue;
    seed(p_[k], [&](double h) {
      for (const auto& [j, factor] : parameters) {
        h_rho_[static_cast<std::size_t>(j)] += factor * h;
        for (std::size_t i = 0; i < out_.size(); ++i)
          D_rho_[i][static_cast<std::size_t>(j)] += factor * out_[i].d[0].c0;
      }
    });
  }
}

void MotionEvents::tangent(int event, const StateView& before, const Side& minus, const Side& plus,
                           double* const* columns, int count, double* dcost, const Eigen::MatrixXd* directions) {
  const GuardOf& g = of(event);
  const int n = assembly_.n(), nz = assembly_.nz(), first = g.first_state;
  const bool impact = has_impulse(event);
  if (between_steps_) refuse_slip_from_rest(event, before);
  if (goes_on_smoothly(event, before, minus, plus)) {
    std::fill(dcost, dcost + count, 0.0);
    return;
  }
  linearize_with_reactions(g, before, minus, true);
  std::vector<double> own(D_x_.size());
  std::vector<double> moved, u(static_cast<std::size_t>(n), 0);  // u's change along the column
  if (impact) linearize_impact(event, before, true);
  for (int j = 0; j < count; ++j) {
    double* x = columns[j];
    const Eigen::VectorXd drho =
        directions ? Eigen::VectorXd(directions->col(j)) : Eigen::VectorXd::Unit(assembly_.np(), j);
    const auto along = [&](const std::vector<double>& by_rho) {
      return drho.dot(Eigen::Map<const Eigen::VectorXd>(by_rho.data(), assembly_.np()));
    };
    double dh = along(h_rho_);
    for (std::size_t i = 0; i < h_x_.size(); ++i) dh += h_x_[i] * x[i];
    const double dt = -dh / hdot_;
    for (std::size_t i = 0; i < own.size(); ++i) {
      own[i] = along(D_rho_[i]) + (D_rate_[i] - plus.zdot[static_cast<std::size_t>(first) + i]) * dt;
      for (std::size_t k = 0; k < D_x_[i].size(); ++k) own[i] += D_x_[i][k] * x[k];
    }
    if (impact) {
      moved.assign(x, x + 2 * n);
      for (int i = 0; i < n; ++i) {
        moved[static_cast<std::size_t>(i)] += before.v[i] * dt;
        moved[static_cast<std::size_t>(n + i)] += minus.a[static_cast<std::size_t>(i)] * dt;
      }
      std::fill(u.begin(), u.end(), 0.0);
      impact_tangent(moved.data(), moved.data() + n, drho, dt, u.data());
      for (int i = 0; i < n; ++i) x[i] -= jump_[static_cast<std::size_t>(i)] * dt;
    }
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      x[n + i] += (minus.a[k] - plus.a[k]) * dt + u[k];
    }
    for (int i = 0; i < nz; ++i)
      x[2 * n + i] += (minus.zdot[static_cast<std::size_t>(i)] - plus.zdot[static_cast<std::size_t>(i)]) * dt;
    for (std::size_t i = 0; i < own.size(); ++i) x[2 * n + first + static_cast<int>(i)] = own[i];
    dcost[j] = (minus.cost - plus.cost) * dt;
  }
}

double MotionEvents::adjoint_of_impact(int event, const StateView& before, double* mu, double* gradient) {
  const int n = assembly_.n();
  linearize_impact(event, before, false);
  const std::vector<double> w(mu + n, mu + 2 * n);
  const double of_time = impact_adjoint(w.data(), mu, mu + n, gradient);
  for (const ContactOf& c : contacts_)
    for (const int state : {c.closed_state, c.sliding_state})
      if (state >= 0) mu[2 * n + state] = 0;
  return of_time;
}

void MotionEvents::adjoint(int event, const StateView& before, const Side& minus, const Side& plus, double* mu,
                           double* gradient) {
  const GuardOf& g = of(event);
  const int n = assembly_.n(), nz = assembly_.nz(), first = g.first_state, np = assembly_.np();
  refuse_slip_from_rest(event, before);
  if (goes_on_smoothly(event, before, minus, plus)) return;
  linearize_with_reactions(g, before, minus, np > 0);
  double sigma = minus.cost - plus.cost;
  if (has_impulse(event)) {
    linearize_impact(event, before, false);
    std::vector<double> w(static_cast<std::size_t>(2 * n), 0);
    sigma += impact_adjoint(mu + n, w.data(), w.data() + n, gradient);
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      sigma += w[k] * before.v[i] + w[k + static_cast<std::size_t>(n)] * minus.a[k] - mu[i] * jump_[k];
    }
    for (int i = 0; i < n; ++i)
      sigma += mu[n + i] * (minus.a[static_cast<std::size_t>(i)] - plus.a[static_cast<std::size_t>(i)]);
    for (int i = 0; i < 2 * n; ++i) mu[i] += w[static_cast<std::size_t>(i)];
  } else
    for (int i = 0; i < n; ++i)
      sigma += mu[n + i] * (minus.a[static_cast<std::size_t>(i)] - plus.a[static_cast<std::size_t>(i)]);
  const int own = static_cast<int>(D_x_.size());
  for (int i = 0; i < nz; ++i)
    if (i < first || i >= first + own)
      sigma += mu[2 * n + i] * (minus.zdot[static_cast<std::size_t>(i)] - plus.zdot[static_cast<std::size_t>(i)]);
  std::vector<double> weights(static_cast<std::size_t>(own));
  for (int i = 0; i < own; ++i) {
    const auto k = static_cast<std::size_t>(i);
    weights[k] = mu[2 * n + first + i];
    sigma += weights[k] * (D_rate_[k] - plus.zdot[static_cast<std::size_t>(first + i)]);
    mu[2 * n + first + i] = 0;
  }
  const double share = -sigma / hdot_;
  for (std::size_t i = 0; i < h_x_.size(); ++i) {
    mu[i] += share * h_x_[i];
    for (std::size_t k = 0; k < weights.size(); ++k) mu[i] += weights[k] * D_x_[k][i];
  }
  for (std::size_t j = 0; j < h_rho_.size(); ++j) {
    gradient[j] += share * h_rho_[j];
    for (std::size_t k = 0; k < weights.size(); ++k) gradient[j] += weights[k] * D_rho_[k][j];
  }
}

}  // namespace costate
