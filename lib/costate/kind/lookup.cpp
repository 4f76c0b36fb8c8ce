#include "costate/kind/lookup.h"

#include "costate/base/error.h"

namespace costate {

namespace {
template <class Find>
decltype(auto) located(const std::string& subject, const Find& find) {
  try {
    return find();
  } catch (const ModelError& e) {
    throw ModelError(subject, e.bare_message());
  }
}

PlanarVector vector(const MechanismBuilder& builder, const std::string& i, const std::string& from,
                    const std::string& j, const std::string& to) {
  PlanarVector d(find_point(builder, i, from), find_point(builder, j, to));
  if (from == to) throw ModelError(j, "The two points must differ, both are '" + from + "'.");
  return d;
}

SpatialVector spatial_vector(const MechanismBuilder& builder, const std::string& i, const std::string& from,
                             const std::string& j, const std::string& to) {
  const auto find = [&](const std::string& subject, const std::string& name) -> const SpatialPoint& {
    return located(subject, [&]() -> const SpatialPoint& { return builder.spatial_point(name); });
  };
  SpatialVector d(find(i, from), find(j, to));
  if (from == to) throw ModelError(j, "The two points must differ, both are '" + from + "'.");
  return d;
}
}  // namespace

const PlanarPoint& find_point(const MechanismBuilder& builder, const std::string& subject, const std::string& name) {
  return located(subject, [&]() -> const PlanarPoint& { return builder.point(name); });
}

int find_angle(const MechanismBuilder& builder, const std::string& subject, const std::string& name) {
  return located(subject, [&] { return builder.angle(name); });
}

int find_coordinate(const MechanismBuilder& builder, const std::string& subject, const std::string& name) {
  return located(subject, [&] { return builder.coordinate(name); });
}

const AttachmentFrame& find_frame(const MechanismBuilder& builder, const std::string& subject,
                                  const std::string& name) {
  return located(subject, [&]() -> const AttachmentFrame& { return builder.frame(name); });
}

const std::vector<int>& find_rigid_body(const MechanismBuilder& builder, const std::string& subject,
                                        const std::string& name) {
  return located(subject, [&]() -> const std::vector<int>& { return builder.rigid_body_frame(name); });
}

PlanarVector find_line(const MechanismBuilder& builder, const std::string& path, const std::string& from,
                       const std::string& to) {
  return vector(builder, path + ".from", from, path + ".to", to);
}

PlanarVector find_pair(const MechanismBuilder& builder, const std::string& path, const std::string& key,
                       const std::pair<std::string, std::string>& points) {
  const std::string at = path + "." + key;
  return vector(builder, at + "[0]", points.first, at + "[1]", points.second);
}

bool is_spatial(const MechanismBuilder& builder, const std::string& from, const std::string& to) {
  return builder.has_spatial_point(from) || builder.has_spatial_point(to);
}

SpatialVector find_spatial_line(const MechanismBuilder& builder, const std::string& path, const std::string& from,
                                const std::string& to) {
  return spatial_vector(builder, path + ".from", from, path + ".to", to);
}

SpatialVector find_spatial_pair(const MechanismBuilder& builder, const std::string& path, const std::string& key,
                                const std::pair<std::string, std::string>& points) {
  const std::string at = path + "." + key;
  return spatial_vector(builder, at + "[0]", points.first, at + "[1]", points.second);
}

std::vector<int> find_angles(const MechanismBuilder& builder, const std::string& path,
                             const std::vector<std::string>& angles) {
  if (angles.size() == 1) return {find_angle(builder, path + ".angle", angles[0])};
  if (angles.size() != 2)
    throw ModelError(path + ".angles", "One angle or two are needed, found " + std::to_string(angles.size()) + ".");
  const std::vector<int> r = {find_angle(builder, path + ".angles[0]", angles[0]),
                              find_angle(builder, path + ".angles[1]", angles[1])};
  if (r[0] == r[1]) throw ModelError(path + ".angles[1]", "The two angles must differ, both are '" + angles[0] + "'.");
  return r;
}

}  // namespace costate
