// Numbers to the digits that are known. psi and its gradient are results of a run with a tolerance: text shows no more
// digits than that tolerance can hold, or than an estimate of the error leaves. JSON keeps full doubles, -0 apart.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate::app {

/// `value` as it is printed among numbers as large as `size` that it may be made of: below 1e-14 of them, some fifty
/// units in their last place, it is what rounding leaves of a zero, and 0. So is -0.
double shown(double value, double size = 0);

/// `value` rounded to the first digit of `uncertainty`, zeros at the end included: 0.7268777 for 0.72687767 and 3e-7;
/// never less than one digit nor more than 15; 0 below a millionth of the uncertainty, which of a relative 1e-8 is
/// rounding. Without an uncertainty (0) 12 digits.
std::string known_digits(double value, double uncertainty);

/// What a run's psi and gradient can hold at best: an integrator keeps the error of each of its steps below rtol.
struct Precision {
  double relative = 0;  // of psi, and of the gradient's largest scaled component
  std::string note;     // where that comes from
  std::string run;      // "rtol 1e-08", "1000 steps of 0.005 s"
};
/// Fixed steps are chosen, unless given, so that the integral is within 0.1 sqrt(rtol) of psi; psi and its gradient are
/// exact for the steps themselves.
Precision precision_of(const SolverOptions& solver, const std::string& integrator, long steps);

/// The largest digit that is not known: rounding at it leaves -log10(relative) digits.
double uncertainty_of(double value, double relative);
/// The same for each component of a gradient, relative to the largest scaled one.
std::vector<double> gradient_uncertainty(const std::vector<double>& gradient, const ParameterSelection& parameters,
                                         double relative);

/// "psi = 0.72687768 (...)" with the note, or with the estimated error: that which was asked for, or what the run knows
/// besides (KnownError) where that is more than the tolerance's last digit.
std::string psi_text(double psi, const Precision& precision, std::optional<double> estimate,
                     const std::optional<KnownError>& known = {});

/// What is shown of a gradient: the errors (empty where none are known beyond the tolerance's digits), and the first
/// digit of each component that is not known. `errors`: asked for, or the method's own, or empty.
struct GradientDigits {
  std::vector<double> errors, unknown;
};
GradientDigits gradient_digits(const std::vector<double>& gradient, const ParameterSelection& parameters,
                               double relative, const std::vector<double>& errors,
                               const std::optional<KnownError>& known = {});

/// The larger of both; of what is known alone that.
std::optional<double> psi_error_of(std::optional<double> estimate, const std::optional<KnownError>& known);
std::vector<double> gradient_error_of(std::vector<double> errors, const std::optional<KnownError>& known);

}  // namespace costate::app
