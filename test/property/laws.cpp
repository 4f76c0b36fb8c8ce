// Every registered kind of law, by its example: the ways to evaluate it agree, derivatives equal differences,
// and the stored energy is the integral.
#include <catch2/catch.hpp>

#include "costate/kind/law/law_table.h"
#include "costate/scene/toml_reader.h"

using namespace costate;

namespace {

struct ExampleLaw {
  std::shared_ptr<const ScalarLaw> law;
  std::vector<double> p;
  double value(double x) const { return law->value(x, p.data()); }
};

ExampleLaw read_example(const LawKind& kind) {
  const SceneNode root = read_toml("law = " + kind.example, "example of " + kind.name);
  SceneTable table(root);
  const LawOptions o = read_law(table, "law");
  table.finish();
  ExampleLaw e{o.law, {}};
  for (const auto& [key, value] : o.numbers) e.p.push_back(value);
  return e;
}

/// The derivative by differences of two widths, extrapolated: truncation h^4 f^(5), rounding eps |f| / h.
template <class F>
double difference(const F& f, double h) {
  const double wide = (f(h) - f(-h)) / (2 * h), narrow = (f(h / 2) - f(-h / 2)) / h;
  return (4 * narrow - wide) / 3;
}

template <class Check>
void for_each_law(const Check& check) {
  REQUIRE(law_kinds().size() >= 5);
  for (const LawKind& kind : law_kinds()) {
    INFO("law " << kind.name);
    const ExampleLaw e = read_example(kind);
    REQUIRE(static_cast<int>(e.p.size()) == e.law->number_count());
    // Points of no meaning to any example, so that none is a break.
    for (int i = 0; i <= 40; ++i) {
      const double x = -1.4871 + 2.9913 * i / 40;
      INFO("x = " << x);
      check(e, x);
    }
  }
}

/// Relative to values of the size of the law's own terms at |x| < 1.5 (the piecewise example's reach 2e6).
double allowed(const ExampleLaw& e, double relative) {
  double size = 1;
  for (const double p : e.p) size = std::max(size, std::abs(p));
  return relative * size;
}

}  // namespace

TEST_CASE("every law: the ways to evaluate agree", "[law]") {
  for_each_law([](const ExampleLaw& e, double x) {
    const std::vector<PathDual> p(e.p.begin(), e.p.end());
    const std::vector<DirectedPathDual> dp(e.p.begin(), e.p.end());
    const double f = e.value(x), rounding = allowed(e, 1e-13);
    const Dual<1> slope = e.law->slope(x, e.p.data());
    const Taylor2 curve = e.law->curve(x, e.p.data());
    const PathDual path = e.law->value(PathDual(Taylor2(x, 1, 0)), p.data());
    DirectedPathDual directed_x(x);
    directed_x.v.v.c1 = 1;
    directed_x.d[0] = PathDual(1.0);
    const DirectedPathDual directed = e.law->value(directed_x, dp.data());
    REQUIRE(slope.v == Approx(f).margin(rounding));
    REQUIRE(curve.c0 == Approx(f).margin(rounding));
    REQUIRE(path.v.c0 == Approx(f).margin(rounding));
    REQUIRE(slope.d[0] == Approx(curve.c1).epsilon(1e-12).margin(rounding));
    REQUIRE(path.v.c1 == Approx(curve.c1).epsilon(1e-12).margin(rounding));
    REQUIRE(path.v.c2 == Approx(curve.c2).epsilon(1e-12).margin(10 * rounding));
    REQUIRE(directed.v.v.c0 == Approx(f).margin(rounding));
    REQUIRE(directed.d[0].v.c0 == Approx(curve.c1).epsilon(1e-12).margin(rounding));
    REQUIRE(directed.d[0].v.c1 == Approx(curve.c2).epsilon(1e-12).margin(10 * rounding));
  });
}

TEST_CASE("every law: slopes, curvatures and derivatives by numbers equal differences", "[law]") {
  // h = 2e-4: truncation below 1e-13 times the fifth derivative, rounding 1e-16 / h = 1e-12 of the terms.
  constexpr double h = 2e-4, relative = 1e-9;
  for_each_law([&](const ExampleLaw& e, double x) {
    const Taylor2 curve = e.law->curve(x, e.p.data());
    REQUIRE(curve.c1 ==
            Approx(difference([&](double s) { return e.value(x + s); }, h)).epsilon(1e-8).margin(allowed(e, relative)));
    REQUIRE(curve.c2 == Approx(difference([&](double s) { return e.law->slope(x + s, e.p.data()).d[0]; }, h))
                            .epsilon(1e-8)
                            .margin(allowed(e, 10 * relative)));
    for (std::size_t k = 0; k < e.p.size(); ++k) {
      std::vector<PathDual> p(e.p.begin(), e.p.end());
      p[k].d[0] = Taylor2(1.0);
      const PathDual d = e.law->value(PathDual(Taylor2(x, 0.8, -0.5)), p.data());
      const auto changed = [&](double s) {
        std::vector<PathDual> q(e.p.begin(), e.p.end());
        q[k] += PathDual(s);
        return e.law->value(PathDual(Taylor2(x, 0.8, -0.5)), q.data()).v;
      };
      CAPTURE(k);
      REQUIRE(d.d[0].c0 == Approx(difference([&](double s) { return changed(s).c0; }, h)).margin(allowed(e, relative)));
      REQUIRE(d.d[0].c1 == Approx(difference([&](double s) { return changed(s).c1; }, h)).margin(allowed(e, relative)));
      REQUIRE(d.d[0].c2 ==
              Approx(difference([&](double s) { return changed(s).c2; }, h)).margin(allowed(e, 100 * relative)));
    }
  });
}

TEST_CASE("every law: the stored energy is the integral from 0", "[law]") {
  for_each_law([](const ExampleLaw& e, double x) {
    const auto energy = [&](double s) { return e.law->integral(x + s, e.p.data()); };
    REQUIRE(e.law->integral(0, e.p.data()) == 0);
    // Gauss-Legendre on 16 pieces, unless a law has its own: exact for smooth laws; a piece with a joint in
    // it, where the third derivative jumps, is off by about 1e-7.
    REQUIRE(difference(energy, 2e-3) == Approx(e.value(x)).epsilon(1e-6).margin(allowed(e, 1e-9)));
  });
}
