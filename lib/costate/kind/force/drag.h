// [drag.NAME]: aerodynamic drag at a point, of the plane or of space, against the wind.
#pragma once

#include <array>
#include <string>

#include "costate/kind/law/law_options.h"

namespace costate {

struct DragOptions {
  double drag_coefficient = 0;
  double area_m2 = 0;
  double air_density_kg_per_m3 = 1.2;
  /// Speed below which the quadratic law turns into a linear one, see element/force/drag.h.
  double smoothing_m_per_s = 0.01;
  std::array<LawOptions, 3> wind_m_per_s = {0.0, 0.0, 0.0};  // of time, in the ground's frame; z not in the plane
};
void add_drag(MechanismBuilder& builder, const std::string& name, const std::string& point, const DragOptions& options);

}  // namespace costate
