#include "costate/event/path_course.h"

#include <algorithm>
#include <cmath>

#include "costate/assembly/gathered_state.h"
#include "costate/base/error.h"
#include "costate/element/course.h"
#include "costate/event/course_places.h"

namespace costate {

namespace {
// Of its size, and of what its terms' rounding may sum up to: less is nothing; and what is nothing in whatever units.
constexpr double kPathRounding = 1e-10, kPathNoise = 8, kNoForce = 1e-30;
// Arguments that change by no more over a step, of the integrator's tolerances and of the motion's size, are rounding.
constexpr double kPathStill = 1e-4, kPathStillAt = 1e-13;
// What is between two places of its law over a step: with this part of what it travels to spare; and what goes one way.
constexpr double kPlaceRoom = 0.1, kOneWay = 0.5;
// The first looks at a step, or at a part of it in which nothing turns by more than kPartAngle, between its ends
// without a common period; and of what turns by more than so many parts of a step those at its beginning alone.
constexpr double kPathLooks[] = {0, 0.0713, 0.1927, 0.2659, 0.4271, 0.5483, 0.7331, 0.8219, 0.9407, 1};
constexpr std::size_t kPathLookCount = std::size(kPathLooks);
constexpr double kPartAngle = 1;
constexpr int kMostParts = 256;
// Places as near as this are one.
constexpr double kSamePlace = 1e-14;
// Towards each place, each half as far as the last; of many places fewer.
constexpr int kPathTowards = 16, kFewestTowards = 3, kPathTowardsAll = 128, kPathDepth = 14;
}  // namespace

PathCourse::PathCourse(const Element& element, const FormulaLaw& formula, std::vector<int> coordinates,
                       Arguments arguments, bool solved)
    : element_(&element),
      arguments_(std::move(arguments)),
      law_(&formula),
      formula_(&formula),
      coordinates_(std::move(coordinates)),
      solved_(solved),
      here_(static_cast<std::size_t>(formula.number_count())) {}

PathCourse::PathCourse(const Element& element, const MotionLawElement& of, const MotionLaw& law,
                       std::vector<double> sharp, bool search)
    : element_(&element),
      owner_(&of),
      first_(law.first),
      origin_(law.origin),
      of_rate_(law.of_rate),
      law_(law.law),
      formula_(dynamic_cast<const FormulaLaw*>(law.law)),
      sharp_(std::move(sharp)),
      search_(search),
      coordinates_(element.coordinates()) {
  std::sort(sharp_.begin(), sharp_.end());
}

void PathCourse::set_arguments(double u) {
  const StateView s =
      solved_ ? (*at_)(motion_->from() + u * (motion_->to() - motion_->from())) : motion_->at(u, coordinates_);
  if (own_) {
    own_here_ = s;
    x_here_ = s.t;
    return;
  }
  if (!owner_) {
    arguments_(s, *assembly_, here_.data());
    x_here_ = s.t;
    return;
  }
  thread_local GatheredState own;
  const LocalState local = own.of(*element_, s, assembly_->numbers());
  here_.assign(local.p + first_, local.p + element_->numbers().size());
  const GapMotion m = owner_->deformation(local);
  x_here_ = of_rate_ ? m.rate : m.gap - local.p[origin_];
  rate_here_ = m.rate;
}

double PathCourse::value(double u) {
  // Dense output may lead out of where a law through data says anything; the motion itself will tell.
  try {
    set_arguments(u);
  } catch (const StepError&) {
    return 0;
  }
  return value_here();
}

double PathCourse::value_here() const {
  if (own_) {
    const double f = own_(own_here_, *assembly_);
    return std::isfinite(f) ? f : 0;
  }
  try {
    const double f = law_->value(x_here_, here_.data());
    return std::isfinite(f) ? f : 0;
  } catch (const StepError&) {
    return 0;
  }
}

double PathCourse::look(double u) {
  if (!formula_) return value(u);
  try {
    set_arguments(u);
  } catch (const StepError&) {
    return 0;
  }
  const double f = formula_->look(x_here_, here_.data(), terms_);
  return std::isfinite(f) ? f : 0;
}

void PathCourse::add(double u) {
  if (u >= 0 && u <= 1) samples_.push_back({u, value(u)});
}

const std::vector<PathCourse::Cell>& PathCourse::cells(StepMotion& motion, const GapTrace::States& at,
                                                       Assembly& assembly, const Precision& precision) {
  motion_ = &motion;
  at_ = &at;
  assembly_ = &assembly;
  off_ = precision.off;
  cells_.clear();
  looked_at_ = 1;
  low_now_ = HUGE_VAL;
  high_now_ = -HUGE_VAL;
  if (owner_ && !sharp_.empty() && is_between_places(precision.bends)) return cells_;
  look_along();
  if (looked_at_ < 1) return cells_;
  const auto meet_samples = [this] {
    for (const Sample& s : samples_) {
      low_now_ = std::min(low_now_, s.f);
      high_now_ = std::max(high_now_, s.f);
    }
  };
  meet_samples();
  impulse_now_ = impulse_;
  if (!moves()) return cells_;
  find_places();
  add_towards_places();
  std::sort(samples_.begin(), samples_.end(), [](const Sample& a, const Sample& b) { return a.u < b.u; });
  meet_samples();
  floor_ = std::max(kPathRounding * std::max(std::abs(low_now_), std::abs(high_now_)), kNoForce);
  const double low = std::min(low_, low_now_), high = std::max(high_, high_now_), h = motion.to() - motion.from();
  // What it is away from where it mostly is, on whichever side.
  impulse_now_ = impulse_ + h * std::min(high_now_ - low, high - low_now_);
  no_range_ = precision.floor * (high - low);
  no_impulse_ = precision.floor * impulse_now_ / h;
  moves_nothing_ = unfelt_impulse() / h;
  const bool leaves = precision.bends == LeftBends::all || (of_rate_ && precision.bends == LeftBends::of_rates);
  if (!is_cubic() && !(leaves && is_bend())) halve(0, 1, 0);
  return cells_;
}

// By the control points of the two cubics through the deformation and its rate at both ends and in the middle; of
// rates, whose own are not known, by five values and how far these are from straight lines.
bool PathCourse::is_between_places(LeftBends leaves) {
  if (search_ || motion_->turn(coordinates_) > kPartAngle) return false;
  const double h = motion_->to() - motion_->from();
  double low = HUGE_VAL, high = -HUGE_VAL, bent = 0, least = HUGE_VAL, x[5], rate[5];
  const int nodes = of_rate_ ? 5 : 3;
  for (int k = 0; k < nodes; ++k) {
    const double f = value(static_cast<double>(k) / (nodes - 1));
    low_now_ = std::min(low_now_, f);
    high_now_ = std::max(high_now_, f);
    x[k] = x_here_;
    rate[k] = rate_here_;
  }
  const auto meet = [&](double at) {
    low = std::min(low, at);
    high = std::max(high, at);
  };
  for (int k = 0; k < nodes; ++k) meet(x[k]);
  if (of_rate_) {
    for (int k = 1; k < nodes; ++k) {
      const double way = x[k] - x[k - 1];
      if (k > 1) bent = std::max(bent, std::abs(way - (x[k - 1] - x[k - 2])));
      least = std::min(least, way * (x[nodes - 1] - x[0]) > 0 ? std::abs(way) : 0);
    }
  } else {
    for (int k = 0; k + 1 < nodes; ++k) {
      meet(x[k] + h / 6 * rate[k]);
      meet(x[k + 1] - h / 6 * rate[k + 1]);
    }
  }
  const double room = kPlaceRoom * (high - low) + bent + motion_->tolerance(std::max(std::abs(low), std::abs(high)));
  const auto first = std::lower_bound(sharp_.begin(), sharp_.end(), low - room);
  const auto passed = std::upper_bound(first, sharp_.end(), high + room) - first;
  impulse_now_ = impulse_;
  // Of a rate's law that bends once and is left to the integrator, where its argument goes one way.
  return passed == 0 || (passed == 1 && of_rate_ && leaves != LeftBends::none && bent < kOneWay * least);
}

void PathCourse::look_along() {
  const auto parts_of = [](double angle) {
    return static_cast<int>(std::ceil(std::clamp(angle / kPartAngle, 1.0, 1e6)));
  };
  int parts = parts_of(motion_->turn(coordinates_));
  if (own_) parts = std::max(parts, parts_of_own());
  if (parts <= kMostParts) {
    look_at_parts(parts);
    // As often as the fastest of its sines.
    double angle = 0;
    for (std::size_t k = 1; k < looks_.size() && formula_; ++k)
      for (std::size_t i = 0; i < first_terms_[k].angles.size(); ++i) {
        const double rate =
            std::abs(first_terms_[k].angles[i] - first_terms_[k - 1].angles[i]) / (looks_[k] - looks_[k - 1]);
        angle = std::max(angle, rate);
      }
    if (parts_of(angle) <= parts) return;
    parts = parts_of(angle);
    if (parts <= kMostParts) return look_at_parts(parts);
  }
  looked_at_ = static_cast<double>(kMostParts) / parts;
}

void PathCourse::look_at_parts(int parts) {
  looks_.clear();
  for (int i = 0; i < parts; ++i)
    for (std::size_t k = 0; k + 1 < kPathLookCount; ++k) looks_.push_back((i + kPathLooks[k]) / parts);
  looks_.push_back(1);
  samples_.clear();
  first_terms_.resize(looks_.size());
  course_.resize(looks_.size());
  least_.clear();
  for (std::size_t k = 0; k < looks_.size(); ++k) {
    samples_.push_back({looks_[k], look(looks_[k])});
    meet_arguments();
    if (formula_)
      first_terms_[k] = terms_;
    else
      course_[k] = x_here_;
  }
}

void PathCourse::meet_arguments() {
  const std::size_t count = here_.size();
  if (least_.size() != count + 1) {
    least_ = here_;
    least_.push_back(x_here_);
    most_ = least_;
    return;
  }
  for (std::size_t i = 0; i <= count; ++i) {
    const double x = i < count ? here_[i] : x_here_;
    least_[i] = std::min(least_[i], x);
    most_[i] = std::max(most_[i], x);
  }
}

bool PathCourse::moves() const {
  const double size = motion_->size(coordinates_);
  for (std::size_t i = 0; i < least_.size(); ++i)
    if (most_[i] - least_[i] > still(i, size)) return true;
  return false;
}

double PathCourse::still(std::size_t i, double size) const {
  return kPathStillAt * size + kPathStill * motion_->tolerance(std::max(std::abs(least_[i]), std::abs(most_[i])));
}

double PathCourse::noise(double u, double size) {
  set_arguments(u);
  const double f = value_here();
  // Rounding of the terms, and of the arguments that change at all.
  double sum = kPathNoise * formula_->rounding(x_here_, here_.data());
  for (std::size_t i = 0; i < here_.size(); ++i) {
    if (!(most_[i] > least_[i])) continue;
    const double x = here_[i];
    here_[i] = x + kPathStillAt * std::max(size, std::abs(x));
    sum += std::abs(value_here() - f);
    here_[i] = x;
  }
  return sum;
}

void PathCourse::find_places() {
  places_.clear();
  if (own_) return;
  if (!formula_) {
    const auto deformation = [this](double u) {
      set_arguments(u);
      return x_here_;
    };
    return CoursePlaces::find(looks_, course_, sharp_, deformation, places_);
  }
  const std::vector<double> zero = {0};
  for (std::size_t i = 0; i < first_terms_[0].values.size(); ++i) {
    for (std::size_t k = 0; k < looks_.size(); ++k) course_[k] = first_terms_[k].values[i];
    const auto term = [this, i](double u) {
      look(u);
      return terms_.values[i];
    };
    CoursePlaces::find(looks_, course_, zero, term, places_);
  }
  for (std::size_t i = 0; i < first_terms_[0].tables.size(); ++i) {
    for (std::size_t k = 0; k < looks_.size(); ++k) course_[k] = first_terms_[k].tables[i].at;
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
      add_law_places(*f.law, here_.data() + f.first, places);
      knots_ = std::move(places.sharp);
      knots_.insert(knots_.end(), places.knots.begin(), places.knots.end());
      std::sort(knots_.begin(), knots_.end());
    }
    const auto asked_at = [this, i](double u) {
      look(u);
      return terms_.tables[i].at;
    };
    CoursePlaces::find(looks_, course_, knots_, asked_at, places_);
  }
}

void PathCourse::add_towards_places() {
  std::sort(places_.begin(), places_.end());
  places_.erase(std::unique(places_.begin(), places_.end(), [](double a, double b) { return b - a < kSamePlace; }),
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
  if (is_met(cubic_over(0, 1), 1)) return true;
  if (formula_) {
    const double before = floor_;
    const double size = motion_->size(coordinates_);
    // Not at the places themselves: beside a zero that it divides by nothing is known of a formula.
    for (const double u : looks_) floor_ = std::max(floor_, noise(u, size));
    if (floor_ > before && is_met(cubic_over(0, 1), 1)) return true;
  }
  return false;
}

// Terms that stay zero make places of looks: it is that one place at which two cubics meet that counts.
bool PathCourse::is_bend() {
  return std::any_of(places_.begin(), places_.end(), [this](double u) {
    return u > CoursePlaces::kPlaced && u < 1 - CoursePlaces::kPlaced && is_met(cubic_over(0, u), u) &&
           is_met(cubic_over(u, 1), 1 - u);
  });
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
  if (!is_met(cubic, b - a) && depth < kPathDepth) return halve(a, b, depth);
  const double begin = samples_[0].f;
  cells_.push_back({a, b, std::max(std::abs(cubic.low() - begin), std::abs(cubic.high() - begin))});
}

void PathCourse::record(double from, double to) {
  low_ = std::min(low_, low_now_);
  high_ = std::max(high_, high_now_);
  impulse_ = impulse_now_;
  steps_.push_back({from, to, high_now_ - low_now_});
}

}  // namespace costate
