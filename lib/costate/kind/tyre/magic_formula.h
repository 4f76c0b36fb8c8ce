// model = "magic_formula" of [tyre.NAME]: coefficients from a .tir file, single ones from the scene.
#pragma once

#include <map>
#include <string>

#include "costate/kind/tyre/tyre.h"

namespace costate {

struct MagicFormulaOptions {
  std::map<std::string, double> coefficients;  // by their names in a .tir file; what is missing is 0, or 1 of a scaling
  bool camber_as_angle = false;                // the generation 5.2 (PAC2002), not 6.1
  bool free_rolling = false;                   // no longitudinal slip nor force: the wheel's spin is left out
  bool mirrored = false;                       // left and right exchanged
  double longitudinal_relaxation_length_m = 0;  // 0: without a lag
  double initial_longitudinal_slip = 0;
  /// Both slips lag (the lateral one alone if free_rolling) over lengths that follow the load, by the
  /// coefficients PTX1, PTX2, PTX3, PTY1, PTY2, PKY3, LSGKP and LSGAL. No other relaxation length is given
  /// then.
  bool relaxation_by_coefficients = false;
  std::string tir_file;  // what the coefficients were read from, for messages
};
void add_magic_formula_tyre(MechanismBuilder& builder, const std::string& name, const TyreOptions& tyre,
                            const TyreSlipOptions& slip, const MagicFormulaOptions& options);

/// Coefficients and generation, and into `tyre` the radius, stiffness and damping that the file gives.
void read_tir_file(const std::string& path, MagicFormulaOptions& options, TyreOptions& tyre);

}  // namespace costate
