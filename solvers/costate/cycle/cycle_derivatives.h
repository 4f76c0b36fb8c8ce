// What a cycle becomes as the parameters move, lib/README.md (18.5), (18.6).
#pragma once

#include <Eigen/Core>

#include "costate/cycle/cycle_values.h"
#include "costate/cycle/return_map.h"

namespace costate {

/// Rows: the section's coordinates; columns and entries: the problem's own parameters.
struct CycleDerivatives {
  Eigen::MatrixXd x;
  Eigen::VectorXd period, travel, psi;
};

/// Of the cycle through the fixed point of `map`, with its value `v` there that has all derivatives, and psi's own by
/// the cycle's `values`; what psi changes by as the largest multiplier does is not among them.
CycleDerivatives cycle_derivatives(const ReturnMap& map, const MapValue& v, const CycleValues& psi_values,
                                   const CycleValues& values);

}  // namespace costate
