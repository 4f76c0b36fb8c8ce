// What may be wrong with a candidate adjoint: every way in which a term can be missing, turned round or mistaken.
#pragma once

#include <string>
#include <vector>

#include "costate/candidate/candidate_model.h"

namespace costate {

/// A term, or a part of it, written otherwise than it should be.
struct CandidateHypothesis {
  Alteration a;
  const AdjointTerm* term;
  double unlikely;  // ranks what explains equally well
  int block;        // of outputs; -1: shared by several
};

/// Alterations of the same term at the same time make no sense.
bool conflict(const Alteration& a, const Alteration& b);

/// Adds those of term `index` of its section; `where`: the equations that the candidate has.
void add_hypotheses(const AdjointTerm& t, int index, const std::vector<std::string>& where,
                    std::vector<CandidateHypothesis>& hypotheses);

}  // namespace costate
