// What 'costate check' says about the limit cycle of a scene that has one: fixed point, period, travel, psi over a
// cycle, multipliers and, by each parameter, what period and psi do, each formulation on both integrators of SUNDIALS
// against a tighter search.
#pragma once

#include <string>
#include <vector>

#include "check_findings.h"
#include "check_row.h"
#include "command.h"
#include "costate/cycle/cycle.h"
#include "costate/integrator/run_budget.h"

namespace costate::app {

struct CycleRow {
  std::string formulation, integrator;
  Verdict verdict = Verdict::ok;
  std::string why;               // refused, failed, cut: the reason
  double period = 0, error = 0;  // [s]; of the worst quantity, against its size
  double largest = 0;            // modulus of the multipliers
  std::string quantity, unit;    // the worst: the farthest beyond what is allowed
  double found = 0, expected = 0;
  std::string remark;

  std::string text() const;  // a line of the table
  std::string sentence() const;
  Json json() const;
};

class CycleCheck {
 public:
  /// Runs take at most `patience` times what the first search has taken.
  CycleCheck(const Setup& setup, double patience);

  /// The tighter search, by the formulation of a reference, and from it what is allowed; then the formulations that
  /// gradients were taken of.
  void run(const Yardstick& yardstick, const std::vector<CheckRow>& gradients);
  void tell(Json& j, std::string& text, CheckFindings& found) const;

 private:
  struct Quantity {
    std::string name, unit;
    double value = 0, size = 0;  // what an error is relative to
  };
  using Quantities = std::vector<Quantity>;

  Quantities find(const Problem& p);
  Quantities quantities_of(const CycleResult& r) const;
  CycleRow judge(const std::string& formulation, const std::string& integrator);
  /// The farthest beyond what is allowed, `more` added to that.
  struct Worst {
    double beyond = -1;
    std::size_t at = 0;
  };
  Worst worst(const Quantities& found, const std::vector<double>& more) const;
  /// |found - expected|, of multipliers with the nearest.
  double apart(const Quantities& found, std::size_t i) const;

  Problem problem_;
  const CycleSettings& settings_;
  const std::vector<double>& rho_;
  RunBudget budget_;
  double patience_, seconds_ = RunBudget::kNoLimit;  // of the first search, which has none
  CycleResult result_;                               // of the last search
  Quantities reference_;
  std::vector<double> allowed_;
  std::vector<CycleRow> rows_;
  std::string note_;
};

}  // namespace costate::app
