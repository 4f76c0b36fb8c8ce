#include "costate/event/path_course.h"

#include <algorithm>
#include <cmath>

#include "costate/assembly/gathered_state.h"
#include "costate/base/error.h"
#include "costate/element/course.h"

namespace costate {

namespace {
// Of its size, and of what its terms' rounding may sum up to: less is nothing; and what is nothing in whatever units.
constexpr double kPathRounding = 1e-10, kPathNoise = 8, kNoForce = 1e-30;
// The first looks at a step, between its ends without a common period.
constexpr double kPathLooks[] = {0, 0.0713, 0.1927, 0.2659, 0.4271, 0.5483, 0.7331, 0.8219, 0.9407, 1};
constexpr std::size_t kPathLookCount = std::size(kPathLooks);
// Towards each place, each half as far as the last; of many places fewer.
constexpr int kPathTowards = 16, kFewestTowards = 3, kPathTowardsAll = 128, kPathDepth = 14;
// Places beyond the step's ends count as well, so far; and of an argument that comes back those that it nearly reaches.
constexpr double kPathBeyond = 0.1, kPathNearly = 0.05;
// A place is known to this part of the step, by so many looks at most.
constexpr double kPathPlaced = 1e-7;
constexpr int kPathPlacing = 40;

/// The parabola through three values of an argument.
double on_parabola(const double (&f)[3], double u) {
  return f[0] + u * (4 * f[1] - 3 * f[0] - f[2] + u * 2 * (f[0] + f[2] - 2 * f[1]));
}
}  // namespace

PathCourse::PathCourse(const Element& element, const FormulaLaw& formula, Arguments arguments)
    : element_(&element), arguments_(std::move(arguments)), law_(&formula), formula_(&formula) {
  for (auto* x : {&at_[0], &at_[1], &at_[2], &here_}) x->assign(static_cast<std::size_t>(formula.number_count()), 0);
}

PathCourse::PathCourse(const Element& element, const MotionLawElement& of, const MotionLaw& law,
                       std::vector<double> sharp)
    : element_(&element),
      owner_(&of),
      first_(law.first),
      origin_(law.origin),
      of_rate_(law.of_rate),
      law_(law.law),
      sharp_(std::move(sharp)) {
  std::sort(sharp_.begin(), sharp_.end());
}

void PathCourse::take(int k, const StateView& s, Assembly& assembly) {
  if (arguments_) {
    arguments_(s, assembly, at_[k].data());
    x_[k] = s.t;
    return;
  }
  thread_local GatheredState own;
  const LocalState local = own.of(*element_, s, assembly.numbers());
  here_.assign(local.p + first_, local.p + element_->numbers().size());
  const GapMotion m = owner_->deformation(local);
  x_[k] = of_rate_ ? m.rate : m.gap - local.p[origin_];
}

void PathCourse::begin_where_it_ended() {
  std::swap(at_[0], at_[2]);
  x_[0] = x_[2];
}

void PathCourse::set_arguments(double u) {
  x_here_ = on_parabola(x_, u);
  if (owner_) return;
  for (std::size_t i = 0; i < here_.size(); ++i) {
    const double f[3] = {at_[0][i], at_[1][i], at_[2][i]};
    here_[i] = on_parabola(f, u);
  }
}

double PathCourse::value(double u) {
  set_arguments(u);
  // Parabolas may lead out of where a law through data says anything; the motion itself will tell.
  try {
    const double f = law_->value(x_here_, here_.data());
    return std::isfinite(f) ? f : 0;
  } catch (const StepError&) {
    return 0;
  }
}

double PathCourse::look(double u) {
  if (owner_) return value(u);
  set_arguments(u);
  const double f = formula_->look(x_here_, here_.data(), terms_);
  return std::isfinite(f) ? f : 0;
}

void PathCourse::add(double u) {
  if (u >= 0 && u <= 1) samples_.push_back({u, value(u)});
}

const std::vector<PathCourse::Cell>& PathCourse::cells(const Precision& precision) {
  off_ = precision.off;
  samples_.clear();
  cells_.clear();
  first_terms_.resize(kPathLookCount);
  course_.resize(kPathLookCount);
  for (std::size_t k = 0; k < kPathLookCount; ++k) {
    samples_.push_back({kPathLooks[k], look(kPathLooks[k])});
    if (owner_)
      course_[k] = x_here_;
    else
      std::swap(first_terms_[k], terms_);
  }
  find_places();
  add_towards_places();
  std::sort(samples_.begin(), samples_.end(), [](const Sample& a, const Sample& b) { return a.u < b.u; });
  low_now_ = HUGE_VAL;
  high_now_ = -HUGE_VAL;
  for (const Sample& s : samples_) {
    low_now_ = std::min(low_now_, s.f);
    high_now_ = std::max(high_now_, s.f);
  }
  floor_ = std::max({precision.floor * (std::max(high_, high_now_) - std::min(low_, low_now_)),
                     kPathRounding * std::max(std::abs(low_now_), std::abs(high_now_)), kNoForce});
  if (!is_cubic() && !(of_rate_ && precision.bends && is_bend())) halve(0, 1, 0);
  return cells_;
}

void PathCourse::find_places() {
  places_.clear();
  if (owner_) return find_places(course_, sharp_, [this] { return x_here_; });
  const std::vector<double> zero = {0};
  for (std::size_t i = 0; i < first_terms_[0].values.size(); ++i) {
    for (std::size_t k = 0; k < kPathLookCount; ++k) course_[k] = first_terms_[k].values[i];
    find_places(course_, zero, [this, i] { return terms_.values[i]; });
  }
  for (std::size_t i = 0; i < first_terms_[0].tables.size(); ++i) {
    for (std::size_t k = 0; k < kPathLookCount; ++k) course_[k] = first_terms_[k].tables[i].at;
    const auto [least, most] = std::minmax_element(course_.begin(), course_.end());
    const FormulaTerms::Table& table = first_terms_[0].tables[i];
    const FormulaFunction& f = formula_->functions()[static_cast<std::size_t>(table.function)];
    knots_.clear();
    if (f.map) {
      knots_ = table.axis == 0 ? f.map->x() : f.map->y();
    } else {
      LawPlaces places;
      const double reach = *most - *least;
      places.from = *least - reach;
      places.to = *most + reach;
      add_law_places(*f.law, at_[0].data() + f.first, places);
      knots_ = std::move(places.sharp);
      knots_.insert(knots_.end(), places.knots.begin(), places.knots.end());
      std::sort(knots_.begin(), knots_.end());
    }
    find_places(course_, knots_, [this, i] { return terms_.tables[i].at; });
  }
}

void PathCourse::find_places(const std::vector<double>& course, const std::vector<double>& knots,
                             const std::function<double()>& of_terms) {
  const auto [least, most] = std::minmax_element(course.begin(), course.end());
  const double range = *most - *least;
  if (!(range > 1e-13 * std::max(std::abs(*least), std::abs(*most)))) return;
  const auto each_between = [&](double a, double b, const auto& meet) {
    if (a > b) std::swap(a, b);
    for (auto c = std::lower_bound(knots.begin(), knots.end(), a); c != knots.end() && *c <= b; ++c) meet(*c);
  };
  const auto put = [&](double u) {
    if (u >= -kPathBeyond && u <= 1 + kPathBeyond) places_.push_back(u);
  };
  const auto& u = kPathLooks;
  for (std::size_t k = 0; k + 1 < kPathLookCount; ++k)
    each_between(course[k], course[k + 1], [&](double knot) {
      put(passage(u[k], u[k + 1], course[k] - knot, course[k + 1] - knot, knot, of_terms));
    });
  for (const auto& [k, from] : {std::pair<std::size_t, double>{0, 0}, {kPathLookCount - 2, 1}}) {
    const double slope = (course[k + 1] - course[k]) / (u[k + 1] - u[k]), at = from == 0 ? course[k] : course[k + 1];
    if (slope != 0)
      each_between(at, at + (from == 0 ? -1 : 1) * kPathBeyond * slope,
                   [&](double knot) { put(from + (knot - at) / slope); });
  }
  for (std::size_t k = 1; k + 1 < kPathLookCount; ++k) {
    const double left = course[k] - course[k - 1], right = course[k + 1] - course[k];
    if (!(left * right < 0)) continue;
    // Where it turns, by the parabola.
    const double a = u[k] - u[k - 1], b = u[k + 1] - u[k], sl = left / a, sr = right / b;
    const double curvature = (sr - sl) / (a + b), slope = (sl * b + sr * a) / (a + b);
    const double turn = -0.5 * slope / curvature, beyond = 0.5 * slope * turn;
    each_between(course[k], course[k] + beyond + std::copysign(kPathNearly * range, left),
                 [&](double) { put(u[k] + turn); });
  }
}

// By false position, with halves of the side that stays.
double PathCourse::passage(double a, double b, double fa, double fb, double knot,
                           const std::function<double()>& of_terms) {
  if (fa == 0 || fb == 0) return fa == 0 ? a : b;
  for (int k = 0; k < kPathPlacing && b - a > kPathPlaced; ++k) {
    const double u = a + std::clamp(fa / (fa - fb), 0.01, 0.99) * (b - a);
    if (owner_)
      set_arguments(u);
    else
      look(u);
    const double f = of_terms() - knot;
    if (f == 0) return u;
    if ((f < 0) == (fa < 0)) {
      if (std::abs(f) < kPathPlaced * std::abs(fa - fb) && u - a < kPathPlaced) return u;
      a = u;
      fa = f;
      fb *= 0.5;
    } else {
      if (std::abs(f) < kPathPlaced * std::abs(fa - fb) && b - u < kPathPlaced) return u;
      b = u;
      fb = f;
      fa *= 0.5;
    }
  }
  return 0.5 * (a + b);
}

void PathCourse::add_towards_places() {
  std::sort(places_.begin(), places_.end());
  places_.erase(std::unique(places_.begin(), places_.end(), [](double a, double b) { return b - a < kPathPlaced; }),
                places_.end());
  if (places_.empty()) return;
  const int count = static_cast<int>(std::min<std::size_t>(places_.size(), kPathTowardsAll));
  const int towards = std::clamp(kPathTowardsAll / count, kFewestTowards, kPathTowards);
  const bool few = towards == kPathTowards;
  for (std::size_t k = 0; k < places_.size(); ++k) {
    add(places_[k]);
    const double left = few || k == 0 ? 1 : places_[k] - places_[k - 1],
                 right = few || k + 1 == places_.size() ? 1 : places_[k + 1] - places_[k];
    double d = 0.5;
    for (int j = 0; j < towards; ++j, d /= 2) {
      add(places_[k] - d * left);
      add(places_[k] + d * right);
    }
  }
}

CubicCheck PathCourse::cubic_over(double a, double b) {
  const double h = b - a;
  CubicCheck cubic({a, a + h / 3, a + 2 * h / 3, b}, [this](double u) { return value(u); });
  auto s = std::lower_bound(samples_.begin(), samples_.end(), a, [](const Sample& x, double at) { return x.u < at; });
  for (; s != samples_.end() && s->u <= b; ++s) cubic.compare(s->u, s->f);
  return cubic;
}

bool PathCourse::is_cubic() {
  if (is_met(cubic_over(0, 1))) return true;
  if (formula_) {
    const double before = floor_;
    for (const Sample& s : samples_) {
      set_arguments(s.u);
      floor_ = std::max(floor_, kPathNoise * formula_->rounding(x_here_, here_.data()));
    }
    if (floor_ > before && is_met(cubic_over(0, 1))) return true;
  }
  return false;
}

bool PathCourse::is_bend() {
  const auto inside = [](double u) { return u > kPathPlaced && u < 1 - kPathPlaced; };
  const auto first = std::find_if(places_.begin(), places_.end(), inside);
  if (first == places_.end() || std::any_of(first + 1, places_.end(), inside)) return false;
  return is_met(cubic_over(0, *first)) && is_met(cubic_over(*first, 1));
}

void PathCourse::halve(double a, double b, int depth) {
  const double middle = a + 0.5 * (b - a);
  refine(a, middle, depth + 1);
  refine(middle, b, depth + 1);
}

void PathCourse::refine(double a, double b, int depth) {
  CubicCheck cubic = cubic_over(a, b);
  for (std::size_t k = 1; k + 1 < kPathLookCount; ++k) {
    const double u = a + kPathLooks[k] * (b - a);
    cubic.compare(u, value(u));
  }
  if (!is_met(cubic) && depth < kPathDepth) return halve(a, b, depth);
  const double begin = samples_[0].f;
  cells_.push_back({a, b, std::max(std::abs(cubic.low() - begin), std::abs(cubic.high() - begin))});
}

void PathCourse::record(double from, double to) {
  low_ = std::min(low_, low_now_);
  high_ = std::max(high_, high_now_);
  steps_.push_back({from, to, high_now_ - low_now_});
}

}  // namespace costate
