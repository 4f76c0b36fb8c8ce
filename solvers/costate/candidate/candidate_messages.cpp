#include "costate/candidate/candidate_messages.h"

#include <fmt/format.h>

namespace costate {

namespace {

using Kind = Alteration::Kind;

/// "K^T s1" of "-K^T s1".
std::string bare(const std::string& name) { return name.front() == '-' ? name.substr(1) : name; }

std::string missing(const AdjointTerm& t, const std::string& name, bool whole) {
  if (whole && !t.message.empty()) return t.message;
  std::string why;
  if (t.section == AdjointTerm::Section::start)
    why = ": the start's dependence on the parameters was forgotten";
  else if (whole && t.unknown.rfind("eta_", 0) == 0)
    why = fmt::format(": the boundary multiplier {} was left out there", t.unknown);
  else if (whole && t.unknown.rfind("tau", 0) == 0)
    why = ": a part of the elimination of accelerations and multipliers from the terminal cost";
  return fmt::format("{} is missing in {}{}", name, t.where, why);
}

}  // namespace

CandidateFinding finding_of(const AdjointTerm& t, const Alteration& a) {
  CandidateFinding f;
  f.where = t.where;
  const bool single = t.parts.size() == 1, named_part = single && t.parts[0] != t.name && t.parts[0] != t.block;
  const bool whole = a.part < 0;
  // A block with one constituent is called by it: -Q_v rather than C.
  f.term = !whole ? t.parts[static_cast<std::size_t>(a.part)] : named_part ? t.parts[0] : t.name;
  const std::string within = whole && !named_part ? "" : fmt::format("{} in ", t.name);
  const std::string block = !whole ? t.part_blocks[static_cast<std::size_t>(a.part)] : t.block;
  switch (a.kind) {
    case Kind::dropped:
      f.what = "missing";
      f.message = named_part && whole ? fmt::format("{} ({}) is missing in {}", f.term, t.name, t.where)
                                      : missing(t, f.term, whole);
      break;
    case Kind::negated:
      f.what = "wrong sign";
      f.message = fmt::format("{} has the wrong sign in {}{}", f.term, within, t.where);
      break;
    case Kind::doubled:
      f.what = "factor 2";
      f.message = fmt::format("{} stands with twice its value in {}{}", f.term, within, t.where);
      break;
    case Kind::halved:
      f.what = "factor 0.5";
      f.message = fmt::format("{} stands with half its value in {}{}", f.term, within, t.where);
      break;
    case Kind::scaled:
      f.what = fmt::format("factor {:.6g}", a.factor);
      f.message = fmt::format("{} stands with {:.6g} times its value in {}{}", f.term, a.factor, within, t.where);
      break;
    case Kind::transposed: {
      const bool plain = t.name.find("^T") == std::string::npos;
      const std::string of = !whole ? f.term : t.block;
      f.what = plain ? "transposed" : "untransposed";
      f.message = plain   ? fmt::format("{} was used transposed in {}{}", of, within, t.where)
                  : whole ? fmt::format("{}^T was used untransposed: {} {} in place of {} in {}", of, of, t.unknown,
                                        bare(t.name), t.where)
                          : fmt::format("{} was used untransposed in {}{}", of, within, t.where);
      break;
    }
    case Kind::other_block: {
      const std::string& other = t.other_blocks[static_cast<std::size_t>(a.option)];
      f.what = "wrong block " + other;
      f.message = fmt::format("{} was used in place of {} in {}{}", other, whole ? block : f.term, within, t.where);
      break;
    }
    case Kind::other_unknown: {
      const std::string& other = t.other_unknowns[static_cast<std::size_t>(a.option)];
      f.what = "wrong factor " + other;
      f.message = t.unknown.empty() ? fmt::format("{} was used in place of {} in {}", other, bare(t.name), t.where)
                                    : fmt::format("{} was used in place of {} in {}, {}{}", other, t.unknown, t.name,
                                                  whole ? "" : f.term + " of ", t.where);
      break;
    }
  }
  return f;
}

}  // namespace costate
