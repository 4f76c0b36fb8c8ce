// What the elements say of a state at which a run gets no further: their own complaints (element/complaint.h), and of
// all forces the one that accelerates a coordinate most and the one that answers a motion most steeply.
#pragma once

#include <string>

#include "costate/assembly/assembly.h"

namespace costate {

/// Sentences; empty without complaints and forces. With M_k the entry of coordinate k on the diagonal of M, the size of
/// a force is the largest |Q_k| / M_k, an acceleration, and its steepness the largest rate among
/// |Q_k,q_l / sqrt(M_k M_l)|^(1/2), |Q_k,v_l| / sqrt(M_k M_l) and, of its states, |f_k,z_l|. Of s accelerations and
/// multipliers are not needed.
std::string element_complaints(Assembly& assembly, const StateView& s);

}  // namespace costate
