// The coefficients of the discrete schemes. Newmark's trapezoidal rule and the generalized-alpha method are one family:
//   q1 = q0 + h v0 + h^2 (1/2 - beta) alpha0 + h^2 beta alpha1,  v1 = v0 + h (1 - gamma) alpha0 + h gamma alpha1,
//   (1 - alpha_m) alpha1 + alpha_m alpha0 = (1 - alpha_f) a1 + alpha_f a0
// for second-order unknowns, and with rates y in the place of alpha
//   z1 = z0 + h (1 - gamma_z) y0 + h gamma_z y1,  (1 - alpha_mz) y1 + alpha_mz y0 = (1 - alpha_fz) f1 + alpha_fz f0
// for force states. Trapezoidal: alpha_m = alpha_f = 0, beta = 1/4, gamma = 1/2, so that alpha = a and y = f.
// Generalized-alpha takes all of them from rho_infinity, the factor by which the fastest oscillations shrink a step
// (Chung and Hulbert 1993; first order: Jansen, Whiting and Hulbert 2000). rho_infinity = 1 is the trapezoidal rule.
#pragma once

#include <string>
#include <vector>

namespace costate {

struct AlphaCoefficients {
  double alpha_m = 0, alpha_f = 0, beta = 0.25, gamma = 0.5;
  double alpha_mz = 0, alpha_fz = 0, gamma_z = 0.5;

  /// "newmark" or "generalized-alpha"; throws CapabilityError for others and for rho_infinity outside [0, 1].
  static AlphaCoefficients make(const std::string& scheme, double rho_infinity);
};

/// Names that AlphaCoefficients::make knows.
const std::vector<std::string>& discrete_scheme_names();

/// The same for a step h, solved for what a step uses:
///   q1 = q0 + h v0 + q_alpha alpha0 + q_a a0 + B a1        alpha1 = new_a a1 + old_a a0 + old_alpha alpha0
///   v1 = v0 + v_alpha alpha0 + v_a a0 + G a1               y1 = new_f f1 + old_f f0 + old_y y0
///   z1 = z0 + z_y y0 + z_f f0 + G_z f1
struct StepCoefficients {
  double h = 0, B = 0, G = 0, G_z = 0;
  double q_alpha = 0, q_a = 0, v_alpha = 0, v_a = 0, z_y = 0, z_f = 0;
  double new_a = 1, old_a = 0, old_alpha = 0, new_f = 1, old_f = 0, old_y = 0;

  StepCoefficients() = default;
  StepCoefficients(const AlphaCoefficients& c, double h);
  /// Those of the trapezoidal rule on a and f, whatever alpha and y are: of a step of another length than those around
  /// it. alpha0 stands for a at a time that follows the length of the step before it, so that a step of another length
  /// would be off by the product of both; nothing of that remains behind this one.
  static StepCoefficients trapezoidal(double h);
};

}  // namespace costate
