#include "costate/event/path_watch.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "costate/assembly/gathered_state.h"
#include "costate/base/error.h"
#include "costate/element/course.h"
#include "costate/element/law/cubic_check.h"
#include "costate/objective/formula_output.h"

namespace costate {

namespace {
// By how much of its range the function may be off a cubic.
constexpr double kOffCubic = 0.1;
// Of its range in the run so far, and of its size: less is nothing; and what is nothing in whatever units.
constexpr double kNoPathRange = 1e-6, kPathRounding = 1e-10, kNoForce = 1e-30;
// Looks within a step, without a common period; and towards each place where a term passes through zero, each half as
// far as the last.
constexpr double kPathLooks[] = {0.0713, 0.1927, 0.2659, 0.4271, 0.5483, 0.7331, 0.8219, 0.9407};
constexpr int kPathTowards = 16, kPathDepth = 14;
constexpr std::size_t kMostPathPlaces = 8;
// So often a step from one time is cut: what is still not resolved then is rounding.
constexpr int kMostPathCuts = 6;
// Steps over what is met, and on the way back over what acted; of the largest change within a step the part that counts
// there.
constexpr double kPathSteps = 2.3, kPathStepsBack = 4, kPathActs = 1e-3;
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

class PathWatch::Function {
 public:
  /// The values of a formula's arguments at a state.
  using Arguments = std::function<void(const StateView& s, Assembly& assembly, double* x)>;

  Function(const Element& element, const FormulaLaw& formula, Arguments arguments)
      : element_(&element), arguments_(std::move(arguments)), law_(&formula) {
    for (auto* x : {&at_[0], &at_[1], &at_[2], &here_, &slopes_})
      x->assign(static_cast<std::size_t>(formula.number_count()), 0);
  }
  /// A law of the element's deformation, with what it says of itself.
  Function(const Element& element, const MotionLawElement& of, const MotionLaw& law, std::vector<double> sharp)
      : element_(&element),
        owner_(&of),
        first_(law.first),
        origin_(law.origin),
        law_(law.law),
        sharp_(std::move(sharp)) {}

  const Element& element() const { return *element_; }

  /// Takes its arguments at the k-th of three states, the beginning, the middle and the end of a step.
  void take(int k, const StateView& s, Assembly& assembly) {
    if (arguments_) {
      arguments_(s, assembly, at_[k].data());
      x_[k] = s.t;
      return;
    }
    thread_local GatheredState own;
    const LocalState local = own.of(*element_, s, assembly.numbers());
    here_.assign(local.p + first_, local.p + element_->numbers().size());
    x_[k] = owner_->deformation(local).gap - local.p[origin_];
  }
  void begin_where_it_ended() {
    std::swap(at_[0], at_[2]);
    x_[0] = x_[2];
  }

  /// Cells of a step, in parts of it: empty where the function is resolved by the step as a whole.
  struct Cell {
    double from, to;
  };
  const std::vector<Cell>& cells() {
    samples_.clear();
    cells_.clear();
    for (const double u : {0.0, 1.0}) add(u);
    for (const double u : kPathLooks) add(u);
    for (const double u : places())
      for (double d = 0.5, k = 0; k < kPathTowards; d /= 2, ++k) {
        add(u - d);
        add(u + d);
      }
    std::sort(samples_.begin(), samples_.end(), [](const Sample& a, const Sample& b) { return a.u < b.u; });
    low_now_ = HUGE_VAL;
    high_now_ = -HUGE_VAL;
    for (const Sample& s : samples_) {
      low_now_ = std::min(low_now_, s.f);
      high_now_ = std::max(high_now_, s.f);
    }
    floor_ = std::max({kNoPathRange * (std::max(high_, high_now_) - std::min(low_, low_now_)),
                       kPathRounding * std::max(std::abs(low_now_), std::abs(high_now_)), kNoForce});
    refine(0, 1, 0);
    if (cells_.size() == 1) cells_.clear();
    return cells_;
  }
  /// The step was taken.
  void record(double from, double to) {
    low_ = std::min(low_, low_now_);
    high_ = std::max(high_, high_now_);
    steps_.push_back({from, to, high_now_ - low_now_});
  }
  void add_looks(std::vector<TouchLook>& looks) const {
    double largest = 0;
    for (const Change& s : steps_) largest = std::max(largest, s.range);
    for (std::size_t k = 0; k < steps_.size();) {
      if (!(steps_[k].range > kPathActs * largest)) {
        ++k;
        continue;
      }
      const double from = steps_[k].from;
      for (; k < steps_.size() && steps_[k].range > kPathActs * largest; ++k) continue;
      const double to = steps_[k - 1].to;
      looks.push_back({from, to, (to - from) / kPathStepsBack, element_});
    }
  }

 private:
  /// The parabola through three values of an argument.
  static double on(double a, double m, double b, double u) {
    return a + u * (4 * m - 3 * a - b + u * 2 * (a + b - 2 * m));
  }
  double value(double u) {
    if (!owner_)
      for (std::size_t i = 0; i < here_.size(); ++i) here_[i] = on(at_[0][i], at_[1][i], at_[2][i], u);
    // Parabolas may lead out of where a law through data says anything; the motion itself will tell.
    try {
      const double f = law_->value(on(x_[0], x_[1], x_[2], u), here_.data());
      return std::isfinite(f) ? f : 0;
    } catch (const StepError&) {
      return 0;
    }
  }
  void add(double u) {
    if (u >= 0 && u <= 1) samples_.push_back({u, value(u)});
  }
  /// Where the law says that it may change, on the chords of both halves.
  std::vector<double> places() {
    std::vector<double> found;
    for (int half = 0; half < 2; ++half) {
      const auto a = static_cast<std::size_t>(half), b = a + 1;
      const auto put = [&](double w) {
        if (w >= -0.1 && w <= 1.1 && found.size() < kMostPathPlaces) found.push_back(0.5 * (half + w));
      };
      if (owner_) {
        for (const double x : sharp_) put((x - x_[a]) / (x_[b] - x_[a]));
        continue;
      }
      for (std::size_t i = 0; i < here_.size(); ++i) slopes_[i] = at_[b][i] - at_[a][i];
      LawPlaces places;
      places.from = 0;
      places.to = 1;
      static_cast<const FormulaLaw*>(law_)->add_places_along(at_[a].data(), slopes_.data(), x_[a], x_[b] - x_[a],
                                                             places);
      for (const double w : places.sharp) put(w);
    }
    return found;
  }
  void refine(double a, double b, int depth) {
    const double h = b - a;
    CubicCheck cubic({a, a + h / 3, a + 2 * h / 3, b}, [this](double u) { return value(u); });
    auto s = std::lower_bound(samples_.begin(), samples_.end(), a, [](const Sample& x, double at) { return x.u < at; });
    for (; s != samples_.end() && s->u <= b; ++s) cubic.compare(s->u, s->f);
    if (depth > 0)
      for (const double w : kPathLooks) cubic.compare(a + w * h, value(a + w * h));
    if (cubic.off() <= std::max(kOffCubic * cubic.range(), floor_) || depth >= kPathDepth) {
      cells_.push_back({a, b});
      return;
    }
    refine(a, a + h / 2, depth + 1);
    refine(a + h / 2, b, depth + 1);
  }

  struct Sample {
    double u, f;
  };
  struct Change {
    double from, to, range;
  };

  const Element* element_;
  Arguments arguments_;                      // of a formula; else a law
  const MotionLawElement* owner_ = nullptr;  // of this element's deformation, with its
  int first_ = -1, origin_ = -1;             // numbers and its origin there
  const ScalarLaw* law_;
  std::vector<double> sharp_;  // of a law of a deformation
  double x_[3] = {};
  std::vector<double> at_[3], here_, slopes_;
  std::vector<Sample> samples_;
  std::vector<Cell> cells_;
  double low_ = HUGE_VAL, high_ = -HUGE_VAL, low_now_ = 0, high_now_ = 0, floor_ = 0;
  std::vector<Change> steps_;
};

PathWatch::PathWatch(Assembly& assembly, const Objective& objective) : assembly_(assembly) {
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
      if (of.origin < 0) continue;
      LawPlaces places;
      places.from = -HUGE_VAL;
      places.to = HUGE_VAL;
      const double* numbers = p.data() + of.first;
      add_law_places(*of.law, numbers, places);
      // One stop alone is a gap.
      if (!places.search && places.knots.empty() && law_begins(*of.law, numbers).size() < 2) continue;
      places.sharp.insert(places.sharp.end(), places.knots.begin(), places.knots.end());
      functions_.emplace_back(*force, *owner, of, std::move(places.sharp));
    }
  }
  for (const auto& term : objective.running)
    for (const FormulaOutput* formula : formulas_of(*term))
      // What it makes of time alone is known beforehand (StepPlan); of accelerations a step's ends tell nothing.
      if (!formula->inputs().empty() && !formula->needs_accelerations())
        functions_.emplace_back(formula->definition(), formula->definition().formula(),
                                [formula](const StateView& s, Assembly& a, double* x) { formula->arguments(s, a, x); });
}

PathWatch::~PathWatch() = default;

void PathWatch::set_middle() {
  const double h = end_.t - begin_.t;
  middle_.t = begin_.t + 0.5 * h;
  middle_.q.resize(begin_.q.size());
  middle_.v.resize(begin_.q.size());
  for (std::size_t i = 0; i < begin_.q.size(); ++i) {
    middle_.q[i] = 0.5 * (begin_.q[i] + end_.q[i]) + h / 8 * (begin_.v[i] - end_.v[i]);
    middle_.v[i] = 1.5 * (end_.q[i] - begin_.q[i]) / h - 0.25 * (begin_.v[i] + end_.v[i]);
  }
  middle_.z.resize(begin_.z.size());
  for (std::size_t i = 0; i < begin_.z.size(); ++i) middle_.z[i] = 0.5 * (begin_.z[i] + end_.z[i]);
}

std::optional<TouchLook> PathWatch::look(double from, double to, const GapTrace::States& at) {
  if (functions_.empty() || !(from < to)) return {};
  if (begin_.t != from) {
    begin_.set(at(from), assembly_);
    for (Function& f : functions_) f.take(0, begin_.view(), assembly_);
  }
  end_.set(at(to), assembly_);
  set_middle();
  cuts_ = from == cut_from_ ? cuts_ + 1 : 0;
  cut_from_ = from;
  std::optional<TouchLook> first;
  for (Function& f : functions_) {
    f.take(1, middle_.view(), assembly_);
    f.take(2, end_.view(), assembly_);
    const auto& cells = f.cells();
    if (cells.empty()) continue;
    const auto length = [](const Function::Cell& c) { return c.to - c.from; };
    double least = 1;
    for (const auto& c : cells) least = std::min(least, length(c));
    // What is as short as the shortest, and what lies between.
    const auto is_short = [&](const Function::Cell& c) { return length(c) < 4.5 * least; };
    const auto begin = std::find_if(cells.begin(), cells.end(), is_short);
    const auto end = std::find_if_not(begin, cells.end(), is_short);
    const double h = to - from;
    const TouchLook look{from + begin->from * h, end == cells.end() ? to : from + end->from * h, least * h / kPathSteps,
                         &f.element(), "acts"};
    if (!first || look.from < first->from) first = look;
  }
  if (first && cuts_ < kMostPathCuts) return first;
  for (Function& f : functions_) {
    f.record(from, to);
    f.begin_where_it_ended();
  }
  std::swap(begin_, end_);
  return {};
}

void PathWatch::add_looks(std::vector<TouchLook>& looks) const {
  for (const Function& f : functions_) f.add_looks(looks);
}

}  // namespace costate
