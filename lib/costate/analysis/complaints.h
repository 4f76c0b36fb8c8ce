// What the elements say of a state at which a run gets no further: their own complaints (element/complaint.h), the
// constraint rows that nearly depend on each other, and of all forces the one that accelerates a coordinate most and
// the one that answers a motion most steeply.
#pragma once

#include <string>

#include "costate/assembly/assembly.h"

namespace costate {

/// Sentences; empty where there is nothing to say. Rows are of length 1, and depend on each other to within their
/// smallest singular value. With M_k the entry of coordinate k on the diagonal of M, the size of
/// a force is the largest |Q_k| / M_k, an acceleration, and its steepness the largest rate among
/// |Q_k,q_l / sqrt(M_k M_l)|^(1/2), |Q_k,v_l| / sqrt(M_k M_l) and, of its states, |f_k,z_l|. Of s accelerations and
/// multipliers are not needed.
std::string element_complaints(Assembly& assembly, const StateView& s);

/// Of it the sentence about rows alone: those with a share in the smallest singular value, if that is small; in one
/// above rounding if there is one, as redundant rows have ended nothing. Empty of more rows than `most`: it takes full
/// matrices. Of s only t and q are needed.
std::string dependent_row(Assembly& assembly, const StateView& s, int most = 400);

}  // namespace costate
