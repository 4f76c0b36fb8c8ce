// Sentences about altered terms.
#pragma once

#include "costate/candidate/candidate_search.h"

namespace costate {

/// What it means that a candidate has this alteration of the term.
CandidateFinding finding_of(const AdjointTerm& term, const Alteration& alteration);

}  // namespace costate
