#include "costate/element/law/formula_law.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>

#include "costate/base/error.h"
#include "costate/base/golden_section.h"
#include "costate/derivative/rounded.h"
#include "costate/element/course.h"

namespace costate {

namespace {
/// Of a function that says nothing there, one: as of all that is not known.
template <class Value>
double known_or_one(const Value& value, bool* known) {
  try {
    return value();
  } catch (const StepError&) {
    if (known) *known = false;
    return 1;
  }
}
double known_or_one(const ScalarLaw& law, double x, const double* p, bool* known = nullptr) {
  return known_or_one([&] { return law.value(x, p); }, known);
}
double known_or_one(const PointSurface& map, double x, double y, const double* scale, bool* known = nullptr) {
  return known_or_one([&] { return *scale * map.value(x, y); }, known);
}
}  // namespace

void FormulaLaw::add_places(const double* p, LawPlaces& places) const {
  // Runs the program on c + s x; s is NaN where a term is not linear.
  struct Linear {
    double c = 0, s = 0;
  };
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  Linear stack[kDepth + 1] = {};
  Linear* top = stack;
  bool linear = true;
  const auto leave = [&](Linear& term, bool sine) {  // for a function that is not linear
    if (term.s == 0) return;
    linear = false;
    if (std::isfinite(term.s)) {
      places.sharp.push_back(-term.c / term.s);
      if (sine) places.waves.push_back({places.from, places.to, 2 * std::numbers::pi / std::abs(term.s)});
    }
    term = {nan, nan};
  };
  for (const Step& step : program_) {
    switch (step.op) {
      case Op::constant:
        *++top = {step.value, 0};
        break;
      case Op::variable:
        *++top = {0, 1};
        break;
      case Op::number:
        *++top = {p[step.index], 0};
        break;
      case Op::add:
        --top;
        top[0] = {top[0].c + top[1].c, top[0].s + top[1].s};
        break;
      case Op::subtract:
        --top;
        top[0] = {top[0].c - top[1].c, top[0].s - top[1].s};
        break;
      case Op::multiply:
        --top;
        if (top[0].s == 0)
          top[0] = {top[0].c * top[1].c, top[0].c * top[1].s};
        else if (top[1].s == 0)
          top[0] = {top[1].c * top[0].c, top[1].c * top[0].s};
        else {
          leave(top[0], false);
          leave(top[1], false);
        }
        break;
      case Op::divide:
        --top;
        leave(top[1], false);
        top[0] = {top[0].c / top[1].c, top[0].s / top[1].c};
        break;
      case Op::negate:
        top[0] = {-top[0].c, -top[0].s};
        break;
      case Op::power:
        --top;
        leave(top[0], false);
        leave(top[1], false);
        top[0] = {std::pow(top[0].c, top[1].c), top[0].s + top[1].s};
        break;
      case Op::whole_power:
        leave(top[0], false);
        top[0].c = std::pow(top[0].c, step.index);
        break;
      case Op::sin:
        leave(top[0], true);
        top[0].c = std::sin(top[0].c);
        break;
      case Op::cos:
      case Op::tan:
        leave(top[0], true);
        top[0].c = step.op == Op::cos ? std::cos(top[0].c) : std::tan(top[0].c);
        break;
      case Op::exp:
        leave(top[0], false);
        top[0].c = std::exp(top[0].c);
        break;
      case Op::log:
        leave(top[0], false);
        top[0].c = std::log(top[0].c);
        break;
      case Op::sqrt:
        leave(top[0], false);
        top[0].c = std::sqrt(top[0].c);
        break;
      case Op::tanh:
        leave(top[0], false);
        top[0].c = std::tanh(top[0].c);
        break;
      case Op::atan:
        leave(top[0], false);
        top[0].c = std::atan(top[0].c);
        break;
      case Op::absolute:
        leave(top[0], false);
        top[0].c = std::abs(top[0].c);
        break;
      case Op::least:
      case Op::most: {
        --top;
        Linear apart = {top[0].c - top[1].c, top[0].s - top[1].s};
        if (apart.s == 0) {
          if ((apart.c < 0) == (step.op == Op::most)) top[0] = top[1];
          break;
        }
        leave(apart, false);
        linear = false;
        top[0] = {nan, nan};
        break;
      }
      case Op::function: {
        const FormulaFunction& f = functions_[static_cast<std::size_t>(step.index)];
        const double* numbers = p + f.first;
        const Linear at = top[0];
        if (at.s == 0) {
          top[0].c = known_or_one(*f.law, at.c, numbers);
          break;
        }
        linear = false;
        top[0] = {nan, nan};
        if (!std::isfinite(at.s)) break;
        LawPlaces of;
        const double a = at.c + at.s * places.from, b = at.c + at.s * places.to;
        of.from = std::min(a, b);
        of.to = std::max(a, b);
        add_law_places(*f.law, numbers, of);
        const auto back = [&](double place) { return (place - at.c) / at.s; };
        for (const double place : of.sharp) places.sharp.push_back(back(place));
        for (const double place : of.knots) places.knots.push_back(back(place));
        for (const LawPlaces::Wave& w : of.waves)
          places.waves.push_back(
              {std::min(back(w.from), back(w.to)), std::max(back(w.from), back(w.to)), w.length / std::abs(at.s)});
        break;
      }
      case Op::map: {
        --top;
        const FormulaFunction& f = functions_[static_cast<std::size_t>(step.index)];
        if (top[0].s == 0 && top[1].s == 0) {
          top[0].c = known_or_one(*f.map, top[0].c, top[1].c, p + f.first);
          break;
        }
        linear = false;
        auto& knots = f.map->between() == PointSurface::Between::lines ? places.sharp : places.knots;
        for (const auto& [at, along] : {std::pair(top[0], &f.map->x()), std::pair(top[1], &f.map->y())})
          if (at.s != 0 && std::isfinite(at.s))
            for (const double knot : *along) knots.push_back((knot - at.c) / at.s);
        top[0] = {nan, nan};
        break;
      }
    }
  }
  if (!linear) {
    places.search = true;
    add_bend_places(p, places);
  }
}

// By looks in which a sine that does not repeat more often than every fourth of them is smooth: of an argument that
// comes back between two of them the turn, too, which a search for what is narrow may find too small to matter.
void FormulaLaw::add_bend_places(const double* p, LawPlaces& places) const {
  constexpr int kLooks = 4096, kDivisions = 40, kHalvings = 60;
  constexpr std::size_t kMost = 256;  // of more of them the search takes care
  constexpr double kSame = 1e-10;
  const double from = places.from, h = (places.to - from) / kLooks;
  if (!may_bend() || !(h > 0) || !std::isfinite(h)) return;
  std::vector<double> own;
  const auto look = [&](double x, std::vector<double>& bends) {
    bends.clear();
    try {
      add_bends(x, p, bends);
    } catch (const StepError&) {
      bends.clear();
    }
  };
  const auto at = [&](std::size_t i, double x) {
    look(x, own);
    return i < own.size() ? own[i] : std::numeric_limits<double>::quiet_NaN();
  };
  std::vector<double> found;
  const auto add_passage = [&](std::size_t i, double left, double right) {
    const bool side = at(i, left) >= 0;
    for (int k = 0; k < kHalvings && left < right; ++k) {
      const double x = left + 0.5 * (right - left);
      if (!(x > left && x < right)) break;
      ((at(i, x) >= 0) == side ? left : right) = x;
    }
    found.push_back(right);
  };
  std::vector<double> a, b, c;
  look(from, a);
  look(from + h, b);
  for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
    if ((a[i] >= 0) != (b[i] >= 0)) add_passage(i, from, from + h);
  for (int k = 2; k <= kLooks && found.size() <= kMost; ++k) {
    const double right = from + k * h, left = right - 2 * h;
    look(right, c);
    for (std::size_t i = 0; i < std::min({a.size(), b.size(), c.size()}); ++i) {
      const bool side = b[i] >= 0;
      if ((c[i] >= 0) != side) {
        add_passage(i, right - h, right);
        continue;
      }
      const double sign = side ? -1 : 1;
      if ((a[i] >= 0) != side || !(sign * b[i] >= sign * a[i] && sign * b[i] > sign * c[i])) continue;
      const GoldenSection turn = golden_section(
          left, right, kDivisions, [&](double x) { return sign * at(i, x); },
          [](const GoldenSection& g) { return !(g.f_low > 0 || g.f_high > 0); });
      if (!(turn.most() > 0)) continue;
      add_passage(i, left, turn.best());
      add_passage(i, turn.best(), right);
    }
    a.swap(b);
    b.swap(c);
  }
  if (found.size() > kMost) return;
  // What is known already, of terms linear in x, or of two bends at once, is one.
  const double same = kSame * (places.to - places.from);
  for (const double x : found)
    if (std::none_of(places.sharp.begin(), places.sharp.end(), [&](double y) { return std::abs(x - y) <= same; }))
      places.sharp.push_back(x);
}

bool FormulaLaw::may_bend() const {
  return std::any_of(program_.begin(), program_.end(), [](const Step& step) {
    return step.op == Op::absolute || step.op == Op::least || step.op == Op::most || step.op == Op::function ||
           step.op == Op::map;
  });
}

bool FormulaLaw::is_polynomial() const {
  return std::all_of(program_.begin(), program_.end(), [](const Step& step) {
    return step.op < Op::divide || step.op == Op::negate || (step.op == Op::whole_power && step.index >= 0);
  });
}

namespace {
struct Bends {
  std::vector<double>& found;

  void term(double) {}
  void angle(double) {}
  void bend(double a) { found.push_back(a); }
  double call(const FormulaFunction& f, double x, const double* p) {
    thread_local std::vector<double> kinks;
    kinks.clear();
    f.law->add_kinks(p, kinks);
    for (const double at : kinks) found.push_back(x - at);
    return f.law->value(x, p);
  }
  double map(const FormulaFunction& f, double x, double y, const double* scale) {
    f.map->add_bends(x, y, found);
    return *scale * f.map->value(x, y);
  }
};

struct Guess {
  void term(double) {}
  void angle(double) {}
  void bend(double) {}
  double call(const FormulaFunction& f, double x, const double* p) { return known_or_one(*f.law, x, p); }
  double map(const FormulaFunction& f, double x, double y, const double* scale) {
    return known_or_one(*f.map, x, y, scale);
  }
};

struct Terms {
  FormulaTerms& found;
  const FormulaFunction* functions;
  bool known = true;

  void term(double a) { found.values.push_back(a); }
  void angle(double a) { found.angles.push_back(a); }
  void bend(double a) { found.values.push_back(a); }
  double call(const FormulaFunction& f, double x, const double* p) {
    if (const auto* formula = dynamic_cast<const FormulaLaw*>(f.law.get())) return formula->add_terms(x, p, found);
    found.tables.push_back({index(f), 0, x});
    return known_or_one(*f.law, x, p, &known);
  }
  double map(const FormulaFunction& f, double x, double y, const double* scale) {
    found.tables.push_back({index(f), 0, x});
    found.tables.push_back({index(f), 1, y});
    return known_or_one(*f.map, x, y, scale, &known);
  }
  int index(const FormulaFunction& f) const { return static_cast<int>(&f - functions); }
};

struct Rounding {
  void term(double) {}
  void angle(double) {}
  void bend(double) {}
  Rounded call(const FormulaFunction& f, const Rounded& x, const double* p) {
    const Dual<1> at = f.law->slope(x.v, p);
    const auto* formula = dynamic_cast<const FormulaLaw*>(f.law.get());
    return {at.v, std::abs(at.d[0]) * x.error + (formula ? formula->rounding(x.v, p) : 0)};
  }
  Rounded map(const FormulaFunction& f, const Rounded& x, const Rounded& y, const double* scale) {
    const auto at = f.map->value(Dual<2>::variable(x.v, 0), Dual<2>::variable(y.v, 1));
    return {*scale * at.v, std::abs(*scale) * (std::abs(at.d[0]) * x.error + std::abs(at.d[1]) * y.error)};
  }
};
}  // namespace

double FormulaLaw::rounding(double x, const double* p) const {
  Rounding watch;
  try {
    const double error = run<Rounded>(Rounded(x), p, watch).error;
    return std::isfinite(error) ? error : 0;
  } catch (const StepError&) {
    return 0;
  }
}

double FormulaLaw::look(double x, const double* p, FormulaTerms& terms) const {
  terms.values.clear();
  terms.angles.clear();
  terms.tables.clear();
  return add_terms(x, p, terms);
}

double FormulaLaw::add_terms(double x, const double* p, FormulaTerms& terms) const {
  Terms watch{terms, functions_.data()};
  const double value = run<double>(x, p, watch);
  return watch.known ? value : 0;
}

void FormulaLaw::add_bends(double x, const double* p, std::vector<double>& bends) const {
  Bends watch{bends};
  run<double>(x, p, watch);
}

double FormulaLaw::guess(double x, const double* p) const {
  Guess guess;
  return run<double>(x, p, guess);
}

bool FormulaLaw::varies() const {
  return std::any_of(program_.begin(), program_.end(), [](const Step& step) { return step.op == Op::variable; });
}

bool FormulaLaw::uses(std::size_t i) const {
  return std::any_of(program_.begin(), program_.end(), [&](const Step& step) {
    return step.op == Op::number && static_cast<std::size_t>(step.index) == i;
  });
}

bool FormulaLaw::calls(std::size_t i) const {
  return std::any_of(program_.begin(), program_.end(), [&](const Step& step) {
    return (step.op == Op::function || step.op == Op::map) && static_cast<std::size_t>(step.index) == i;
  });
}

}  // namespace costate
