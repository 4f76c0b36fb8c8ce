// Designs of experiments: points of a box or of distributions, for studies.
#pragma once

#include <string>
#include <vector>

namespace costate::app {

/// One number that a design varies.
struct Variation {
  enum class Kind { uniform, logarithmic, normal };
  std::string path;
  Kind kind = Kind::uniform;
  double first = 0, second = 1;  // from and to; of a normal distribution mean and standard deviation
  int steps = 0;                 // of a grid

  /// The value whose cumulative probability is u, 0 < u < 1; of a grid, from 0 to 1, both ends.
  double value(double u) const;
  /// sqrt(C) dx/du' at a value: the factor by which df/dx is the slope whose mean square bounds the total index, times
  /// the variance (indices.h).
  double slope_factor(double x) const;
};

/// "grid", "latin-hypercube", "sobol", "monte-carlo", "saltelli".
const std::vector<std::string>& design_kinds();

/// Whether points of a kind are drawn at random: a Sobol sequence and a grid are not.
bool draws_points(const std::string& kind, std::size_t numbers);

/// The points of a design, a row a point with a value for each variation. `count` is that of a grid's product where it
/// is a grid; of Saltelli's kind that of blocks, each of a point A, a point B, and for each number A with that of B, A
/// and B from one Sobol sequence, or by chance where that has too few dimensions. The same seed gives the same points
/// on every machine; a Sobol sequence has none. Throws Error where a Sobol sequence has more dimensions than its table.
std::vector<std::vector<double>> design_points(const std::string& kind, const std::vector<Variation>& variations,
                                               int count, unsigned long seed);

/// The quantile of the standard normal distribution, to rounding.
double normal_quantile(double u);

}  // namespace costate::app
