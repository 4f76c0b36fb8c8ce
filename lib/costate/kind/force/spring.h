// [spring.NAME]: a spring and damper in parallel between two points; [torsion_spring.NAME]: the same on one
// angle or between two. F = k (x - x0) + c xdot + F0 + spring_law(x - x0) + damper_law(xdot), pulling for F >
// 0.
#pragma once

#include <string>
#include <vector>

#include "costate/element/force/force_law.h"
#include "costate/kind/law/law_options.h"
#include "costate/scene/scene_table.h"

namespace costate {

struct SpringOptions {
  double stiffness_N_per_m = 0;
  double natural_length_m = 0;
  double damping_N_s_per_m = 0;
  double preload_N = 0;
  LawOptions spring_law = {}, damper_law = {};  // in addition to the linear parts
};
void add_spring(MechanismBuilder& builder, const std::string& name, const std::string& from, const std::string& to,
                const SpringOptions& options);

/// For other kinds with the keys of [spring]: the law and the numbers under `path`; `length` says what lengths may be.
struct SpringParts {
  SpringDamperLaw law;
  std::vector<int> numbers;
};
SpringParts add_spring_parts(MechanismBuilder& builder, const std::string& path, const SpringOptions& options,
                             NumberRule length = NumberRule::non_negative);
SpringOptions read_spring_options(SceneTable& table);

struct TorsionSpringOptions {
  double stiffness_N_m_per_rad = 0;
  double natural_angle_rad = 0;
  double damping_N_m_s_per_rad = 0;
  double preload_N_m = 0;
  LawOptions spring_law = {}, damper_law = {};
};
/// One angle against the ground, or two: the spring acts on the second relative to the first.
void add_torsion_spring(MechanismBuilder& builder, const std::string& name, const std::vector<std::string>& angles,
                        const TorsionSpringOptions& options);

}  // namespace costate
