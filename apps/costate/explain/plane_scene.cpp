#include "plane_scene.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <set>

#include "body_frame.h"
#include "costate/analysis/start.h"
#include "costate/scene/toml_reader.h"
#include "costate/scene/toml_writer.h"

namespace costate::app {

namespace {

constexpr double kAlong = 1e-6;  // two directions or heights are the same up to this

SceneNode list_node(const std::vector<std::string>& texts) {
  SceneNode n;
  n.type = SceneNode::Type::array;
  for (const std::string& t : texts) n.children.push_back(text_node(t));
  return n;
}

std::vector<std::string> texts_of(const SceneNode* node) {
  std::vector<std::string> texts;
  if (node)
    for (const SceneNode& c : node->children) texts.push_back(c.text);
  return texts;
}

class PlaneWriter {
 public:
  PlaneWriter(const Setup& setup, const PlaneMotion& plane)
      : m_(*setup.scene.mechanism()), root_(read_toml(setup.scene.dump(), setup.scene.file_name())) {
    Eigen::Index k = 0;
    if (plane.normal.cwiseAbs().maxCoeff(&k) < 1 - kAlong)
      throw CapabilityError(
          fmt::format("The motion's plane has the normal ({:.3g}, {:.3g}, {:.3g}); a scene of the plane is written of "
                      "motions across an axis of space. Turn the scene.",
                      plane.normal[0], plane.normal[1], plane.normal[2]));
    normal_ = static_cast<int>(k);
    Assembly assembly(setup.problem.mechanism, setup.problem.parameters);
    assembly.set_parameters(setup.rho.data());
    start_ = find_start(assembly, setup.problem.solver.t_start, false);
  }

  std::string text() {
    for (const SceneNode& table : root_.children) {
      if (table.key == "rigid_body" || table.key == "natural_body")
        each(table, [&](const SceneNode& t) { add_body(table.key, t); });
    }
    for (const SceneNode& table : root_.children) write(table);
    if (!refused_.empty()) {
      std::string list;
      for (const std::string& r : refused_) list += (list.empty() ? "" : "; ") + r;
      throw CapabilityError("No scene of the plane can be written: " + list + ".");
    }
    give_headers(out_);
    return write_toml(out_);
  }

 private:
  struct Frame {
    int axis = 2;          // of the body along the normal
    bool flipped = false;  // against it
    Eigen::Matrix3d A = Eigen::Matrix3d::Identity();
    /// The body's axes that become x and y.
    int local(int i) const { return (axis + (flipped ? 2 - i : 1 + i)) % 3; }
  };

  template <class Visit>
  static void each(const SceneNode& group, const Visit& visit) {
    for (const SceneNode& t : group.children) visit(t);
  }
  /// Tables stand under headers of their own.
  static void give_headers(SceneNode& node) {
    node.inlined = false;
    for (SceneNode& c : node.children) give_headers(c);
  }
  void refuse(const std::string& what) { refused_.push_back(what); }
  /// The axis of space that becomes x (0) or y (1).
  int axis(int i) const { return (normal_ + 1 + i) % 3; }
  static char letter(int axis) { return "xyz"[axis]; }
  double q(const std::string& name) const { return start_.q[static_cast<std::size_t>(m_.coordinate(name))]; }
  double v(const std::string& name) const { return start_.v[static_cast<std::size_t>(m_.coordinate(name))]; }
  void set(const std::string& path, double value) { set_node(out_, path, number_node(value + 0.0)); }
  /// A number of the scene at its new place.
  void move(const std::string& from, const std::string& to, double value) {
    moved_[from] = to;
    set(to, value);
  }
  double number(const std::string& path) const { return m_.numbers()[static_cast<std::size_t>(m_.number(path))].value; }

  void add_body(const std::string& kind, const SceneNode& t) {
    const std::string &name = t.key, from = kind + "." + name + ".", to = "body." + name + ".";
    Frame f;
    const BodyFrame frame = body_frame(m_, start_, kind, name);
    f.A = frame.A;
    const Eigen::Vector3d along = f.A.row(normal_);
    Eigen::Index k = 0;
    if (along.cwiseAbs().maxCoeff(&k) < 1 - kAlong)
      return refuse(fmt::format("[{}.{}] has no axis of its frame along the plane's normal", kind, name));
    f.axis = static_cast<int>(k);
    f.flipped = along[k] < 0;
    frames_[name] = f;
    for (int i = 0; i < 2; ++i) {
      const char old = letter(axis(i)), own = letter(f.local(i)), c = letter(i);
      move(fmt::format("{}{}_m", from, old), fmt::format("{}{}_m", to, c), q(fmt::format("{}.{}", name, old)));
      move(fmt::format("{}v{}_m_per_s", from, old), fmt::format("{}v{}_m_per_s", to, c),
           v(fmt::format("{}.{}", name, old)));
      move(fmt::format("{}center_{}_m", from, own), fmt::format("{}center_{}_m", to, c),
           number(fmt::format("{}center_{}_m", from, own)));
    }
    const Eigen::Vector3d x = f.A.col(f.local(0)), rate = frame.rate.col(f.local(0));
    set(to + "angle_rad", std::atan2(x[axis(1)], x[axis(0)]));
    set(to + "angular_velocity_rad_per_s", x[axis(0)] * rate[axis(1)] - x[axis(1)] * rate[axis(0)]);
    move(from + "mass_kg", to + "mass_kg", number(from + "mass_kg"));
    const std::string inertia = fmt::format("inertia_{0}{0}_kg_m2", letter(f.axis));
    move(from + inertia, to + "inertia_kg_m2", number(from + inertia));
  }

  void write_point(const SceneNode& t) {
    const std::string path = "point." + t.key + ".";
    const SceneNode* on = t.find("on");
    const auto at = on ? frames_.find(on->text) : frames_.end();
    if (on && at == frames_.end()) return;  // its body is refused
    for (int i = 0; i < 2; ++i) {
      const char old = letter(on ? at->second.local(i) : axis(i)), c = letter(i);
      const std::string name = fmt::format("{}.{}", t.key, old);
      const bool free = !on && !(t.find("ground") && t.find("ground")->flag);
      move(fmt::format("{}{}_m", path, old), fmt::format("{}{}_m", path, c),
           free ? q(name) : number(fmt::format("{}{}_m", path, old)));
      if (free) move(fmt::format("{}v{}_m_per_s", path, old), fmt::format("{}v{}_m_per_s", path, c), v(name));
    }
    for (const char* key : {"on", "ground"})
      if (const SceneNode* n = t.find(key)) set_node(out_, path + key, *n);
  }

  /// How far along the normal a point is.
  double height(const std::string& name) const {
    const SpatialPoint& p = m_.spatial_point(name);
    std::vector<double> own, numbers;
    for (const int i : p.coordinates()) own.push_back(start_.q[static_cast<std::size_t>(i)]);
    for (const int i : p.numbers()) numbers.push_back(m_.numbers()[static_cast<std::size_t>(i)].value);
    double r[3];
    p.position(own.data(), numbers.data(), r);
    return r[normal_];
  }
  /// In space, of a direction in the frame of the body that a point is on, or of the ground.
  Eigen::Vector3d direction(const std::string& point, const SceneNode& list) const {
    Eigen::Vector3d d = Eigen::Vector3d::Zero();
    for (std::size_t i = 0; i < 3 && i < list.children.size(); ++i)
      d[static_cast<Eigen::Index>(i)] = list.children[i].as_double();
    const SceneNode* on = find_node(root_, "point." + point + ".on");
    const auto at = on ? frames_.find(on->text) : frames_.end();
    return (at == frames_.end() ? d : Eigen::Vector3d(at->second.A * d)).normalized();
  }

  void write_joint(const std::string& kind, const SceneNode& t) {
    const std::string path = kind + "." + t.key;
    const auto points = texts_of(t.find("points"));
    if (kind == "in_plane") {
      const double along = std::abs(direction(points.at(0), *t.find("normal"))[normal_]);
      if (along > 1 - kAlong) return;  // holds what the plane holds
      if (along > kAlong) return refuse("[" + path + "] is a slanted plane");
      return planes_[points].push_back(&t);
    }
    if (t.find("angle")) return refuse("[" + path + "] has a coordinate of its own, 'angle'");
    if (kind == "hinge" && std::abs(direction(points.at(0), *t.find("axis_first"))[normal_]) < 1 - kAlong)
      return refuse("[" + path + "] turns about another axis than the plane's normal");
    set_node(out_, "revolute." + t.key + ".points", list_node(points));
  }

  void write_planes() {
    for (const auto& [points, tables] : planes_) {
      const std::string path = "in_plane." + tables.front()->key;
      const auto normal = [&](std::size_t i) { return direction(points.at(0), *tables[i]->find("normal")); };
      if (tables.size() != 2 || normal(0).cross(normal(1)).norm() < kAlong)
        refuse("[" + path + "] holds a point on a line");
      else
        set_node(out_, "revolute." + tables.front()->key + ".points", list_node(points));
    }
  }

  /// "P.z_dot" in the plane's letters; what is no coordinate of a point or body, as it is.
  std::string output(const std::string& name) {
    const std::size_t dot = name.find('.');
    const std::string owner = name.substr(0, dot), rest = dot == std::string::npos ? "" : name.substr(dot + 1);
    if (rest.empty() || (rest.size() > 1 && rest[1] != '_')) return name;
    const std::size_t old = std::string("xyz").find(rest[0]);
    if (old == std::string::npos || (!frames_.contains(owner) && !find_node(root_, "point." + owner))) return name;
    for (int i = 0; i < 2; ++i)
      if (axis(i) == static_cast<int>(old)) return owner + "." + letter(i) + rest.substr(1);
    refuse("the output '" + name + "' is along the plane's normal");
    return name;
  }

  void rename_outputs(SceneNode& n) {
    const std::string prefix = "output:";
    if (n.type == SceneNode::Type::text && n.key != "kind" && n.key != "name")
      n.text = n.text.starts_with(prefix) ? prefix + output(n.text.substr(prefix.size())) : output(n.text);
    for (SceneNode& c : n.children) rename_outputs(c);
  }

  std::vector<std::string> given(const std::vector<std::string>& names) {
    std::vector<std::string> list;
    for (const std::string& name : names) {
      const std::size_t dot = name.find('.');
      const std::string owner = name.substr(0, dot), rest = dot == std::string::npos ? "" : name.substr(dot + 1);
      std::string now = name;
      if (rest == letter_text(normal_)) continue;  // the plane has it
      if (rest.size() == 1)
        now = output(name);
      else if (!rest.empty() && frames_.contains(owner))
        now = owner + ".angle";
      if (std::find(list.begin(), list.end(), now) == list.end()) list.push_back(now);
    }
    return list;
  }
  static std::string letter_text(int axis) { return std::string(1, letter(axis)); }

  void write_parameter(const SceneNode& t) {
    SceneNode copy = t;
    const auto rename = [&](SceneNode& n) {
      if (const auto at = moved_.find(n.text); at != moved_.end())
        n.text = at->second;
      else if (!kept_.contains(n.text.substr(0, n.text.find('.'))))
        refuse(fmt::format("the parameter '{}' varies '{}', which the plane has no number for", t.key, n.text));
    };
    if (SceneNode* n = copy.find("number")) rename(*n);
    if (SceneNode* n = copy.find("numbers"))
      for (SceneNode& c : n->children) rename(c);
    set_node(out_, "parameter." + t.key, copy);
  }

  void write(const SceneNode& table) {
    const std::string& kind = table.key;
    if (kind == "rigid_body" || kind == "natural_body") return;
    if (kind == "gravity") {
      for (int i = 0; i < 2; ++i) {
        const std::string old = fmt::format("gravity.{}_m_per_s2", letter(axis(i)));
        const SceneNode* n = find_node(root_, old);
        move(old, fmt::format("gravity.{}_m_per_s2", letter(i)), n ? n->as_double() : 0);
      }
    } else if (kind == "point") {
      each(table, [&](const SceneNode& t) { write_point(t); });
    } else if (kind == "hinge" || kind == "spherical" || kind == "in_plane") {
      each(table, [&](const SceneNode& t) { write_joint(kind, t); });
      if (kind == "in_plane") write_planes();
    } else if (kind == "spring" || kind == "mass") {
      each(table, [&](const SceneNode& t) {
        if (const SceneNode* a = t.find("from"), *b = t.find("to"); a && b)
          if (std::abs(height(a->text) - height(b->text)) > kAlong * (1 + std::abs(height(a->text))))
            refuse(fmt::format("[{}.{}] has ends at different heights over the plane", kind, t.key));
      });
      set_node(out_, kind, table);
    } else if (kind == "start") {
      SceneNode copy = table;
      for (SceneNode& c : copy.children)
        if (c.key == "given" || c.key == "given_velocities") {
          const std::string key = c.key;
          c = list_node(given(texts_of(&c)));
          c.key = key;
        }
      set_node(out_, kind, copy);
    } else if (kind == "parameter") {
      each(table, [&](const SceneNode& t) { write_parameter(t); });
    } else if (kind == "cost" || kind == "optimize" || kind == "run") {
      SceneNode copy = table;
      for (SceneNode& c : copy.children)
        if (kind == "cost" || c.key == "outputs" || c.key == "ends_when" || c.key == "constraint") rename_outputs(c);
      set_node(out_, kind, copy);
    } else if (kind == "title" || kind == "description" || kind == "formulation") {
      set_node(out_, kind, table);
    } else {
      each(table, [&](const SceneNode& t) { refuse(fmt::format("[{}.{}]", kind, t.key)); });
    }
  }

  const Mechanism& m_;
  SceneNode root_, out_;
  int normal_ = 2;
  Start start_;
  std::map<std::string, Frame> frames_;
  std::map<std::string, std::string> moved_;
  std::map<std::vector<std::string>, std::vector<const SceneNode*>> planes_;
  std::set<std::string> kept_ = {"spring", "mass", "cost", "run", "optimize"};
  std::vector<std::string> refused_;
};

}  // namespace

std::string plane_scene(const Setup& setup, const PlaneMotion& plane) { return PlaneWriter(setup, plane).text(); }

}  // namespace costate::app
