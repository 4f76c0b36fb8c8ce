// Reads URDF by the parser of the format's own project (urdfdom), where that was found when the tool was built.
#include <fmt/format.h>

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>

#include "costate/base/error.h"
#include "robot.h"

#ifdef COSTATE_WITH_URDF
#include <console_bridge/console.h>
#include <urdf_parser/urdf_parser.h>
#endif

namespace costate::app {

RobotInertia RobotInertia::seen_from(const Isometry3d& pose) const {
  return {mass, pose * center, pose.linear() * matrix * pose.linear().transpose()};
}

RobotInertia& RobotInertia::operator+=(const RobotInertia& other) {
  const double sum = mass + other.mass;
  if (sum == 0) {
    matrix += other.matrix;
    return *this;
  }
  const Vector3d c = (mass * center + other.mass * other.center) / sum;
  const auto about = [&](const RobotInertia& one) -> Eigen::Matrix3d {
    const Vector3d d = one.center - c;
    return one.matrix + one.mass * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
  };
  const Eigen::Matrix3d all = about(*this) + about(other);
  mass = sum;
  center = c;
  matrix = all;
  return *this;
}

const RobotBody& Robot::body(const std::string& body_name) const {
  return *std::find_if(bodies.begin(), bodies.end(), [&](const auto& b) { return b.name == body_name; });
}

#ifdef COSTATE_WITH_URDF

namespace {

Vector3d vector_of(const urdf::Vector3& v) { return {v.x, v.y, v.z}; }

Isometry3d pose_of(const urdf::Pose& p) {
  Isometry3d t = Isometry3d::Identity();
  t.linear() =
      Eigen::Quaterniond(p.rotation.w, p.rotation.x, p.rotation.y, p.rotation.z).normalized().toRotationMatrix();
  t.translation() = vector_of(p.position);
  return t;
}

/// The parser tells its complaints to a log: they become the message.
class Complaints : public console_bridge::OutputHandler {
 public:
  Complaints() { console_bridge::useOutputHandler(this); }
  ~Complaints() override { console_bridge::restorePreviousOutputHandler(); }
  void log(const std::string& text, console_bridge::LogLevel level, const char*, int) override {
    if (level >= console_bridge::CONSOLE_BRIDGE_LOG_ERROR) errors += (errors.empty() ? "" : " ") + text;
  }
  std::string errors;
};

class UrdfReader {
 public:
  UrdfReader(const std::string& file, const RobotOptions& options) : file_(file), options_(options) {}

  Robot read() {
    const Complaints complaints;
    model_ = urdf::parseURDFFile(file_);
    if (!model_)
      throw Error(fmt::format("{}: This is no URDF that can be read: {}", file_,
                              complaints.errors.empty() ? "the file cannot be opened" : complaints.errors));
    // What it could not read it has left out: an <inertial> whose mass is "1,5" is none.
    if (!complaints.errors.empty())
      throw Error(fmt::format("{}: This URDF cannot be read as a whole: {}", file_, complaints.errors));
    robot_.name = model_->getName();
    for (const auto& [name, value] : options_.positions)
      if (!model_->joints_.contains(name)) throw unknown("--pose", "joint", name, model_->joints_);
    robot_.bodies.emplace_back();  // the ground
    const auto root = model_->getRoot();
    if (options_.floating) {
      add_body(root->name).floating = true;
      add_links(*root, 1, Isometry3d::Identity());
    } else {
      add_links(*root, 0, Isometry3d::Identity());
    }
    for (auto& j : robot_.joints) {
      if (j.leader.empty()) continue;
      const auto leader =
          std::find_if(robot_.joints.begin(), robot_.joints.end(), [&](const auto& o) { return o.name == j.leader; });
      if (leader == robot_.joints.end() || !leader->leader.empty())
        throw Error(fmt::format("{}: Joint '{}' mimics '{}', which is not a joint that moves by itself.", file_, j.name,
                                j.leader));
      j.position = j.multiplier * leader->position + j.offset;
    }
    for (const RobotJoint& j : robot_.joints) tell_of_stops(j);
    place_bodies();
    for (std::size_t i = 1; i < robot_.bodies.size(); ++i)
      if (!(robot_.bodies[i].inertia.mass > 0))
        throw Error(
            fmt::format("{}: Link '{}' moves and has no mass; give it (or a link that is fixed to it) an "
                        "<inertial> with a mass above 0, or make its joint fixed.",
                        file_, robot_.bodies[i].name));
    for (const auto& [first, second] : options_.closed) close(first, second);
    return std::move(robot_);
  }

 private:
  template <class Map>
  Error unknown(const char* option, const char* what, const std::string& name, const Map& known) const {
    std::vector<std::string> names;
    for (const auto& entry : known) names.push_back(entry.first);
    return Error(fmt::format("{}: {} has no {} '{}'.{}", option, file_, what, name, suggestion(name, names)));
  }

  RobotBody& add_body(const std::string& name) {
    robot_.bodies.emplace_back();
    robot_.bodies.back().name = name;
    return robot_.bodies.back();
  }

  /// `link` stands at `pose` in the frame of the body `index`.
  void add_links(const urdf::Link& link, std::size_t index, const Isometry3d& pose) {
    where_[link.name] = {index, pose};
    RobotBody& body = robot_.bodies[index];
    if (link.name != body.name) {
      body.fixed.push_back(link.name);
      body.frames[link.name] = pose.translation();
    }
    if (link.inertial) {
      const auto& i = *link.inertial;
      RobotInertia one;
      one.mass = i.mass;
      one.matrix << i.ixx, i.ixy, i.ixz, i.ixy, i.iyy, i.iyz, i.ixz, i.iyz, i.izz;
      require_inertia(link.name, one);
      if (index == 0 && i.mass > 0)
        robot_.left_out.push_back(fmt::format("link '{}' stands on the ground, its mass does not matter", link.name));
      body.inertia += one.seen_from(pose * pose_of(i.origin));
    }
    for (const auto& v : link.visual_array)
      if (v && v->geometry) add_visual(link.name, body, pose * pose_of(v->origin), *v->geometry);
    for (const auto& joint : link.child_joints) add_joint(*joint, index, pose);
  }

  /// Of each link: in the sum with what is fixed to it a mistake would not be seen.
  void require_inertia(const std::string& link, const RobotInertia& of) const {
    constexpr double kRounding = 1e-9;
    if (!std::isfinite(of.mass) || of.mass < 0)
      throw Error(fmt::format("{}: Link '{}' has a mass of {:g} kg: at least 0 is expected.", file_, link, of.mass));
    const Vector3d moments = Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d>(of.matrix).eigenvalues();
    if (!of.matrix.allFinite() || moments[0] < -kRounding * moments.cwiseAbs().maxCoeff())
      throw Error(
          fmt::format("{}: Link '{}' has an inertia matrix whose principal moments are {:.4g}, {:.4g} and {:.4g} "
                      "kg m^2: none may be negative.",
                      file_, link, moments[0], moments[1], moments[2]));
  }

  void add_joint(const urdf::Joint& j, std::size_t parent, const Isometry3d& parent_pose) {
    const urdf::Link& child = *model_->getLink(j.child_link_name);
    const Isometry3d origin = parent_pose * pose_of(j.parent_to_joint_origin_transform);
    if (j.type == urdf::Joint::FIXED) return add_links(child, parent, origin);
    if (j.type == urdf::Joint::PLANAR || j.type == urdf::Joint::UNKNOWN)
      throw Error(
          fmt::format("{}: Joint '{}' is of a kind that is not imported (planar or unknown). A planar joint can be "
                      "written as two prismatic joints and a continuous one.",
                      file_, j.name));
    const std::size_t index = robot_.bodies.size();
    RobotBody& body = add_body(child.name);
    body.pose = origin;
    body.floating = j.type == urdf::Joint::FLOATING;
    if (j.type == urdf::Joint::FLOATING) {
      if (parent != 0)
        robot_.left_out.push_back(
            fmt::format("joint '{}' leaves '{}' free of '{}'", j.name, child.name, robot_.bodies[parent].name));
      return add_links(child, index, Isometry3d::Identity());
    }
    RobotJoint r;
    r.name = j.name;
    r.parent = robot_.bodies[parent].name;
    r.child = child.name;
    r.kind = j.type == urdf::Joint::PRISMATIC ? RobotJointKind::prismatic : RobotJointKind::revolute;
    r.continuous = j.type == urdf::Joint::CONTINUOUS;
    r.origin = origin;
    r.axis = vector_of(j.axis).normalized();
    if (!(r.axis.norm() > 0.5)) throw Error(fmt::format("{}: Joint '{}' has an axis of no length.", file_, j.name));
    if (j.limits) {
      r.effort = j.limits->effort;
      if (!r.continuous) take_limits(j.limits->lower, j.limits->upper, r);
    }
    if (j.dynamics) {
      r.damping = j.dynamics->damping;
      r.friction = j.dynamics->friction;
    }
    if (j.safety)
      robot_.left_out.push_back(fmt::format("joint '{}' has a <safety_controller>, which is not imported", j.name));
    if (j.mimic) {
      r.leader = j.mimic->joint_name;
      r.multiplier = j.mimic->multiplier;
      r.offset = j.mimic->offset;
    }
    if (const auto at = options_.positions.find(j.name); at != options_.positions.end()) {
      if (!r.leader.empty())
        throw Error(fmt::format("--pose: Joint '{}' mimics '{}'; give the position of that one.", j.name, r.leader));
      r.position = at->second;
    }
    robot_.joints.push_back(r);
    add_links(child, index, Isometry3d::Identity());
  }

  /// Limits that are left out are 0 and 0 to the parser, as those are that lock a joint.
  void take_limits(double lower, double upper, RobotJoint& r) {
    if (lower < upper)
      r.limits = {lower, upper};
    else if (lower > upper)
      robot_.left_out.push_back(
          fmt::format("joint '{}' has limits that no position meets, {:g} .. {:g}: it moves "
                      "without any",
                      r.name, lower, upper));
    else
      robot_.left_out.push_back(
          fmt::format("joint '{}' has limits {:g} .. {:g}, both of them or none given: it moves "
                      "without any; where they are to lock it, make it fixed",
                      r.name, lower, upper));
  }

  /// What the stops of a joint begin with.
  void tell_of_stops(const RobotJoint& j) {
    if (!j.limits) return;
    if (j.position < j.limits->first || j.position > j.limits->second)
      robot_.left_out.push_back(
          fmt::format("joint '{}' is at {:g}, outside its limits {:g} .. {:g}: its stop pushes "
                      "it from the start on; --pose gives another position",
                      j.name, j.position, j.limits->first, j.limits->second));
    if (!(j.effort > 0))
      robot_.left_out.push_back(fmt::format("joint '{}' gives no effort, by which its stops are made: they take 1 {}",
                                            j.name, j.kind == RobotJointKind::prismatic ? "N" : "N m"));
  }

  void add_visual(const std::string& link, RobotBody& body, const Isometry3d& pose, const urdf::Geometry& g) {
    const auto corner = [&](double x, double y, double z) { body.corners.push_back(pose * Vector3d(x, y, z)); };
    if (g.type == urdf::Geometry::BOX) {
      const Vector3d half = 0.5 * vector_of(static_cast<const urdf::Box&>(g).dim);
      for (int k = 0; k < 8; ++k)
        corner((k & 1) != 0 ? half[0] : -half[0], (k & 2) != 0 ? half[1] : -half[1], (k & 4) != 0 ? half[2] : -half[2]);
    } else if (g.type == urdf::Geometry::CYLINDER) {
      const auto& c = static_cast<const urdf::Cylinder&>(g);
      for (int k = 0; k < 6; ++k)
        for (const double z : {-0.5 * c.length, 0.5 * c.length})
          corner(c.radius * std::cos(k * std::numbers::pi / 3), c.radius * std::sin(k * std::numbers::pi / 3), z);
    } else if (g.type == urdf::Geometry::SPHERE) {
      const double r = static_cast<const urdf::Sphere&>(g).radius;
      for (const double s : {-r, r}) {
        corner(s, 0, 0);
        corner(0, s, 0);
        corner(0, 0, s);
      }
    } else {
      robot_.left_out.push_back(fmt::format("link '{}' has a mesh as its visual, which is not drawn", link));
    }
  }

  void place_bodies() {
    const auto body = [&](const std::string& name) {
      return std::find_if(robot_.bodies.begin(), robot_.bodies.end(), [&](const auto& b) { return b.name == name; });
    };
    for (const auto& j : robot_.joints) {
      Isometry3d motion = Isometry3d::Identity();
      if (j.kind == RobotJointKind::revolute)
        motion.linear() = Eigen::AngleAxisd(j.position, j.axis).toRotationMatrix();
      else
        motion.translation() = j.position * j.axis;
      body(j.child)->pose = body(j.parent)->pose * j.origin * motion;
    }
  }

  void close(const std::string& first, const std::string& second) {
    for (const auto& name : {first, second})
      if (!where_.contains(name)) throw unknown("--close", "link", name, where_);
    const auto& [a, pose_a] = where_.at(first);
    const auto& [b, pose_b] = where_.at(second);
    if (a == b) throw Error(fmt::format("--close: Links '{}' and '{}' are fixed to each other.", first, second));
    robot_.loops.push_back(
        {robot_.bodies[a].name, robot_.bodies[b].name, pose_a.translation(), pose_b.translation(), first, second});
  }

  std::string file_;
  const RobotOptions& options_;
  urdf::ModelInterfaceSharedPtr model_;
  std::map<std::string, std::pair<std::size_t, Isometry3d>> where_;  // of each link: its body, its pose in it
  Robot robot_;
};

}  // namespace

Robot read_urdf(const std::string& file, const RobotOptions& options) { return UrdfReader(file, options).read(); }

#else

Robot read_urdf(const std::string&, const RobotOptions&) {
  throw Error("This tool was built without a reader of URDF. Install liburdfdom-dev and build it again.");
}

#endif

}  // namespace costate::app
