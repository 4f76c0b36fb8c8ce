// The two kinds of Runge-Kutta schemes that runs and discrete methods are made for, by what they are made of: explicit
// ones on a right-hand side, Radau IIA on a residual.
#pragma once

#include <cmath>
#include <string>

#include "costate/discrete/explicit_derivative.h"
#include "costate/discrete/explicit_step.h"
#include "costate/discrete/radau_derivative.h"
#include "costate/discrete/radau_step.h"
#include "costate/integrator/explicit_tape.h"
#include "costate/integrator/radau_tape.h"
#include "costate/problem/problem.h"

namespace costate {

struct ExplicitKind {
  using SystemType = OdeSystem;
  using Scheme = ExplicitScheme;
  using Step = ExplicitStep;
  using Stages = ExplicitStages;
  using Tape = ExplicitTape;
  using Tangent = ExplicitTangent;
  using Adjoint = ExplicitAdjoint;
  static constexpr bool implicit = false;
  static const Scheme* find(const std::string& name) { return find_explicit_scheme(name); }
  /// Up to which errors of stabilized constraints decay. There may be none that would tell, but a tangent and an
  /// adjoint have them.
  static double longest_step(const OdeSystem& system, const Scheme& scheme) {
    // Of the bound on the negative real axis; so much holds for those hardly damped, too (dopri5: 0.73 at xi = 0.05).
    constexpr double kStable = 0.7;
    const double rate = system.stabilizing_rate();
    return rate > 0 ? kStable * scheme.stability / rate : HUGE_VAL;
  }
  static std::unique_ptr<OdeSystem> make(const Problem& problem) { return problem.make_ode(); }
};

struct RadauKind {
  using SystemType = DaeSystem;
  using Scheme = RadauScheme;
  using Step = RadauStep;
  using Stages = RadauStages;
  using Tape = RadauTape;
  using Tangent = RadauTangent;
  using Adjoint = RadauAdjoint;
  static constexpr bool implicit = true;
  static const Scheme* find(const std::string& name) { return find_radau_scheme(name); }
  static double longest_step(const DaeSystem&, const Scheme&) { return HUGE_VAL; }
  static std::unique_ptr<DaeSystem> make(const Problem& problem) { return problem.make_dae(); }
};

}  // namespace costate
