#include "costate/event/path_watch.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "costate/assembly/gathered_state.h"
#include "costate/element/course.h"
#include "costate/element/guarded_force.h"
#include "costate/element/jumping_force.h"
#include "costate/element/path_function.h"
#include "costate/objective/formula_output.h"

namespace costate {

namespace {
// By how much of what it changes the function may be off a cubic, where the integrator is asked for so much; where it
// is asked for more, of what its steps of high order make of a sine.
constexpr double kOffCubic = 0.02, kAtRtol = 1e-4, kOffOrder = 0.125;
// Of what the function changed so far, or of its impulse: less is nothing, in what the integrator is asked for.
constexpr double kNoPathRange = 10, kLeastPathRange = 1e-10, kMostPathRange = 1e-6;
// So often a step from one time is cut: what is still not resolved then is rounding. And steps so short, of the time.
constexpr int kMostPathCuts = 6;
// So often one step is looked at, each time to where it is to end; where that is by less nearer counts no more.
constexpr int kMostPathLooks = 8;
constexpr double kSameCut = 1e-3;
constexpr double kPathInstant = 1e-13;
// Steps over what is met, and on the way back over what acted; of the largest change within a step the part that counts
// there. Cells shorter by more are met by a step of their own.
constexpr double kOwnLooks = 8192;  // over the run, at what tells nothing of itself
constexpr double kPathSteps = 2.3, kPathStepsBack = 4, kPathActs = 1e-3, kAlike = 6;

/// What a cost of a user's is called.
class OwnCost final : public Element {
 public:
  OwnCost() : Element("cost", "own") {}
};
}  // namespace

PathWatch::PathWatch(Assembly& assembly, const Objective& objective, double rtol, double atol, LeftBends leaves,
                     double span)
    : assembly_(assembly),
      precision_{kOffCubic * std::min(1.0, std::pow(rtol / kAtRtol, kOffOrder)),
                 std::clamp(kNoPathRange * rtol, kLeastPathRange, kMostPathRange), leaves},
      motion_(assembly.mechanism(), rtol, atol) {
  for (const auto& force : assembly.mechanism().forces()) {
    if (const auto* formulas = dynamic_cast<const PathFunctionElement*>(force.get()))
      for (int i = 0; i < formulas->path_functions(); ++i)
        functions_.emplace_back(*force, formulas->path_function(i), force->coordinates(),
                                [force = force.get(), formulas, i](const StateView& s, Assembly& a, double* x) {
                                  thread_local GatheredState own;
                                  formulas->path_arguments(i, own.of(*force, s, a.numbers()), x);
                                });
    const auto* owner = dynamic_cast<const MotionLawElement*>(force.get());
    if (!owner) continue;
    std::vector<MotionLaw> laws;
    owner->add_motion_laws(laws);
    std::vector<double> p;
    for (const int n : force->numbers()) p.push_back(assembly.numbers()[static_cast<std::size_t>(n)]);
    for (const MotionLaw& of : laws) {
      if (!of.followed()) continue;
      LawPlaces places;
      places.from = -HUGE_VAL;
      places.to = HUGE_VAL;
      const double* numbers = p.data() + of.first;
      add_law_places(*of.law, numbers, places);
      // One stop alone is a gap; and a law with one bend does nothing briefly.
      if (!places.search && (of.of_rate ? places.knots.size() + places.sharp.size() < 2
                                        : places.knots.empty() && law_begins(*of.law, numbers).size() < 2))
        continue;
      places.sharp.insert(places.sharp.end(), places.knots.begin(), places.knots.end());
      functions_.emplace_back(*force, *owner, of, std::move(places.sharp), places.search);
    }
  }
  std::vector<int> all(assembly.mechanism().coordinates().size());
  std::iota(all.begin(), all.end(), 0);
  const auto follow = [&](const std::vector<const FormulaOutput*>& formulas, bool of_time) {
    for (const FormulaOutput* formula : formulas) {
      // Of what a cost makes of accelerations, too, but of sums and products of them, which are as smooth as they are.
      const auto& inputs = formula->inputs();
      const bool of_motion =
          std::any_of(inputs.begin(), inputs.end(), [](const auto& x) { return !x->needs_accelerations(); });
      const FormulaLaw& law = formula->definition().formula();
      const bool solved = !of_time && formula->needs_accelerations() && !law.is_polynomial();
      if (!solved && !of_motion && (!of_time || formula->needs_accelerations())) continue;
      accelerations_ = accelerations_ || solved;
      functions_.emplace_back(
          formula->definition(), law, formula->depends_on().value_or(all),
          [formula](const StateView& s, Assembly& a, double* x) { formula->arguments(s, a, x); }, solved);
    }
  };
  const double often = span > 0 ? kOwnLooks / span : 0;
  for (const auto& force : assembly.mechanism().forces())
    if (often > 0 && is_own(*force) && !dynamic_cast<const GuardedForce*>(force.get()) &&
        !dynamic_cast<const JumpingForce*>(force.get()) && !dynamic_cast<const PathFunctionElement*>(force.get()))
      functions_.emplace_back(*force, force->coordinates(), own_value(assembly.mechanism(), *force), often);
  static const OwnCost own_cost;
  for (const auto& term : objective.running)
    if (often > 0 && is_own(*term) && !term->needs_accelerations())
      functions_.emplace_back(own_cost, all, own_value(*term), often);
  // What a cost makes of time alone is known beforehand (StepPlan).
  for (const auto& term : objective.running) follow(formulas_of(*term), false);
  for (const auto& output : objective.followed) follow(formulas_of(*output), true);
}

std::optional<TouchLook> PathWatch::passed_over(PathCourse& f) {
  const double from = motion_.from(), to = motion_.to(), h = to - from;
  const auto& cells = f.cells(motion_, *states_, assembly_, precision_);
  if (const double part = f.looked_at(); part < 1)
    return TouchLook{from + part * h, to, part * h, &f.element(), "turns"};
  // Until the function changes the step is right. Whatever is as long as what follows there is met by steps of its
  // length; what is much shorter, or longer, when they come to it.
  const auto begin =
      std::find_if(cells.begin(), cells.end(), [&](const PathCourse::Cell& c) { return c.away > f.nothing(1); });
  if (begin == cells.end()) return {};
  const auto length = [](const PathCourse::Cell& c) { return c.to - c.from; };
  const double first = length(*begin);
  double least = first;
  auto end = begin;
  for (; end != cells.end() && length(*end) < kAlike * least && kAlike * length(*end) > first; ++end)
    least = std::min(least, length(*end));
  const double instant = kPathInstant * std::max(std::abs(from), std::abs(to));
  return TouchLook{from + begin->from * h, end == cells.end() ? to : from + end->from * h,
                   std::max(least * h / kPathSteps, instant), &f.element(), "acts"};
}

std::optional<TouchLook> PathWatch::first_passed_over() {
  std::optional<TouchLook> first;
  for (PathCourse& f : functions_) {
    const auto look = passed_over(f);
    if (look && (!first || look->from < first->from || (look->from == first->from && look->step < first->step)))
      first = look;
  }
  return first;
}

std::optional<TouchLook> PathWatch::look(double from, double to, const GapTrace::States& at) {
  if (functions_.empty() || !(from < to)) return {};
  states_ = &at;
  motion_.take(from, to, at);
  cuts_ = from == cut_from_ ? cuts_ + 1 : 0;
  cut_from_ = from;
  const double instant = kPathInstant * std::max(std::abs(from), std::abs(to));
  auto first = first_passed_over();
  if (first && cuts_ < kMostPathCuts && to - from > instant) {
    // Where that begins is the better known the shorter the motion that is looked at.
    for (int k = 0; k < kMostPathLooks && first->from - from > instant; ++k) {
      motion_.take(from, first->from, at);
      const auto before = first_passed_over();
      if (!before) break;
      const bool same = first->from - before->from < kSameCut * (first->from - from);
      first = before;
      if (same) break;
    }
    return first;
  }
  for (PathCourse& f : functions_) f.record(from, to);
  return {};
}

void PathWatch::add_looks(std::vector<TouchLook>& looks) const {
  for (const PathCourse& f : functions_)
    f.active(kPathActs, [&](double from, double to) {
      looks.push_back({from, to, (to - from) / kPathStepsBack, &f.element()});
    });
}

}  // namespace costate
