#include "costate/candidate/candidate_hypotheses.h"

namespace costate {

bool conflict(const Alteration& a, const Alteration& b) {
  return a.section == b.section && a.term == b.term && (a.part == b.part || a.part < 0 || b.part < 0);
}

void add_hypotheses(const AdjointTerm& t, int index, const std::vector<std::string>& where,
                    std::vector<CandidateHypothesis>& hypotheses) {
  using Kind = Alteration::Kind;
  int block = -1;
  if (!t.shared)
    for (std::size_t k = 0; k < where.size(); ++k)
      if (where[k] == t.where) block = static_cast<int>(k);
  if (!t.shared && block < 0) return;  // an equation that the candidate does not have
  const auto add = [&](int part, Kind kind, double unlikely, int option = 0) {
    Alteration a;
    a.section = t.section;
    a.term = index;
    a.part = part;
    a.kind = kind;
    a.option = option;
    hypotheses.push_back(
        {a, &t, unlikely + (part >= 0 ? 0.01 : 0) + (t.shared ? 0.02 : 0) + (t.matrix_of_solve ? 0.05 : 0), block});
  };
  const auto add_all = [&](int part) {
    add(part, Kind::dropped, 0);
    add(part, Kind::negated, 0.1);
    if (t.square) add(part, Kind::transposed, 0.2);
    add(part, Kind::doubled, 0.3);
    add(part, Kind::halved, 0.35);
    if (t.matrix_of_solve) return;
    const std::string own = part < 0 ? t.block : t.part_blocks[static_cast<std::size_t>(part)];
    for (std::size_t o = 0; o < t.other_unknowns.size(); ++o)
      if (t.other_unknowns[o] != t.unknown) add(part, Kind::other_unknown, 0.5, static_cast<int>(o));
    for (std::size_t o = 0; o < t.other_blocks.size(); ++o)
      if (t.other_blocks[o] != own) add(part, Kind::other_block, 0.6, static_cast<int>(o));
  };
  add_all(-1);
  if (t.parts.size() > 1)
    for (int p = 0; p < static_cast<int>(t.parts.size()); ++p) add_all(p);
}

}  // namespace costate
