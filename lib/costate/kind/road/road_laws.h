// Shapes of roads as options: heights [m] over a distance [m].
#pragma once

#include <string>

#include "costate/element/law/road_laws.h"
#include "costate/kind/law/law_options.h"

namespace costate {

struct BumpOptions {
  double height_m = 0.1;  // of h (1 - cos(2 pi y / length)), which is 2 h high, or of h sin(pi y / length)
  double start_m = 0, length_m = 1;
  int count = 1;
  double spacing_m = 0;  // from one start to the next, at least the length
  bool half_sine = false;
};
LawOptions bump_law(const BumpOptions& options);

struct SineSweepOptions {
  double amplitude_m = 0.01, start_m = 0, length_m = 100;
  double n_start_1_per_m = 0.1, n_end_1_per_m = 1;
};
LawOptions sine_sweep_law(const SineSweepOptions& options);

/// G0 = G(0.1 1/m) in m^3.
LawOptions sine_sum_law(double roughness_m3, const SpectrumOptions& spectrum);
/// The geometric mean of an ISO 8608 class, 'A' to 'H': 16e-6 m^3 times 4 for each further class.
double iso8608_roughness(char road_class);

LawOptions profile_table_law(std::vector<double> x_m, std::vector<double> z_m, double scale = 1);
/// Two columns, x and z in m, separated by blanks, tabs, commas or semicolons; # starts a comment. Errors
/// name the line.
LawOptions profile_table_law(const std::string& file, double scale = 1);

}  // namespace costate
