// Which bodies are welded to each other (`[fixed.*]`), which one stays of each group, and where the others stand in it.
#pragma once

#include <Eigen/Core>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "costate/analysis/start.h"
#include "costate/mechanism/mechanism.h"
#include "costate/scene/scene_node.h"

namespace costate::app {

/// A body that becomes a part of another one, or of the ground: what is x in its frame is d + R x in that one's.
struct WeldedPart {
  std::string kind;  // rigid_body, natural_body
  std::string into;  // empty: the ground
  Eigen::Matrix3d R = Eigen::Matrix3d::Identity();
  Eigen::Vector3d d = Eigen::Vector3d::Zero();  // m
  bool turned() const { return R != Eigen::Matrix3d::Identity(); }
};

struct WeldGroups {
  std::map<std::string, WeldedPart> parts;  // by the body's name
  std::vector<std::string> welds;           // that go
  std::vector<std::string> kept;            // that stay, as something refers to them
};

/// Calls of every text in a tree: the keys on the way to it (array items have none), and the text.
using TextVisitor = std::function<void(const std::vector<std::string>&, SceneNode&)>;
void each_text(SceneNode& root, const TextVisitor& visit);

/// The names of outputs, elements and numbers in a text or formula ("rod.x_dot", "rigid_body.rod.mass_kg"), replaced
/// where `replacement` returns another one.
std::string with_names(const std::string& text, const std::function<std::string(const std::string&)>& replacement);

/// A name split at its dots.
std::vector<std::string> split_name(const std::string& name);

/// What a body's output is called behind its name, without the rate's suffix: x, omega_global_z, u1x; empty where it is
/// none.
std::string body_output(const std::vector<std::string>& parts);
/// Whether that is a rate of turning in the ground's frame, the same for all bodies that are welded.
bool is_global_rate(const std::string& output);

/// Of the scene that the mechanism was made of; poses are those of the start.
WeldGroups weld_groups(const Mechanism& mechanism, const Start& start, SceneNode& scene);

}  // namespace costate::app
