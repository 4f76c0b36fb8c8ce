// [maxwell.NAME]: a spring in series with a damper between two points (relaxation); its state is the damper's
// stroke.
#pragma once

#include <string>

#include "costate/mechanism/builder.h"

namespace costate {

struct MaxwellOptions {
  double stiffness_N_per_m = 0;
  double natural_length_m = 0;
  double damping_N_s_per_m = 0;
  double initial_stroke_m = 0;
};
void add_maxwell(MechanismBuilder& builder, const std::string& name, const std::string& from, const std::string& to,
                 const MaxwellOptions& options);

}  // namespace costate
