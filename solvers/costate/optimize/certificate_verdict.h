// What a certificate's figures amount to, in one sentence, with the digits that are known.
#pragma once

#include "costate/optimize/certificate.h"

namespace costate {

/// Fills `kind` and `verdict` from all the rest; `curvature`: whether there is a Hessian.
void judge(Certificate& certificate, bool curvature);

/// With the digits that are known of it, one to six.
std::string known_eigenvalue(const Certificate& certificate, double eigenvalue);

}  // namespace costate
