#include "costate/optimize/certificate_terms.h"

#include <algorithm>
#include <cmath>

#include "costate/optimize/bound_size.h"

namespace costate {

CertificateTerms certificate_terms(const Design& design, const OptimizerEvaluation& first,
                                   const OptimizerEvaluation& best, const Eigen::VectorXd& scale) {
  using Terms = CertificateTerms::Terms;
  CertificateTerms t;
  const auto scaled = [&](const std::vector<double>& gradient) -> Eigen::VectorXd {
    return scale.cwiseProduct(Eigen::Map<const Eigen::VectorXd>(gradient.data(), scale.size()));
  };
  std::vector<Terms> targets;
  const bool several = design.several();
  for (std::size_t i = 0; i < design.cases.size(); ++i) {
    const DesignCase& c = design.cases[i];
    const double weight = design.weight(i);
    t.quantities.push_back({several ? "psi of " + c.name : "psi", i, &c.problem.objective, weight,
                            weight * (several ? best.cases[i] : best.psi),
                            weight * (several ? first.cases[i] : first.psi),
                            weight * scaled(several ? best.case_gradients[i] : best.gradient),
                            weight * scaled(several ? first.case_gradients[i] : first.gradient)});
  }
  for (const DesignTarget& target : design.targets) {
    targets.emplace_back();
    for (const std::size_t i : target.cases) targets.back().emplace_back(i, 1.0);
  }
  const std::vector<DesignBound> bounds = design.bounds();
  const std::vector<double> sizes = bound_sizes(design.parameters, first, bounds);
  for (std::size_t k = 0; k < bounds.size(); ++k) {
    const DesignBound& b = bounds[k];
    std::size_t at = b.of;
    if (b.constraint) {  // an evaluation keeps psi_c - upper
      at = t.quantities.size();
      t.quantities.push_back({"constraint." + b.name, b.of, &b.constraint->objective, 1, best.constraints[k] + b.upper,
                              first.constraints[k] + b.upper, scaled(best.constraint_gradients[k]),
                              scaled(first.constraint_gradients[k])});
    }
    t.rows.push_back(
        {"constraint." + b.name, best.constraints[k], sizes[k], scaled(best.constraint_gradients[k]), {{at, 1.0}}});
  }
  if (!design.minimax()) {
    for (const Terms& of : targets) t.psi.insert(t.psi.end(), of.begin(), of.end());
    return t;
  }
  // L = F_w + sum of mu_g (F_g - F_w): the worst one has 1 - sum of mu_g, which must not be negative either.
  t.worst = design.worst(best.cases);
  t.psi = targets[t.worst];
  for (std::size_t g = 0; g < targets.size(); ++g) {
    if (g == t.worst) continue;
    CertificateTerms::Row r{"worst." + design.targets[g].name,
                            design.target(g, best.cases) - best.psi,
                            std::abs(best.psi),
                            scaled(design.target_gradient(g, best.case_gradients)) - scaled(best.gradient),
                            targets[g],
                            true};
    for (const auto& [q, factor] : t.psi) r.terms.emplace_back(q, -factor);
    t.rows.push_back(std::move(r));
  }
  return t;
}

}  // namespace costate
