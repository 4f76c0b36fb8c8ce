// How much of an output's variance each varied number makes: Sobol' indices of designs of Saltelli's kind, and bounds
// of them from gradients.
#pragma once

#include <string>
#include <vector>

#include "costate/json_text.h"

namespace costate::app {

/// Values at the points of a design of Saltelli's kind (design.h), block by block: f(A), f(B), then f(A with number i
/// from B) for each number. Of independent numbers x_i
///   S_i = Var(E(f | x_i)) / Var(f),     estimated by  mean((f(B) - f0) (f(A_i) - f(A))) / Var(f)   (Saltelli 2010)
///   T_i = E(Var(f | all but x_i)) / Var(f),        by  mean((f(A) - f(A_i))^2) / (2 Var(f))         (Jansen)
/// with the standard errors of these means. Blocks with a value that is not finite are left out.
struct SobolIndices {
  std::size_t blocks = 0;
  double mean = 0, variance = 0;
  std::vector<double> first, total, first_error, total_error;
};
SobolIndices sobol_indices(const std::vector<double>& values, std::size_t numbers);

/// The rows of one design (study_table.h): for psi, or for each output, mean, variance and the indices by path of what
/// was varied; null where there is nothing to say. Of gradients the bounds T_i <= C_i E((df/dx_i)^2) / Var(f) of
/// Poincare's inequality, (b - a)^2 / pi^2 for x_i uniform in (a, b), the variance for a normal one.
Json sensitivity_json(const std::vector<Json>& rows);
/// The same in lines.
std::string sensitivity_text(const Json& sensitivity);

}  // namespace costate::app
