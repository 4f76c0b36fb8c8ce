// [road.NAME]: the ground under tyres, shared by any number of them. Flat, a profile over the distance x, or
// a post that moves in time. The shapes are laws of the distance: bump, sine_sweep, iso8608, noise,
// profile_table.
#pragma once

#include <memory>
#include <string>

#include "costate/element/force/road.h"
#include "costate/kind/law/law_options.h"

namespace costate {

struct RoadOptions {
  Road::Kind kind = Road::Kind::flat;
  double height_m = 0;       // of a flat road
  LawOptions law = {};       // of a profile: height over x; of a post: over t, or over speed t
  double speed_m_per_s = 0;  // of a post: 0 means that its law is one of time
  double ramp = 0;           // 0 to 1 over this distance [m] of a profile or time [s] of a post; 0: at once
};
void add_road(MechanismBuilder& builder, const std::string& name, const RoadOptions& options);

/// `subject` is the dotted path of the option that names the road, for errors.
std::shared_ptr<const Road> find_road(const MechanismBuilder& builder, const std::string& subject,
                                      const std::string& name);

}  // namespace costate
