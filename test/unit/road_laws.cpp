// Shapes of roads against sums and formulas written out here.
#include "costate/kind/road/road_laws.h"

#include <unistd.h>

#include <catch2/catch.hpp>
#include <cmath>
#include <complex>
#include <fstream>
#include <numeric>

#include "costate/base/error.h"

using namespace costate;
using Catch::Contains;

namespace {

constexpr double kPi = 3.14159265358979323846;

std::vector<double> values(const LawOptions& o) {
  std::vector<double> p;
  for (const auto& [key, x] : o.numbers) p.push_back(x);
  return p;
}

double value(const LawOptions& o, double x) { return o.law->value(x, values(o).data()); }

/// d^k/dx^k, k <= 4, through the scalar that carries four: path duals with a direction.
std::array<double, 5> derivatives(const LawOptions& o, double x) {
  const auto p = values(o);
  std::vector<DirectedPathDual> pp(p.begin(), p.end());
  DirectedPathDual y(PathDual(Taylor2(x, 1, 0)));
  y.v.d[0] = y.d[0].v = Taylor2(1.0);  // two directions, both along x
  const DirectedPathDual r = o.law->value(y, pp.data());
  return {r.v.v.c0, r.v.v.c1, r.v.v.c2, r.v.d[0].c2, r.d[0].d[0].c2};
}

const SineSumLaw& sum_law(const LawOptions& o) { return dynamic_cast<const SineSumLaw&>(*o.law); }

}  // namespace

TEST_CASE("road laws: the sum of sines is the sum, with all its derivatives") {
  SpectrumOptions spectrum;
  spectrum.count = 401;  // not a whole number of groups
  spectrum.seed = 7;
  const LawOptions o = sine_sum_law(64e-6, spectrum);
  const SineSumLaw& law = sum_law(o);
  for (const double x : {0.0, 0.3, -17.0, 250.0}) {
    std::array<double, 5> expected{}, size{};
    for (int i = 0; i < 401; ++i) {
      const double w = 2 * kPi * law.wave_number(i), A = 8e-3 * law.unit_amplitude(i);
      const std::complex<double> e = A * std::polar(1.0, w * x + law.phase(i));
      std::complex<double> factor = 1;
      for (std::size_t k = 0; k < 5; ++k) {
        expected[k] += (e * factor).imag();
        size[k] += std::abs(A * factor);
        factor *= std::complex<double>(0, w);
      }
    }
    const auto found = derivatives(o, x);
    // A rotation by the angle 2 pi n x, up to 4e3 rad at 250 m, 100 times: 4e3 eps + 100 eps.
    for (std::size_t k = 0; k < 5; ++k) CHECK(std::abs(found[k] - expected[k]) <= 2e-12 * size[k]);
    CHECK(value(o, x) == Approx(found[0]).margin(1e-15));
  }
}

TEST_CASE("road laws: ISO 8608 has the spectrum and the height that it should") {
  // rms heights of classes A to H in the band 0.011 to 2.83 1/m: sqrt of the integral of G_d (n/0.1)^-2,
  // which for class A is 16e-6 0.01 (1/0.011 - 1/2.83).
  for (char c = 'A'; c <= 'H'; ++c) {
    SpectrumOptions spectrum;
    spectrum.count = 20000;
    const LawOptions o = sine_sum_law(iso8608_roughness(c), spectrum);
    const SineSumLaw& law = sum_law(o);
    double square = 0;
    for (int i = 0; i < spectrum.count; ++i) square += o.numbers[0].second * std::pow(law.unit_amplitude(i), 2) / 2;
    const double expected = std::sqrt(std::ldexp(16e-6, 2 * (c - 'A')) * 0.01 * (1 / 0.011 - 1 / 2.83));
    // Midpoints of n^-2: the sum is short by dn^2 / 24 times the difference of the slopes at the ends (the
    // first term of Euler and Maclaurin), here 1.4e-5 of the integral, half of that in the root. The next one
    // is of its square.
    const double dn = (2.83 - 0.011) / spectrum.count,
                 short_by = dn * dn / 24 * (std::pow(0.011, -3) - std::pow(2.83, -3)) / (1 / 0.011 - 1 / 2.83);
    CHECK(std::sqrt(square) == Approx(expected * (1 - short_by)).epsilon(1e-8));
    if (c == 'A') CHECK(expected == Approx(0.0038064310637368762).epsilon(1e-14));
    if (c == 'H') CHECK(expected == Approx(0.48722317615832016).epsilon(1e-14));
    // Each amplitude is that of the density: A^2 / 2 = G(n) dn.
    for (const int i : {0, 17, 19999}) {
      const double n = law.wave_number(i), G = iso8608_roughness(c) * std::pow(n / 0.1, -2.0);
      CHECK(n == Approx(0.011 + (i + 0.5) * dn));
      CHECK(o.numbers[0].second * std::pow(law.unit_amplitude(i), 2) / 2 == Approx(G * dn).epsilon(1e-13));
    }
  }
  // The realisation itself: with n_min = 2.5 dn all wave numbers are multiples of dn, over 1/dn the sines are
  // orthogonal and the mean square is the sum exactly; 4096 samples resolve products of waves up to 402 dn.
  SpectrumOptions spectrum;
  spectrum.n_min = 0.0125;
  spectrum.n_max = 2.0125;
  const LawOptions o = sine_sum_law(16e-6, spectrum);
  double square = 0, expected = 0;
  const double dn = 0.005;
  for (int i = 0; i < 400; ++i) expected += 16e-6 * std::pow(sum_law(o).unit_amplitude(i), 2) / 2;
  for (int k = 0; k < 4096; ++k) square += std::pow(value(o, k / (4096 * dn)), 2) / 4096;
  CHECK(square == Approx(expected).epsilon(1e-10));
}

TEST_CASE("road laws: noise is white or red, and a seed tells realisations apart") {
  SpectrumOptions white;
  white.exponent = 0;
  white.count = 10;
  const LawOptions o = sine_sum_law(2e-6, white);
  CHECK(sum_law(o).unit_amplitude(0) == Approx(sum_law(o).unit_amplitude(9)));
  CHECK(sum_law(o).unit_amplitude(0) == Approx(std::sqrt(2 * (2.83 - 0.011) / 10)));
  SpectrumOptions other = white;
  other.seed = 2;
  CHECK(value(o, 1.0) == value(sine_sum_law(2e-6, white), 1.0));
  CHECK(value(o, 1.0) != value(sine_sum_law(2e-6, other), 1.0));
  // The first number of mt19937 with seed 1 is 1791095845 (the generator's definition): the same on every
  // machine.
  CHECK(sum_law(o).phase(0) == Approx(2 * kPi * 1791095845.0 / 4294967296.0).epsilon(1e-15));
}

TEST_CASE("road laws: bumps and a sweep") {
  BumpOptions b;
  b.start_m = 0.97;
  b.length_m = 5;
  const LawOptions one = bump_law(b);
  for (const double x : {0.0, 0.97, 1.5, 3.47, 5.9, 5.97, 8.0})
    CHECK(value(one, x) ==
          Approx(x > 0.97 && x < 5.97 ? 0.1 * (1 - std::cos(2 * kPi * (x - 0.97) / 5)) : 0).margin(1e-15));
  b.count = 3;
  b.spacing_m = 7;
  const LawOptions three = bump_law(b);
  for (const double x : {0.5, 2.0, 6.5, 9.0, 14.0, 16.0, 21.0, 23.0, 40.0})
    CHECK(value(three, x) == Approx(value(one, x) + value(one, x - 7) + value(one, x - 14)).margin(1e-15));
  b = {};
  b.half_sine = true;
  CHECK(value(bump_law(b), 0.3) == Approx(0.1 * std::sin(0.3 * kPi)));
  CHECK(value(bump_law(b), 1.1) == 0);

  SineSweepOptions s;
  s.amplitude_m = 0.02;
  s.start_m = 1;
  s.length_m = 10;
  s.n_start_1_per_m = 0.1;
  s.n_end_1_per_m = 0.6;
  const LawOptions sweep = sine_sweep_law(s);
  CHECK(value(sweep, 0.9) == 0);
  // The phase is the integral of the wave number: 0.1 y + 0.025 y^2 up to 10, then 3.5 + 0.6 (y - 10).
  CHECK(value(sweep, 5) == Approx(0.02 * std::sin(2 * kPi * (0.4 + 0.4))));
  CHECK(value(sweep, 13) == Approx(0.02 * std::sin(2 * kPi * (3.5 + 1.2))).margin(1e-15));
  CHECK(value(sweep, 11 - 1e-9) == Approx(value(sweep, 11 + 1e-9)).margin(1e-9));
}

TEST_CASE("road laws: a table is the natural spline of the law 'table'") {
  const std::vector<double> x = {-1, 0.5, 1, 2.5, 4}, z = {0, 0.1, -0.05, 0.2, 0.1};
  const LawOptions spline = table_law(x, z), profile = profile_table_law(x, z, 2);
  for (const double at : {-3.0, -1.0, 0.0, 0.5, 0.7, 2.0, 3.9, 4.0, 6.0}) {
    const auto p = values(spline);
    const Taylor2 expected = spline.law->curve(at, p.data()), found = profile.law->curve(at, values(profile).data());
    CHECK(found.c0 == Approx(2 * expected.c0).margin(1e-14));
    CHECK(found.c1 == Approx(2 * expected.c1).margin(1e-14));
    CHECK(found.c2 == Approx(2 * expected.c2).margin(1e-13));
  }
  const auto file = std::string("road_profile_") + std::to_string(getpid()) + ".csv";
  const auto read = [&](const std::string& text) -> std::string {
    std::ofstream(file) << text;
    try {
      const LawOptions o = profile_table_law(file);
      std::remove(file.c_str());
      return std::to_string(value(o, 1));
    } catch (const Error& e) {
      std::remove(file.c_str());
      return e.what();
    }
  };
  CHECK(read("# x, z\n0, 0.1\r\n2; 0.3  # end\n\n") == "0.200000");
  CHECK(read("0 0\n1 a\n") == file + ":2:1: Expected two numbers, x and z in m, found 'a'.");
  CHECK(read("0 0\n1\n") == file + ":2:1: Expected two numbers, x and z in m, found 1.");
  CHECK(read("0 0\n1 1\n1 2\n") == file + ":3:1: The distances must increase, found 1 after 1.");
  CHECK_THAT(read("0 0\n"), Contains("A road profile needs at least 2 points, found 1."));
}
