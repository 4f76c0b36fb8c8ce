// Adjoints written by a researcher against costate/candidate/candidate.h. Right ones pass, for every formulation. Then
// every single term of a right one is dropped, negated, doubled and, where its block is square, transposed in turn: the
// checker must name exactly that term. The kitchen sink is rich enough that next to no term vanishes.
#include <fmt/format.h>
#include <support/models.h>
#include <support/sweep.h>

#include <catch2/catch.hpp>
#include <functional>
#include <map>

#include "candidate_researchers_reduced.h"
#include "costate/candidate/candidate_check.h"

using namespace costate;
using namespace costate::test;

namespace {

bool second_order(const std::string& formulation) { return formulation.find("second-order") != std::string::npos; }

CandidateReference reference_for(const std::string& formulation) {
  const TestModel model = second_order(formulation) ? kitchen_sink_without_accelerations() : kitchen_sink();
  Problem p = model.problem(formulation, 1e-9);
  p.parameters = model.all_parameters();
  p.solver.t_end = 0.2;
  p.formulation_options.set("penalty_alpha", 1e4);
  return candidate_reference(p, formulation, p.parameters.values());
}

std::string text_of(const CandidateReport& r) {
  std::string s = fmt::format("error {:.2e}, own error {:.2e}, failure '{}'", r.error, r.own_error, r.failure);
  if (r.first) s += fmt::format("\n  first: t = {}, {}", r.first->t, r.first->component);
  for (const auto& f : r.findings) {
    s += fmt::format("\n  [{} | {} | {}] {}", f.where, f.term, f.what, f.message);
    for (const auto& a : f.alternatives) s += "\n     or " + a;
  }
  for (const auto& n : r.notes) s += "\n  note " + n;
  return s;
}

bool algebraic(const std::string& where) {
  return where.rfind("the algebraic", 0) == 0 || where.rfind("the constraint", 0) == 0 ||
         where.rfind("the definition", 0) == 0;
}

/// Slips of the terms, one at a time, where `which` holds for the equation: every fifth in the suite, each formulation
/// with others of the terms that it shares with the rest.
template <class Candidate>
void check_slips(
    Candidate& candidate, const CandidateReference& reference, const std::string& kinds = "dn2t",
    const std::function<bool(const std::string&)>& which = [](const std::string&) { return true; }) {
  const CandidateReport right = check_candidate(
      candidate, reference, [](const std::string&) {}, true);
  INFO(text_of(right));
  REQUIRE(right.agrees);
  const auto blind = [&](const std::string& id, bool transposed) {
    for (const auto& b : right.blind)
      if ((b.why.find("symmetric") != std::string::npos) == transposed && b.where + "|" + b.term == id) return true;
    return false;
  };
  std::string unseen;
  for (const auto& b : right.blind)
    if (b.why.find("vanish") != std::string::npos) unseen += b.where + "|" + b.term + "\n";
  CAPTURE(unseen);
  // No force state of this scene depends on velocities; all else is there.
  for (const auto& b : right.blind)
    if (b.why.find("vanish") != std::string::npos && !second_order(reference.problem.formulation))
      CHECK((b.term == "-f_yd^T mu_z" || b.term.find("f_v") != std::string::npos));
  const auto terms = candidate.terms;
  const int every = sweep_stride(5, 11);
  static int turn = 0;
  int judged = 0, count = turn++;
  for (const auto& [id, square] : terms)
    for (const char kind : kinds) {
      if (++count % every != 0) continue;
      if (!which(id) || (kind == 't' && !square)) continue;
      if (unseen.find(id + "\n") != std::string::npos || (kind == 't' && blind(id, true))) continue;
      if (reference.problem.formulation != "penalty" && id.find("/ alpha") != std::string::npos) continue;
      if (reference.problem.formulation == "index1" && id.find("omega") != std::string::npos) continue;
      candidate.slips = {{id, kind}};
      const CandidateReport r = check_candidate(
          candidate, reference, [](const std::string&) {}, true);
      CAPTURE(id, kind, text_of(r));
      if (kind == 't' && r.findings.empty()) continue;  // a symmetric constituent
      // An algebraic equation may be multiplied by any number.
      if (id == "the constraint on mu_q|Phi_q mu_q" && (kind == 'n' || kind == '2')) {
        CHECK(r.agrees);
        continue;
      }
      ++judged;
      REQUIRE(r.findings.size() == 1);
      if (!r.findings[0].alternatives.empty() && algebraic(r.findings[0].where)) {
        const std::string name = id.substr(id.find('|') + 1);
        bool named = r.findings[0].term == name;
        for (const auto& a : r.findings[0].alternatives) named = named || a.find(name) != std::string::npos;
        CHECK(named);
        continue;
      }
      const CandidateFinding& f = r.findings[0];
      if (kind == 't' && !f.alternatives.empty()) {
        // The transpose of a whole block is that of one constituent where the others are symmetric: both are said.
        const std::string name = id.substr(id.find('|') + 1);
        bool named = f.term == name;
        for (const auto& a : f.alternatives) named = named || a.rfind(name + " was used untransposed", 0) == 0;
        CHECK(named);
        continue;
      }
      CHECK(f.where + "|" + f.term == id);
      const std::string what = kind == 'd'   ? "missing"
                               : kind == 'n' ? "wrong sign"
                               : kind == '2' ? "factor 2"
                                             : "transposed";
      CHECK(f.what.find(what) != std::string::npos);
    }
  candidate.slips.clear();
  const int expected = kinds.size() > 3 ? 100 : 15;
  CHECK(judged >= expected / every);
}

}  // namespace

TEST_CASE("right candidates agree, for every formulation") {
  for (const char* formulation : {"index1", "baumgarte", "penalty", "augmented-lagrangian", "index2", "index3", "maggi",
                                  "maggi-implicit", "maggi-second-order", "penalty-second-order"}) {
    const CandidateReference reference = reference_for(formulation);
    const auto agrees = [&](const CandidateAdjoint& candidate) {
      const CandidateReport r = check_candidate(candidate, reference);
      CAPTURE(formulation, text_of(r));
      CHECK(r.agrees);
      // The compact form multiplies the trajectory's error of 1e-9 by alpha / M, here 1e4 and more.
      CHECK(r.error < (formulation == std::string("penalty-second-order") ? 1e-4 : 1e-6));
      CHECK(!r.first);
    };
    const std::string name = formulation;
    if (name == "index2" || name == "index3") {
      agrees(MomentumResearcher(name));
    } else if (second_order(name)) {
      agrees(SecondOrderResearcher(name));
    } else if (name == "maggi" || name == "maggi-implicit") {
      agrees(MaggiResearcher(name, name == "maggi-implicit"));
    } else {
      agrees(AccelerationResearcher(name, false));
      agrees(AccelerationResearcher(name, true));
      if (name == "penalty") agrees(PenaltyResearcher());
    }
  }
}

TEST_CASE("candidates of Maggi's formulations are carried through changes of coordinates") {
  const TestModel model = pendulum(1, 2);  // swings past the horizontal and the vertical: x and y take turns
  for (const std::string formulation : {"maggi", "maggi-implicit", "maggi-second-order"}) {
    Problem p = model.problem(formulation, 1e-9);
    const CandidateReference reference = candidate_reference(p, formulation, p.parameters.values());
    const CandidateReport r =
        second_order(formulation)
            ? check_candidate(SecondOrderResearcher(formulation), reference)
            : check_candidate(MaggiResearcher(formulation, formulation == "maggi-implicit"), reference);
    CAPTURE(formulation, text_of(r));
    CHECK(r.agrees);
    CHECK(r.error < 1e-6);
    CHECK(!r.first);
  }
}

TEST_CASE("each slip in an explicit adjoint is named") {
  for (const char* formulation : {"index1", "baumgarte", "penalty"}) {
    const CandidateReference reference = reference_for(formulation);
    AccelerationResearcher candidate(formulation, false);
    check_slips(candidate, reference);
  }
}

TEST_CASE("each slip in an implicit adjoint is named") {
  for (const char* formulation : {"baumgarte", "penalty"}) {
    const CandidateReference reference = reference_for(formulation);
    AccelerationResearcher candidate(formulation, true);
    check_slips(candidate, reference);
  }
}

TEST_CASE("each slip in adjoints of index 2 and 3 is named") {
  for (const char* formulation : {"index2", "index3"}) {
    const CandidateReference reference = reference_for(formulation);
    MomentumResearcher candidate(formulation);
    check_slips(candidate, reference);
  }
}

TEST_CASE("each slip in adjoints of Maggi's formulations is named") {
  MaggiResearcher first("maggi", false), implicit("maggi-implicit", true);
  check_slips(first, reference_for("maggi"), "dnt");
  // The other equations are the same.
  check_slips(implicit, reference_for("maggi-implicit"), "dnt", [](const std::string& id) {
    return id.find(" P'|") != std::string::npos || id.find(" P|") != std::string::npos ||
           id.find("P^T") != std::string::npos;
  });
}

TEST_CASE("each slip in adjoints of second order is named") {
  for (const char* formulation : {"maggi-second-order", "penalty-second-order"}) {
    SecondOrderResearcher candidate(formulation);
    // The end values of first order, from which those of second order follow, have been judged above.
    check_slips(candidate, reference_for(formulation), "dnt", [](const std::string& id) {
      return id.rfind("the equation", 0) == 0 || id.rfind("the terminal value mu_dot(T)", 0) == 0 ||
             id.rfind(kIntegrand, 0) == 0 || id.rfind(kStart, 0) == 0;
    });
  }
}

TEST_CASE("several slips at once are named together") {
  const CandidateReference reference = reference_for("baumgarte");
  AccelerationResearcher candidate("baumgarte", false);
  const auto expect = [&](const std::vector<Slip>& slips) {
    candidate.slips = slips;
    const CandidateReport r = check_candidate(
        candidate, reference, [](const std::string&) {}, true);
    CAPTURE(text_of(r));
    REQUIRE(r.findings.size() == slips.size());
    for (const Slip& s : slips) {
      CAPTURE(s.id);
      bool named = false;
      for (const auto& f : r.findings) named = named || f.where + "|" + f.term == s.id;
      CHECK(named);
    }
  };
  expect({{kMuQ + "|(M a)_q", 'd'}, {kMuQ + "|-Q_q", 't'}});
  expect({{kMuQ + "|-g_q", 'n'}, {kMuV + "|-Q_v", 'd'}});
  expect({{kMuQ + "|-g_q", 'n'}, {kMuQ + "|-f_q^T mu_z", 'd'}, {kMuQ + "|Phidd_q", '2'}});
  expect({{kSolve + "|g_a", 'd'}, {kIntegrand + "|-Q_rho", 'n'}});
  expect({{kTau + "|w_a", 'd'}, {kEnd + "|Phidd_rho", 'n'}});
  expect({{kMuQ + "|(Phi_q^T lambda)_q", '7'}});
  expect({{kMuQ + "|(Phi_q^T lambda)_q", '7'}, {kMuQ + "|-Q_q", 'd'}, {kStart + "|mu_v^T Sv0", 'h'}});
}

TEST_CASE("a wrong terminal value shows where the multipliers part, and in the gradient") {
  const CandidateReference reference = reference_for("index1");
  AccelerationResearcher candidate("index1", false);
  candidate.slips = {{"the terminal value mu_v(T)|w_v", 'd'}};
  CandidateReport r = check_candidate(candidate, reference);
  INFO(text_of(r));
  CHECK(!r.agrees);
  CHECK(r.error > 1e-4);
  REQUIRE(r.first);
  CHECK(r.first->t == reference.problem.solver.t_end);
  CHECK(r.first->component.rfind("mu_v.", 0) == 0);
  REQUIRE(r.findings.size() == 1);
  CHECK(r.findings[0].message == "w_v is missing in the terminal value mu_v(T)");
  candidate.slips = {{kStart + "|mu_v^T Sv0", 'd'}};
  r = check_candidate(candidate, reference);
  CHECK(!r.agrees);
  CHECK(!r.first);
}
