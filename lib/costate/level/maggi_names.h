// Names of the unknowns of Maggi's formulations: those of the coordinates that are independent at the time.
#pragma once

#include <vector>

#include "costate/level/unknown.h"
#include "costate/mechanism/mechanism.h"

namespace costate {

/// A chart is changed when it falls behind the best one by this ratio: the largest derivative |R_ij| of a dependent
/// coordinate with respect to an independent one (56 degrees of a pendulum's turn).
inline constexpr double kWorstMaggiRatio = 1.5;

/// (y, yd, z), or one idle unknown when there is nothing to integrate: the drivers determine the whole motion.
void append_maggi_unknowns(const Mechanism& mechanism, int freedoms, std::vector<Unknown>& unknowns);
/// Names y and yd (and w, when the unknowns end with it) after the independent coordinates, and behind these after the
/// rows whose places they are (maggi_rows.h).
void name_maggi_unknowns(const Mechanism& mechanism, const std::vector<int>& independent,
                         const std::vector<int>& places, std::vector<Unknown>& unknowns);

}  // namespace costate
