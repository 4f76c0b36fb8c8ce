#include "weld_groups.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>

#include "body_frame.h"

namespace costate::app {

namespace {

constexpr double kRounding = 1e-11;  // of a direction's component; the start is solved to 1e-12
constexpr int kGiven = 1000;         // a body that the start gives stays before others that outputs name

void visit(std::vector<std::string>& keys, SceneNode& node, const TextVisitor& f) {
  if (node.type == SceneNode::Type::text) f(keys, node);
  for (SceneNode& c : node.children) {
    if (!c.key.empty()) keys.push_back(c.key);
    visit(keys, c, f);
    if (!c.key.empty()) keys.pop_back();
  }
}

bool is_of_name(char c) { return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.'; }

/// The body that a point is on; empty for points of the ground and free ones.
std::string carrier(const SceneNode& scene, const std::string& point) {
  const SceneNode* on = find_node(scene, "point." + point + ".on");
  return on ? on->text : "";
}

/// Names of bodies as nodes of a graph; the ground is "".
class Groups {
 public:
  std::string root(const std::string& name) {
    const auto at = into_.find(name);
    return at == into_.end() ? name : root(at->second);
  }
  void join(const std::string& a, const std::string& b) {
    const std::string x = root(a), y = root(b);
    if (x != y) into_[x.empty() ? y : x] = x.empty() ? x : y;
  }

 private:
  std::map<std::string, std::string> into_;
};

/// How often the scene names each body in a way that only the body itself can answer.
std::map<std::string, int> mentions(SceneNode& scene) {
  std::map<std::string, int> count;
  each_text(scene, [&](const std::vector<std::string>& keys, SceneNode& n) {
    const bool given = keys.front() == "start";
    with_names(n.text, [&](const std::string& name) {
      const auto parts = split_name(name);
      const std::string output = body_output(parts);
      const bool a_place = output.size() == 1 || is_global_rate(output);
      if (given)
        count[parts.front()] += kGiven;
      else if (!output.empty() && !a_place)
        ++count[parts.front()];
      else if (parts.size() > 2 && (parts[0] == "rigid_body" || parts[0] == "natural_body") && parts[2] != "mass_kg")
        ++count[parts[1]];
      return name;
    });
  });
  return count;
}

/// Welds that something refers to: a reaction, a multiplier, a number.
std::set<std::string> asked_for(SceneNode& scene, const SceneNode& welds) {
  std::set<std::string> names;
  each_text(scene, [&](const std::vector<std::string>&, SceneNode& n) {
    with_names(n.text, [&](const std::string& name) {
      auto parts = split_name(name);
      if (parts.size() > 1 && parts[0] == "lambda") parts.erase(parts.begin());
      const bool number = parts.size() > 1 && parts[0] == "fixed";
      if (number) parts.erase(parts.begin());
      if (welds.find(parts[0]) &&
          (number || (parts.size() > 1 && (parts[1].starts_with("reaction_") || parts[1].starts_with("moment_")))))
        names.insert(parts[0]);
      return name;
    });
  });
  return names;
}

}  // namespace

void each_text(SceneNode& root, const TextVisitor& f) {
  for (SceneNode& c : root.children) {
    if (c.key == "title" || c.key == "description") continue;
    std::vector<std::string> keys = {c.key};
    visit(keys, c, f);
  }
}

std::string with_names(const std::string& text, const std::function<std::string(const std::string&)>& replacement) {
  std::string out;
  for (std::size_t i = 0; i < text.size();) {
    std::size_t end = i;
    while (end < text.size() && is_of_name(text[end])) ++end;
    if (end == i) {
      out += text[i++];
      continue;
    }
    const std::string word = text.substr(i, end - i);
    out += std::isdigit(static_cast<unsigned char>(word[0])) || word[0] == '.' ? word : replacement(word);
    i = end;
  }
  return out;
}

std::vector<std::string> split_name(const std::string& name) {
  std::vector<std::string> parts(1);
  for (const char c : name)
    if (c == '.')
      parts.emplace_back();
    else
      parts.back() += c;
  return parts;
}

std::string body_output(const std::vector<std::string>& parts) {
  static const std::set<std::string> kNames = {"x",
                                               "y",
                                               "z",
                                               "e0",
                                               "e1",
                                               "e2",
                                               "e3",
                                               "u1x",
                                               "u1y",
                                               "u1z",
                                               "u2x",
                                               "u2y",
                                               "u2z",
                                               "u3x",
                                               "u3y",
                                               "u3z",
                                               "roll",
                                               "pitch",
                                               "yaw",
                                               "omega_x",
                                               "omega_y",
                                               "omega_z",
                                               "omega_global_x",
                                               "omega_global_y",
                                               "omega_global_z",
                                               "alpha_x",
                                               "alpha_y",
                                               "alpha_z",
                                               "alpha_global_x",
                                               "alpha_global_y",
                                               "alpha_global_z"};
  if (parts.size() != 2) return {};
  std::string output = parts[1];
  for (const char* suffix : {"_ddot", "_dot"})
    if (output.ends_with(suffix)) {
      output.resize(output.size() - std::string(suffix).size());
      break;
    }
  return kNames.contains(output) ? output : "";
}

bool is_global_rate(const std::string& output) {
  return output.starts_with("omega_global") || output.starts_with("alpha_global");
}

WeldGroups weld_groups(const Mechanism& m, const Start& start, SceneNode& scene) {
  const BodyFrame ground{Eigen::Vector3d::Zero(), Eigen::Matrix3d::Identity(), Eigen::Matrix3d::Zero()};
  WeldGroups result;
  const SceneNode* welds = scene.find("fixed");
  if (!welds) return result;
  std::map<std::string, std::string> kinds;  // of bodies
  std::vector<std::string> order;
  for (const char* kind : {"rigid_body", "natural_body"})
    if (const SceneNode* table = scene.find(kind))
      for (const SceneNode& t : table->children) {
        kinds[t.key] = kind;
        order.push_back(t.key);
      }
  const std::set<std::string> needed = asked_for(scene, *welds);
  Groups groups;
  for (const SceneNode& t : welds->children) {
    if (needed.contains(t.key)) {
      result.kept.push_back(t.key);
      continue;
    }
    const SceneNode* points = t.find("points");
    groups.join(carrier(scene, points->children.at(0).text), carrier(scene, points->children.at(1).text));
    result.welds.push_back(t.key);
  }
  const auto count = mentions(scene);
  const auto said = [&](const std::string& name) { return count.contains(name) ? count.at(name) : 0; };
  std::map<std::string, std::string> stays;  // of each group, by its root
  for (const std::string& name : order) {
    const std::string root = groups.root(name);
    if (root.empty()) continue;
    const auto [at, first] = stays.try_emplace(root, name);
    if (!first && said(name) > said(at->second)) at->second = name;
  }
  for (const std::string& name : order) {
    const std::string root = groups.root(name), into = root.empty() ? "" : stays.at(root);
    if (into == name) continue;
    const BodyFrame own = body_frame(m, start, kinds.at(name), name),
                    other = into.empty() ? ground : body_frame(m, start, kinds.at(into), into);
    WeldedPart part{kinds.at(name), into, other.A.transpose() * own.A, other.A.transpose() * (own.r - other.r)};
    for (double& x : part.R.reshaped())
      for (const double whole : {-1.0, 0.0, 1.0})
        if (std::abs(x - whole) < kRounding) x = whole;
    result.parts.emplace(name, part);
  }
  return result;
}

}  // namespace costate::app
