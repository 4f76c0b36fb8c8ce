// Names in the options of a kind, resolved so that a dangling one is reported at the option it stands in.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "costate/element/point/planar_vector.h"
#include "costate/element/point/spatial_vector.h"
#include "costate/mechanism/builder.h"

namespace costate {

/// `subject` is the dotted path of the option, "spring.S1.from": the subject of the error.
const PlanarPoint& find_point(const MechanismBuilder& builder, const std::string& subject, const std::string& name);
int find_angle(const MechanismBuilder& builder, const std::string& subject, const std::string& name);
int find_coordinate(const MechanismBuilder& builder, const std::string& subject, const std::string& name);
const AttachmentFrame& find_frame(const MechanismBuilder& builder, const std::string& subject, const std::string& name);
/// The coordinates of a rigid body in space.
const std::vector<int>& find_rigid_body(const MechanismBuilder& builder, const std::string& subject,
                                        const std::string& name);

/// The vector between the points of the options "from" and "to" of the element at `path`.
PlanarVector find_line(const MechanismBuilder& builder, const std::string& path, const std::string& from,
                       const std::string& to);
/// The vector between the two points of the option `key`: errors are reported at path.key[0] or [1].
PlanarVector find_pair(const MechanismBuilder& builder, const std::string& path, const std::string& key,
                       const std::pair<std::string, std::string>& points);

/// Whether one of these names is a point of space; the find_spatial_... then report the other one.
bool is_spatial(const MechanismBuilder& builder, const std::string& from, const std::string& to);
SpatialVector find_spatial_line(const MechanismBuilder& builder, const std::string& path, const std::string& from,
                                const std::string& to);
SpatialVector find_spatial_pair(const MechanismBuilder& builder, const std::string& path, const std::string& key,
                                const std::pair<std::string, std::string>& points);

/// One angle against the ground, or two relative to each other: their coordinates. Errors are reported at
/// path.angle or path.angles[i].
std::vector<int> find_angles(const MechanismBuilder& builder, const std::string& path,
                             const std::vector<std::string>& angles);

}  // namespace costate
