// The exact adjoint equations of each formulation, written term by term, so that single terms can be altered:
// dropped, negated, transposed, taken with another block or another multiplier. What a candidate adjoint is
// compared with.
#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "costate/candidate/candidate.h"

namespace costate {

/// A term of the equations as the reports name it: "K^T s1" with its constituents "(M a)_q", ...
struct AdjointTerm {
  enum class Section { solve, flow, integrand, terminal, start };
  Section section = Section::flow;
  std::string where;               // "the equation of mu_q'"
  std::string name;                // "K^T s1"
  std::vector<std::string> parts;  // constituents; one at least
  std::vector<std::string> part_blocks, other_blocks, other_unknowns;
  std::string unknown, block;    // what it multiplies, and the whole block
  bool square = false;           // the block can be transposed
  bool matrix_of_solve = false;  // stands in the matrix of an inner solve
  bool shared = false;           // several equations depend on it (a result of an inner solve)
  std::string message;           // what is said when it is missing, or empty: the default
};

/// One deliberate change of one term.
struct Alteration {
  enum class Kind { dropped, negated, doubled, halved, transposed, other_block, other_unknown, scaled };
  AdjointTerm::Section section = AdjointTerm::Section::flow;
  int term = 0;   // within its section
  int part = -1;  // -1: the whole term
  Kind kind = Kind::dropped;
  int option = 0;     // which other block or unknown
  double factor = 1;  // of a scaled term
};

/// What the equations of all formulations are written with.
class AdjointModel : public CandidateAdjoint {
 public:
  explicit AdjointModel(std::string formulation);

  std::string formulation() const override { return formulation_; }
  void alter(std::vector<Alteration> a) { alterations_ = std::move(a); }
  /// The terms of a section, known once it has been evaluated.
  const std::vector<AdjointTerm>& terms(AdjointTerm::Section s) const { return terms_[static_cast<int>(s)]; }

 protected:
  using Section = AdjointTerm::Section;
  using Named = std::vector<std::pair<const char*, const Vector*>>;
  using Blocks = std::vector<std::pair<const char*, const Matrix*>>;
  struct Part {
    const char* name;
    const char* block;
    const Matrix* B;
    double c;
  };
  void begin(Section s) const;
  /// sum of c op(B) u over the parts, op: transposed.
  Vector product(const char* where, const char* name, const char* block, std::vector<Part> parts, const char* unknown,
                 const Vector& u, const Blocks& others, const Named& unknowns, bool transposed = true) const;
  Vector vector(const char* where, const char* name, const Vector& x, double c, const Named& others = {}) const;
  /// What several equations use: a result of an inner solve.
  Vector result(const char* where, const char* name, const Vector& x, const char* message) const;
  double coefficient(const char* where, const char* name) const;

  std::string formulation_;
  mutable bool all_shared_ = false;  // whatever shared_ says
  mutable bool shared_ = false;      // the terms that follow act on several equations

 private:
  /// The next term's place in its section; its entry is filled when it is new.
  int next(const char* where, const char* name, bool& fresh) const;
  double factor(int term, int part) const;

  std::vector<Alteration> alterations_;
  mutable std::vector<AdjointTerm> terms_[5];
  mutable Section section_ = Section::flow;
  mutable int position_ = 0;
  mutable bool in_matrix_ = false;
};

/// The groups that a candidate for this formulation has by default.
std::vector<CandidateAdjoint::Group> usual_unknowns(const std::string& formulation);

/// The equations of a formulation with as many multipliers kept as unknowns as `groups` name.
std::unique_ptr<AdjointModel> make_adjoint_model(const std::string& formulation,
                                                 const std::vector<std::string>& groups);

}  // namespace costate
