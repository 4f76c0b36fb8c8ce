// What a gradient takes on top of its run, by which a method is chosen on an integrator and integrators are compared.
#pragma once

#include <string>

#include "costate/formulation/formulation.h"
#include "costate/integrator/integrators.h"

namespace costate {

struct GradientPrice {
  std::string method;  // empty: the integrator has none here
  double runs = 0;     // without parameters
};

/// The method of an integrator that costs the least. Over bends the way back is dear, which begins anew at them, and so
/// is what differentiates steps, which are short there.
GradientPrice least_price(const Formulation& formulation, const Integrator& integrator, std::size_t parameters,
                          bool bends);

/// The name of the adjoint method that goes with an integrator.
std::string adjoint_on(const Integrator& integrator);

}  // namespace costate
