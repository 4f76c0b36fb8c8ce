#include "costate/event/path_watch.h"

#include <algorithm>
#include <cmath>

#include "costate/assembly/gathered_state.h"
#include "costate/element/course.h"
#include "costate/element/path_function.h"
#include "costate/objective/formula_output.h"

namespace costate {

namespace {
// By how much of what it changes the function may be off a cubic, where the integrator is asked for so much; where it
// is asked for more, of what its steps of high order make of a sine.
constexpr double kOffCubic = 0.02, kAtRtol = 1e-4, kOffOrder = 0.125;
// Of what the function changed so far: less is nothing, in what the integrator is asked for.
constexpr double kNoPathRange = 10, kLeastPathRange = 1e-10, kMostPathRange = 1e-6;
// So often a step from one time is cut: what is still not resolved then is rounding. And steps so short, of the time.
constexpr int kMostPathCuts = 6;
constexpr double kPathInstant = 1e-13;
// Steps over what is met, and on the way back over what acted; of the largest change within a step the part that counts
// there. Cells shorter by more are met by a step of their own.
constexpr double kPathSteps = 2.3, kPathStepsBack = 4, kPathActs = 1e-3, kAlike = 6;
}  // namespace

void PathWatch::State::set(const StateView& s, const Assembly& assembly) {
  t = s.t;
  q.assign(s.q, s.q + assembly.n());
  v.assign(s.v, s.v + assembly.n());
  z.assign(s.z, s.z + assembly.nz());
}

StateView PathWatch::State::view() const {
  StateView s;
  s.t = t;
  s.q = q.data();
  s.v = v.data();
  s.z = z.data();
  return s;
}

PathWatch::PathWatch(Assembly& assembly, const Objective& objective, double rtol, double atol, bool leaves_bends)
    : assembly_(assembly),
      rtol_(rtol),
      atol_(atol),
      precision_{kOffCubic * std::min(1.0, std::pow(rtol / kAtRtol, kOffOrder)),
                 std::clamp(kNoPathRange * rtol, kLeastPathRange, kMostPathRange), leaves_bends} {
  for (const auto& force : assembly.mechanism().forces()) {
    if (const auto* formulas = dynamic_cast<const PathFunctionElement*>(force.get()))
      for (int i = 0; i < formulas->path_functions(); ++i)
        functions_.emplace_back(*force, formulas->path_function(i),
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
      functions_.emplace_back(*force, *owner, of, std::move(places.sharp));
    }
  }
  const auto follow = [&](const std::vector<const FormulaOutput*>& formulas, bool of_time) {
    for (const FormulaOutput* formula : formulas)
      // Of accelerations a step's ends tell nothing.
      if ((of_time || !formula->inputs().empty()) && !formula->needs_accelerations())
        functions_.emplace_back(formula->definition(), formula->definition().formula(),
                                [formula](const StateView& s, Assembly& a, double* x) { formula->arguments(s, a, x); });
  };
  // What a cost makes of time alone is known beforehand (StepPlan).
  for (const auto& term : objective.running) follow(formulas_of(*term), false);
  for (const auto& output : objective.followed) follow(formulas_of(*output), true);
}

void PathWatch::set_middle() {
  const double h = end_.t - begin_.t;
  middle_.t = begin_.t + 0.5 * h;
  middle_.q.resize(begin_.q.size());
  middle_.v.resize(begin_.q.size());
  for (std::size_t i = 0; i < begin_.q.size(); ++i) {
    const double q0 = begin_.q[i], q1 = end_.q[i], v0 = begin_.v[i], v1 = end_.v[i], mean = 0.5 * (v0 + v1);
    middle_.q[i] = 0.5 * (q0 + q1) + h / 8 * (v0 - v1);
    // In short steps the difference of positions is the integrator's error.
    const double more = q1 - q0 - h * mean, noise = atol_ + rtol_ * std::max(std::abs(q0), std::abs(q1));
    middle_.v[i] = mean + (std::abs(more) > noise ? 1.5 * more / h : 0);
  }
  middle_.z.resize(begin_.z.size());
  for (std::size_t i = 0; i < begin_.z.size(); ++i) middle_.z[i] = 0.5 * (begin_.z[i] + end_.z[i]);
}

std::optional<TouchLook> PathWatch::passed_over(PathCourse& f, double from, double to) const {
  const auto& cells = f.cells(precision_);
  // Until the function changes the step is right. Whatever is as long as what follows there is met by steps of its
  // length; what is much shorter, or longer, when they come to it.
  const auto begin =
      std::find_if(cells.begin(), cells.end(), [&](const PathCourse::Cell& c) { return c.away > f.floor(); });
  if (begin == cells.end()) return {};
  const auto length = [](const PathCourse::Cell& c) { return c.to - c.from; };
  const double first = length(*begin);
  double least = first;
  auto end = begin;
  for (; end != cells.end() && length(*end) < kAlike * least && kAlike * length(*end) > first; ++end)
    least = std::min(least, length(*end));
  const double h = to - from, instant = kPathInstant * std::max(std::abs(from), std::abs(to));
  return TouchLook{from + begin->from * h, end == cells.end() ? to : from + end->from * h,
                   std::max(least * h / kPathSteps, instant), &f.element(), "acts"};
}

std::optional<TouchLook> PathWatch::look(double from, double to, const GapTrace::States& at) {
  if (functions_.empty() || !(from < to)) return {};
  if (begin_.t != from) {
    begin_.set(at(from), assembly_);
    for (PathCourse& f : functions_) f.take(0, begin_.view(), assembly_);
  }
  end_.set(at(to), assembly_);
  set_middle();
  cuts_ = from == cut_from_ ? cuts_ + 1 : 0;
  cut_from_ = from;
  const bool may_cut = cuts_ < kMostPathCuts && to - from > kPathInstant * std::max(std::abs(from), std::abs(to));
  std::optional<TouchLook> first;
  for (PathCourse& f : functions_) {
    f.take(1, middle_.view(), assembly_);
    f.take(2, end_.view(), assembly_);
    const auto look = passed_over(f, from, to);
    if (look && (!first || look->from < first->from || (look->from == first->from && look->step < first->step)))
      first = look;
  }
  if (first && may_cut) return first;
  for (PathCourse& f : functions_) {
    f.record(from, to);
    f.begin_where_it_ended();
  }
  std::swap(begin_, end_);
  return {};
}

void PathWatch::add_looks(std::vector<TouchLook>& looks) const {
  for (const PathCourse& f : functions_)
    f.active(kPathActs, [&](double from, double to) {
      looks.push_back({from, to, (to - from) / kPathStepsBack, &f.element()});
    });
}

}  // namespace costate
