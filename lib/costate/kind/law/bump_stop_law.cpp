#include "costate/kind/law/bump_stop_law.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "costate/base/error.h"
#include "costate/element/course.h"
#include "costate/kind/law/law_table.h"

namespace costate {

namespace {

/// The integral of ramp^exponent from where it starts to the depth d: by Gauss-Legendre in the smoothed part,
/// where the integrand is a power of a polynomial, in closed form beyond.
double stored(double d, double exponent, double width) {
  if (d <= -0.5 * width) return 0;
  static constexpr double node[5] = {0.1488743389816312, 0.4333953941292472, 0.6794095682990244, 0.8650633666889845,
                                     0.9739065285171717};
  static constexpr double weight[5] = {0.2955242247147529, 0.2692667193099963, 0.2190863625159820, 0.1494513491505806,
                                       0.0666713443086881};
  const double end = std::min(1.0, width > 0 ? d / width + 0.5 : 0.0);
  double sum = 0;
  if (width > 0) {
    constexpr int pieces = 8;
    const double h = end / pieces;
    for (int k = 0; k < pieces; ++k)
      for (int i = 0; i < 5; ++i)
        for (int sign = -1; sign <= 1; sign += 2) {
          const double s = h * (k + 0.5 + 0.5 * sign * node[i]);
          sum += 0.5 * h * width * weight[i] * std::pow(width * s * s * s * (1 - 0.5 * s), exponent);
        }
  }
  const double from = 0.5 * width;
  if (d > from) sum += (std::pow(d, exponent + 1) - std::pow(from, exponent + 1)) / (exponent + 1);
  return sum;
}

}  // namespace

void BumpStopLaw::add_places(const double* p, LawPlaces& places) const {
  places.sharp.insert(places.sharp.end(), {p[0] - 0.5 * p[3], p[0] + 0.5 * p[3]});
}

double BumpStopLaw::integral(double x, const double* p) const {
  // F = sign k ramp(sign (x - gap))^e, so that dF's integral over x is k times that over the depth.
  return p[1] * (stored(sign_ * (x - p[0]), p[2], p[3]) - stored(-sign_ * p[0], p[2], p[3]));
}

LawOptions bump_stop_law(double gap, double stiffness, double exponent, double smoothing, StopSide side) {
  if (!(stiffness >= 0)) throw ModelError("", fmt::format("'stiffness' must not be negative, found {}.", stiffness));
  if (!(exponent >= 1)) throw ModelError("", fmt::format("'exponent' must be 1 or more, found {}.", exponent));
  if (!(smoothing >= 0)) throw ModelError("", fmt::format("'smoothing' must not be negative, found {}.", smoothing));
  if (exponent == 1 && smoothing == 0)
    throw ModelError("",
                     "A stop with exponent 1 has a kink where contact starts: give a width 'smoothing' over which it "
                     "is rounded, small against the depths that occur, or an exponent above 1.");
  return {std::make_shared<BumpStopLaw>(side),
          {{"gap", gap}, {"stiffness", stiffness}, {"exponent", exponent}, {"smoothing", smoothing}}};
}

namespace {

const RegisterLawKind bump_stop_law_registered(
    {.name = "bump_stop",
     .summary = "no force before x falls below 'gap', -stiffness (gap - x)^exponent beyond, rounded over "
                "'smoothing'",
     .example = R"({ kind = "bump_stop", gap = 0.3, stiffness = 70, exponent = 1.5, smoothing = 0.4 })",
     .read = [](SceneTable& t) {
       const double gap = t.value("gap"), stiffness = t.value("stiffness");
       const double exponent = t.value("exponent", NumberRule::any, 1);
       const double smoothing = t.value("smoothing", NumberRule::any, 0);
       const bool below = t.one_of("side", {"below", "above"}, "below") == "below";
       return bump_stop_law(gap, stiffness, exponent, smoothing, below ? StopSide::below : StopSide::above);
     }});

}  // namespace

}  // namespace costate
