#include "costate/element/course.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>

#include "costate/base/error.h"
#include "costate/element/law/cubic_check.h"
#include "costate/element/law/scalar_law.h"
#include "costate/element/law/two_lines.h"

namespace costate {

namespace {

constexpr int kGrid = 8192;           // points of a search
constexpr int kGrading = 24;          // points towards each sharp place in a search, each half as far as the last
constexpr double kSmallest = 1e-7;    // of the whole length: what is shorter is not looked for
constexpr double kUnresolved = 0.05;  // of what a law changes within a cell: how far it may be from a cubic
constexpr double kNothing = 1e-12;    // of what it changes altogether
constexpr long kMostCells = 200'000;
// Not whole: at the quarters of a bump its second derivative, all that some formulations see of a driver, is zero.
constexpr double kStepsInCell = 2.3, kStepsInWave = 4.3;
constexpr std::size_t kMostInKink = 60;  // samples in a cell that may be one
// Places within a cell, without a common period.
constexpr double kWithin[] = {0.0713, 0.1927, 0.2659, 0.4271, 0.5483, 0.7331, 0.8219, 0.9407};

struct Sample {
  double x, f;
};

/// Halves the length between two places until the law is near a cubic on each part.
class Cells {
 public:
  using Function = std::function<double(double)>;
  Cells(const Function& f, const LawPlaces& places) : f_(f), places_(places) {}

  template <class Emit>
  void find(const Emit& emit) {
    std::vector<double> ends = places_.sharp;
    const double from = places_.from, to = places_.to;
    ends.push_back(from);
    ends.push_back(to);
    std::sort(ends.begin(), ends.end());
    ends.erase(std::unique(ends.begin(), ends.end()), ends.end());
    std::erase_if(ends, [&](double x) { return !(x >= from && x <= to); });
    for (const double x : places_.knots) add(x);
    for (std::size_t k = 0; k + 1 < ends.size(); ++k)
      for (const double w : kWithin) add(ends[k] + w * (ends[k + 1] - ends[k]));
    if (places_.search) {
      // Off any round number, so that no period of the law is met at its zeros alone.
      for (int k = 0; k < kGrid; ++k) add(from + (to - from) * (k + 0.3819) / kGrid);
      for (const double x : ends)
        for (double d = to - from, k = 0; k < kGrading; d /= 2, ++k) {
          add(x - d);
          add(x + d);
        }
    }
    for (const double x : ends) add(x);
    std::sort(samples_.begin(), samples_.end(), [](const Sample& a, const Sample& b) { return a.x < b.x; });
    double low = std::numeric_limits<double>::infinity(), high = -low, size = 0;
    for (const Sample& s : samples_) {
      low = std::min(low, s.f);
      high = std::max(high, s.f);
      size = std::max(size, std::abs(s.f));
    }
    range_ = high - low;
    floor_ = std::max(kNothing * range_, 1e-15 * size);
    smallest_ = kSmallest * (to - from);
    for (std::size_t k = 0; k + 1 < ends.size(); ++k) {
      const double a = ends[k], b = ends[k + 1];
      if (!places_.search && repeats(a, b))
        emit(a, b);
      else
        refine(a, b, 0, emit);
    }
  }

 private:
  /// Zero where the law says nothing: what is looked at goes farther than the motion.
  double value(double x) const {
    try {
      const double f = f_(x);
      return std::isfinite(f) ? f : 0;
    } catch (const StepError&) {
      return 0;
    }
  }
  /// Whether steps are short enough throughout by the law's waves.
  bool repeats(double a, double b) const {
    return std::any_of(places_.waves.begin(), places_.waves.end(),
                       [&](const LawPlaces::Wave& w) { return w.from <= a && b <= w.to; });
  }
  void add(double x) {
    if (x >= places_.from && x <= places_.to) samples_.push_back({x, value(x)});
  }
  /// Of the cell that these four places span, with the samples from `first` on.
  bool is_kink(const std::array<double, 4>& x, std::vector<Sample>::const_iterator first, double off) const {
    std::vector<std::pair<double, double>> values;
    for (auto s = first; s != samples_.end() && s->x < x[3]; ++s) {
      if (values.size() > kMostInKink) return false;
      values.emplace_back(s->x, s->f);
    }
    for (const double at : x) values.emplace_back(at, value(at));
    // More of them than told of it: the flank of something short is two lines to few.
    const std::size_t more = 3 * values.size();
    for (std::size_t k = 0; k < more; ++k) {
      const double at = x[0] + (static_cast<double>(k) + 0.3819) / static_cast<double>(more) * (x[3] - x[0]);
      values.emplace_back(at, value(at));
    }
    std::sort(values.begin(), values.end());
    values.erase(std::unique(values.begin(), values.end()), values.end());
    return are_two_lines(values, off);
  }
  template <class Emit>
  void refine(double a, double b, int depth, const Emit& emit) {
    const double h = b - a;
    if (!(h > 0)) return;
    // Just inside: a law may jump at its sharp places.
    const std::array<double, 4> x = {a + 1e-9 * h, a + h / 3, a + 2 * h / 3, b - 1e-9 * h};
    CubicCheck cubic(x, [this](double at) { return value(at); });
    const auto resolved = [&] { return cubic.off() <= std::max(kUnresolved * cubic.range(), floor_); };
    for (const double w : kWithin) cubic.compare(a + w * h, value(a + w * h));
    const auto first =
        std::lower_bound(samples_.begin(), samples_.end(), x[0], [](const Sample& s, double at) { return s.x < at; });
    for (auto s = first; s != samples_.end() && s->x < x[3]; ++s) {
      cubic.compare(s->x, s->f);
      if (cubic.off() > kUnresolved * range_) break;  // far off, whatever else there is
    }
    if (resolved()) {
      // Level between two sharp places it is another level, perhaps, than beyond them.
      if (cubic.range() > floor_ || (depth == 0 && !places_.sharp.empty())) emit(a, b);
      return;
    }
    // A kink has no length of its own to be met by.
    if (is_kink(x, first, kUnresolved * cubic.range())) return emit(a, b);
    if (h <= smallest_ || ++cells_ > kMostCells || depth > 60) return emit(a, b);
    refine(a, a + h / 2, depth + 1, emit);
    refine(a + h / 2, b, depth + 1, emit);
  }

  const Function& f_;
  const LawPlaces& places_;
  std::vector<Sample> samples_;
  double range_ = 0, floor_ = 0, smallest_ = 0;
  long cells_ = 0;
};

}  // namespace

void add_law_places(const ScalarLaw& law, const double* p, LawPlaces& places) {
  if (const auto* placed = dynamic_cast<const PlacedLaw*>(&law)) return placed->add_places(p, places);
  // A polynomial is one piece throughout.
  if (dynamic_cast<const PolynomialLaw*>(&law)) return;
  if (dynamic_cast<const SineLaw*>(&law)) {
    if (p[1] != 0 && p[2] != 0) places.waves.push_back({places.from, places.to, 2 * std::numbers::pi / std::abs(p[2])});
  } else if (dynamic_cast<const SmoothStepLaw*>(&law)) {
    places.sharp.insert(places.sharp.end(), {p[0], p[1]});
  } else if (const auto* table = dynamic_cast<const TableLaw*>(&law)) {
    places.knots.insert(places.knots.end(), table->abscissae().begin(), table->abscissae().end());
  } else {
    places.search = true;
  }
}

namespace {
std::vector<ElementCourse>& registered_courses() {
  static std::vector<ElementCourse> courses;
  return courses;
}
}  // namespace

RegisterElementCourse::RegisterElementCourse(ElementCourse course) {
  registered_courses().push_back(std::move(course));
}
const std::vector<ElementCourse>& element_courses() { return registered_courses(); }

void Course::begin_owner(const std::string& name) { owners_.push_back(name); }

void Course::add(const ScalarLaw& f, const double* p, double shift, double rate) {
  if (told_) return told_(f, p, shift, rate);
  if (!(std::abs(rate) > 0) || !std::isfinite(rate) || !std::isfinite(shift)) return;
  LawPlaces places;
  places.from = rate * ((rate > 0 ? from_ : to_) - shift);
  places.to = rate * ((rate > 0 ? to_ : from_) - shift);
  add_law_places(f, p, places);
  const auto add_here = [&](double from, double to, double step) {
    if (rate < 0) std::swap(from, to);
    add_look(shift + from / rate, shift + to / rate, step / std::abs(rate));
  };
  for (const auto& w : places.waves)
    if (w.length > 0) add_here(w.from, w.to, w.length / kStepsInWave);
  for (const double at : places.sharp) sharp_.push_back(shift + at / rate);
  if (!places.search && places.sharp.empty() && places.knots.empty()) return;
  Cells([&](double x) { return f.value(x, p); }, places).find([&](double a, double b) {
    add_here(a, b, (b - a) / kStepsInCell);
  });
}

void Course::search(const std::function<double(double)>& f) {
  LawPlaces places;
  places.from = from_;
  places.to = to_;
  places.search = true;
  // What changes within the shortest cells jumps, which no step is short enough to meet; what it is between two jumps
  // is to be met.
  const double shortest = 2 * kSmallest * (to_ - from_);
  double last = std::numeric_limits<double>::quiet_NaN();
  Cells(f, places).find([&](double a, double b) {
    if (b - a > shortest) return add_look(a, b, (b - a) / kStepsInCell);
    if (b - last > 2 * shortest) add_look(last, b, (b - last) / kStepsInCell);
    last = b;
  });
}

void Course::add_look(double from, double to, double step) {
  from = std::max(from, from_);
  to = std::min(to, to_);
  // Beyond the rounding of its place nothing can be looked at.
  step = std::max(step, 1e-12 * std::max({std::abs(from), std::abs(to), to_ - from_}));
  if (owners_.empty()) owners_.emplace_back();
  if (from < to && std::isfinite(step)) looks_.push_back({from, to, step, static_cast<int>(owners_.size()) - 1});
}

void Course::finish() {
  pieces_.clear();
  std::sort(sharp_.begin(), sharp_.end());
  struct Edge {
    double at;
    bool begins;
    std::size_t look;
  };
  std::vector<Edge> edges;
  for (std::size_t i = 0; i < looks_.size(); ++i) {
    edges.push_back({looks_[i].from, true, i});
    edges.push_back({looks_[i].to, false, i});
  }
  std::sort(edges.begin(), edges.end(), [](const Edge& a, const Edge& b) { return a.at < b.at; });
  std::set<std::pair<double, std::size_t>> active;  // by step
  for (std::size_t k = 0; k < edges.size();) {
    const double at = edges[k].at;
    for (; k < edges.size() && edges[k].at == at; ++k) {
      const std::pair<double, std::size_t> entry{looks_[edges[k].look].step, edges[k].look};
      edges[k].begins ? void(active.insert(entry)) : void(active.erase(entry));
    }
    if (active.empty() || k == edges.size()) continue;
    const Piece& smallest = looks_[active.begin()->second];
    // Pieces of one step are one, but for a bend between them, which no step should have within it.
    if (!pieces_.empty() && pieces_.back().to == at && pieces_.back().step == smallest.step &&
        !std::binary_search(sharp_.begin(), sharp_.end(), at))
      pieces_.back().to = edges[k].at;
    else
      pieces_.push_back({at, edges[k].at, smallest.step, smallest.owner});
  }
}

Course::Bound Course::bound(double x, bool downwards) const {
  Bound b;
  if (downwards) {
    b.end = -b.end;
    auto i = std::lower_bound(pieces_.begin(), pieces_.end(), x,
                              [](const Piece& piece, double at) { return piece.from < at; });
    while (i != pieces_.begin()) {
      --i;
      if (i->to <= b.end) break;
      const double end = std::min(i->to, x - i->step);
      if (end > b.end) b = {end, i->step, i->owner};
    }
    return b;
  }
  auto i =
      std::upper_bound(pieces_.begin(), pieces_.end(), x, [](double at, const Piece& piece) { return at < piece.to; });
  for (; i != pieces_.end() && i->from < b.end; ++i) {
    const double end = std::max(i->from, x + i->step);
    if (end < b.end) b = {end, i->step, i->owner};
  }
  return b;
}

double Course::next_place(double x) const {
  const auto i =
      std::upper_bound(pieces_.begin(), pieces_.end(), x, [](double at, const Piece& piece) { return at < piece.to; });
  if (i == pieces_.end()) return Bound().end;
  return i->from > x ? i->from : i->to;
}

double Course::least_step(double from, double to) const {
  double least = Bound().step;
  for (const Piece& piece : pieces_)
    if (piece.to > from && piece.from < to && piece.to > piece.from) least = std::min(least, piece.step);
  return least;
}

}  // namespace costate
