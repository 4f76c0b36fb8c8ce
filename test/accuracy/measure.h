// One variant: a proven reference, what `--accuracy` makes of each request, and the best fixed setting there is.
#pragma once

#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "variants.h"

namespace costate::accuracy {

struct MeasureOptions {
  std::vector<double> requests = {1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8};
  bool exhaustive = true;   // find the best fixed setting, too
  double reference_s = 60;  // processor time of the reference's runs together; twenty times that of a vehicle's
  double limit_s = 300;     // of one request
};

/// An object {number, family, gradient, reference, floor, requests: [{accuracy, met, estimated, error, worst, choice,
/// time_s, result_s, best_s, best}]}; `error`: the true one, null where the reference is not good to a fifth of the
/// request. `unjudged` says why there is none at all.
nlohmann::json measure(std::uint64_t number, const MeasureOptions& options);

}  // namespace costate::accuracy
