// What a drawing of a mechanism shows, found by generic means: an element joins the points whose numbers or
// coordinates it uses, and acts on the bodies whose coordinates these are. So a new kind of element is drawn
// without being known here.
#pragma once

#include <Eigen/Geometry>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "costate/mechanism/mechanism.h"

namespace costate::app {

using Eigen::Vector3d;

/// A point, in space; of the plane at z = 0.
struct Place {
  std::string name;
  Vector3d at;
  bool ground = false;
};

/// A frame that is fixed in a body: its origin, and its axes as columns, in the ground's.
struct BodyFrame {
  Vector3d origin = Vector3d::Zero();
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
};

/// A body: where its points are, in the ground's frame, and a box about its centre where these span nothing.
struct BodyShape {
  std::string name;
  std::vector<Vector3d> corners;
  bool slender = false;            // a bar between two points
  std::optional<BodyFrame> frame;  // of a body with coordinates of its own
};

enum class LinkRole {
  joint,    // a constraint whose points coincide
  rod,      // one that keeps two points apart
  guide,    // any other one between points
  driver,   // one that moves in time
  spring,   // a force between points
  load,     // a force at one point
  wheel,    // one with an axis and a radius
  contact,  // of points, or of circles about them, with the ground: the last place is on it
  pair,     // of two circles with each other
  couple    // a force or a driver on a coordinate, at its body: along it where it is a length
};

/// A constraint or a force.
struct LinkShape {
  std::string name;
  LinkRole role = LinkRole::joint;
  std::vector<Vector3d> at;  // one place or several
  std::optional<Vector3d>
      direction;            // of a joint's axis, a load's force, a coordinate, along the ground; a unit vector
  double radius = 0;        // of a wheel, a round contact
  double other_radius = 0;  // of the second circle of a pair
  Eigen::Matrix3d turned = Eigen::Matrix3d::Identity();  // the axes of the body of its first point
};

struct Figure {
  std::vector<Place> places;
  std::vector<BodyShape> bodies;
  std::vector<LinkShape> links;
  bool spatial = false;
  int up = 2;       // the axis against gravity: 0 x, 1 y, 2 z
  double size = 1;  // [m]
};

/// Numbers of the scene that are none of the mechanism's, by path: an axis that cannot vary.
using SceneNumbers = std::function<std::optional<double>(const std::string& path)>;

/// The mechanism at the positions q and velocities v, force states z.
Figure make_figure(const Mechanism& mechanism, const SceneNumbers& numbers, const Eigen::VectorXd& q,
                   const Eigen::VectorXd& v, const Eigen::VectorXd& z, double t);

}  // namespace costate::app
