#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "robot.h"

namespace costate::app {

namespace {

/// As a scene writes it; what rounding left of a zero is one.
std::string number_text(double x) { return fmt::format("{}", std::abs(x) < 1e-14 ? 0.0 : x); }
std::string axis_text(const Vector3d& a) {
  return fmt::format("[{}, {}, {}]", number_text(a[0]), number_text(a[1]), number_text(a[2]));
}

class RobotWriter {
 public:
  RobotWriter(const Robot& robot, const std::string& source) : robot_(robot), source_(source) {}

  std::string text() {
    // Bodies and joints become names of coordinates, which differ.
    for (const auto& b : robot_.bodies)
      if (!b.name.empty()) body_names_[b.name] = fresh(b.name);
    for (const auto& j : robot_.joints) joint_names_[j.name] = fresh(j.name, "_joint");
    head();
    for (const auto& b : robot_.bodies)
      if (!b.name.empty()) body(b);
    for (const auto& j : robot_.joints) joint(j);
    loops();
    start();
    return text_;
  }

  std::string coordinate(const RobotJoint& j) {
    return joint_names_.at(j.name) + (j.kind == RobotJointKind::revolute ? ".angle" : ".displacement");
  }

 private:
  /// A name that a scene may have, unlike those before.
  std::string fresh(const std::string& wanted, const char* suffix = "_2") {
    std::string name;
    for (const char c : wanted)
      name += (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' ? c : '_';
    if (name.empty() || (name[0] >= '0' && name[0] <= '9')) name = "n" + name;
    while (!names_.insert(name).second) name += suffix;
    return name;
  }
  void line(const std::string& text) { text_ += text + "\n"; }
  void entry(const char* key, double x) {
    if (std::abs(x) >= 1e-14) line(fmt::format("{} = {}", key, number_text(x)));
  }

  void head() {
    line(
        fmt::format("# From {}: robot '{}'. Each link that moves is a body with the link's frame, what is fixed to it\n"
                    "# included; each joint that moves has a coordinate, zero where the joint's position is.",
                    source_, robot_.name));
    for (const auto& sentence : robot_.left_out) line("# Note: " + sentence + ".");
    std::string title;
    for (const char c : robot_.name) title += c == '"' || c == '\\' || static_cast<unsigned char>(c) < 32 ? ' ' : c;
    line(fmt::format("title = \"{}\"\n\n[gravity]\nz_m_per_s2 = -9.81\n", title));
  }

  /// The point's name.
  std::string point(const std::string& wanted, const std::string& body, const Vector3d& at) {
    const std::string name = fresh(wanted);
    line(fmt::format("[point.{}]", name));
    line(body.empty() ? "ground = true" : fmt::format("on = \"{}\"", body_names_.at(body)));
    const char* keys[] = {"x_m", "y_m", "z_m"};
    for (int k = 0; k < 3; ++k) line(fmt::format("{} = {}", keys[k], number_text(at[k])));
    line("");
    return name;
  }

  void body(const RobotBody& b) {
    line(fmt::format("# Link {}{}", b.name,
                     b.fixed.empty() ? "" : fmt::format(", fixed to it: {}", fmt::join(b.fixed, ", "))));
    line(fmt::format("[rigid_body.{}]", body_names_.at(b.name)));
    const Vector3d r = b.pose.translation();
    Eigen::Quaterniond q(b.pose.linear());
    if (q.w() < 0) q.coeffs() = -q.coeffs();
    line(fmt::format("x_m = {}\ny_m = {}\nz_m = {}", number_text(r[0]), number_text(r[1]), number_text(r[2])));
    line(fmt::format("e0 = {}\ne1 = {}\ne2 = {}\ne3 = {}", number_text(q.w()), number_text(q.x()), number_text(q.y()),
                     number_text(q.z())));
    const RobotInertia& i = b.inertia;
    line(fmt::format("mass_kg = {}", number_text(i.mass)));
    entry("center_x_m", i.center[0]);
    entry("center_y_m", i.center[1]);
    entry("center_z_m", i.center[2]);
    const char* axes = "xyz";
    for (int k = 0; k < 3; ++k) line(fmt::format("inertia_{0}{0}_kg_m2 = {1}", axes[k], number_text(i.matrix(k, k))));
    entry("inertia_xy_kg_m2", i.matrix(0, 1));
    entry("inertia_xz_kg_m2", i.matrix(0, 2));
    entry("inertia_yz_kg_m2", i.matrix(1, 2));
    line("");
    for (const auto& [name, at] : b.frames) point(name, b.name, at);
    if (b.corners.empty()) return;
    line("# Corners of its visuals, for drawings.");
    for (std::size_t k = 0; k < b.corners.size(); ++k)
      point(fmt::format("{}_corner_{}", b.name, k + 1), b.name, b.corners[k]);
  }

  void joint(const RobotJoint& j) {
    const std::string& name = joint_names_.at(j.name);
    const bool turns = j.kind == RobotJointKind::revolute;
    const char* unit = turns ? "rad" : "m";
    line(fmt::format("# Joint {}, {}: {} on {}{}", j.name,
                     turns ? (j.continuous ? "continuous" : "revolute") : "prismatic", j.child,
                     j.parent.empty() ? "the ground" : j.parent,
                     j.limits ? fmt::format("; limits {:g} .. {:g} {}, effort {:g} {}", j.limits->first,
                                            j.limits->second, unit, j.effort, turns ? "N m" : "N")
                              : ""));
    const std::string base = point(j.name + "_base", j.parent, j.origin.translation());
    const std::string tip = point(j.name + "_tip", j.child, Vector3d::Zero());
    const Vector3d across = j.axis.unitOrthogonal(), axis = j.origin.linear() * j.axis,
                   normal = j.origin.linear() * across;
    line(fmt::format("[{}.{}]\npoints = [\"{}\", \"{}\"]", turns ? "hinge" : "translational", name, base, tip));
    line(fmt::format("axis_first = {}\naxis_second = {}", axis_text(axis), axis_text(j.axis)));
    line(fmt::format("normal_first = {}\nnormal_second = {}", axis_text(normal), axis_text(across)));
    line(fmt::format("{} = \"{}\"", turns ? "angle" : "displacement", name));
    if (j.position != 0) line(fmt::format("{} = {}", turns ? "angle_rad" : "displacement_m", number_text(j.position)));
    line("");
    stops(j, name, base, tip, axis);
    if (!j.leader.empty()) mimic(j, name);
  }

  /// Damping, and stops at the limits that reach the joint's effort a hundredth of a radian (a millimetre) behind them.
  void stops(const RobotJoint& j, const std::string& name, const std::string& base, const std::string& tip,
             const Vector3d& axis) {
    const bool turns = j.kind == RobotJointKind::revolute;
    if (j.limits || j.damping != 0) {
      line(turns ? fmt::format("[torsion_spring.{}]\nangle = \"{}\"", fresh(j.name + "_dynamics"), name)
                 : fmt::format("[axis_spring.{}]\nfrom = \"{}\"\nto = \"{}\"\naxis = {}", fresh(j.name + "_dynamics"),
                               base, tip, axis_text(axis)));
      if (j.damping != 0)
        line(fmt::format("{} = {}", turns ? "damping_N_m_s_per_rad" : "damping_N_s_per_m", number_text(j.damping)));
      if (j.limits) {
        const double depth = turns ? 0.01 : 0.001, stiffness = (j.effort > 0 ? j.effort : 1) / depth;
        if (!turns) line("natural_length_m = 0");
        const auto stop = [&](double gap, const char* side) {
          return fmt::format("{{ kind = \"bump_stop\", gap = {}, stiffness = {}, smoothing = {}, side = \"{}\" }}",
                             number_text(gap), number_text(stiffness), number_text(0.1 * depth), side);
        };
        line(fmt::format("spring_law = {{ kind = \"sum\", terms = [{}, {}] }}", stop(j.limits->first, "below"),
                         stop(j.limits->second, "above")));
      }
      line("");
    }
    if (j.friction != 0) {
      line(fmt::format("[friction.{}]", fresh(j.name + "_friction")));
      line(turns ? fmt::format("angle = \"{}\"\nradius_m = 1", name)
                 : fmt::format("coordinate = \"{}.displacement\"", name));
      line(fmt::format("normal_force_N = {}\nstatic_coefficient = 1\ntransition_velocity_m_per_s = 0.01\n",
                       number_text(j.friction)));
    }
  }

  void mimic(const RobotJoint& j, const std::string& name) {
    const auto& leader = *std::find_if(robot_.joints.begin(), robot_.joints.end(),
                                       [&](const auto& other) { return other.name == j.leader; });
    line(fmt::format("# It is {:g} times {}{}.", j.multiplier, j.leader,
                     j.offset != 0 ? fmt::format(" and {:g}", j.offset) : ""));
    line(fmt::format("[driver.{}]\ncoordinates = [\"{}\", \"{}\"]\nweights = [1, {}]\nlaw = {}\n",
                     fresh(name + "_mimic"), coordinate(j), coordinate(leader), number_text(-j.multiplier),
                     number_text(j.offset)));
  }

  void loops() {
    const auto directions = loop_directions(robot_);
    for (std::size_t i = 0; i < robot_.loops.size(); ++i) {
      const RobotLoop& l = robot_.loops[i];
      line(fmt::format("# A loop: the origins of links {} and {} are one point.", l.first_link, l.second_link));
      const std::string a = point(fmt::format("{}_closed", l.first_link), l.first, l.at_first),
                        b = point(fmt::format("{}_closed", l.second_link), l.second, l.at_second);
      const std::string pair = fmt::format("points = [\"{}\", \"{}\"]", a, b);
      if (directions[i].cols() == 3) {
        line(fmt::format("[spherical.{}]\n{}\n", fresh(fmt::format("loop_{}", i + 1)), pair));
        continue;
      }
      line("# In the directions left out they are together by the other joints, so that rows would be redundant.");
      const Eigen::Matrix3d back = robot_.body(l.first).pose.linear().transpose();
      for (Eigen::Index k = 0; k < directions[i].cols(); ++k)
        line(fmt::format("[in_plane.{}]\n{}\nnormal = {}\n", fresh(fmt::format("loop_{}_{}", i + 1, "abc"[k])), pair,
                         axis_text(back * directions[i].col(k))));
    }
  }

  void start() {
    line("[start]");
    std::vector<std::string> given;
    for (const auto& b : robot_.bodies)
      if (b.floating) given.push_back(fmt::format("\"{}\"", body_names_.at(b.name)));
    const auto free = free_coordinates(robot_);
    for (const auto& j : robot_.joints)
      if (std::find(free.begin(), free.end(), j.name) != free.end())
        given.push_back(fmt::format("\"{}\"", coordinate(j)));
    line(fmt::format("given = [{}]\n\n[run]\nt_end_s = 2", fmt::join(given, ", ")));
  }

  const Robot& robot_;
  std::string source_, text_;
  std::set<std::string> names_;
  std::map<std::string, std::string> body_names_, joint_names_;
};

/// How the origin of each loop's second link moves against that of the first, by the joints that move by themselves:
/// three rows a loop, a column a joint.
Eigen::MatrixXd loop_jacobian(const Robot& robot, const std::vector<const RobotJoint*>& leaders) {
  Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3 * static_cast<Eigen::Index>(robot.loops.size()),
                                            static_cast<Eigen::Index>(leaders.size()));
  for (std::size_t i = 0; i < robot.loops.size(); ++i) {
    const RobotLoop& l = robot.loops[i];
    const auto add = [&](std::string body, const Vector3d& at, double sign) {
      const Vector3d point = robot.body(body).pose * at;
      // From the body down to the ground.
      for (auto j = robot.joints.rbegin(); j != robot.joints.rend(); ++j) {
        if (j->child != body) continue;
        const Isometry3d frame = robot.body(j->parent).pose * j->origin;
        const Vector3d axis = frame.linear() * j->axis;
        Vector3d v = axis;
        if (j->kind == RobotJointKind::revolute) v = axis.cross(point - frame.translation());
        const auto leader = std::find_if(leaders.begin(), leaders.end(), [&](const RobotJoint* one) {
          return one->name == (j->leader.empty() ? j->name : j->leader);
        });
        J.block<3, 1>(3 * static_cast<Eigen::Index>(i), leader - leaders.begin()) +=
            sign * (j->leader.empty() ? 1 : j->multiplier) * v;
        body = j->parent;
      }
    };
    add(l.second, l.at_second, 1);
    add(l.first, l.at_first, -1);
  }
  return J;
}

std::vector<const RobotJoint*> leaders_of(const Robot& robot) {
  std::vector<const RobotJoint*> r;
  for (const auto& j : robot.joints)
    if (j.leader.empty()) r.push_back(&j);
  return r;
}

}  // namespace

std::vector<Eigen::Matrix3Xd> loop_directions(const Robot& robot) {
  const Eigen::MatrixXd J = loop_jacobian(robot, leaders_of(robot));
  std::vector<Eigen::Matrix3Xd> r;
  for (std::size_t i = 0; i < robot.loops.size(); ++i) {
    const Eigen::MatrixXd rows = J.middleRows(3 * static_cast<Eigen::Index>(i), 3);
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(rows, Eigen::ComputeFullU | Eigen::ComputeThinV);
    const auto& s = svd.singularValues();
    const Eigen::Index rank = s.size() == 0 || s[0] == 0 ? 0 : (s.array() > 1e-9 * s[0]).count();
    r.push_back(svd.matrixU().leftCols(rank));
  }
  return r;
}

std::vector<std::string> free_coordinates(const Robot& robot) {
  // The last joints that can be made to follow do.
  const auto leaders = leaders_of(robot);
  const Eigen::MatrixXd J = loop_jacobian(robot, leaders);
  std::vector<Eigen::VectorXd> basis;
  std::set<std::string> dependent;
  for (Eigen::Index k = J.cols() - 1; k >= 0; --k) {
    Eigen::VectorXd rest = J.col(k);
    const double size = rest.norm();
    for (int pass = 0; pass < 2; ++pass)
      for (const auto& b : basis) rest -= b.dot(rest) * b;
    if (!(rest.norm() > 1e-7 * size) || size == 0) continue;
    basis.push_back(rest.normalized());
    dependent.insert(leaders[static_cast<std::size_t>(k)]->name);
  }
  std::vector<std::string> r;
  for (const RobotJoint* j : leaders)
    if (!dependent.contains(j->name)) r.push_back(j->name);
  return r;
}

std::string robot_scene(const Robot& robot, const std::string& source) { return RobotWriter(robot, source).text(); }

}  // namespace costate::app
