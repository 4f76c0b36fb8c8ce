// A robot as URDF describes it, in the terms of scenes: bodies, joints, and what is fixed to what.
#pragma once

#include <Eigen/Geometry>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace costate::app {

using Eigen::Isometry3d;
using Eigen::Vector3d;

/// Mass, centre, and the inertia matrix about the centre, in a body's frame.
struct RobotInertia {
  double mass = 0;
  Vector3d center = Vector3d::Zero();
  Eigen::Matrix3d matrix = Eigen::Matrix3d::Zero();

  /// The same in a frame in which this one stands at `pose`.
  RobotInertia seen_from(const Isometry3d& pose) const;
  RobotInertia& operator+=(const RobotInertia& other);
};

/// Links that are fixed to each other; the frame is that of the first. The ground is the body that has no name.
struct RobotBody {
  std::string name;
  RobotInertia inertia;
  std::vector<std::string> fixed;            // names of further links in it
  std::map<std::string, Vector3d> frames;    // of those: where their origins are
  std::vector<Vector3d> corners;             // of its visuals
  Isometry3d pose = Isometry3d::Identity();  // at the start
  bool floating = false;                     // joined to nothing
};

enum class RobotJointKind { revolute, prismatic };

struct RobotJoint {
  std::string name, parent, child;  // bodies
  RobotJointKind kind = RobotJointKind::revolute;
  bool continuous = false;
  Isometry3d origin = Isometry3d::Identity();  // of the joint's frame in the parent's; the child's is the same at zero
  Vector3d axis = Vector3d::UnitX();           // in the joint's frame
  double position = 0;                         // at the start [rad or m]
  std::optional<std::pair<double, double>> limits;
  double effort = 0, damping = 0, friction = 0;
  std::string leader;  // that it mimics, or empty
  double multiplier = 1, offset = 0;
};

/// Two links whose origins are to coincide: a loop.
struct RobotLoop {
  std::string first, second;     // bodies
  Vector3d at_first, at_second;  // in their frames
  std::string first_link, second_link;
};

struct Robot {
  std::string name;
  std::vector<RobotBody> bodies;   // the ground first
  std::vector<RobotJoint> joints;  // parents before children
  std::vector<RobotLoop> loops;
  std::vector<std::string> left_out;  // what a scene has no place for, as sentences

  const RobotBody& body(const std::string& body_name) const;
};

struct RobotOptions {
  bool floating = false;                                    // the root link is a free body
  std::map<std::string, double> positions;                  // of joints at the start
  std::vector<std::pair<std::string, std::string>> closed;  // links
};

/// Reads a URDF file. Throws Error that names the file and what is wrong.
Robot read_urdf(const std::string& file, const RobotOptions& options);

/// The scene, with comments.
std::string robot_scene(const Robot& robot, const std::string& source);

/// Joints whose coordinates the closed loops and mimics leave free at the start, in order.
std::vector<std::string> free_coordinates(const Robot& robot);

/// For each loop the directions (of the ground's axes) along which its two points are not together by themselves.
std::vector<Eigen::Matrix3Xd> loop_directions(const Robot& robot);

}  // namespace costate::app
