// Parameter identification: parameters that bring the outputs of runs to measured samples ([[cost.samples]]), by
// Levenberg and Marquardt's method on the residuals' exact tangents, and how well the data tell them (lib/README.md
// (20)).
#pragma once

#include <Eigen/Core>
#include <functional>
#include <string>
#include <vector>

#include "costate/problem/problem.h"

namespace costate {

/// The residuals sqrt(weight) (y - measured)/sigma of one run at its samples, and their derivatives.
struct SampleResiduals {
  /// Of each residual the term of the cost it belongs to, "cost.samples[0]", and its time [s].
  std::vector<std::string> terms;
  std::vector<double> times;
  Eigen::VectorXd r;
  Eigen::MatrixXd r_rho;  // an entry of r by a parameter; empty unless wanted
  Counters counters;
};

/// By forward sensitivities on the problem's own integrator. Throws CapabilityError where the cost is not of samples
/// alone, or the integrator has no tangents (fixed steps).
SampleResiduals sample_residuals(const Problem& problem, const std::vector<double>& rho, bool derivatives);

struct FitOptions {
  int max_iterations = 50;
  double tolerance = 1e-10;  // of the sum of squares and of the parameters, between iterations
  double confidence = 0.95;
  bool sigma_from_residuals = false;  // the given sigmas are weights; how large errors are, the residuals say
};

/// Told of each evaluation: its number, the sum of squares, the parameters.
using FitSink = std::function<void(int evaluation, double chi_square, const std::vector<double>& rho)>;

struct FittedParameter {
  std::string name;
  double start = 0, value = 0, lower = 0, upper = 0, scale = 1;
  bool at_bound = false, identified = true;
  double standard_error = 0;                          // NaN where there is none
  double confidence_lower = 0, confidence_upper = 0;  // NaN where there is none; with integration_error
  double integration_error = 0;  // by how much the integrator's errors move it, by the farther of two runs, and the
                                 // search's next step
};

struct FitResult {
  std::vector<FittedParameter> parameters;
  Eigen::MatrixXd covariance, correlation;  // of all parameters; NaN for those that are at a bound or not identified
  double start_chi_square = 0, chi_square = 0;
  int residuals = 0, degrees_of_freedom = 0, iterations = 0, evaluations = 0, failed_evaluations = 0;
  bool converged = false;
  std::string termination;  // a sentence
  /// Whether the data tell the parameters, in words; empty where nothing is to be said.
  std::vector<std::string> identifiability;
  /// Root mean squares of the residuals, in sigmas.
  struct Set {
    std::size_t problem;
    std::string term;
    int count;
    double start_rms, rms;
    std::vector<double> times = {}, residuals = {};  // at the solution
  };
  std::vector<Set> sets;
  Counters counters;
};

/// Several problems are fitted at once: parameters of one name are one and the same. Bounds are those of the
/// parameters.
FitResult fit(const std::vector<Problem>& problems, const FitOptions& options, const FitSink& sink = {});

/// What the residuals' tangents say of the parameters at the solution: fills covariance, correlation, intervals and
/// words. `others`: residuals there, and tangents of the first, with other errors of integration.
void judge_fit(const SampleResiduals& at, const std::vector<SampleResiduals>& others, const FitOptions& options,
               FitResult& result);

/// t such that |T| < t with this probability, of Student's distribution; of the normal one for 0 degrees of freedom.
double two_sided_quantile(double probability, int degrees_of_freedom);

}  // namespace costate
