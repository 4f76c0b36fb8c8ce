// What a user may set of a formulation: the constants of its constraints' stabilization and of its fixed steps.
#pragma once

#include <string>

namespace costate {

/// Settings that formulations read; unset means the formulation's own default.
struct FormulationOptions {
  double baumgarte_xi = 1;                // damping ratio of the constraint error
  double baumgarte_omega_rad_per_s = 10;  // its frequency
  double penalty_xi = 1;
  double penalty_omega_rad_per_s = 10;
  double penalty_alpha = 0;  // weight of the constraints against the masses; 0: 1e8 times the largest mass entry
  std::string discrete_scheme = "newmark";  // fixed-step runs: "newmark" (trapezoidal) or "generalized-alpha"
  double discrete_rho_infinity = 0.8;       // generalized-alpha: what a step leaves of the fastest oscillations
};

}  // namespace costate
