// [bar.NAME]: a rigid bar between two points, free or on the ground: its inertia and the constraint of its
// length.
#pragma once

#include <optional>
#include <string>

#include "costate/mechanism/builder.h"

namespace costate {

struct BarOptions {
  double mass_kg = 0;                        // 0: a massless link, only the constraint
  std::optional<double> length_m = {};       // default: the distance of the points at the start
  std::optional<double> center_m = {};       // centre of mass from the first point; default: a uniform bar
  std::optional<double> inertia_kg_m2 = {};  // about the centre of mass; to be given together with center_m
};
void add_bar(MechanismBuilder& builder, const std::string& name, const std::string& from, const std::string& to,
             const BarOptions& options);

}  // namespace costate
