#include "costate/kind/contact/contact_ground.h"

#include <fmt/format.h>

#include "costate/base/error.h"
#include "costate/element/law/motion_law.h"
#include "costate/kind/lookup.h"
#include "costate/kind/road/road.h"

namespace costate {

namespace {

void require_smooth(const MechanismBuilder& builder, const std::string& subject, const Road& road) {
  std::vector<double> p;
  for (const int number : road.numbers()) p.push_back(builder.number_value(number));
  const double* law = p.data() + road.law_numbers();
  const LawJoints joints = road.has_ramp() ? law_joints(*road.law(), law, 0) : law_joints(*road.law(), law);
  for (const LawJoint& j : joints.all)
    if (joints.jumps(j) || joints.bends(j))
      throw ModelError(subject,
                       fmt::format("The profile has a {} at x = {:g}, on which what has a radius turns about an "
                                   "edge: take a profile with a continuous slope, or a contact without radius.",
                                   joints.jumps(j) ? "jump" : "kink", j.x));
}

}  // namespace

ContactGround find_contact_ground(const MechanismBuilder& builder, const std::string& path,
                                  const ContactGroundOptions& options, const std::vector<int>& point_coordinates,
                                  bool round, bool space) {
  ContactGround ground;
  if (!options.road.empty()) {
    ground.road = find_road(builder, path + ".road", options.road);
    if (round && ground.road->kind() == Road::Kind::profile) require_smooth(builder, path + ".road", *ground.road);
  }
  if (options.ground_body.empty()) return ground;
  const std::string subject = path + ".ground_body";
  if (space)
    throw ModelError(subject,
                     "A body carries the ground in the plane only. In space let a [road] of the kind 'post' "
                     "move it, or take a [contact_pair] with a sphere.");
  const AttachmentFrame& frame = find_frame(builder, subject, options.ground_body);
  if (frame.kind != PlanarPoint::Kind::on_body)
    throw ModelError(subject, fmt::format("'{}' is no [body].", options.ground_body));
  ground.carrier = frame.coordinates;
  if (ground.carrier == point_coordinates)
    throw ModelError(subject, fmt::format("What touches is on '{}' itself: name another body.", options.ground_body));
  return ground;
}

}  // namespace costate
