// The velocity jump (impulse_jump.h) of formulations that solve the balance of impulses as they solve for
// accelerations, with 1/alpha in its corner where they have one.
#pragma once

#include "costate/level/acceleration_level.h"
#include "costate/level/impulse_jump.h"

namespace costate {

class VelocityJump : public ImpulseJump {
 public:
  VelocityJump(Assembly& assembly, AccelerationLevel& level);
};

}  // namespace costate
