// The certificate of an optimum as JSON and as the lines that a user reads.
#pragma once

#include <string>

#include "command.h"
#include "costate/optimize/certificate.h"

namespace costate::app {

/// `wall_s`: what the certificate took [s].
Json certificate_json(const Certificate& c, double wall_s);
std::string certificate_text(const Certificate& c);

}  // namespace costate::app
