// Every registered kind of law tells the places where it changes, so that no step passes over one.

#include <algorithm>
#include <catch2/catch.hpp>
#include <cmath>

#include "costate/element/course.h"
#include "costate/kind/law/law_table.h"
#include "costate/scene/toml_reader.h"

using namespace costate;

TEST_CASE("late laws: every registered kind of law is met where it changes", "[late][law]") {
  // A stepper that sees nothing and takes all that it may: between two of its places a straight line must show what the
  // law does, to most of what it changes nearby. A new kind that does not tell its places is searched; one that tells
  // too little fails here.
  constexpr double from = -40, to = 60;
  for (const LawKind& kind : law_kinds()) {
    INFO("law " << kind.name);
    const SceneNode root = read_toml("law = " + kind.example, "example of " + kind.name);
    SceneTable table(root);
    const LawOptions o = read_law(table, "law");
    std::vector<double> p;
    for (const auto& [key, value] : o.numbers) p.push_back(value);
    Course course(from, to);
    course.add(*o.law, p.data());
    course.finish();
    double hidden = 0, size = 0;
    long steps = 0;
    for (double x = from; x < to; ++steps) {
      REQUIRE(steps < 20000);
      const double end = std::min(to, course.bound(x, false).end);
      REQUIRE(end > x);
      const double a = o.law->value(x, p.data()), b = o.law->value(end, p.data());
      double low = std::min(a, b), high = std::max(a, b), off = 0;
      for (int k = 1; k < 40; ++k) {
        const double s = k / 40.0, f = o.law->value(x + s * (end - x), p.data());
        low = std::min(low, f);
        high = std::max(high, f);
        off = std::max(off, std::abs(f - a - s * (b - a)));
      }
      size = std::max(size, high - low);
      // A bow that leaves the line by as much as it rises is met; a pulse within is not.
      if (high - std::max(a, b) > 0 || std::min(a, b) - low > 0)
        hidden = std::max(hidden, std::max(high - std::max(a, b), std::min(a, b) - low));
      x = end;
    }
    INFO(steps << " steps, hidden " << hidden << " of " << size);
    CHECK(hidden <= 0.6 * size);
    // And the same places are met on the way back.
    for (double x = to; x > from;) {
      const double end = std::max(from, course.bound(x, true).end);
      REQUIRE(end < x);
      x = end;
    }
  }
}
