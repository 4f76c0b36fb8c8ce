#include "costate/analysis/motion_watch.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>

#include "costate/analysis/mechanism_size.h"
#include "costate/base/error.h"
#include "costate/base/golden_section.h"

namespace costate {

namespace {
// Steps between looks: within them a distance changes little. Where they are so few as these they are long, and each is
// looked at.
constexpr long kCadence = 4, kLongSteps = 200;
// Points kept: those of two stretches between looks, with both ends.
constexpr std::size_t kKept = 2 * kCadence + 2;
// Added to the squares of the distances, so that a redundant row has a positive pivot: distances below 3e-7 are zero.
constexpr double kShift = 1e-13;
constexpr double kZero = 1e-6;
// At the start: rounding in long chains, and a start found to its tolerance, leave a redundant row up to this.
constexpr double kDependent = 1e-5;
// A minimum is looked for below this distance; a row that was dependent and gets this far off is so no longer.
constexpr double kSuspicious = 0.25;
/// Or where it falls by half from one look to the next, or rises by as much: V-shaped, it may vanish between them.
bool may_vanish(double least, double beside) { return least < kSuspicious || 2 * least < beside; }
constexpr int kGolden = 40;
// Places in a stretch between looks at which many rows are looked at together first.
constexpr int kPlaces = 16;
// What a run at rtol may drift by without a word, in parts of the row's own length: errors are usually 1 to 200 rtol,
// and a formulation that does not take its drift back collects them.
constexpr double kDriftWarning = 1e3;
// Beyond this it is no longer the mechanism of the scene; a loose tolerance, or soft weights that the user chose, ask
// for more.
constexpr double kTorn = 1e-3;
constexpr double kMostTorn = 0.05;
// A length below this part of the mechanism is the rounding of another, not the length of a row.
constexpr double kLeastLength = 1e-6;

bool ends_with(const std::string& text, const char* end) {
  const std::string e = end;
  return text.size() >= e.size() && text.compare(text.size() - e.size(), e.size(), e) == 0;
}
}  // namespace

MotionWatch::MotionWatch(std::shared_ptr<const Mechanism> mechanism, const ParameterSelection& parameters,
                         const double* rho, WatchSettings settings)
    : assembly_(std::move(mechanism), parameters),
      settings_(std::move(settings)),
      products_(assembly_.jacobian()),
      lines_(assembly_.mechanism()),
      jumps_(assembly_.mechanism(), settings_.fixed_steps),
      formulas_(assembly_.mechanism(), settings_.objective),
      travelled_(assembly_.mechanism()) {
  assembly_.set_parameters(rho);
  const Mechanism& mech = assembly_.mechanism();
  const auto n = static_cast<std::size_t>(assembly_.n()), m = static_cast<std::size_t>(assembly_.m());
  rows_ = mech.row_names();
  for (const auto& c : mech.coordinates()) metric_.push_back(c.unit == "m");
  metric_row_.assign(m, 0);
  row_length_.assign(m, 0);
  row_size_.assign(m, 0);
  length_part_ = angle_part_ = row_size_;
  redundant_.assign(m, 0);
  distances_.assign(m, 1);
  farthest_.assign(m, 0);
  q_.assign(n, 0);
  v_.assign(n, 0);
  // Two branches of a motion at a distance d from each other violate the constraints by d^2 between them, and the rows
  // are at the distance d from dependence: nearer than sqrt(tolerance), an integrator cannot tell them apart.
  rank_limit_ = std::clamp(10 * std::sqrt(settings_.rtol), 1e-4, 3e-3);
  drift_error_ = settings_.chosen_weight ? kMostTorn : std::clamp(kDriftWarning * settings_.rtol, kTorn, kMostTorn);
  drift_warning_ = std::min(kDriftWarning * settings_.rtol, drift_error_);
  scaled_.assign(assembly_.jacobian().row.size(), 0);
  ring_.resize(kKept);
  for (Point& p : ring_) {
    p.q.resize(n);
    p.v.resize(n);
  }
}

std::string MotionWatch::with_unit(int row, double length) const {
  return fmt::format("{:.3g} {}", length, metric_row_[row] ? "m" : "rad");
}

void MotionWatch::require_finite(double t, const double* q, const double* v) const {
  const auto& c = assembly_.mechanism().coordinates();
  for (int i = 0; i < assembly_.n(); ++i) {
    if (!std::isfinite(q[i]))
      throw SolverError(
          fmt::format("{} is {} at t = {:.9g} s: the motion cannot be computed this way.", c[i].name, q[i], t));
    if (!std::isfinite(v[i]))
      throw SolverError(fmt::format(
          "The velocity {}_dot is {} at t = {:.9g} s: the motion cannot be computed this way.", c[i].name, v[i], t));
  }
}

void MotionWatch::begin(double t, const double* q, const double* v) {
  require_finite(t, q, v);
  look_for_jumps(t, q, v);
  const Mechanism& mech = assembly_.mechanism();
  const auto& J = assembly_.jacobian();
  // Lengths: of the mechanism, by its numbers and by how far its coordinates lie apart; of a row, by its own numbers.
  double spread = 0, low = HUGE_VAL, high = -HUGE_VAL, largest = 0;
  for (int i = 0; i < assembly_.n(); ++i)
    if (metric_[i]) {
      low = std::min(low, q[i]);
      high = std::max(high, q[i]);
    }
  if (high > low) spread = high - low;
  const auto& numbers = assembly_.numbers();
  double longest = spread;
  for (std::size_t k = 0; k < mech.numbers().size(); ++k) {
    const std::string& path = mech.numbers()[k].path;
    if (path.starts_with("point.") && ends_with(path, "_m")) longest = std::max(longest, std::abs(numbers[k]));
  }
  const double rounding = std::max(kLeastLength * longest, kNoLength);
  for (std::size_t c = 0; c < mech.constraints().size(); ++c) {
    const Constraint& element = *mech.constraints()[c];
    double own = 0, other = 0;
    for (const int k : element.numbers()) {
      const std::string& path = mech.numbers()[k].path;
      if (ends_with(path, "length_m") || ends_with(path, "radius_m"))
        own = std::max(own, std::abs(numbers[k]));
      else if (ends_with(path, "_m"))
        other = std::max(other, std::abs(numbers[k]));
    }
    if (own <= rounding) own = spread > rounding ? std::min(other, spread) : other;
    if (own <= rounding) continue;
    largest = std::max(largest, own);
    for (int r = 0; r < element.rows(); ++r) row_length_[mech.row_offsets()[c] + r] = own;
  }
  length_ = largest > 0 ? largest : longest > kNoLength ? longest : 1;
  for (double& l : row_length_)
    if (!(l > 0)) l = length_;
  for (int j = 0; j < J.cols; ++j)
    if (metric_[j])
      for (auto k = J.column_start[j]; k < J.column_start[j + 1]; ++k) metric_row_[J.row[k]] = 1;
  points_ = 0;
  steps_ = 0;
  samples_.clear();
  sample(t, q, v);
  for (std::size_t i = 0; i < redundant_.size(); ++i) redundant_[i] = distances_[i] < kDependent;
  began_redundant_ = std::find(redundant_.begin(), redundant_.end(), 1) != redundant_.end();
  if (!began_redundant_) return;
  refuse_dependent_rows(t);
  first_ = ring_.front();
  first_rank_ = -1;
}

void MotionWatch::look_for_jumps(double t, const double* q, const double* v) {
  if (!lines_.empty()) lines_.look({t, q, v}, assembly_);
  if (!jumps_.empty()) jumps_.look({t, q, v}, assembly_);
  if (!formulas_.empty()) formulas_.look({t, q, v}, assembly_);
  if (!travelled_.empty()) travelled_.look({t, q, v}, assembly_);
}

void MotionWatch::step(double t, const double* q, const double* v) {
  require_finite(t, q, v);
  look_for_jumps(t, q, v);
  Point& p = ring_[points_++ % kKept];
  p.t = t;
  std::copy(q, q + assembly_.n(), p.q.begin());
  std::copy(v, v + assembly_.n(), p.v.begin());
  if (++steps_ % kCadence == 0 || steps_ <= kLongSteps) sample(t, q, v);
}

void MotionWatch::finish(double t, const double* q, const double* v) {
  require_finite(t, q, v);
  look_for_jumps(t, q, v);
  if (assembly_.m() == 0) return;
  if (points_ > 0 && ring_[(points_ - 1) % kKept].t < t) {
    Point& p = ring_[points_++ % kKept];
    p.t = t;
    std::copy(q, q + assembly_.n(), p.q.begin());
    std::copy(v, v + assembly_.n(), p.v.begin());
  }
  if (samples_.empty() || samples_.back().t < t) sample(t, q, v);
  look_for_minima(true);
}

void MotionWatch::sample(double t, const double* q, const double* v) {
  if (points_ == 0) {  // the start
    Point& p = ring_[points_++];
    p.t = t;
    std::copy(q, q + assembly_.n(), p.q.begin());
    std::copy(v, v + assembly_.n(), p.v.begin());
  }
  if (assembly_.m() == 0) return;
  StateView s;
  s.t = t;
  s.q = q;
  s.v = v;
  assembly_.calc_constraints(s);
  calc_distances(distances_);
  look_at_drift(t, v);
  for (std::size_t i = 0; i < distances_.size(); ++i) farthest_[i] = std::max(farthest_[i], distances_[i]);
  if (samples_.size() < 3)
    samples_.emplace_back();
  else
    std::rotate(samples_.begin(), samples_.begin() + 1, samples_.end());
  samples_.back().t = t;
  samples_.back().distance = distances_;
  look_for_minima(false);
}

void MotionWatch::calc_distances(std::vector<double>& out) {
  const auto& J = assembly_.jacobian();
  std::fill(length_part_.begin(), length_part_.end(), 0.0);
  std::fill(angle_part_.begin(), angle_part_.end(), 0.0);
  for (int j = 0; j < J.cols; ++j)
    for (auto k = J.column_start[j]; k < J.column_start[j + 1]; ++k)
      (metric_[j] ? length_part_ : angle_part_)[J.row[k]] += assembly_.phi_q[k] * assembly_.phi_q[k];
  for (std::size_t i = 0; i < row_size_.size(); ++i)
    row_size_[i] = std::sqrt(length_part_[i] * length_ * length_ + angle_part_[i]);
  for (int j = 0; j < J.cols; ++j)
    for (auto k = J.column_start[j]; k < J.column_start[j + 1]; ++k) {
      const double size = row_size_[J.row[k]];
      scaled_[k] = size > 0 ? assembly_.phi_q[k] * (metric_[j] ? length_ : 1.0) / size : 0.0;
    }
  const Eigen::SparseMatrix<double>& normal = products_.of(scaled_.data());
  if (!analyzed_) {
    ldlt_.setShift(kShift);
    ldlt_.analyzePattern(normal);
    analyzed_ = true;
  }
  ldlt_.factorize(normal);
  const auto d = ldlt_.vectorD();
  const auto& P = ldlt_.permutationP().indices();
  for (Eigen::Index i = 0; i < d.size(); ++i) {
    const double square = d[P.size() > 0 ? P[i] : i];
    // Rows that come and go are not watched: those of contacts, which say themselves where they end.
    out[static_cast<std::size_t>(i)] = !assembly_.is_there(static_cast<int>(i)) ? 1
                                       : square > 0                             ? std::sqrt(square)
                                                                                : 0;
  }
}

void MotionWatch::look_for_minima(bool at_end) {
  if (samples_.size() < 2) return;
  // Near a place where the motion turns round steps may be so short that distances hardly change over one.
  constexpr double kDip = 1e-2;
  const auto is_dip = [&](std::size_t i, double d) { return d < rank_limit_ && d < kDip * farthest_[i]; };
  const std::size_t last = samples_.size() - 1;
  std::vector<int> rows;
  double from = samples_[last - 1].t;
  for (std::size_t i = 0; i < redundant_.size(); ++i) {
    if (redundant_[i]) {
      if (samples_[last].distance[i] < kSuspicious) continue;
      // Dependent at the start, and no longer: the start was the singular position, if no other row depends instead.
      if (rank_has_risen(samples_[last].t)) events_.push_back({first_.t, static_cast<int>(i), 0});
      redundant_[i] = 0;
      continue;
    }
    const double c = samples_[last].distance[i], b = samples_[last - 1].distance[i];
    if (at_end) {
      if (c < b && may_vanish(c, b)) rows.push_back(static_cast<int>(i));
      continue;
    }
    if (!(b < c)) continue;
    if (samples_.size() == 2) {  // beside the start
      if (may_vanish(b, c)) rows.push_back(static_cast<int>(i));
    } else if (const double a = samples_[last - 2].distance[i];
               b <= a && (is_dip(i, b) || (std::max(a, c) > 1.2 * b && may_vanish(b, std::max(a, c))))) {
      from = samples_[last - 2].t;
      rows.push_back(static_cast<int>(i));
    }
  }
  if (rows.size() > 1) keep_those_that_may_vanish(rows, from, samples_[last].t);
  for (const int row : rows) refine(row, from, samples_[last].t);
}

// All at the same places, as an evaluation is of all rows: what is V-shaped, and vanishes between two of them, is no
// more there than it changes from one to the next.
void MotionWatch::keep_those_that_may_vanish(std::vector<int>& rows, double from, double to) {
  const auto count = rows.size();
  std::vector<double> least(count, HUGE_VAL), steepest(count, 0), before(count);
  for (int k = 0; k <= kPlaces; ++k) {
    calc_distances_at(from + (to - from) * k / kPlaces);
    for (std::size_t i = 0; i < count; ++i) {
      const double d = distances_[static_cast<std::size_t>(rows[i])];
      least[i] = std::min(least[i], d);
      if (k > 0) steepest[i] = std::max(steepest[i], std::abs(d - before[i]));
      before[i] = d;
    }
  }
  std::size_t i = 0;
  std::erase_if(rows, [&](int) {
    const bool far = least[i] > 2 * steepest[i] && least[i] > kZero;
    ++i;
    return far;
  });
}

void MotionWatch::calc_distances_at(double t) {
  // Hermite's cubic between the two steps around t.
  const std::size_t kept = std::min(points_, kKept);
  const auto point = [&](std::size_t back) -> const Point& { return ring_[(points_ - 1 - back) % kKept]; };
  std::size_t back = 0;
  while (back + 2 < kept && point(back + 1).t > t) ++back;
  const Point &p1 = point(back), &p0 = point(std::min(back + 1, kept - 1));
  const double h = p1.t - p0.t, x = h > 0 ? std::clamp((t - p0.t) / h, 0.0, 1.0) : 1;
  const double h00 = (1 + 2 * x) * (1 - x) * (1 - x), h10 = x * (1 - x) * (1 - x), h01 = x * x * (3 - 2 * x),
               h11 = x * x * (x - 1);
  for (std::size_t j = 0; j < q_.size(); ++j)
    q_[j] = h00 * p0.q[j] + h10 * h * p0.v[j] + h01 * p1.q[j] + h11 * h * p1.v[j];
  StateView s;
  s.t = t;
  s.q = q_.data();
  s.v = p1.v.data();
  assembly_.calc_constraints(s);
  calc_distances(distances_);
}

double MotionWatch::distance_at(int row, double t) {
  calc_distances_at(t);
  return distances_[static_cast<std::size_t>(row)];
}

void MotionWatch::refine(int row, double from, double to) {
  // The least of the steps between, then golden sections around it: a distance that vanishes is V-shaped.
  const std::size_t kept = std::min(points_, kKept);
  std::vector<double> times;
  for (std::size_t back = kept; back-- > 0;) {
    const double t = ring_[(points_ - 1 - back) % kKept].t;
    if (t >= from && t <= to) times.push_back(t);
  }
  if (times.size() < 2) return;
  std::size_t least = 0;
  double value = HUGE_VAL;
  for (std::size_t k = 0; k < times.size(); ++k) {
    const double d = distance_at(row, times[k]);
    if (d < value) {
      value = d;
      least = k;
    }
  }
  const GoldenSection section = golden_section(
      times[least > 0 ? least - 1 : 0], times[std::min(least + 1, times.size() - 1)], kGolden,
      [&](double t) { return -distance_at(row, t); },
      [&](const GoldenSection& g) { return std::min(value, -g.most()) >= kZero; });
  const bool nearer = -section.most() < value;
  const double at = nearer ? section.best() : times[least];
  if (nearer) value = -section.most();
  if (value < rank_limit_ && rank_falls(from, at, to)) events_.push_back({at, row, value});
}

}  // namespace costate
