// The exact derivative of one step of an explicit Runge-Kutta scheme, forward along columns and transposed; the step
// itself is held fixed (lib/README.md (9)).
#pragma once

#include <vector>

#include "costate/discrete/explicit_step.h"
#include "costate/formulation/stage_adjoint.h"

namespace costate {

class ExplicitTangent {
 public:
  ExplicitTangent(OdeSystem& system, const ExplicitScheme& scheme);
  /// Columns s_j (size() entries) and psi's derivatives (np) before the step become those behind it.
  void step(const ExplicitStages& stages, double* const* s, double* psi);

 private:
  OdeSystem& system_;
  const ExplicitScheme& scheme_;
  int n_, np_;
  std::vector<double> rates_, at_, cost_;
  std::vector<const double*> in_;
  std::vector<double*> out_;
};

class ExplicitAdjoint {
 public:
  /// Throws CapabilityError where the system gives no transposed products of its own.
  ExplicitAdjoint(OdeSystem& system, const ExplicitScheme& scheme);
  /// mu behind the step becomes mu before it; the gradient gains the step's own dependence on rho.
  void step_back(const ExplicitStages& stages, double* mu, double* gradient);

 private:
  StageAdjoint& system_;
  const ExplicitScheme& scheme_;
  int n_;
  bool has_cost_;
  std::vector<double> pulled_, weight_;
};

}  // namespace costate
