// [driver.NAME]: a coordinate, or a weighted sum of several, follows a law of time (with a constant law: a
// gear); [distance_driver.NAME]: the distance between two points does.
#pragma once

#include <string>
#include <vector>

#include "costate/kind/law/law_options.h"

namespace costate {

/// One weight a coordinate; without weights a single coordinate counts once.
void add_driver(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& coordinates,
                const std::vector<double>& weights, const LawOptions& law);

void add_distance_driver(MechanismBuilder& builder, const std::string& name, const std::string& from,
                         const std::string& to, const LawOptions& length_m);

}  // namespace costate
