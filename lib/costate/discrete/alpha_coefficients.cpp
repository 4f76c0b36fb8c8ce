#include "costate/discrete/alpha_coefficients.h"

#include <fmt/format.h>

#include "costate/base/error.h"

namespace costate {

const std::vector<std::string>& discrete_scheme_names() {
  static const std::vector<std::string> names = {"newmark", "generalized-alpha"};
  return names;
}

AlphaCoefficients AlphaCoefficients::make(const std::string& scheme, double rho) {
  AlphaCoefficients c;
  if (scheme == "newmark") return c;
  if (scheme != "generalized-alpha")
    throw CapabilityError(
        fmt::format("There is no discrete scheme '{}'.{}", scheme, suggestion(scheme, discrete_scheme_names())));
  if (!(rho >= 0 && rho <= 1))
    throw CapabilityError(
        fmt::format("discrete_rho_infinity must lie between 0 (fastest damping of what the step does "
                    "not resolve) and 1 (none), found {}.",
                    rho));
  c.alpha_m = (2 * rho - 1) / (rho + 1);
  c.alpha_f = rho / (rho + 1);
  c.gamma = 0.5 + c.alpha_f - c.alpha_m;
  c.beta = 0.25 * (c.gamma + 0.5) * (c.gamma + 0.5);
  c.alpha_mz = (3 * rho - 1) / (2 * (rho + 1));
  c.alpha_fz = c.alpha_f;
  c.gamma_z = 0.5 + c.alpha_fz - c.alpha_mz;
  return c;
}

StepCoefficients StepCoefficients::trapezoidal(double step) {
  StepCoefficients c;
  c.h = step;
  c.B = c.q_a = 0.25 * step * step;
  c.G = c.v_a = c.G_z = c.z_f = 0.5 * step;
  return c;
}

StepCoefficients::StepCoefficients(const AlphaCoefficients& c, double step) : h(step) {
  new_a = (1 - c.alpha_f) / (1 - c.alpha_m);
  old_a = c.alpha_f / (1 - c.alpha_m);
  old_alpha = -c.alpha_m / (1 - c.alpha_m);
  new_f = (1 - c.alpha_fz) / (1 - c.alpha_mz);
  old_f = c.alpha_fz / (1 - c.alpha_mz);
  old_y = -c.alpha_mz / (1 - c.alpha_mz);
  const double q1 = h * h * c.beta, v1 = h * c.gamma, z1 = h * c.gamma_z;
  B = q1 * new_a;
  q_a = q1 * old_a;
  q_alpha = h * h * (0.5 - c.beta) + q1 * old_alpha;
  G = v1 * new_a;
  v_a = v1 * old_a;
  v_alpha = h * (1 - c.gamma) + v1 * old_alpha;
  G_z = z1 * new_f;
  z_f = z1 * old_f;
  z_y = h * (1 - c.gamma_z) + z1 * old_y;
}

}  // namespace costate
