#include "costate/kind/road/road_laws.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <sstream>

#include "costate/base/error.h"
#include "costate/base/notice.h"
#include "costate/base/text_file.h"
#include "costate/kind/law/law_table.h"
#include "costate/scene/scene_files.h"

namespace costate {

namespace {
constexpr std::size_t kLongestFile = 256 << 20;  // bytes
constexpr int kMostParts = 100000;               // of a sum of sines, or bumps

int read_count(SceneTable& t, int otherwise) {
  const int count = t.whole_number("count", otherwise);
  if (count > kMostParts) t.fail("count", fmt::format("must not be above {}, found {}.", kMostParts, count));
  return count;
}

void positive(const char* key, double x) {
  if (!(x > 0)) throw ModelError("", fmt::format("'{}' must be positive, found {}.", key, x));
}
}  // namespace

LawOptions bump_law(const BumpOptions& o) {
  positive("length_m", o.length_m);
  if (o.count < 1) throw ModelError("", fmt::format("'count' must be at least 1, found {}.", o.count));
  if (o.count > 1 && !(o.spacing_m >= o.length_m))
    throw ModelError("", fmt::format("'spacing_m' counts from one start to the next and must not be less than length_m "
                                     "= {}, found {}.",
                                     o.length_m, o.spacing_m));
  LawOptions law{std::make_shared<BumpLaw>(o.count, o.half_sine),
                 {{"height_m", o.height_m}, {"start_m", o.start_m}, {"length_m", o.length_m}}};
  if (o.count > 1) law.numbers.emplace_back("spacing_m", o.spacing_m);
  return law;
}

LawOptions sine_sweep_law(const SineSweepOptions& o) {
  positive("length_m", o.length_m);
  return {std::make_shared<SineSweepLaw>(),
          {{"amplitude_m", o.amplitude_m},
           {"start_m", o.start_m},
           {"length_m", o.length_m},
           {"n_start_1_per_m", o.n_start_1_per_m},
           {"n_end_1_per_m", o.n_end_1_per_m}}};
}

LawOptions sine_sum_law(double roughness_m3, const SpectrumOptions& spectrum) {
  positive("roughness_m3", roughness_m3);
  return {std::make_shared<SineSumLaw>(spectrum), {{"roughness_m3", roughness_m3}}};
}

double iso8608_roughness(char road_class) {
  if (road_class < 'A' || road_class > 'H')
    throw ModelError("", fmt::format("A class of ISO 8608 is a letter from A to H, found '{}'.", road_class));
  return std::ldexp(16e-6, 2 * (road_class - 'A'));
}

LawOptions profile_table_law(std::vector<double> x_m, std::vector<double> z_m, double scale) {
  return {std::make_shared<ProfileTableLaw>(std::move(x_m), std::move(z_m)), {{"scale", scale}}};
}

LawOptions profile_table_law(const std::string& file, double scale) {
  std::istringstream in(read_text_file(file, kLongestFile, "This road profile, whose path is relative to the scene,"));
  std::vector<double> x, z;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    line.resize(std::min(line.size(), line.find('#')));
    std::replace_if(
        line.begin(), line.end(), [](char c) { return c == ',' || c == ';' || c == '\r'; }, ' ');
    std::istringstream words(line);
    std::string word;
    std::vector<double> values;
    while (words >> word) {
      if (!read_number(word, values.emplace_back()))
        throw SceneError({file, number, 1}, fmt::format("Expected two numbers, x and z in m, found '{}'.", word));
    }
    if (values.empty()) continue;
    if (values.size() != 2)
      throw SceneError({file, number, 1}, fmt::format("Expected two numbers, x and z in m, found {}.", values.size()));
    if (!x.empty() && !(values[0] > x.back()))
      throw SceneError({file, number, 1},
                       fmt::format("The distances must increase, found {} after {}.", values[0], x.back()));
    x.push_back(values[0]);
    z.push_back(values[1]);
  }
  if (x.size() < 2)
    throw SceneError({file, 0, 0}, fmt::format("A road profile needs at least 2 points, found {}.", x.size()));
  return profile_table_law(std::move(x), std::move(z), scale);
}

namespace {

/// Even bands that are wider than the spectrum's long waves leave these out, which have most of its variance.
void tell_missing_variance(const SceneTable& t, const SpectrumOptions& o) {
  constexpr double kMissed = 0.2;
  const double w = o.exponent, dn = (o.n_max - o.n_min) / o.count;
  if (!(dn > 0)) return;
  const double whole =
      w == 1 ? std::log(o.n_max / o.n_min) : (std::pow(o.n_max, 1 - w) - std::pow(o.n_min, 1 - w)) / (1 - w);
  double sum = 0;
  for (int i = 0; i < o.count; ++i) sum += std::pow(o.n_min + (i + 0.5) * dn, -w) * dn;
  if (std::abs(sum - whole) <= kMissed * whole) return;
  notice(
      fmt::format("{}: {} sine waves, {:.3g} 1/m apart, have {:.3g} of the variance of the spectrum from {:g} to {:g} "
                  "1/m; the longest is one of {:.3g} 1/m. Take a larger n_min_1_per_m, a smaller n_max_1_per_m or a "
                  "larger count.",
                  t.path(), o.count, dn, sum / whole, o.n_min, o.n_max, o.n_min + 0.5 * dn));
}

SpectrumOptions read_spectrum(SceneTable& t, double exponent) {
  SpectrumOptions o;
  o.exponent = exponent;
  o.n_min = t.value("n_min_1_per_m", NumberRule::positive, o.n_min);
  o.n_max = t.value("n_max_1_per_m", NumberRule::positive, o.n_max);
  o.count = read_count(t, o.count);
  o.seed = static_cast<std::uint32_t>(t.whole_number("seed", static_cast<int>(o.seed)));
  if (o.count > 1) tell_missing_variance(t, o);  // one is a wave of its own
  return o;
}

const RegisterLawKind bump(
    {.name = "bump",
     .summary = "height_m (1 - cos(2 pi (x - start_m) / length_m)) over length_m, count times",
     .example = R"({ kind = "bump", height_m = 0.1, start_m = -1.5, length_m = 5, count = 2, spacing_m = 8 })",
     .read = [](SceneTable& t) {
       BumpOptions o;
       o.height_m = t.value("height_m");
       o.start_m = t.value("start_m", NumberRule::any, 0);
       o.length_m = t.value("length_m", NumberRule::positive);
       o.count = read_count(t, 1);
       if (o.count > 1) o.spacing_m = t.value("spacing_m", NumberRule::positive);
       o.half_sine = t.one_of("shape", {"cosine", "half_sine"}, "cosine") == "half_sine";
       return bump_law(o);
     }});

const RegisterLawKind sine_sweep(
    {.name = "sine_sweep",
     .summary = "amplitude_m sin(...) with wave numbers from n_start_1_per_m to n_end_1_per_m over length_m",
     .example =
         R"({ kind = "sine_sweep", amplitude_m = 0.01, start_m = -4, length_m = 20, n_start_1_per_m = 0.1, n_end_1_per_m = 0.5 })",
     .read = [](SceneTable& t) {
       SineSweepOptions o;
       o.amplitude_m = t.value("amplitude_m");
       o.start_m = t.value("start_m", NumberRule::any, 0);
       o.length_m = t.value("length_m", NumberRule::positive);
       o.n_start_1_per_m = t.value("n_start_1_per_m", NumberRule::non_negative);
       o.n_end_1_per_m = t.value("n_end_1_per_m", NumberRule::non_negative);
       return sine_sweep_law(o);
     }});

const RegisterLawKind iso8608(
    {.name = "iso8608",
     .summary = "a road of ISO 8608 class A to H (or roughness_m3), a sum of sines with phases from a seed",
     .example =
         R"({ kind = "iso8608", roughness_m3 = 0.5, seed = 3, count = 21, n_min_1_per_m = 0.4, n_max_1_per_m = 0.8 })",
     .read = [](SceneTable& t) {
       // A varied roughness is written beside the class and stands over it.
       double g = 0;
       if (t.has("class")) g = iso8608_roughness(t.one_of("class", {"A", "B", "C", "D", "E", "F", "G", "H"})[0]);
       if (t.has("roughness_m3")) g = t.value("roughness_m3", NumberRule::positive);
       if (g == 0) t.fail("needs 'class' (A to H) or 'roughness_m3' (G at 0.1 1/m).");
       return sine_sum_law(g, read_spectrum(t, 2));
     }});

const RegisterLawKind noise(
    {.name = "noise",
     .summary = "a sum of sines with the spectral density roughness_m3 (n / 0.1)^-exponent",
     .example =
         R"({ kind = "noise", roughness_m3 = 0.4, exponent = 1.5, n_min_1_per_m = 0.4, n_max_1_per_m = 0.8, count = 8, seed = 5 })",
     .read = [](SceneTable& t) {
       const double exponent = t.value("exponent", NumberRule::non_negative);
       const double g = t.value("roughness_m3", NumberRule::positive);
       return sine_sum_law(g, read_spectrum(t, exponent));
     }});

const RegisterLawKind profile_table(
    {.name = "profile_table",
     .summary = "scale times the spline through many points, x_m and z_m or two columns of a file",
     .example = R"({ kind = "profile_table", x_m = [-3, -1, 1, 3], z_m = [0, 0.03, 0.05, 0.06] })",
     .read = [](SceneTable& t) {
       const double scale = t.value("scale", NumberRule::any, 1);
       if (!t.has("file")) {
         const auto x = t.values("x_m");
         return profile_table_law(x, t.values("z_m"), scale);
       }
       return read_named_file(t, "file", [&](const std::string& file) { return profile_table_law(file, scale); });
     }});

}  // namespace

}  // namespace costate
