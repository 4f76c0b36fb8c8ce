// One row of costate check: what a formulation gave by a gradient method, how it was judged, and how that is told.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "check_judge.h"
#include "command.h"

namespace costate::app {

/// A formulation with a gradient method.
struct CheckRow {
  std::string formulation, method;
  std::string integrator = {};        // asked for; empty: the method's default
  std::string why;                    // refused, failed or cut: the reason
  std::vector<std::string> warnings;  // of its own run; those that judge it run otherwise
  GradientResult result;
  double wall_s = 0;
  std::optional<double> time_ratio;  // to a plain simulation on the same form
  Judgement judged;

  /// "discrete-adjoint", "discrete-adjoint radau5".
  std::string label() const { return integrator.empty() ? method : method + " " + integrator; }
  Verdict verdict() const { return judged.verdict; }
  bool refused() const { return verdict() == Verdict::refused; }
  /// There is a result, and it has been judged.
  bool ended() const { return !refused() && verdict() != Verdict::cut && verdict() != Verdict::failed; }
  void end(Verdict v, const std::string& reason) {
    judged = {};
    judged.verdict = v;
    why = reason;
  }
};

/// The row of the table, of the JSON, and what is to be said about it in a sentence.
std::string row_text(const Setup& setup, const CheckRow& r, std::size_t label_width);
Json row_json(const Setup& setup, const CheckRow& r);
std::string row_sentence(const CheckRow& r);

}  // namespace costate::app
