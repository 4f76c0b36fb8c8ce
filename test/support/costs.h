// Costs for tests: built-in terms by output name, and a user's own term that touches every variable.
#pragma once

#include <cmath>
#include <string>
#include <vector>

#include "costate/objective/objective.h"

namespace costate::test {

/// weight (output - target)^power; numbers by path; a target law reads the numbers listed.
std::shared_ptr<const CostTerm> output_term(const Mechanism& mechanism, const std::string& output, int power,
                                            const std::string& weight,
                                            std::shared_ptr<const ScalarLaw> target = nullptr,
                                            const std::vector<std::string>& target_numbers = {});
/// weight (output - other)^2.
std::shared_ptr<const CostTerm> output_difference(const Mechanism& mechanism, const std::string& output,
                                                  const std::string& other, const std::string& weight);

/// w (u - target cos(2 t))^2 + w sin(u) with u a sum over all entries of q, v, a, lambda and z, each with a coefficient
/// of its own, so that a lost or misplaced entry of the cost's gradient shows.
class EverythingCost final : public DualCostTerm<EverythingCost> {
 public:
  struct Sizes {
    int n = 0, m = 0, nz = 0;
  };
  /// Factors of the groups bring them to similar size.
  struct Factors {
    double q = 1, v = 1, a = 0, lambda = 0, z = 1;
  };
  EverythingCost(const Mechanism& mechanism, const std::string& weight, const std::string& target, Factors factors)
      : sizes_{mechanism.coordinate_count(), mechanism.row_count(), mechanism.state_count()},
        weight_(mechanism.number(weight)),
        target_(mechanism.number(target)),
        factors_(factors) {}

  template <class S>
  S physics(const CostArguments<S>& x) const {
    using std::cos;
    using std::sin;
    S u(0.0);
    const auto add = [&u](const S* from, int count, double factor) {
      if (factor == 0) return;
      for (int i = 0; i < count; ++i) u += S(factor * (1 + 0.3 * std::sin(1 + 2.3 * i))) * from[i];
    };
    add(x.q, sizes_.n, factors_.q);
    add(x.v, sizes_.n, factors_.v);
    add(x.a, sizes_.n, factors_.a);
    add(x.lambda, sizes_.m, factors_.lambda);
    add(x.z, sizes_.nz, factors_.z);
    const S d = u - x.numbers[target_] * cos(S(2.0) * x.t);
    return x.numbers[weight_] * (d * d + sin(u));
  }
  bool needs_accelerations() const override { return factors_.a != 0 || factors_.lambda != 0; }

 private:
  Sizes sizes_;
  int weight_, target_;
  Factors factors_;
};

}  // namespace costate::test
