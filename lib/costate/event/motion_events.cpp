#include "costate/event/motion_events.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/base/error.h"
#include "costate/event/contact_gap.h"

namespace costate {

namespace {
// Looks within a step: what touches and leaves again between two of them is not seen.
constexpr int kLooks = 4;
// Below this share of the speeds that make it up the rate of a guard is rounding: the motion grazes.
constexpr double kGrazing = 1e-7;
// A gap of this part of the coordinates is none.
constexpr double kGapRounding = 1e-10;

/// Derivatives through impacts of one instant exist from one side only, if at all: which comes first decides.
template <class Contacts, class Contact>
void require_one_impact(const Contacts& contacts, const Contact* own, const StateView& s, const Assembly& assembly,
                        double speed) {
  for (const auto& c : contacts) {
    if (&c == own || (c.closed_state >= 0 && s.z[c.closed_state] > 0.5)) continue;
    if (strikes_too(c, s, assembly, speed) > 0)
      throw SolverError(
          fmt::format("At t = {:.9g} s {} and {} strike at the same time: a gradient does not exist there, as which "
                      "of them comes first decides. Let one of them be later.",
                      s.t, own->force->path(), c.force->path()));
  }
}
}  // namespace

bool MotionEvents::has_any(const Mechanism& mechanism) {
  for (const auto& f : mechanism.forces()) {
    const auto* g = dynamic_cast<const GuardedForce*>(f.get());
    if (g && g->guard_count() > 0) return true;
  }
  return false;
}

void MotionEvents::refuse(const Mechanism& mechanism, const std::string& what) {
  if (!has_any(mechanism)) return;
  throw CapabilityError(fmt::format(
      "This scene has events (contacts that touch and let go), which {} not carried across yet. Take idas or "
      "cvodes methods, which every formulation has for them.",
      what));
}

MotionEvents::MotionEvents(Assembly& assembly) : assembly_(assembly) {
  const Mechanism& mech = assembly.mechanism();
  for (std::size_t f = 0; f < mech.forces().size(); ++f) {
    const Force& force = *mech.forces()[f];
    const auto* guarded = dynamic_cast<const GuardedForce*>(&force);
    if (!guarded) continue;
    int contact = -1, first_row = -1;
    if (const auto* unilateral = dynamic_cast<const UnilateralForce*>(&force)) {
      contact = static_cast<int>(contacts_.size());
      for (std::size_t i = 0; i < mech.constraints().size(); ++i)
        if (mech.constraints()[i].get() == unilateral->rows()) first_row = mech.row_offsets()[i];
      const int state = unilateral->closed_state();
      contacts_.push_back({&force, unilateral, state < 0 ? -1 : mech.state_offsets()[f] + state, first_row});
      needs_multipliers_ = needs_multipliers_ || first_row >= 0;
    }
    for (int k = 0; k < guarded->guard_count(); ++k)
      guards_.push_back({&force, guarded, k, mech.state_offsets()[f],
                         fmt::format("{}: {}", force.path(), guarded->guard_name(k)), contact, first_row, false,
                         false});
  }
}

void MotionEvents::load(const GuardOf& g, const StateView& s) {
  const auto& c = g.force->coordinates();
  q_.assign(c.size(), {});
  v_.assign(c.size(), {});
  for (std::size_t i = 0; i < c.size(); ++i) {
    q_[i] = PathDual(s.q[c[i]]);
    v_[i] = PathDual(s.v[c[i]]);
  }
  z_.assign(static_cast<std::size_t>(g.force->states()), {});
  for (std::size_t i = 0; i < z_.size(); ++i) z_[i] = PathDual(s.z[g.first_state + static_cast<int>(i)]);
  const auto& numbers = g.force->numbers();
  p_.assign(numbers.size(), {});
  for (std::size_t i = 0; i < p_.size(); ++i)
    p_[i] = PathDual(assembly_.numbers()[static_cast<std::size_t>(numbers[i])]);
  out_.assign(z_.size(), {});
  lambda_.clear();
  if (g.first_row >= 0 && s.lambda)
    for (int i = 0; i < contacts_[static_cast<std::size_t>(g.contact)].contact->row_count(); ++i)
      lambda_.emplace_back(s.lambda[g.first_row + i]);
  t_ = PathDual(s.t);
}

MeasureArguments MotionEvents::arguments() const {
  MeasureArguments x;
  x.t = t_;
  x.q = q_.data();
  x.v = v_.data();
  x.z = z_.data();
  x.p = p_.data();
  if (!lambda_.empty()) x.lambda = lambda_.data();
  return x;
}

double MotionEvents::value(const GuardOf& g, const StateView& s) {
  const auto& c = g.force->coordinates();
  const auto& numbers = g.force->numbers();
  values_.resize(2 * c.size() + numbers.size());
  double *q = values_.data(), *v = q + c.size(), *p = v + c.size();
  for (std::size_t i = 0; i < c.size(); ++i) {
    q[i] = s.q[c[i]];
    v[i] = s.v[c[i]];
  }
  for (std::size_t i = 0; i < numbers.size(); ++i) p[i] = assembly_.numbers()[static_cast<std::size_t>(numbers[i])];
  LocalState local;
  local.t = s.t;
  local.q = q;
  local.v = v;
  local.z = s.z + g.first_state;
  local.p = p;
  if (g.first_row >= 0 && s.lambda) local.lambda = s.lambda + g.first_row;
  return g.guarded->guard_value(g.k, local);
}

void MotionEvents::calc(const StateView& s, std::vector<double>& h) {
  h.assign(guards_.size(), std::numeric_limits<double>::quiet_NaN());
  for (std::size_t i = 0; i < guards_.size(); ++i)
    if (guards_[i].guarded->guard_armed(guards_[i].k, s.z + guards_[i].first_state)) h[i] = value(guards_[i], s);
}

void MotionEvents::begin(const StateView& s) {
  calc(s, before_);
  for (std::size_t i = 0; i < guards_.size(); ++i) {
    GuardOf& g = guards_[i];
    const int direction = g.guarded->guard_direction(g.k);
    g.ready = before_[i] * direction < 0;
    if (std::isnan(before_[i]) || g.ready) continue;
    // At zero, but for rounding, it counts if it is about to cross; beyond, the start is of another mode.
    load(g, s);
    double size = 0;
    for (std::size_t c = 0; c < q_.size(); ++c) {
      size = std::max(size, std::abs(q_[c].v.c0));
      q_[c].v.c1 = v_[c].v.c0;
    }
    t_.v.c1 = 1;
    const double rate = g.guarded->guard(g.k, arguments()).v.c1 * direction;
    const bool past = before_[i] * direction > 1e-9 * size;
    const std::string advice = g.guarded->past_at_start(g.k);
    if (past && !advice.empty())
      throw ModelError(g.force->path(), fmt::format("At the start '{}' has happened already, by {:.6g}: {}", g.name,
                                                    std::abs(before_[i]), advice));
    g.ready = !past && rate > 0;
  }
}

std::optional<MotionEvents::Hit> MotionEvents::find(double from, double to,
                                                    const std::function<StateView(double)>& at) {
  double begin = from;
  for (int j = 0; j <= kLooks; ++j) {
    const double end = j == kLooks ? to : from + (to - from) * j / kLooks;
    calc(at(end), after_);
    std::optional<Hit> first;
    for (std::size_t i = 0; i < guards_.size(); ++i) {
      GuardOf& g = guards_[i];
      const int direction = g.guarded->guard_direction(g.k);
      if (std::isnan(after_[i])) {
        g.ready = g.just_left = false;
        continue;
      }
      double a = begin, b = end;
      if (g.just_left) {
        // It may begin a little below the ground, by what the integrator has let it drift, and what lets go leaves with
        // the cube of time: only beyond rounding it has left.
        double size = 0;
        const double before = value(g, at(begin)) * direction;
        const StateView last = at(end);
        for (const int c : g.force->coordinates()) size = std::max(size, std::abs(last.q[c]));
        const double rounding = kGapRounding * size;
        if (after_[i] * direction < -rounding) {
          g.ready = true;
          g.just_left = false;
          continue;
        }
        // It may have left and come back within a part of this look.
        for (int k = 0; k < 50 && !(value(g, at(a)) * direction < -rounding); ++k)
          a = begin + (end - begin) * std::ldexp(1, -50 + k);
        g.ready = value(g, at(a)) * direction < -rounding;
        if (!g.ready && after_[i] * direction <= std::max(before, 0.0) + rounding) continue;
        if (!g.ready)
          throw SolverError(
              fmt::format("At t = {:.9g} s '{}' falls into the ground that it has just left.", begin, g.name));
        g.just_left = false;
      }
      if (after_[i] * direction < 0) {
        g.ready = true;
        continue;
      }
      if (!g.ready) continue;
      // In (a, b]: by halves and secants to the last bit, and then its far side.
      double ha = value(g, at(a)) * direction, hb = after_[i] * direction;
      if (ha >= 0) b = a;
      for (int k = 0; k < 200 && b - a > 2 * std::numeric_limits<double>::epsilon() * std::abs(b); ++k) {
        double m = k % 3 == 2 || !(hb > ha) ? 0.5 * (a + b) : a + (b - a) * (-ha / (hb - ha));
        // A secant's point near an end is moved inward so that the bracket shrinks from both sides.
        const double inward = 1e-3 * (b - a);
        if (!(m > a + inward * 1e-6) || !(m < b - inward * 1e-6)) m = 0.5 * (a + b);
        if (m <= a || m >= b) break;
        const double hm = value(g, at(m)) * direction;
        (hm < 0 ? a : b) = m;
        (hm < 0 ? ha : hb) = hm;
      }
      if (!first || b < first->t) first = Hit{b, static_cast<int>(i)};
    }
    if (first) {
      guards_[static_cast<std::size_t>(first->event)].ready = false;
      return first;
    }
    begin = end;
  }
  return {};
}

void MotionEvents::cross(int event, const StateView& before, double* v, double* z) {
  const GuardOf& g = of(event);
  last_jump_ = last_loss_ = 0;
  if (contact_of(event)) return cross_contact(event, before, v, z);
  load(g, before);
  g.guarded->transition(g.k, arguments(), out_.data());
  for (std::size_t i = 0; i < out_.size(); ++i) {
    const double jump = out_[i].v.c0 - z_[i].v.c0;
    if (std::abs(jump) > std::abs(last_jump_)) last_jump_ = jump;
    z[g.first_state + static_cast<int>(i)] = out_[i].v.c0;
  }
}

void MotionEvents::linearize(const GuardOf& g, const StateView& before, const Side& minus, bool columns) {
  const int n = assembly_.n(), nz = assembly_.nz(), np = assembly_.np();
  const auto width = static_cast<std::size_t>(2 * n + nz);
  load(g, before);
  h_x_.assign(width, 0);
  h_rho_.assign(static_cast<std::size_t>(np), 0);
  D_x_.assign(out_.size(), h_x_);
  D_rho_.assign(out_.size(), h_rho_);
  D_rate_.assign(out_.size(), 0);
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
    hdot_ += h;
    speed += std::abs(h);
    for (std::size_t i = 0; i < out_.size(); ++i) D_rate_[i] += out_[i].d[0].c0;
  });
  if (!(std::abs(hdot_) > kGrazing * speed))
    throw SolverError(
        fmt::format("At t = {:.9g} s '{}' is grazed: its guard changes by {:.3g} per second, of terms of {:.3g}. The "
                    "time of the event has no derivative there. Move the motion away from grazing.",
                    before.t, g.name, hdot_, speed));
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
                           double* const* columns, int count, double* dcost) {
  const GuardOf& g = of(event);
  const int n = assembly_.n(), nz = assembly_.nz(), first = g.first_state;
  const bool impact = contact_of(event, true) != nullptr;
  if (contact_of(event) && !impact) {  // a release: nothing jumps but what is latched, and f- = f+
    std::fill(dcost, dcost + count, 0.0);
    return;
  }
  linearize(g, before, minus, true);
  std::vector<double> own(D_x_.size());
  std::vector<double> moved, u(static_cast<std::size_t>(n), 0);  // u's change along the column
  if (impact) {
    strike(event, before);
    require_one_impact(contacts_, contact_of(event), before, assembly_, -impact_->speed_before(0));
    impact_->linearize(true);
  }
  for (int j = 0; j < count; ++j) {
    double* x = columns[j];
    double dh = h_rho_[static_cast<std::size_t>(j)];
    for (std::size_t i = 0; i < h_x_.size(); ++i) dh += h_x_[i] * x[i];
    const double dt = -dh / hdot_;
    for (std::size_t i = 0; i < own.size(); ++i) {
      own[i] =
          D_rho_[i][static_cast<std::size_t>(j)] + (D_rate_[i] - plus.zdot[static_cast<std::size_t>(first) + i]) * dt;
      for (std::size_t k = 0; k < D_x_[i].size(); ++k) own[i] += D_x_[i][k] * x[k];
    }
    if (impact) {
      moved.assign(x, x + 2 * n);
      for (int i = 0; i < n; ++i) {
        moved[static_cast<std::size_t>(i)] += before.v[i] * dt;
        moved[static_cast<std::size_t>(n + i)] += minus.a[static_cast<std::size_t>(i)] * dt;
      }
      std::fill(u.begin(), u.end(), 0.0);
      impact_->tangent(moved.data(), moved.data() + n, j, dt, u.data());
      for (int i = 0; i < n; ++i) x[i] -= impact_->u()[i] * dt;
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

void MotionEvents::adjoint(int event, const StateView& before, const Side& minus, const Side& plus, double* mu,
                           double* gradient) {
  const GuardOf& g = of(event);
  const int n = assembly_.n(), nz = assembly_.nz(), first = g.first_state, np = assembly_.np();
  if (contact_of(event) && !contact_of(event, true)) return;
  linearize(g, before, minus, np > 0);
  double sigma = minus.cost - plus.cost;
  if (contact_of(event, true)) {
    strike(event, before);
    require_one_impact(contacts_, contact_of(event), before, assembly_, -impact_->speed_before(0));
    impact_->linearize(false);
    std::vector<double> w(static_cast<std::size_t>(2 * n), 0);
    sigma += impact_->adjoint(mu + n, w.data(), w.data() + n, gradient);
    for (int i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      sigma += w[k] * before.v[i] + w[k + static_cast<std::size_t>(n)] * minus.a[k] - mu[i] * impact_->u()[i];
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
