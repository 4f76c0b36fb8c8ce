#include "costate/level/maggi_positions.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "costate/analysis/complaints.h"
#include "costate/analysis/mechanism_size.h"
#include "costate/analysis/start.h"
#include "costate/base/error.h"
#include "costate/element/switched_rows.h"

namespace costate {

namespace {
// Steps relative to the mechanism's size. After a Newton step below kQuadratic the next one is of rounding size, which
// may exceed kRounding where the chart is ill-conditioned, but not kLoose.
constexpr double kRounding = 1e-14, kQuadratic = 1e-8, kLoose = 1e-10;
constexpr double kKeepEvery = 0.05;  // distance between kept positions
constexpr int kMaxIterations = 30;
// No part of a way is longer than this, so that others that it moves go no farther than Newton may; a wheel that spins
// freely goes many in a step.
constexpr double kFarthest = 0.1, kMostParts = 1e5;
// By factors of positions nearby: by how much steps become shorter at least, and how many there are.
constexpr double kLookContraction = 0.3, kLookRounding = 1e-13;
constexpr int kMostLookSteps = 12;
constexpr std::size_t kReserved = 256;  // kept positions that need no allocation
}  // namespace

MaggiPositions::MaggiPositions(Assembly& assembly)
    : assembly_(assembly),
      n_(assembly.n()),
      m_(assembly.m()),
      f_(open_freedoms(assembly)),
      switched_(find_switched_rows(assembly)),
      redundant_(m_ + f_ > n_ + static_cast<int>(switched_.size())),
      charts_(assembly, f_) {
  const auto n = static_cast<std::size_t>(n_), f = static_cast<std::size_t>(f_);
  q_.assign(n, 0);
  last_.q = last_.v = last_.a = factored_at_ = walked_ = guessed_ = q_;
  step_.assign(static_cast<std::size_t>(std::max(m_ + f_, n_)), 0);
  rate_ = step_;
  y_from_.assign(f, 0);
  y_part_ = y_from_;
  weight_.assign(n, 1);
}

double MaggiPositions::largest(const double* x) const {
  double r = 0;
  for (int i = 0; i < n_; ++i) {
    if (!std::isfinite(x[i])) return std::numeric_limits<double>::infinity();
    if (constrained_[static_cast<std::size_t>(i)])
      r = std::max(r, std::abs(x[i]) * measure(static_cast<std::size_t>(i)));
  }
  return r;
}

double MaggiPositions::distance_between(const std::vector<double>& a, const std::vector<double>& b) const {
  double r = 0;
  for (std::size_t i = 0; i < a.size(); ++i) r = std::max(r, std::abs(a[i] - b[i]) * measure(i));
  return r;
}

void MaggiPositions::start(const StateView& s) {
  assembly_.switch_rows(s.z);
  begin(s, nullptr);
}

void MaggiPositions::begin(const StateView& from, const MaggiCharts::Chart* choice) {
  const double t = from.t, *q = from.q;
  // Angles count with the size of the mechanism: an angle is chosen before the positions that it moves.
  const auto& coordinates = assembly_.mechanism().coordinates();
  double low = 0, high = 0;
  bool any = false;
  for (int i = 0; i < n_; ++i) {
    if (coordinates[i].unit != "m") continue;
    low = any ? std::min(low, q[i]) : q[i];
    high = any ? std::max(high, q[i]) : q[i];
    any = true;
  }
  constrained_.assign(static_cast<std::size_t>(n_), 0);
  branches_ = false;
  for (const auto& c : assembly_.mechanism().constraints()) {
    branches_ = branches_ || !dynamic_cast<const SwitchedRows*>(c.get());
    for (const int i : c->coordinates()) constrained_[static_cast<std::size_t>(i)] = 1;
  }
  // What is rounding beside the points is no size.
  const double extent = extent_of(assembly_, Eigen::Map<const Eigen::VectorXd>(q, n_)).value_or(1),
               none = kRounding * extent;
  scale_ = high - low > none ? high - low : any && std::abs(high) > none ? std::abs(high) : extent;
  sizes_.resize(weight_.size());
  for (int i = 0; i < n_; ++i) {
    weight_[i] = coordinates[i].unit == "m" ? 1 : scale_;
    sizes_[i] = scale_ / weight_[i];
  }

  dropped_factorizations_ = factorizations();
  charts_.clear();
  kept_t_.clear();
  kept_q_.clear();
  kept_t_.reserve(kReserved);
  kept_q_.reserve(kReserved * static_cast<std::size_t>(n_));
  repeated_.clear();
  forgotten_ = false;
  factored_chart_ = -1;
  std::copy(q, q + n_, q_.begin());
  StateView s;
  s.t = t;
  s.q = q_.data();
  assembly_.calc_constraints(s);
  chart_ = -1;
  if (choice != nullptr) {
    chart_ = charts_.find(choice->rows, choice->rates->independent(), choice->of_reactions());
  } else {
    MaggiRows rows = rows_there(assembly_, switched_);
    if (!switched_.empty()) find_dependent_rows(assembly_, switched_, rows);
    if (!rows.slides.empty()) assembly_.calc_jacobian(from);  // in space the direction is that of the velocities
    chart_ = charts_.find_best(rows, weight_);
  }
  take_solved(t);
  remember();
}

bool MaggiPositions::begin_as(const MaggiPositions& other) {
  const bool first = !started();
  const MaggiCharts::Chart& choice = other.charts_[other.chart_];
  if (first) {
    StateView from;
    from.t = other.last_.t;
    from.q = other.last_.q.data();
    begin(from, &choice);
  }
  last_ = other.last_;
  remembered_ = other.remembered_;
  if (charts_[chart_].is(choice.rows, choice.rates->independent(), nullptr)) return first;
  chart_ = charts_.find(choice.rows, choice.rates->independent(), choice.of_reactions());
  return true;
}

bool MaggiPositions::solve_by_factors_of(const MaggiPositions& other, double t, const double* y, const double* yd,
                                         std::vector<double>& v) {
  if (other.factored_chart_ != other.chart_ || redundant_) return false;
  guess(t, false, false);
  const double distance = distance_between(q_, other.factored_at_);
  if (!(distance <= kNear * scale_)) return false;
  MaggiChart& X = *other.charts_[other.chart_].rates;
  const auto& independent = X.independent();
  const std::size_t free = independent.size();
  StateView s;
  s.t = t;
  s.q = q_.data();
  double previous = std::numeric_limits<double>::infinity();
  for (int k = 0;; ++k) {
    ++iterations_;
    assembly_.calc_constraints(s);
    for (int i = 0; i < m_; ++i) step_[i] = -assembly_.phi[i];
    add_places(y, step_.data());
    for (std::size_t i = 0; i < independent.size(); ++i)
      step_[static_cast<std::size_t>(m_) + i] = y[i] - q_[static_cast<std::size_t>(independent[i])];
    X.solve(step_.data());
    const double step = largest(step_.data()) / scale_;
    if (!(step <= std::max(kLookRounding, kLookContraction * previous)) || k == kMostLookSteps) return false;
    // Coordinates without constraints, which do not count, come to their place by the first one.
    for (std::size_t i = 0; i < q_.size(); ++i) q_[i] += step_[i];
    if (step <= kLookRounding) break;
    previous = step;
  }
  // [Phi_q; B] v = [-Phi_t; yd], with what the factors leave of it taken up again.
  const auto rest = [&](double* r) {
    for (int i = 0; i < m_; ++i) r[i] = -assembly_.phi_t[i];
    std::copy(yd, yd + f_, r + m_);
    if (v.empty()) return;
    add_product(assembly_.jacobian(), assembly_.phi_q.data(), -1, v.data(), r);
    for (std::size_t i = 0; i < free; ++i)
      r[static_cast<std::size_t>(m_) + i] -= v[static_cast<std::size_t>(independent[i])];
  };
  v.clear();
  rest(step_.data());
  X.solve(step_.data());
  v = step_;
  const double all = largest(v.data());
  for (int k = 0; k < kMostLookSteps; ++k) {
    rest(step_.data());
    X.solve(step_.data());
    for (int i = 0; i < n_; ++i) v[static_cast<std::size_t>(i)] += step_[static_cast<std::size_t>(i)];
    if (largest(step_.data()) <= kLookRounding * all) return true;
  }
  return false;
}

long MaggiPositions::factorizations() const { return dropped_factorizations_ + charts_.factorizations(); }

void MaggiPositions::set_rates(const double* v, const double* a) {
  std::copy(v, v + n_, last_.v.begin());
  if (a)
    std::copy(a, a + n_, last_.a.begin());
  else
    std::fill(last_.a.begin(), last_.a.end(), 0.0);
  last_.accelerated = a != nullptr;
}

void MaggiPositions::remember() {
  remembered_ = last_;
  if (!kept_t_.empty()) {
    if (last_.t <= kept_t_.back()) return;
    const double* before = kept(kept_t_.size() - 1);
    double moved = 0;
    for (int i = 0; i < n_; ++i) moved = std::max(moved, std::abs(last_.q[i] - before[i]) * weight_[i]);
    if (moved < kKeepEvery * scale_) return;
  }
  kept_t_.push_back(last_.t);
  kept_q_.insert(kept_q_.end(), last_.q.begin(), last_.q.end());
}

std::size_t MaggiPositions::nearest_kept(double t) const {
  const auto above = std::lower_bound(kept_t_.begin(), kept_t_.end(), t);
  const auto at = static_cast<std::size_t>(above - kept_t_.begin());
  if (at == kept_t_.size()) return at - 1;
  return at > 0 && t - kept_t_[at - 1] < kept_t_[at] - t ? at - 1 : at;
}

double MaggiPositions::guess(double t, bool from_kept, bool far) {
  const double dt = t - last_.t;
  const std::size_t near = nearest_kept(t);
  if (!from_kept) {
    double way = 0;
    for (int i = 0; i < n_; ++i) {
      const double d = dt * (last_.v[i] + 0.5 * dt * last_.a[i]);
      q_[i] = last_.q[i] + d;
      if (constrained_[static_cast<std::size_t>(i)]) way = std::max(way, std::abs(d) * weight_[i]);
    }
    if ((way <= kFar * scale_ || !branches_) && !far) return t;
    if (way <= scale_) {
      q_ = last_.q;
      return last_.t;
    }
  }
  std::copy(kept(near), kept(near) + n_, q_.begin());
  return kept_t_[near];
}

void MaggiPositions::forget_history() {
  factored_chart_ = -1;
  charts_.forget_history();
  forgotten_ = true;
}

double MaggiPositions::repeated_guess(double t, bool& far) {
  for (const Repeated& r : repeated_)
    if (r.t == t && r.chart == chart_) {
      q_ = r.q;
      far = r.far;
      return r.from;
    }
  const double from = guess(t, false, far);
  repeated_.push_back({t, from, chart_, far, q_});
  return from;
}

void MaggiPositions::solve(double t, const double* y) {
  const bool forgotten = std::exchange(forgotten_, false);
  bool far = driven_way(t - last_.t) > kFar * scale_;
  const auto find = [&] {
    for (const bool from_kept : {false, true})
      for (const int least : {1, 8, 64}) {
        const double from = forgotten ? repeated_guess(t, far) : guess(t, from_kept, far);
        if (far) return walk(from, t, y);
        const int parts = least < 64 ? least : std::max(least, parts_to(from, y));
        guessed_ = q_;
        if (!(parts == 1 ? newton(t, y) : follow(from, t, y, parts))) continue;
        if (parts > 1 || !driven() || moved_since(guessed_) <= kFar * scale_) return true;
        q_ = from == t ? last_.q : guessed_;
        return walk(from == t ? last_.t : from, t, y);
      }
    return false;
  };
  if (!find()) {
    factored_chart_ = -1;
    // In a trial step: of many rows it would take longer than the search.
    constexpr int few_rows = 60;
    StateView last;
    last.t = last_.t;
    last.q = last_.q.data();
    const std::string rows = dependent_row(assembly_, last, few_rows);
    throw StepError(
        fmt::format("At t = {:.9g} s the constraints have no positions near the last ones for the wanted "
                    "independent coordinates. The mechanism reaches the end of its motion or a singular "
                    "configuration.{}{}",
                    t, rows.empty() ? "" : " ", rows));
  }
  take_solved(t);
}

void MaggiPositions::take_solved(double t) {
  last_.t = t;
  last_.q = q_;
  std::fill(last_.v.begin(), last_.v.end(), 0.0);
  std::fill(last_.a.begin(), last_.a.end(), 0.0);
  last_.accelerated = false;
}

int MaggiPositions::parts_to(double t, const double* y) {
  double way = 0;
  read_from(t, y);
  // What rolls turns by more than 1 as it goes by the size of a small mechanism.
  const double turns = std::min(1.0, scale_);
  for (std::size_t k = chart().independent().size(); k < y_from_.size(); ++k)
    way = std::max(way, std::abs(y[k] - y_from_[k]) / turns);
  const auto& independent = chart().independent();
  for (std::size_t k = 0; k < independent.size(); ++k)
    if (const auto i = static_cast<std::size_t>(independent[k]); constrained_[i])
      way = std::max(way, std::abs(y[k] - q_[i]) * measure(i));
  return static_cast<int>(std::min(way / (kFarthest * scale_), kMostParts));
}

void MaggiPositions::read_from(double t, const double* y) {
  const auto& independent = chart().independent();
  std::copy(y, y + f_, y_from_.begin());
  for (std::size_t k = 0; k < independent.size(); ++k) y_from_[k] = q_[static_cast<std::size_t>(independent[k])];
  if (independent.size() == y_from_.size()) return;
  StateView s;
  s.t = t;
  s.q = q_.data();
  assembly_.calc_constraints(s);
  for (std::size_t k = 0; k < rows().closed.size(); ++k)
    if (const int row = rows().closed[k]; !assembly_.holds_position(row))
      y_from_[independent.size() + k] = assembly_.phi[static_cast<std::size_t>(row)];
}

bool MaggiPositions::follow(double t_guess, double t, const double* y, int parts) {
  read_from(t_guess, y);
  for (int p = 1; p <= parts; ++p) {
    const double s = static_cast<double>(p) / parts;
    for (std::size_t k = 0; k < y_part_.size(); ++k)
      y_part_[k] = p == parts ? y[k] : y_from_[k] + s * (y[k] - y_from_[k]);
    if (!newton(p == parts ? t : t_guess + s * (t - t_guess), y_part_.data())) return false;
  }
  return true;
}

bool MaggiPositions::newton(double t, const double* y) {
  MaggiChart& X = chart();
  const auto& independent = X.independent();
  StateView s;
  s.t = t;
  s.q = q_.data();
  double distance = std::numeric_limits<double>::infinity();  // from the positions of the last factorization
  if (factored_chart_ == chart_) {
    distance = distance_between(q_, factored_at_) / scale_;
  }
  bool fresh = !(distance <= kNear);
  // Far from where they began, beside the mechanism's size, positions are no better than their own rounding.
  const double rounding = std::max(kRounding, 4 * std::numeric_limits<double>::epsilon() * largest(q_.data()) / scale_);
  double previous = std::numeric_limits<double>::infinity();
  bool quadratic = false;  // the previous step was Newton's own
  for (int k = 0; k < kMaxIterations; ++k) {
    ++iterations_;
    assembly_.calc_constraints(s);
    if (fresh) {
      factored_chart_ = -1;
      if (!X.factor(assembly_.phi_q.data())) return false;
      factored_chart_ = chart_;
      factored_at_ = q_;
    }
    for (int i = 0; i < m_; ++i) step_[i] = -assembly_.phi[i];
    add_places(y, step_.data());
    for (std::size_t i = 0; i < independent.size(); ++i)
      step_[static_cast<std::size_t>(m_) + i] = y[i] - q_[static_cast<std::size_t>(independent[i])];
    X.solve(step_.data());
    const double step = largest(step_.data()) / scale_;
    const double farthest = branches_ ? 1 : std::numeric_limits<double>::max();
    if (!(step <= farthest) || (k > 2 && fresh && step > 2 * previous && step > kQuadratic)) return false;
    for (std::size_t i = 0; i < q_.size(); ++i) q_[i] += step_[i];
    if (fresh) {
      // The factorization belongs to positions that differ by this last step, and so do velocities by it: behind a
      // step on old factors it may be far above rounding.
      if (step <= rounding || (quadratic && previous <= kQuadratic && step <= kLoose)) return true;
      quadratic = true;
    } else {
      // One more step on the old factorization if that gets to rounding, before the new one that the end needs anyway.
      const double contraction = previous < 1e300 ? step / previous : std::min(1.0, 2 * distance);
      fresh = step * contraction <= rounding || step * contraction * contraction > rounding;
    }
    previous = step;
  }
  return false;
}

}  // namespace costate
