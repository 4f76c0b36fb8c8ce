#include "costate/optimize/certificate_verdict.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

namespace costate {

namespace {
// Newton's step to a minimum, in scaled parameters, up to which it is taken for reached.
constexpr double kNewton = 1e-2;
// An eigenvalue that counts as zero is no rounding where it is this many times its error, and this part of the
// tolerance.
constexpr double kOfItsError = 100, kOfTolerance = 1e-6;
}  // namespace

void judge(Certificate& c, bool curvature) {
  using Kind = Certificate::Kind;
  const std::string residual = fmt::format("the KKT residual is {:.3g}, {} {:.3g}", c.kkt_residual,
                                           c.kkt_residual <= c.tolerance ? "within" : "above", c.tolerance);
  if (!c.violated.empty()) {
    std::vector<std::string> by;
    for (const auto& [name, excess] : c.violated) by.push_back(fmt::format("'{}' by {:.3g}", name, excess));
    c.kind = Kind::not_feasible;
    c.verdict = fmt::format(
        "not feasible: the point exceeds the bound of {}. Either no point within the parameters' bounds meets {}, or "
        "the search ended before it found one: start from another point, widen the bounds, or take a larger 'upper'.",
        fmt::join(by, ", "), by.size() == 1 ? "it" : "them all");
  } else if (!(c.kkt_residual <= c.tolerance)) {
    c.kind = Kind::not_stationary;
    c.verdict = fmt::format(
        "not stationary: {}; more evaluations or a smaller tolerance may go on, unless psi has a kink there (abs, max, "
        "contacts).",
        residual);
  } else if (!curvature && !(c.free.empty() && !c.active.empty())) {
    c.kind = Kind::stationary;
    c.verdict = fmt::format("stationary: {}; of the curvature nothing is known.", residual);
  } else if (c.eigenvalues.empty()) {  // nor is a curvature asked for
    c.kind = Kind::strict_minimum;
    c.verdict = fmt::format("strict local minimum: {}, and bounds and constraints leave no direction free.", residual);
  } else if (c.flat_slope > 0) {
    c.kind = Kind::not_stationary;
    c.verdict = fmt::format(
        "not stationary: psi falls by {:.3g} a scale along a direction in which its second derivative is zero within "
        "{:.3g}; more evaluations or other scales of the parameters may go on.",
        c.flat_slope, c.curvature_tolerance);
  } else if (c.newton_step > kNewton) {
    c.kind = Kind::not_stationary;
    c.verdict = fmt::format(
        "not stationary: Newton's step to the minimum is still {:.3g} of the parameters' scales, psi would "
        "fall by "
        "{:.3g}; more evaluations or a smaller tolerance may go on.",
        c.newton_step, c.predicted_decrease);
  } else if (const double least = c.eigenvalues.front(); least > c.curvature_tolerance) {
    c.kind = Kind::strict_minimum;
    c.verdict = fmt::format("strict local minimum: {}, and the smallest eigenvalue of the Hessian is {}.", residual,
                            known_eigenvalue(c, least));
  } else if (least >= -c.curvature_tolerance) {
    c.kind = Kind::flat;
    const auto zeros =
        std::count_if(c.eigenvalues.begin(), c.eigenvalues.end(), [&](double e) { return e <= c.curvature_tolerance; });
    // Far above its own error it may be one: of a parameter whose scale is far too small.
    const bool small = least > kOfItsError * c.eigenvalue_error && least > kOfTolerance * c.curvature_tolerance;
    c.verdict = fmt::format(
        "stationary, Hessian singular: {} of its {} eigenvalues {} zero within {:.3g}; {}.", zeros,
        c.eigenvalues.size(), zeros == 1 ? "is" : "are", c.curvature_tolerance,
        small ? fmt::format("found as {} or more, a minimum if that is right: scales of the parameters by which the "
                            "eigenvalues are more alike would tell",
                            known_eigenvalue(c, least))
              : "psi is flat that way to second order");
  } else if (c.falls_outward) {
    c.kind = Kind::stationary;
    c.verdict = fmt::format(
        "stationary: {}; the smallest of the Hessian's eigenvalues is {}, but that direction leaves bounds or "
        "constraints that are touched without a multiplier: whether this is a minimum is not known.",
        residual, known_eigenvalue(c, least));
  } else {
    c.kind = Kind::indefinite;
    c.verdict = fmt::format(
        "stationary, Hessian indefinite: the smallest of its eigenvalues is {}; psi falls "
        "along that direction, so this is no minimum.",
        known_eigenvalue(c, least));
  }
}

std::string known_eigenvalue(const Certificate& c, double x) {
  const double error = c.eigenvalue_error,
               digits = error > 0 && x != 0 ? std::floor(std::log10(std::abs(x) / error)) + 1 : 6;
  return fmt::format("{:.{}g}", x, static_cast<int>(std::clamp(digits, 1.0, 6.0)));
}

}  // namespace costate
