// Which constraints are active at a point, and their multipliers mu >= 0: those that leave the least of
//   dL/dx = dpsi/dx + sum_i mu_i dc_i/dx
// where no bound takes it. Constraints that hold nothing are as near to their bounds as those beside them that do: what
// the ones at their bounds explain alone is theirs.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

#include "costate/optimize/certificate_terms.h"

namespace costate {

struct ActiveRows {
  std::vector<std::size_t> near;  // of the rows
  Eigen::MatrixXd A;              // their gradients, a column each
  Eigen::VectorXd mu, slope;      // slope: dL/dx before the bounds' own terms
};

/// `held(j, s)`: whether a bound takes the slope s of parameter j. `near_bound`: how far from its bound a constraint is
/// a candidate, relative to the larger of 1 and the bound, as optimizers stop some way inside.
ActiveRows find_active_rows(const std::vector<CertificateTerms::Row>& rows, const Eigen::VectorXd& g,
                            const std::function<bool(int j, double s)>& held, double near_bound);

/// The unit direction along e_j - H_FF^-1 H_Fj: that of j with the free parameters F where psi is least. Curvature may
/// be far less along it than along j alone. e_j where H_FF is not positive.
Eigen::VectorXd valley(const Eigen::MatrixXd& H, int j, const std::vector<Eigen::Index>& free);

}  // namespace costate
