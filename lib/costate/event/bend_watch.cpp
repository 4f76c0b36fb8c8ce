#include "costate/event/bend_watch.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>

#include "costate/assembly/gathered_state.h"
#include "costate/base/golden_section.h"
#include "costate/element/gap_element.h"
#include "costate/element/path_function.h"
#include "costate/objective/formula_output.h"

namespace costate {

namespace {
// More looks at a step where an argument that comes back could have been beyond the place: where it is nearer to it, at
// the ends or in the middle, than this many times what it moves between these.
constexpr double kBendNear = 4;
// And where by the parabola through three looks it comes back within this part of what it moves: so many divisions of
// the golden section.
constexpr double kGrazes = 0.1;
constexpr int kTurnings = 24;
// Halvings at most.
constexpr int kBendHalvings = 60;
// Of the way to a place, what one step takes.
constexpr double kApproach = 0.9;
// Steps across a place, in the length of the steps around them; and, of the time, at least.
constexpr double kAcross = 1e-6, kBendInstant = 16 * std::numeric_limits<double>::epsilon();
// Of a step: a bend that is as near to one of its ends takes no part in it.
constexpr double kAtEnds = 1e-4;
// Of one step, at most.
constexpr int kMostPassages = 64;
// Of the tolerances: a smaller argument is zero.
constexpr double kBendCounts = 0.1;

bool is_beyond(double x) { return x >= 0; }
}  // namespace

void BendWatch::add_laws(Assembly& assembly, const Element& force, const MotionLawElement& owner) {
  std::vector<MotionLaw> laws;
  owner.add_motion_laws(laws);
  for (const MotionLaw& law : laws) {
    if (!law.followed()) continue;
    const LawJoints joints = joints_of(force, law, assembly.numbers());
    std::vector<double> bends;
    for (const LawJoint& joint : joints.all)
      if (joints.bends(joint)) bends.push_back(joint.x);
    if (bends.empty()) continue;
    sources_.push_back({[&assembly, &force, &owner, law, bends](const StateView& s, std::vector<double>& beyond) {
      thread_local GatheredState own;
      const LocalState local = own.of(force, s, assembly.numbers());
      const GapMotion m = owner.deformation(local);
      const double x = law.of_rate ? m.rate : m.gap - local.p[law.origin];
      for (const double at : bends) beyond.push_back(x - at);
    }});
  }
}

BendWatch::BendWatch(Assembly& assembly, const Objective& objective, double rtol, double atol, bool solved)
    : rtol_(rtol), atol_(atol) {
  /// arguments(s, x) gives those of the formula.
  const auto add_formula = [&](const FormulaLaw& formula, const auto& arguments) {
    if (formula.may_bend())
      sources_.push_back({[&formula, arguments](const StateView& s, std::vector<double>& beyond) {
        thread_local std::vector<double> x;
        x.assign(static_cast<std::size_t>(formula.number_count()), 0);
        arguments(s, x.data());
        formula.add_bends(s.t, x.data(), beyond);
      }});
  };
  int next_state = 0;
  for (const auto& force : assembly.mechanism().forces()) {
    const int first_state = next_state;
    next_state += force->states();
    if (const auto* owner = dynamic_cast<const MotionLawElement*>(force.get())) add_laws(assembly, *force, *owner);
    if (const auto* gaps = dynamic_cast<const GapElement*>(force.get()); gaps && gaps->tells_bends())
      sources_.push_back(
          {[&assembly, force = force.get(), gaps, first_state](const StateView& s, std::vector<double>& beyond) {
            thread_local GatheredState own;
            LocalState local = own.of(*force, s, assembly.numbers());
            local.z = s.z + first_state;
            gaps->add_bends(local, beyond);
          }});
    if (const auto* formulas = dynamic_cast<const PathFunctionElement*>(force.get()))
      for (int i = 0; i < formulas->path_functions(); ++i)
        add_formula(formulas->path_function(i),
                    [&assembly, force = force.get(), formulas, i](const StateView& s, double* x) {
                      thread_local GatheredState own;
                      formulas->path_arguments(i, own.of(*force, s, assembly.numbers()), x);
                    });
  }
  for (const auto& term : objective.running)
    for (const FormulaOutput* formula : formulas_of(*term)) {
      if (!formula->definition().formula().may_bend() || (formula->needs_accelerations() && !solved)) continue;
      accelerations_ = accelerations_ || formula->needs_accelerations();
      add_formula(formula->definition().formula(),
                  [&assembly, formula](const StateView& s, double* x) { formula->arguments(s, assembly, x); });
    }
}

std::optional<double> BendWatch::passed(double from, double to, double length, const GapTrace::States& at) {
  if (across(to - from)) return {};
  const auto t = first(from, to, at);
  if (!t) return {};
  const double half = std::max(0.25 * kAcross * std::max(length, to - from), kBendInstant * std::abs(to));
  across_ = 4 * half;
  // Stages at the end of a step are known less well than the end itself: where the step is long and ends at the place
  // they may be beyond it. So the place is approached.
  if (const double way = *t - from; (1 - kApproach) * way > half) return from + kApproach * way;
  return *t - half > from + half ? *t - half : std::min(to, *t + 2 * half);
}

std::optional<double> BendWatch::within(double from, double to, const GapTrace::States& at) {
  const double near = kAtEnds * (to - from);
  for (double begin = from;;) {
    const auto t = first(begin, to, at);
    if (!t || to - *t <= near) return {};
    if (*t - from > near) return t;
    begin = *t;
  }
}

// Another place may be passed before this one: whoever ends a step here looks again.
double BendWatch::passage(std::size_t place, double left, double right, double resolution, const GapTrace::States& at) {
  const auto beyond = [&](double t) { return is_beyond(look_again(place, t, at)); };
  const bool side = beyond(left);
  for (int k = 0; k < kBendHalvings && right - left > resolution; ++k) {
    const double t = left + 0.5 * (right - left);
    (beyond(t) == side ? left : right) = t;
  }
  return right;
}

void BendWatch::look(const StateView& s, std::vector<double>& beyond) {
  beyond.clear();
  for (Source& source : sources_) {
    source.first = beyond.size();
    source.add(s, beyond);
  }
}

double BendWatch::look_again(std::size_t place, double t, const GapTrace::States& at) {
  const Source& source = *std::prev(std::upper_bound(
      sources_.begin(), sources_.end(), place, [](std::size_t i, const Source& other) { return i < other.first; }));
  own_.clear();
  source.add(at(t), own_);
  return own_[place - source.first];
}

// By the parabola through the three, which tells whether it is worth while to look.
std::optional<double> BendWatch::beyond_turn(std::size_t place, double left, double part, const double* looks,
                                             double least, const GapTrace::States& at) {
  const double slope = 0.5 * (looks[2] - looks[0]), curvature = looks[0] - 2 * looks[1] + looks[2],
               side = is_beyond(looks[1]) ? 1 : -1;
  if (!(side * curvature > 0) || !(std::abs(slope) <= std::abs(curvature))) return {};
  const double turn = side * (looks[1] - 0.5 * slope * slope / curvature),
               range = std::max(std::abs(looks[0]), std::abs(looks[2])) - std::max(0.0, turn);
  if (!(turn < kGrazes * range)) return {};
  const auto found = [](const GoldenSection& g) { return g.f_low > 0 || g.f_high > 0; };
  const GoldenSection g = golden_section(
      left, left + 2 * part, kTurnings, [&](double t) { return -side * look_again(place, t, at); },
      [&](const GoldenSection& section) { return !found(section); });
  if (!(g.most() > least)) return {};
  return g.best();
}

std::optional<double> BendWatch::first(double from, double to, const GapTrace::States& at) {
  const auto passage = any_passage(from, to, at);
  return passage ? std::optional(passage->t) : std::nullopt;
}

void BendWatch::each_passage(double from, double to, const GapTrace::States& at,
                             const std::function<void(const Passage&)>& met) {
  const double resolution = 2 * kResolved * (to - from);
  double begin = from;
  for (int k = 0; k < kMostPassages; ++k) {
    auto next = any_passage(begin, to, at);
    if (!next) return;
    for (int earlier = 0; earlier < kMostPassages && next->t - resolution > begin; ++earlier) {
      const auto before = any_passage(begin, next->t - resolution, at);
      if (!before) break;
      next = before;
    }
    met(*next);
    begin = next->t;
  }
}

std::optional<BendWatch::Passage> BendWatch::any_passage(double from, double to, const GapTrace::States& at) {
  const double part = 0.25 * (to - from);
  const auto look_at = [&](std::size_t k) { look(at(k == 4 ? to : from + part * double(k)), looks_[k]); };
  for (const std::size_t k : {0, 2, 4}) look_at(k);
  const std::size_t count = looks_[4].size();
  largest_.resize(count, 0);
  bool near = false;
  for (std::size_t i = 0; i < count; ++i) {
    const double a = looks_[0][i], b = looks_[2][i], c = looks_[4][i];
    largest_[i] = std::max({largest_[i], std::abs(a), std::abs(b), std::abs(c)});
    near = near ||
           std::min({std::abs(a), std::abs(b), std::abs(c)}) <= kBendNear * std::max(std::abs(b - a), std::abs(c - b));
  }
  if (!near) return {};
  for (const std::size_t k : {1, 3}) look_at(k);
  const auto least = [&](std::size_t i) { return kBendCounts * (atol_ + rtol_ * largest_[i]); };
  const auto time = [&](std::size_t k) { return k == 4 ? to : from + part * double(k); };
  for (std::size_t k = 1; k < 5; ++k)
    for (std::size_t i = 0; i < count; ++i) {
      const double before = looks_[0][i], now = looks_[k][i];
      if (is_beyond(before) != is_beyond(now) && std::max(std::abs(before), std::abs(now)) > least(i))
        return Passage{i, passage(i, time(k - 1), time(k), kResolved * (to - from), at), is_beyond(now)};
    }
  for (std::size_t k = 0; k < 3; ++k)
    for (std::size_t i = 0; i < count; ++i) {
      const double three[] = {looks_[k][i], looks_[k + 1][i], looks_[k + 2][i]};
      if (const auto there = beyond_turn(i, time(k), part, three, least(i), at))
        return Passage{i, passage(i, time(k), *there, kResolved * (to - from), at), !is_beyond(three[1])};
    }
  return {};
}

}  // namespace costate
