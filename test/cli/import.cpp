// costate import: robots from URDF, against the dynamics of KDL, which reads nothing of ours; loops and mimics against
// geometry; what a reader of the scene finds.
#include <catch2/catch.hpp>
#include <cmath>
#include <map>

#include "costate/integrator/simulate.h"
#include "costate/objective/output.h"
#include "costate/problem/scene_problem.h"
#include "costate/scene/scene.h"
#include "process.h"
#include "support/paths.h"

#ifdef COSTATE_WITH_URDF
#include <urdf_parser/urdf_parser.h>
#endif
#ifdef COSTATE_WITH_KDL
#include <kdl/tree.hpp>
#include <kdl/treeidsolver_recursive_newton_euler.hpp>
#endif

using namespace costate;
using namespace costate::test;
using Catch::Matchers::Contains;

namespace {

const std::string kRobots = std::string(COSTATE_SOURCE_DIR) + "/test/robots/";

std::string imported(const std::string& robot, std::vector<std::string> options = {}) {
  const WorkingDirectory here;
  options.insert(options.begin(), {"import", kRobots + robot, "-o", "r.toml"});
  const Outcome o = run_costate(options, here.path());
  INFO(o.err);
  REQUIRE(o.status == 0);
  CHECK(o.err.empty());
  return file_text(here / "r.toml");
}

/// Outputs by name at the start of a scene.
std::map<std::string, double> at_start(const Scene& scene, const std::vector<std::string>& names) {
  Problem problem = make_problem(scene);
  problem.formulation = "index1";
  std::map<std::string, double> values;
  simulate(problem, {}, {0.0}, [&](const MechanismState& s, System& system) {
    for (const auto& name : names) values[name] = make_output(*problem.mechanism, name)->value(s, system.assembly());
  });
  return values;
}

}  // namespace

#ifdef COSTATE_WITH_URDF

#ifdef COSTATE_WITH_KDL

namespace {

KDL::Frame frame_of(const urdf::Pose& p) {
  return KDL::Frame(KDL::Rotation::Quaternion(p.rotation.x, p.rotation.y, p.rotation.z, p.rotation.w),
                    KDL::Vector(p.position.x, p.position.y, p.position.z));
}

void add_to(KDL::Tree& tree, const urdf::Link& link) {
  for (const auto& joint : link.child_joints) {
    const KDL::Frame origin = frame_of(joint->parent_to_joint_origin_transform);
    const KDL::Vector axis(joint->axis.x, joint->axis.y, joint->axis.z);
    KDL::Joint j(joint->name, KDL::Joint::None);
    if (joint->type == urdf::Joint::PRISMATIC)
      j = KDL::Joint(joint->name, origin.p, origin.M * axis, KDL::Joint::TransAxis);
    else if (joint->type != urdf::Joint::FIXED)
      j = KDL::Joint(joint->name, origin.p, origin.M * axis, KDL::Joint::RotAxis);
    const auto child = std::find_if(link.child_links.begin(), link.child_links.end(),
                                    [&](const auto& l) { return l->name == joint->child_link_name; });
    KDL::RigidBodyInertia inertia = KDL::RigidBodyInertia::Zero();
    if (const auto& i = (*child)->inertial)
      inertia = frame_of(i->origin) *
                KDL::RigidBodyInertia(i->mass, KDL::Vector::Zero(),
                                      KDL::RotationalInertia(i->ixx, i->iyy, i->izz, i->ixy, i->ixz, i->iyz));
    REQUIRE(tree.addSegment(KDL::Segment((*child)->name, j, origin, inertia), link.name));
    add_to(tree, **child);
  }
}

struct JointState {
  std::string name;        // of the joint
  std::string coordinate;  // in the scene
  std::string rate_key;    // where its rate at the start stands
  double q, v, damping;
};

/// Costate's accelerations at (q, v), put into KDL's inverse dynamics, must need no torque but what damping exerts.
void compare_with_kdl(const std::string& file, const std::vector<JointState>& joints) {
  std::vector<std::string> options, overrides, outputs;
  for (const auto& j : joints) {
    options.insert(options.end(), {"--pose", j.name + "=" + std::to_string(j.q)});
    overrides.push_back(j.rate_key + "=" + std::to_string(j.v));
    for (const char* suffix : {"", "_dot", "_ddot"}) outputs.push_back(j.coordinate + suffix);
  }
  const Scene scene = Scene::parse(imported(file, options), "r.toml", overrides);
  auto values = at_start(scene, outputs);
  const auto model = urdf::parseURDFFile(kRobots + file);
  REQUIRE(model);
  KDL::Tree tree(model->getRoot()->name);
  add_to(tree, *model->getRoot());
  const unsigned n = tree.getNrOfJoints();
  REQUIRE(n == joints.size());
  KDL::JntArray q(n), v(n), a(n), torque(n);
  std::vector<unsigned> index;
  for (const auto& j : joints) {
    for (const auto& [name, element] : tree.getSegments())
      if (element.segment.getJoint().getName() == j.name) index.push_back(element.q_nr);
    // What the start was told, to six decimals by std::to_string, exactly.
    CHECK(values.at(j.coordinate) == Approx(std::stod(std::to_string(j.q))).margin(1e-13));
    CHECK(values.at(j.coordinate + "_dot") == Approx(std::stod(std::to_string(j.v))).margin(1e-12));
    q(index.back()) = values.at(j.coordinate);
    v(index.back()) = values.at(j.coordinate + "_dot");
    a(index.back()) = values.at(j.coordinate + "_ddot");
  }
  KDL::TreeIdSolver_RNE solver(tree, KDL::Vector(0, 0, -9.81));
  REQUIRE(solver.CartToJnt(q, v, a, {}, torque) == 0);
  double size = 0;
  KDL::JntArray still(n), at_rest(n);
  REQUIRE(solver.CartToJnt(q, v, still, {}, at_rest) == 0);
  for (unsigned i = 0; i < n; ++i) size = std::max(size, std::abs(at_rest(i)));
  for (std::size_t i = 0; i < joints.size(); ++i) {
    INFO(joints[i].name);
    // Of the size of gravity's torques, some twenty operations of double numbers in a chain of six.
    CHECK(torque(index[i]) == Approx(-joints[i].damping * v(index[i])).margin(1e-10 * size));
  }
}

}  // namespace

TEST_CASE("import: an arm of six joints moves as KDL says") {
  const auto joint = [](const std::string& name, double q, double v, double damping) {
    const std::string scene_name = name == "hand" ? "hand_joint" : name;
    return JointState{name,   scene_name + ".angle", "hinge." + scene_name + ".angular_velocity_rad_per_s", q, v,
                      damping};
  };
  compare_with_kdl("arm.urdf",
                   {joint("joint_1", 0.3, 0.5, 0.7), joint("joint_2", -0.7, 1.1, 0.4), joint("joint_3", 1.2, -0.6, 0),
                    joint("joint_4", -2.1, 1.7, 0), joint("joint_5", 0.9, -2.3, 0.05), joint("hand", 0.4, 3.1, 0)});
  compare_with_kdl("arm.urdf", {joint("joint_1", 0, 0, 0.7), joint("joint_2", 0, 0, 0.4), joint("joint_3", 0, 0, 0),
                                joint("joint_4", 0, 0, 0), joint("joint_5", 0, 0, 0.05), joint("hand", 0, 0, 0)});
}

TEST_CASE("import: slides and turns move as KDL says") {
  // Without the mimic, which KDL knows nothing of: the fingers apart.
  const WorkingDirectory here;
  std::string text = file_text(kRobots + "gripper.urdf");
  const auto mimic = text.find("<mimic"), end = text.find("/>", mimic) + 2;
  write_text(here / "free.urdf", text.erase(mimic, end - mimic));
  const auto slide = [](const std::string& name, double q, double v, double damping) {
    return JointState{name, name + ".displacement", "translational." + name + ".velocity_m_per_s", q, v, damping};
  };
  const std::string free = std::filesystem::relative(here / "free.urdf", kRobots).string();
  compare_with_kdl(free, {slide("lift", 0.1, 0.4, 5),
                          {"turn", "turn.angle", "hinge.turn.angular_velocity_rad_per_s", 0.6, -0.8, 0},
                          slide("left", 0.02, 0.3, 0),
                          slide("right", 0.01, -0.2, 0)});
}

#endif

TEST_CASE("import: a mimicking joint follows its leader") {
  const Scene scene = Scene::parse(imported("gripper.urdf", {"--pose", "left=0.02"}), "r.toml",
                                   {"translational.left.velocity_m_per_s=0.3"});
  auto values = at_start(scene, {"left.displacement", "right.displacement", "left.displacement_dot",
                                 "right.displacement_dot", "left.displacement_ddot", "right.displacement_ddot"});
  CHECK(values["left.displacement"] == Approx(0.02).margin(1e-13));
  CHECK(values["right.displacement"] == Approx(0.5 * 0.02 + 0.01).margin(1e-13));
  CHECK(values["right.displacement_dot"] == Approx(0.15).margin(1e-12));
  CHECK(values["right.displacement_ddot"] == Approx(0.5 * values["left.displacement_ddot"]).epsilon(1e-9));
}

// By Lagrange's equation of the one coordinate that is free (Dormand and Prince at 1e-11).
TEST_CASE("import: a mimicking joint has its damping") {
  const Scene scene = Scene::parse(imported("damped_mimic.urdf", {"--pose", "j1=1"}), "r.toml");
  const Problem problem = make_problem(scene);
  double angle = 0, rate = 0;
  simulate(problem, {}, {2}, [&](const MechanismState& s, System& system) {
    angle = make_output(*problem.mechanism, "j1.angle")->value(s, system.assembly());
    rate = make_output(*problem.mechanism, "j1.angle_dot")->value(s, system.assembly());
  });
  CHECK(angle == Approx(0.308794).margin(2e-6));
  CHECK(rate == Approx(-0.442261).margin(2e-6));
}

TEST_CASE("import: a closed loop stands where its lengths put it, and keeps its energy") {
  // Crank at 1 rad; the coupler's and the rocker's circles meet above.
  const double bx = 0.2 * std::cos(1.0), bz = 0.2 * std::sin(1.0), d = std::hypot(0.5 - bx, bz);
  const double along = (0.5 * 0.5 - 0.4 * 0.4 + d * d) / (2 * d), up = std::sqrt(0.25 - along * along);
  const double ux = (0.5 - bx) / d, uz = -bz / d, x = bx + along * ux - up * uz, z = bz + along * uz + up * ux;
  const double knee = std::atan2(z - bz, x - bx) - 1, pivot = std::atan2(z, x - 0.5);
  const std::string text = imported(
      "four_bar.urdf", {"--close", "coupler_end,rocker_end", "--pose", "motor=1", "--pose",
                        "knee=" + std::to_string(knee + 0.03), "--pose", "pivot=" + std::to_string(pivot - 0.02)});
  CHECK_THAT(text, Contains("given = [\"motor.angle\"]"));
  // All hinges are parallel: of three rows of a ball joint two would be left.
  CHECK_THAT(text, Contains("[in_plane.loop_1_b]") && !Contains("[in_plane.loop_1_c]") && !Contains("[spherical"));
  const Scene scene = Scene::parse(text, "r.toml");
  auto values = at_start(scene, {"motor.angle", "knee.angle", "pivot.angle"});
  CHECK(values["motor.angle"] == Approx(1).margin(1e-13));
  CHECK(values["knee.angle"] == Approx(knee).margin(1e-10));
  CHECK(values["pivot.angle"] == Approx(pivot).margin(1e-10));
  std::vector<double> energy;
  const Problem problem = make_problem(scene);
  simulate(problem, {}, {0, 0.5, 1, 1.5, 2}, [&](const MechanismState& s, System& system) {
    energy.push_back(make_output(*problem.mechanism, "energy.total")->value(s, system.assembly()));
  });
  // 4.5 kg move through some decimetres: 5 J; rtol 1e-8 over some hundred steps.
  for (const double e : energy) CHECK(e == Approx(energy[0]).margin(1e-5));
}

TEST_CASE("import: the scene reads well and tells what it left out") {
  const std::string text = imported("arm.urdf");
  CHECK_THAT(text,
             Contains("# From arm.urdf: robot 'arm'") &&
                 Contains("# Note: link 'forearm' has a mesh as its visual, which is not drawn.") &&
                 Contains("# Link hand, fixed to it: flange, tool0") && Contains("[rigid_body.wrist_1]") &&
                 Contains("# Joint joint_1, revolute: turret on the ground; limits -2.9 .. 2.9 rad, effort 150 N m") &&
                 Contains("[point.tool0]") && Contains("[hinge.hand_joint]") &&
                 Contains("gap = 2.9, stiffness = 15000, smoothing = 0.001, side = \"above\""));
  // Limits hold: thrown against its stop at 2 rad/s, a joint goes no deeper than its energy lets it.
  const WorkingDirectory here;
  write_text(here / "r.toml", imported("arm.urdf", {"--pose", "joint_1=2.85"}));
  const auto j = costate_json(
      {"simulate", "r.toml", "--no-files", "--set", "hinge.joint_1.angular_velocity_rad_per_s=2", "--t-end", "0.2"},
      here.path());
  // At most 12 kg at 1 m: v sqrt(I / k) = 2 sqrt(12 / 15000) = 0.06 rad.
  CHECK(j.at("terminal").at("joint_1.angle").get<double>() < 2.96);
  const Outcome drawn = run_costate({"draw", "r.toml"}, here.path());
  CHECK(drawn.status == 0);
}

TEST_CASE("import: limits that hold nothing, or push from the start on, are told") {
  const WorkingDirectory here;
  const auto told = [&](const std::string& limit) {
    write_text(here / "r.urdf",
               "<robot name=\"r\"><link name=\"world\"/><link name=\"a\"><inertial><origin xyz=\"0.1 0 0\"/><mass "
               "value=\"1\"/><inertia ixx=\"0.01\" iyy=\"0.01\" izz=\"0.01\" ixy=\"0\" ixz=\"0\" "
               "iyz=\"0\"/></inertial></link><joint name=\"turn\" type=\"revolute\"><parent link=\"world\"/><child "
               "link=\"a\"/><axis xyz=\"0 1 0\"/>" +
                   limit + "</joint></robot>");
    const Outcome o = run_costate({"import", "r.urdf", "-o", "r.toml"}, here.path());
    REQUIRE(o.status == 0);
    return o.out;
  };
  CHECK_THAT(told("<limit lower=\"0\" upper=\"0\" effort=\"1\" velocity=\"0\"/>"),
             Contains("'turn' has limits 0 .. 0") && Contains("make it fixed"));
  CHECK_THAT(told("<limit lower=\"-1\" upper=\"-2\" effort=\"1\" velocity=\"0\"/>"),
             Contains("limits that no position meets, -1 .. -2"));
  CHECK_THAT(told("<limit lower=\"1\" upper=\"2\" effort=\"1\" velocity=\"0\"/>"),
             Contains("is at 0, outside its limits 1 .. 2"));
  CHECK_THAT(told("<limit lower=\"-1\" upper=\"2\" effort=\"0\" velocity=\"0\"/>"), Contains("take 1 N m"));
  CHECK_THAT(told("<limit lower=\"-1\" upper=\"2\" effort=\"3\" velocity=\"0\"/>"), !Contains("note:"));
}

TEST_CASE("import: mistakes name file, link and joint") {
  const WorkingDirectory here;
  const auto complaint = [&](const std::vector<std::string>& words) {
    const Outcome o = run_costate(words, here.path());
    CHECK(o.status == 1);
    CHECK(o.out.empty());
    return o.err;
  };
  const std::string arm = kRobots + "arm.urdf";
  CHECK_THAT(complaint({"import", "none.urdf"}), Contains("none.urdf"));
  write_text(here / "bad.urdf", "<robot name='x'><link name='a'/><link name='b'/></robot>");
  CHECK_THAT(complaint({"import", "bad.urdf"}), Contains("bad.urdf") && Contains("no URDF that can be read"));
  write_text(here / "light.urdf",
             "<robot name='x'><link name='a'/><link name='b'/><joint name='j' type='continuous'><parent link='a'/>"
             "<child link='b'/><axis xyz='0 0 1'/></joint></robot>");
  CHECK_THAT(complaint({"import", "light.urdf"}), Contains("Link 'b' moves and has no mass"));
  CHECK_THAT(complaint({"import", arm, "--pose", "joint_7=1"}), Contains("no joint 'joint_7'") && Contains("joint_1"));
  CHECK_THAT(complaint({"import", arm, "--pose", "joint_1"}), Contains("--pose needs JOINT=VALUE"));
  CHECK_THAT(complaint({"import", arm, "--pose", "joint_1=1", "--pose", "joint_1=2"}), Contains("'joint_1' twice"));
  CHECK_THAT(complaint({"import", arm, "--close", "hand,foot"}), Contains("no link 'foot'"));
  CHECK_THAT(complaint({"import", arm, "--close", "hand,tool0"}), Contains("fixed to each other"));
  CHECK(here.entries() == std::vector<std::string>{"bad.urdf", "light.urdf"});
}

// urdfdom leaves an <inertial> out that it cannot read: of a tool fixed to a link its mass would just be missing.
TEST_CASE("import: no inertia is left out") {
  const WorkingDirectory here;
  const auto import = [&](const std::string& inertial) {
    write_text(here / "tool.urdf", R"(<robot name="z"><link name="b"/>
<link name="l"><inertial><mass value="2"/><inertia ixx="0.02" ixy="0" ixz="0" iyy="0.02" iyz="0" izz="0.02"/></inertial></link>
<link name="t"><inertial>)" + inertial +
                                       R"(</inertial></link>
<joint name="j" type="continuous"><parent link="b"/><child link="l"/><axis xyz="0 1 0"/></joint>
<joint name="f" type="fixed"><parent link="l"/><child link="t"/></joint></robot>)");
    return run_costate({"import", "tool.urdf"}, here.path());
  };
  const std::string at = "<origin xyz=\"0 0 0.3\"/>", mass = "<mass value=\"1.5\"/>",
                    inertia = "<inertia ixx=\"0.02\" ixy=\"0\" ixz=\"0\" iyy=\"0.02\" iyz=\"0\" izz=\"0.02\"/>";
  CHECK_THAT(import(at + mass + inertia).out, Contains("mass_kg = 3.5"));
  const auto changed = [](std::string text, const std::string& from, const std::string& to) {
    return text.replace(text.find(from), from.size(), to);
  };
  for (const std::string& wrong :
       {at + changed(mass, "1.5", "1,5") + inertia, at + changed(mass, "1.5", "1.5kg") + inertia,
        at + changed(mass, "1.5", "") + inertia, at + changed(mass, "1.5", "nan") + inertia,
        at + changed(mass, "1.5", "inf") + inertia, at + changed(mass, "1.5", "-1") + inertia,
        at + changed(mass, "mass", "mas") + inertia, changed(at, "0 0 0.3", "0 0.3") + mass + inertia,
        changed(at, "0 0 0.3", "0,0,0.3") + mass + inertia, at + mass + changed(inertia, " izz=\"0.02\"", ""),
        at + mass + changed(inertia, "0.02", "0,02"), at + mass + changed(inertia, "0.02", "-0.01"), at + mass}) {
    CAPTURE(wrong);
    const Outcome o = import(wrong);
    CHECK(o.status == 1);
    CHECK(o.out.empty());
    CHECK_THAT(o.err, Contains("tool.urdf"));
  }
}

#else

TEST_CASE("import: a tool without a reader of URDF says so") {
  const WorkingDirectory here;
  const Outcome o = run_costate({"import", kRobots + "arm.urdf"}, here.path());
  CHECK(o.status == 1);
  CHECK_THAT(o.err, Contains("liburdfdom-dev"));
}

#endif
