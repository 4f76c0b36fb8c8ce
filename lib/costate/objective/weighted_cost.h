// A term of a cost times a law of the time: w(t, p) g, measured weights or a window.
#pragma once

#include <memory>
#include <vector>

#include "costate/objective/objective.h"

namespace costate {

class WeightedTerm final : public CostTerm {
 public:
  /// `numbers`: of the law, in the mechanism.
  WeightedTerm(std::shared_ptr<const CostTerm> term, std::shared_ptr<const ScalarLaw> law, std::vector<int> numbers)
      : term_(std::move(term)), law_(std::move(law)), numbers_(std::move(numbers)) {}
  const CostTerm& term() const { return *term_; }
  const ScalarLaw& law() const { return *law_; }
  const std::vector<int>& law_numbers() const { return numbers_; }

  double value(const StateView& s, Assembly& assembly) const override;
  void add_gradient(const StateView& s, Assembly& assembly, double factor, ScalarGradient& g) const override;
  bool needs_accelerations() const override { return term_->needs_accelerations(); }
  void add_gradient_change(const StateView& s, Assembly& assembly, const Variation& d,
                           ScalarGradient& g) const override;
  double change(const StateView& s, Assembly& assembly, const Variation& d) const override;

 private:
  double weight(double t, const Assembly& assembly) const;
  /// The weight and its change along d.
  Taylor2 weight_along(double t, const Assembly& assembly, const Variation& d) const;
  /// Whether parameters move one of the law's numbers.
  bool varies(const Assembly& assembly) const;
  /// gradient += w_p change + (the change of w_p along d) value, by each number that parameters move.
  void add_by_numbers(double t, Assembly& assembly, const Variation& d, double value, double change,
                      ScalarGradient& g) const;
  /// The law's numbers along d, in a buffer of the thread.
  std::vector<PathDual>& along(const Assembly& assembly, const Variation& d) const;
  std::shared_ptr<const CostTerm> term_;
  std::shared_ptr<const ScalarLaw> law_;
  std::vector<int> numbers_;
};

}  // namespace costate
