#include "merged_scene.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "bushing_frame.h"
#include "costate/analysis/start.h"
#include "costate/scene/toml_reader.h"
#include "costate/scene/toml_writer.h"
#include "scene_vector.h"
#include "weld_groups.h"
#include "written_start.h"

namespace costate::app {

namespace {

// Of a position's largest component, what is left of a zero.
constexpr double kZeroLength = 1e-13;
constexpr const char* kPairs[6] = {"xx", "yy", "zz", "xy", "xz", "yz"};

struct MassProperties {
  double m = 0;                                 // kg
  Eigen::Vector3d c = Eigen::Vector3d::Zero();  // m, centre
  Eigen::Matrix3d J = Eigen::Matrix3d::Zero();  // kg m^2, about the centre
  Eigen::Matrix3d about(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d d = c - p;
    return J + m * (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose());
  }
};

class MergedWriter {
 public:
  explicit MergedWriter(const Setup& setup)
      : m_(*setup.problem.mechanism), root_(read_toml(setup.scene.dump(), setup.scene.file_name())) {
    for (const Number& n : m_.numbers()) numbers_[n.path] = n.value;
    Assembly assembly(setup.problem.mechanism, setup.problem.parameters);
    assembly.set_parameters(setup.rho.data());
    start_ = find_start(assembly, setup.problem.solver.t_start, false);
    groups_ = weld_groups(m_, start_, root_);
  }

  MergedScene scene() {
    MergedScene r;
    for (const std::string& name : groups_.kept)
      r.kept.push_back(fmt::format("fixed.{} stays: the scene asks for its reaction or varies its numbers", name));
    if (groups_.parts.empty())
      throw CapabilityError("--merged: No bodies are welded to each other or to the ground by [fixed.*]" +
                            (r.kept.empty() ? "." : fmt::format(" that could go: {}.", fmt::join(r.kept, "; "))));
    for (const auto& [name, part] : groups_.parts) r.bodies.push_back(part.kind + "." + name);
    each_text(root_, [&](const std::vector<std::string>& keys, SceneNode& n) { rewrite(keys, n); });
    each_key(root_);
    turn_directions();
    move_points();
    merge_masses();
    write_start(root_, m_, start_, named_, [&](const std::string& body) { return part(body) != nullptr; });
    remove();
    if (!refused_.empty())
      throw CapabilityError(fmt::format("--merged: The scene with welded bodies as one cannot be written: {}.",
                                        fmt::join(std::vector<std::string>(refused_.begin(), refused_.end()), "; ")));
    r.toml = write_toml(root_);
    return r;
  }

 private:
  void refuse(const std::string& what) { refused_.insert(what); }
  const WeldedPart* part(const std::string& body) const {
    const auto at = groups_.parts.find(body);
    return at == groups_.parts.end() ? nullptr : &at->second;
  }
  /// The part that a point is on, or null.
  const WeldedPart* part_of_point(const std::string& point) const {
    const SceneNode* on = find_node(root_, "point." + point + ".on");
    return on ? part(on->text) : nullptr;
  }
  double number(const std::string& path) const { return numbers_.at(path); }
  void set(const std::string& path, double value) { set_node(root_, path, number_node(value + 0.0)); }
  bool is_root(const std::string& body) const {
    return std::any_of(groups_.parts.begin(), groups_.parts.end(),
                       [&](const auto& p) { return p.second.into == body; });
  }

  /// A text of the scene: names of the parts' outputs and numbers.
  void rewrite(const std::vector<std::string>& keys, SceneNode& n) {
    const std::string& key = keys.back();
    if (key == "on" || key == "body" || key == "bodies" || key == "ground_body") {
      if (const WeldedPart* p = part(n.text); p && keys.front() != "point") carry(keys, n, *p);
      return;
    }
    n.text = with_names(n.text, [&](const std::string& name) { return renamed(keys, name); });
  }

  /// An element on the part itself: a rotor, a couple.
  void carry(const std::vector<std::string>& keys, SceneNode& n, const WeldedPart& p) {
    const std::string path = keys.front() + "." + keys.at(1);
    const SceneNode* frame = find_node(root_, path + ".frame");
    if (p.into.empty() ||
        (p.turned() && (keys.front() == "couple" ? frame && frame->text == "body" : keys.front() != "rotor")))
      return refuse(fmt::format("[{}] is on '{}'", path, n.text));
    if (SceneNode* axis = keys.front() == "rotor" && p.turned() ? find(path + ".axis") : nullptr)
      turn(path + ".axis", *axis, p);
    n.text = p.into;
  }
  SceneNode* find(const std::string& path) { return const_cast<SceneNode*>(find_node(root_, path)); }
  void turn(const std::string& path, const SceneNode& node, const WeldedPart& p) {
    set_node(root_, path, vector_node(p.R * vector_of(node)));
  }

  std::string renamed(const std::vector<std::string>& keys, const std::string& name) {
    const auto parts = split_name(name);
    if (keys.front() == "start" && part(parts.front()) && (parts.size() == 1 || !body_output(parts).empty())) {
      refuse(fmt::format("[start] gives '{}', of a body that is welded to another one", name));
      return name;
    }
    if (const std::string output = body_output(parts); !output.empty())
      if (const WeldedPart* p = part(parts[0])) return output_of_part(name, parts, output, *p);
    return number_path(name, parts);
  }

  std::string output_of_part(const std::string& name, const std::vector<std::string>& parts, const std::string& output,
                             const WeldedPart& p) {
    if (output.size() == 1) {
      origins_.insert(parts[0]);
      return name;
    }
    const bool rates = is_global_rate(output) || !p.turned();
    const bool coordinate = output[0] == 'e' || output[0] == 'u';
    if (p.into.empty() || !rates || coordinate)
      refuse(fmt::format("'{}' is asked for, of a body that is welded to {}", name,
                         p.into.empty() ? "the ground" : "'" + p.into + "'"));
    return p.into + "." + parts[1];
  }

  /// A number of the scene that something names (a parameter, a run, a bound) at its new place.
  std::string number_path(const std::string& name, const std::vector<std::string>& parts) {
    named_.insert(name);
    if (parts.size() < 3) return name;
    const bool body = parts[0] == "rigid_body" || parts[0] == "natural_body";
    const WeldedPart* p = body ? part(parts[1]) : parts[0] == "point" ? part_of_point(parts[1]) : nullptr;
    if (body && !p && is_root(parts[1])) {
      if (parts[2].starts_with("inertia_")) turning_varies_.insert(parts[1]);
      if (parts[2] == "mass_kg" || parts[2].starts_with("center_")) apart_.insert(parts[1]);
    }
    if (body && p && parts[2] == "mass_kg" && !p->into.empty()) {
      apart_.insert(p->into);
      return "mass." + parts[1] + ".mass_kg";
    }
    if (p || (parts[0] == "lambda" && part(parts[2])))
      refuse(fmt::format("'{}' is named, of a body that is welded to {}", name,
                         p && !p->into.empty() ? "'" + p->into + "'" : "another one or the ground"));
    return name;
  }

  /// Keys that are paths themselves ("rigid_body.rod.mass_kg" = ...) are not rewritten.
  void each_key(const SceneNode& node) {
    for (const SceneNode& c : node.children) {
      if (c.key.find('.') != std::string::npos)
        if (const std::string now = renamed({"key"}, c.key); now != c.key)
          refuse(fmt::format("the key '{}' names a body that is welded to another one", c.key));
      each_key(c);
    }
  }

  void turn_directions() {
    for (const SceneNode& kind : SceneNode(root_).children) {
      if (kind.key == "point" || kind.key == "fixed" || kind.key == "rotor") continue;
      for (const SceneNode& t : kind.children)
        if (t.is_table()) turn_directions(kind.key, t);
    }
    for (const std::string& name : groups_.kept)
      if (const SceneNode* t = find_node(root_, "fixed." + name)) turn_directions("fixed", SceneNode(*t));
  }

  void turn_directions(const std::string& kind, const SceneNode& t) {
    const std::string path = kind + "." + t.key;
    std::set<std::string> turned;  // keys that are done
    const auto by_point = [&](const char* key, const char* point, const Eigen::Vector3d* fallback) {
      const SceneNode* at = t.find(point);
      const WeldedPart* p = at ? part_of_point(at->text) : nullptr;
      const SceneNode* n = t.find(key);
      turned.insert(key);
      if (!p || !p->turned() || (!n && !fallback)) return;
      set_node(root_, path + "." + key, vector_node(p->R * (n ? vector_of(*n) : *fallback)));
    };
    if (const SceneNode* points = t.find("points"); points && points->children.size() == 2) {
      const WeldedPart* ends[2] = {part_of_point(points->children[0].text), part_of_point(points->children[1].text)};
      if ((ends[0] && ends[0]->turned()) || (ends[1] && ends[1]->turned()))
        for (const char* base : {"axis", "normal"}) turn_pair(path, t, base, ends);
      if (const SceneNode* n = t.find("normal"); n && ends[0] && ends[0]->turned())
        turn(path + ".normal", *n, *ends[0]);
      turned.insert({"axis_first", "axis_second", "normal_first", "normal_second", "normal"});
    } else if (kind == "axis_spring") {
      by_point("axis", "from", nullptr);
    } else if (kind == "tie_rod") {
      by_point("direction", "from", nullptr);
    } else if (kind == "tyre") {
      const Eigen::Vector3d across = Eigen::Vector3d::UnitY();
      by_point("axis", "wheel", &across);
    } else if (kind == "bushing") {
      for (const std::string end : {"from", "to"}) {
        const SceneNode* at = t.find(end);
        if (const WeldedPart* p = at ? part_of_point(at->text) : nullptr; p && p->turned())
          turn_bushing_frame(root_, path, t, end, p->R);
      }
      for (const SceneNode& c : t.children) turned.insert(c.key);  // all along the axes of its frame
    }
    // What else may be in the frame of a part that is turned against the body that stays.
    bool on_turned = false, in_frame = false;
    SceneNode copy = t;
    each_text(copy, [&](const std::vector<std::string>& keys, SceneNode& n) {
      const WeldedPart* p = part_of_point(n.text);
      on_turned = on_turned || (p && p->turned());
      in_frame = in_frame || (keys.back() == "frame" && n.text == "body");
    });
    for (const SceneNode& c : t.children) in_frame = in_frame || (is_vector(c) && !turned.contains(c.key));
    if (on_turned && in_frame)
      refuse("[" + path + "] has numbers in the frame of a body that is welded to another one");
  }

  /// X_first and X_second of a joint, as written or as the joint has taken them.
  void turn_pair(const std::string& path, const SceneNode& t, const std::string& base,
                 const WeldedPart* const (&ends)[2]) {
    std::optional<Eigen::Vector3d> now[2];
    for (int i = 0; i < 2; ++i) {
      const std::string key = base + (i == 0 ? "_first" : "_second"), first = path + "." + key + "[0]";
      if (const SceneNode* n = t.find(key))
        now[i] = vector_of(*n);
      else if (numbers_.contains(first))
        now[i] = {number(first), number(path + "." + key + "[1]"), number(path + "." + key + "[2]")};
      else
        now[i] = now[0];
    }
    for (int i = 0; i < 2; ++i)
      if (now[i])
        set_node(root_, path + "." + base + (i == 0 ? "_first" : "_second"),
                 vector_node(ends[i] ? Eigen::Vector3d(ends[i]->R * *now[i]) : *now[i]));
  }

  void place(const std::string& point, const std::string& into, const Eigen::Vector3d& at) {
    if (into.empty()) {
      SceneNode yes;
      yes.type = SceneNode::Type::flag;
      yes.flag = true;
      set_node(root_, "point." + point + ".ground", yes);
      std::erase_if(find("point." + point)->children, [](const SceneNode& c) { return c.key == "on"; });
    } else {
      set_node(root_, "point." + point + ".on", text_node(into));
    }
    for (int i = 0; i < 3; ++i)
      set(fmt::format("point.{}.{}_m", point, "xyz"[i]),
          std::abs(at[i]) < kZeroLength * at.cwiseAbs().maxCoeff() ? 0 : in_start_digits(at[i]));
  }

  void move_points() {
    if (const SceneNode* points = root_.find("point"))
      for (const SceneNode& t : SceneNode(*points).children)
        if (const WeldedPart* p = part_of_point(t.key)) {
          Eigen::Vector3d x;
          for (int i = 0; i < 3; ++i) x[i] = number(fmt::format("point.{}.{}_m", t.key, "xyz"[i]));
          if (p->into.empty()) grounded_.insert(t.key);
          place(t.key, p->into, p->d + p->R * x);
        }
    for (const std::string& body : origins_) {
      if (find_node(root_, "point." + body)) refuse(fmt::format("'{}' is the name of a point, too", body));
      place(body, part(body)->into, part(body)->d);
    }
  }

  MassProperties properties(const std::string& path) const {
    MassProperties p;
    p.m = number(path + ".mass_kg");
    for (int i = 0; i < 3; ++i) p.c[i] = number(fmt::format("{}.center_{}_m", path, "xyz"[i]));
    for (const char* pair : kPairs)
      p.J(pair[0] - 'x', pair[1] - 'x') = p.J(pair[1] - 'x', pair[0] - 'x') =
          number(fmt::format("{}.inertia_{}_kg_m2", path, pair));
    return p;
  }

  void write_number(const std::string& path, double before, double now) {
    if (now != before) set(path, in_start_digits(now));
  }

  void write(const std::string& path, const MassProperties& before, const MassProperties& now) {
    write_number(path + ".mass_kg", before.m, now.m);
    for (int i = 0; i < 3; ++i) write_number(fmt::format("{}.center_{}_m", path, "xyz"[i]), before.c[i], now.c[i]);
    for (const char* pair : kPairs)
      write_number(fmt::format("{}.inertia_{}_kg_m2", path, pair), before.J(pair[0] - 'x', pair[1] - 'x'),
                   now.J(pair[0] - 'x', pair[1] - 'x'));
  }

  void merge_masses() {
    std::map<std::string, std::vector<std::string>> members;
    for (const auto& [name, p] : groups_.parts)
      if (!p.into.empty()) members[p.into].push_back(name);
    for (const auto& [stays, names] : members) {
      const std::string path = (find_node(root_, "rigid_body." + stays) ? "rigid_body." : "natural_body.") + stays;
      const MassProperties own = properties(path);
      const bool apart = apart_.contains(stays);
      MassProperties whole = own;
      std::vector<MassProperties> all = {own};
      for (const std::string& name : names) {
        const WeldedPart& p = groups_.parts.at(name);
        MassProperties of = properties(p.kind + "." + name);
        of.c = p.d + p.R * of.c;
        of.J = p.R * of.J * p.R.transpose();
        all.push_back(of);
        if (turning_varies_.contains(stays) && (!apart || !of.J.isZero()))
          refuse(
              fmt::format("a parameter varies an inertia of '{}', which that of '{}' would be added to", stays, name));
        if (apart) {
          add_mass(name, stays, of);
          whole.J += of.J;
        }
      }
      if (!apart) whole = together(all);
      write(path, own, whole);
    }
  }

  static MassProperties together(const std::vector<MassProperties>& all) {
    MassProperties r;
    for (const MassProperties& p : all) {
      r.m += p.m;
      r.c += p.m * p.c;
    }
    if (r.m > 0)
      r.c /= r.m;
    else
      r.c = all.front().c;
    for (const MassProperties& p : all) r.J += p.about(r.c);
    return r;
  }

  /// A part's mass at a point of the body that stays, where parameters vary masses of the group.
  void add_mass(const std::string& name, const std::string& into, const MassProperties& of) {
    std::string point = name + "_center";
    while (find_node(root_, "point." + point)) point += "_";
    if (find_node(root_, "mass." + name)) refuse(fmt::format("'{}' is the name of a mass, too", name));
    place(point, into, of.c);
    set_node(root_, "mass." + name + ".point", text_node(point));
    set("mass." + name + ".mass_kg", of.m);
  }

  void remove() {
    const auto erase = [&](const char* kind, const auto& gone) {
      if (SceneNode* table = root_.find(kind)) std::erase_if(table->children, gone);
    };
    for (const char* kind : {"rigid_body", "natural_body"})
      erase(kind, [&](const SceneNode& t) { return part(t.key) != nullptr; });
    erase("fixed", [&](const SceneNode& t) {
      return std::find(groups_.welds.begin(), groups_.welds.end(), t.key) != groups_.welds.end();
    });
    erase("mass", [&](const SceneNode& t) {
      const bool gone = t.find("point") && grounded_.contains(t.find("point")->text);
      if (gone && named_.contains("mass." + t.key + ".mass_kg"))
        refuse(fmt::format("a parameter varies [mass.{}], which rests on the ground", t.key));
      return gone;
    });
    std::erase_if(root_.children, [](const SceneNode& c) {
      return c.is_table() && c.children.empty() && c.key != "gravity" && c.key != "run";
    });
  }

  const Mechanism& m_;
  SceneNode root_;
  std::map<std::string, double> numbers_;  // by path
  Start start_;
  WeldGroups groups_;
  std::set<std::string> refused_, origins_, named_, apart_, turning_varies_, grounded_;
};

}  // namespace

MergedScene merged_scene(const Setup& setup) { return MergedWriter(setup).scene(); }

}  // namespace costate::app
