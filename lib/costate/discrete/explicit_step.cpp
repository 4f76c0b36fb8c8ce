#include "costate/discrete/explicit_step.h"

#include <algorithm>
#include <cmath>

namespace costate {

ExplicitStep::ExplicitStep(const ExplicitScheme& scheme, int unknowns, bool has_cost, Rates rates)
    : scheme_(scheme),
      unknowns_(unknowns),
      size_(unknowns + (has_cost ? 1 : 0)),
      has_cost_(has_cost),
      rates_(std::move(rates)) {
  const std::size_t all = scheme.c.size();
  rows_.resize(all);
  needs_cost_.assign(all, 0);
  for (std::size_t i = 0; i < scheme.a.size(); ++i)
    for (std::size_t j = 0; j < scheme.a[i].size(); ++j)
      if (scheme.a[i][j] != 0) rows_[i].push_back({static_cast<int>(j), scheme.a[i][j]});
  const auto mark = [&](const std::vector<double>& weights) {
    for (std::size_t i = 0; i < weights.size(); ++i)
      if (weights[i] != 0) needs_cost_[i] = 1;
  };
  mark(scheme.weights());
  mark(scheme.error);
  mark(scheme.error_low);
  for (const auto& row : scheme.dense) mark(row);
  for (std::size_t i = static_cast<std::size_t>(scheme.stages) + 1; i < scheme.a.size(); ++i) mark(scheme.a[i]);
  needs_cost_[0] = needs_cost_[static_cast<std::size_t>(scheme.stages)] = 1;  // the dense output has both
  y_.assign(all * static_cast<std::size_t>(size_), 0);
  k_ = y_;
  dense_.assign((scheme.dense.size() + 3) * static_cast<std::size_t>(size_), 0);
  error_.assign(static_cast<std::size_t>(size_), 0);
  if (!scheme.error_low.empty()) error_low_ = error_;
}

void ExplicitStep::evaluate(int i) {
  ++evaluations_;
  rates_(scheme_.time(i, t_, h_, t_end_), stage(i), rate(i),
         has_cost_ && needs_cost_[static_cast<std::size_t>(i)] != 0);
  if (keep_ && i <= scheme_.stages) keep_(i);
}

void ExplicitStep::form_stage(int i, double h, int entries) {
  double* y = stage(i);
  const double* y0 = stage(0);
  std::fill(y, y + entries, 0.0);
  for (const Term& term : rows_[static_cast<std::size_t>(i)]) {
    const double* k = rate(term.of);
    for (int e = 0; e < entries; ++e) y[e] += term.a * k[e];
  }
  for (int e = 0; e < entries; ++e) y[e] = y0[e] + h * y[e];
}

void ExplicitStep::begin(double t, const double* y) {
  t_ = t_end_ = t;
  h_ = 0;
  dense_ready_ = false;
  std::copy(y, y + size_, stage(0));
  evaluate(0);
}

void ExplicitStep::go_on() {
  t_ = t_end_;
  h_ = 0;
  dense_ready_ = false;
  const int s = scheme_.stages;
  std::copy(stage(s), stage(s) + size_, stage(0));
  std::copy(rate(s), rate(s) + size_, rate(0));
}

void ExplicitStep::attempt(double h, double t_end) {
  h_ = h;
  t_end_ = t_end;
  dense_ready_ = false;
  for (int i = 1; i < scheme_.stages; ++i) {
    form_stage(i, h, unknowns_);
    evaluate(i);
  }
  form_stage(scheme_.stages, h, size_);
  evaluate(scheme_.stages);
}

void ExplicitStep::repeat(double t, const double* y, double h, double t_end) {
  begin(t, y);
  h_ = h;
  t_end_ = t_end;
  for (int i = 1; i < scheme_.stages; ++i) {
    form_stage(i, h, unknowns_);
    evaluate(i);
  }
  form_stage(scheme_.stages, h, size_);
}

void ExplicitStep::combine(const std::vector<double>& weights, double* out) const {
  std::fill(out, out + size_, 0.0);
  for (std::size_t i = 0; i < weights.size(); ++i) {
    if (weights[i] == 0) continue;
    const double* k = rate(static_cast<int>(i));
    for (int e = 0; e < size_; ++e) out[e] += weights[i] * k[e];
  }
  for (int e = 0; e < size_; ++e) out[e] *= h_;
}

namespace {
/// Mean square of x in tolerances over the first n entries.
double mean_square(const double* x, const double* y0, const double* y1, double rtol, const double* atol, int n) {
  double sum = 0;
  for (int e = 0; e < n; ++e) {
    const double r = x[e] / (atol[e] + rtol * std::max(std::abs(y0[e]), std::abs(y1[e])));
    sum += r * r;
  }
  return n > 0 ? sum / n : 0;
}
}  // namespace

double ExplicitStep::error_of(int from, int count, double rtol, const double* atol) const {
  const auto square = [&](const std::vector<double>& error) {
    return mean_square(error.data() + from, start() + from, end() + from, rtol, atol + from, count);
  };
  const double high = square(error_);
  if (error_low_.empty()) return std::sqrt(high);
  const double both = high + 0.01 * square(error_low_);
  return both > 0 ? high / std::sqrt(both) : 0;
}

StepEstimate ExplicitStep::estimate(double rtol, const double* atol) {
  combine(scheme_.error, error_.data());
  if (!error_low_.empty()) combine(scheme_.error_low, error_low_.data());
  const double of_state = error_of(0, unknowns_, rtol, atol);
  double moved = 0;  // over the step, in tolerances
  for (const int i : {0, scheme_.stages})
    moved = std::max(moved, h_ * std::sqrt(mean_square(rate(i), start(), end(), rtol, atol, unknowns_)));
  StepEstimate r{of_state, moved > 1 ? of_state / moved : 0};
  if (!has_cost_) return r;
  const int k = unknowns_;
  const double of_cost = error_of(k, 1, rtol, atol),
               tolerance = atol[k] + rtol * std::max(std::abs(start()[k]), std::abs(end()[k]));
  r.error = std::max(r.error, of_cost);
  r.rate_error = std::max(
      r.rate_error, cost_pace_.rate_error(of_cost * tolerance, h_, rate(0)[k], rate(scheme_.stages)[k], tolerance));
  return r;
}

double ExplicitStep::stiffness() const {
  // The last two evaluations are both at the step's end.
  const int s = scheme_.stages;
  double rates = 0, states = 0;
  for (int e = 0; e < unknowns_; ++e) {
    const double k = rate(s)[e] - rate(s - 1)[e], y = stage(s)[e] - stage(s - 1)[e];
    rates += k * k;
    states += y * y;
  }
  return states > 0 ? h_ * std::sqrt(rates / states) : 0;
}

double ExplicitStep::first_step(double rtol, const double* atol, double span) {
  const double* y0 = stage(0);
  const double d0 = std::sqrt(mean_square(y0, y0, y0, rtol, atol, unknowns_)),
               d1 = std::sqrt(mean_square(rate(0), y0, y0, rtol, atol, unknowns_));
  double h0 = d0 < 1e-5 || d1 < 1e-5 ? 1e-6 : 0.01 * d0 / d1;
  h0 = std::min(h0, span);
  // A step of Euler's tells the second derivative.
  double *y1 = stage(1), *k1 = rate(1);
  for (int e = 0; e < unknowns_; ++e) y1[e] = y0[e] + h0 * rate(0)[e];
  ++evaluations_;
  rates_(t_ + h0, y1, k1, false);
  for (int e = 0; e < unknowns_; ++e) k1[e] -= rate(0)[e];
  const double d2 = std::sqrt(mean_square(k1, y0, y0, rtol, atol, unknowns_)) / h0, fastest = std::max(d1, d2);
  const double h1 = fastest <= 1e-15 ? std::max(1e-6, 1e-3 * h0) : std::pow(0.01 / fastest, 1.0 / scheme_.order);
  return std::min({100 * h0, h1, span});
}

void ExplicitStep::dense(double x, double* y) {
  const int s = scheme_.stages;
  const auto part = [&](std::size_t i) { return dense_.data() + i * static_cast<std::size_t>(size_); };
  if (!dense_ready_) {
    const long counted = evaluations_;
    for (int i = s + 1; i < static_cast<int>(scheme_.c.size()); ++i) {
      form_stage(i, h_, size_);
      evaluate(i);
    }
    evaluations_ = counted;
    for (int e = 0; e < size_; ++e) {
      const double d = end()[e] - start()[e], k0 = h_ * rate(0)[e], k1 = h_ * rate(s)[e];
      part(0)[e] = d;
      part(1)[e] = k0 - d;
      part(2)[e] = 2 * d - k0 - k1;
    }
    for (std::size_t i = 0; i < scheme_.dense.size(); ++i) combine(scheme_.dense[i], part(3 + i));
    dense_ready_ = true;
  }
  std::fill(y, y + size_, 0.0);
  for (std::size_t i = scheme_.dense.size() + 3; i-- > 0;) {
    const double factor = i % 2 == 0 ? x : 1 - x;
    for (int e = 0; e < size_; ++e) y[e] = (y[e] + part(i)[e]) * factor;
  }
  for (int e = 0; e < size_; ++e) y[e] += start()[e];
}

}  // namespace costate
