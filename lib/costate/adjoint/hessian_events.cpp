// Second derivatives across events, lib/README.md (13.14) and (13.17), and at an end that an event decides, (13.15).
#include <algorithm>
#include <array>
#include <cmath>

#include "costate/adjoint/hessian_equations.h"
#include "costate/adjoint/steep_begins.h"
#include "costate/base/error.h"
#include "costate/event/crossing_rate.h"
#include "costate/level/acceleration_rates.h"

namespace costate {

namespace {

using Eigen::Index;
using Eigen::Map;
using Eigen::VectorXd;

/// z'' along the motion, of all forces.
void calc_state_rates(const Assembly& assembly, const StateView& s, double* out) {
  const Mechanism& mechanism = assembly.mechanism();
  std::array<PathDual, kMaxLocal> q, v, z, Q, f;
  std::vector<PathDual> p;
  for (std::size_t k = 0; k < mechanism.forces().size(); ++k) {
    const Force& e = *mechanism.forces()[k];
    if (e.states() == 0) continue;
    const int first = mechanism.state_offsets()[k];
    for (std::size_t i = 0; i < e.coordinates().size(); ++i) {
      const int c = e.coordinates()[i];
      q[i] = PathDual(Taylor2(s.q[c], s.v[c], s.a[c]));
      v[i] = PathDual(Taylor2(s.v[c], s.a[c], 0));
    }
    for (int i = 0; i < e.states(); ++i)
      z[static_cast<std::size_t>(i)] =
          PathDual(Taylor2(s.z[first + i], assembly.zdot[static_cast<std::size_t>(first + i)], 0));
    p.clear();
    for (const int number : e.numbers()) p.emplace_back(assembly.numbers()[static_cast<std::size_t>(number)]);
    Q.fill(PathDual());
    f.fill(PathDual());
    e.force(PathDual(Taylor2(s.t, 1, 0)), q.data(), v.data(), z.data(), p.data(), Q.data(), f.data());
    for (int i = 0; i < e.states(); ++i) out[first + i] = f[static_cast<std::size_t>(i)].v.c1;
  }
}

}  // namespace

HessianEquations::Flow HessianEquations::flow() const {
  const StateView s = level_.state();
  Flow w;
  w.f.resize(state_size());
  w.f << Map<const VectorXd>(s.v, n_), Map<const VectorXd>(s.a, n_), Map<const VectorXd>(assembly_.zdot.data(), nz_);
  return w;
}

void HessianEquations::add_rates(Flow& flow) {
  const VectorXd x = acceleration_rates(assembly_, level_);
  const StateView s = level_.state();
  flow.f_rate.resize(state_size());
  flow.f_rate.head(n_) = Map<const VectorXd>(s.a, n_);
  flow.f_rate.segment(n_, n_) = x.head(n_);
  calc_state_rates(assembly_, s, flow.f_rate.data() + 2 * n_);
  if (objective_.running.empty()) return;
  flow.cost = objective_.running_value(s, assembly_);
  const std::vector<double> none(assembly_.numbers().size(), 0.0);
  const Variation motion{1, s.v, s.a, x.data(), x.data() + n_, flow.f.data() + 2 * n_, none.data()};
  for (const auto& term : objective_.running) flow.cost_rate += term->change(s, assembly_, motion);
}

void HessianEquations::add_adjoint(const VectorXd& mu, Flow& flow) {
  flow.mup.resize(state_size());
  flow.rho.resize(parameter_count());
  adjoint(mu.data(), flow.mup.data(), flow.rho.data());
}

MotionEvents::Side HessianEquations::side_of(const Flow& flow) const {
  const auto part = [&](int first, int count) {
    return std::vector<double>(flow.f.data() + first, flow.f.data() + first + count);
  };
  return {part(n_, n_), part(2 * n_, nz_), flow.cost};
}

void HessianEquations::cross_tangents(const Jumps& jumps, Event& e) {
  const int N = state_size(), k = directions();
  if (e.event >= 0) SteepBegins::of(assembly_).refuse_changed(e.t, e.before.data() + 2 * n_, e.after.data() + 2 * n_);
  if (e.event < 0) {
    jumps.instant->prepare(view(e.t, e.before.data()), e.behind);
    e.after = e.before;
    Map<VectorXd>(e.after.data() + n_, n_) += jumps.instant->u();
  }
  std::copy(e.before.begin() + N, e.before.end(), e.after.begin() + N);
  evaluate(e.t, e.before.data(), e.before.data() + N);
  const Flow minus = flow();
  evaluate(e.behind, e.after.data(), e.after.data() + N);
  const Flow plus = flow();
  if (e.event < 0) {
    for (int j = 0; j < k; ++j) {
      Map<VectorXd> x(e.after.data() + static_cast<std::ptrdiff_t>(1 + j) * N, N);
      const double dt = e.by.dot(directions_.col(j));
      const VectorXd dx = x + minus.f * dt;
      x = dx - plus.f * dt;
      x.segment(n_, n_) += jumps.instant->change(moved(j, dt, dx));
    }
    return;
  }
  std::vector<double*> columns;
  for (int j = 0; j < k; ++j) columns.push_back(e.after.data() + static_cast<std::ptrdiff_t>(1 + j) * N);
  std::vector<double> cost(static_cast<std::size_t>(k));
  jumps.events->tangent(e.event, view(e.t, e.before.data()), side_of(minus), side_of(plus), columns.data(), k,
                        cost.data(), &directions_);
}

Variation HessianEquations::moved(int j, double dt, const VectorXd& dx) const {
  Variation d;
  d.t = dt;
  d.q = dx.data();
  d.v = d.q + n_;
  d.z = d.q + 2 * n_;
  d.numbers = number_changes_[static_cast<std::size_t>(j)].data();
  return d;
}

HessianEquations::Flow HessianEquations::flow_beside(const Event& e, bool after, const VectorXd* mu) {
  const int N = state_size();
  const auto at = [&](double t, const std::vector<double>& state) {
    evaluate(t, state.data(), state.data() + N);
    Flow w = flow();
    add_rates(w);
    if (mu) add_adjoint(*mu, w);
    return w;
  };
  Flow further;
  if (e.ratio > 0)
    further = after ? at(e.further_after, e.state_further_after) : at(e.further_before, e.state_further_before);
  Flow near = after ? at(e.near_after, e.state_after) : at(e.near_before, e.state_before);
  if (!(e.ratio > 0)) return near;
  const auto limit = [&](auto& x, const auto& far) { x = (e.ratio * x - far) / (e.ratio - 1); };
  for (VectorXd Flow::*part : {&Flow::f, &Flow::f_rate, &Flow::mup, &Flow::rho}) limit(near.*part, further.*part);
  limit(near.cost, further.cost);
  limit(near.cost_rate, further.cost_rate);
  return near;
}

void HessianEquations::cross_event(const Jumps& jumps, const Event& e, double* mu, double* dmu, double* gradient,
                                   double* products) {
  const int N = state_size(), np = parameter_count();
  if (e.bends) return cross_bend_of_contact(jumps, e, mu, dmu, products);
  const VectorXd behind = Map<const VectorXd>(mu, N);
  const Flow plus = flow_beside(e, true, &behind);
  Flow minus = flow_beside(e, false, nullptr);

  const bool known = e.event < 0;
  const VectorXd lambda = Map<const VectorXd>(level_.lambda(), m_);
  MotionEvents::Gradient h{VectorXd::Zero(N), -e.by, 1};
  StateView at = view(e.t, e.before.data());
  at.lambda = lambda.data();
  if (known)
    jumps.instant->prepare(view(e.t, e.before.data()), e.behind);
  else
    h = jumps.events->begin_second(e.event, at, side_of(minus));
  // Where friction falls f jumps in an instant that multipliers decide.
  const bool falls = h.lambda.size() > 0 && !h.lambda.isZero(0);
  Reactions reactions;
  if (falls) reactions = add_reactions(minus.f, h);
  const auto transition = [&](const double* of) {
    return known ? jumps.instant->transition_gradient(of) : jumps.events->transition_gradient(of);
  };
  // mu- = Lambda_x with Lambda = mu+^T G + kappa h; kappa keeps mu^T f + g + Lambda_t.
  const auto G = transition(mu);
  const double h_rate = h.t + h.x.dot(minus.f),
               kappa = (behind.dot(plus.f) + plus.cost - G.t - G.x.dot(minus.f) - minus.cost) / h_rate;
  for (double& s : reactions.s) s *= kappa;
  const VectorXd before = G.x + kappa * h.x;
  if (e.ratio > 0)
    minus = flow_beside(e, false, &before);
  else
    add_adjoint(before, minus);
  Map<VectorXd>(mu, N) = before;
  Map<VectorXd>(gradient, np) += G.rho + kappa * h.rho;

  const Map<const Eigen::MatrixXd> S_before(e.before.data() + N, N, directions()),
      near_before(e.state_before.data() + N, N, directions()), near_after(e.state_after.data() + N, N, directions());
  for (int j = 0; j < directions(); ++j) {
    const VectorXd drho = directions_.col(j);
    const double dt = -(h.x.dot(S_before.col(j)) + h.rho.dot(drho)) / h_rate;
    // Everything in the moved instant.
    const VectorXd dx = S_before.col(j) + minus.f * dt;
    Map<VectorXd> own(dmu + static_cast<std::ptrdiff_t>(j) * N, N);
    const VectorXd dmu_behind = own + plus.mup * dt;
    Variation d = moved(j, dt, dx);
    VectorXd by_motion;
    if (falls) {
      by_motion = accelerations_.col(j) + reactions.rates * dt;
      d.a = by_motion.data();
      d.lambda = d.a + n_;
    }
    auto W = known ? jumps.instant->gradient_change(behind.data(), d)
                   : jumps.events->gradient_change(behind.data(), kappa, d, drho);
    if (falls) add_reactions_change(reactions.s, d, W);
    const auto by = transition(dmu_behind.data());
    const double change_before = minus.rho.dot(drho) - minus.mup.dot(near_before.col(j)) + dt * minus.rate(before),
                 change_behind = dmu_behind.dot(plus.f) + plus.rho.dot(drho) - plus.mup.dot(near_after.col(j)) +
                                 dt * plus.rate(behind),
                 dkappa = (change_behind - by.t - W.t - (by.x + W.x).dot(minus.f) - change_before) / h_rate;
    own = by.x + W.x + dkappa * h.x - minus.mup * dt;
    Map<VectorXd>(products + static_cast<std::ptrdiff_t>(j) * np, np) +=
        by.rho + W.rho + dkappa * h.rho + (minus.rho - plus.rho) * dt;
  }
}

VectorXd HessianEquations::bend_shifts(const Jumps& jumps, const Event& e) {
  evaluate(e.near_before, e.state_before.data(), e.state_before.data() + state_size());
  StateView before = view(e.t, e.before.data());
  before.lambda = level_.lambda();
  const MotionEvents::Gradient h = jumps.events->begin_second(e.event, before, side_of(flow()));
  const VectorXd rates = acceleration_rates(assembly_, level_).tail(m_);
  const double h_rate = h.lambda.dot(rates);
  require_crossing(e.t, jumps.events->name(e.event), h_rate, h.lambda.cwiseAbs().dot(rates.cwiseAbs()));
  return -(accelerations_.bottomRows(m_).transpose() * h.lambda + directions_.transpose() * h.rho) / h_rate;
}

void HessianEquations::cross_bend_of_contact(const Jumps& jumps, const Event& e, const double* mu, double* dmu,
                                             double* products) {
  const int N = state_size(), np = parameter_count();
  const VectorXd weights = Map<const VectorXd>(mu, N);
  evaluate(e.near_after, e.state_after.data(), e.state_after.data() + N);
  Flow plus = flow(), minus;
  add_adjoint(weights, plus);
  const VectorXd dt = bend_shifts(jumps, e);
  add_adjoint(weights, minus);
  for (int j = 0; j < directions(); ++j) {
    Map<VectorXd>(dmu + static_cast<std::ptrdiff_t>(j) * N, N) += dt[j] * (plus.mup - minus.mup);
    Map<VectorXd>(products + static_cast<std::ptrdiff_t>(j) * np, np) += dt[j] * (minus.rho - plus.rho);
  }
}

void HessianEquations::move_end(const double* mu, double* dmu, double* products) {
  const int N = state_size(), np = parameter_count();
  const VectorXd weights = Map<const VectorXd>(mu, N);
  const StateView s = level_.state();
  Flow at = flow();
  add_rates(at);
  add_adjoint(weights, at);
  const auto vector_of = [&](const ScalarGradient& g) {
    VectorXd x(N);
    x << g.q, g.v, g.z;
    return x;
  };
  ScalarGradient h, along, by_time;
  for (ScalarGradient* g : {&h, &along, &by_time}) g->resize(assembly_);
  end_event_->add_gradient(s, assembly_, 1, h);
  const VectorXd h_x = vector_of(h), still = VectorXd::Zero(N);
  const std::vector<double> none(assembly_.numbers().size(), 0.0);
  const Variation motion{1, at.f.data(), at.f.data() + n_, nullptr, nullptr, at.f.data() + 2 * n_, none.data()},
      time{1, still.data(), still.data(), nullptr, nullptr, still.data(), none.data()};
  const double h_rate = end_event_->change(s, assembly_, motion);
  objective_.add_terminal_gradient_change(s, assembly_, motion, along);
  objective_.add_terminal_gradient_change(s, assembly_, time, by_time);
  // Lambda_tt is not known of any cost: it has to be zero.
  const auto slope = [&](double later) {
    StateView at_another_time = s;
    at_another_time.t += later * std::max(1.0, std::abs(s.t));
    double sum = 0;
    for (const auto& term : objective_.terminal) sum += term->change(at_another_time, assembly_, time);
    return sum;
  };
  if (slope(0.731) != slope(0) || slope(-0.417) != slope(0))
    throw CapabilityError(
        "The terminal cost, or the output that ends the run, depends on time by itself (a target that is a law of "
        "time, "
        "the square of the time): second derivatives of runs that end by an event are known of costs in which the time "
        "stands by itself alone.");
  const double curvature = vector_of(along).dot(at.f) + vector_of(by_time).dot(at.f);
  for (int j = 0; j < directions(); ++j) {
    const VectorXd drho = directions_.col(j), dx = tangents_.col(j);
    const double dt = -(h_x.dot(dx) + h.rho.dot(drho)) / h_rate,
                 dkappa = -(vector_of(along).dot(dx) + along.rho.dot(drho) - at.mup.dot(dx) + at.rho.dot(drho) +
                            dt * (curvature + at.rate(weights))) /
                          h_rate;
    Map<VectorXd>(dmu + static_cast<std::ptrdiff_t>(j) * N, N) += dt * (vector_of(along) - at.mup) + dkappa * h_x;
    Map<VectorXd>(products + static_cast<std::ptrdiff_t>(j) * np, np) += dt * (along.rho + at.rho) + dkappa * h.rho;
  }
}

}  // namespace costate
