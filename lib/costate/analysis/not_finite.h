// What an element computes must be a number: a formula outside its domain (log(-1), 1/t at 0), or numbers so large that
// they overflow, are named as that and not as what follows from them.
#pragma once

#include "costate/assembly/assembly.h"
#include "costate/base/error.h"

namespace costate {

/// Something of an element is not finite; the subject is the element's path. Scene::located adds which of its laws it
/// may be.
class NotFinite : public ModelError {
 public:
  using ModelError::ModelError;
};

/// Throws NotFinite if M, Q, zdot, phi, phi_q, phi_t or bias, as `assembly` holds them, are not finite; `s` is the
/// state that they were computed at (v and z null where only the constraints were).
void require_finite(Assembly& assembly, const StateView& s);

}  // namespace costate
