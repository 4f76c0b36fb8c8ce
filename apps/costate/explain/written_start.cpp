#include "written_start.h"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <cmath>

#include "body_frame.h"
#include "weld_groups.h"

namespace costate::app {

namespace {

// A start that the scene's numbers give up to this (relative to 1 + their size) is left as it is written.
constexpr double kAsWritten = 1e-9, kIsWritten = 1e-14;

class StartWriter {
 public:
  StartWriter(SceneNode& scene, const Mechanism& m, const Start& start, const std::set<std::string>& kept)
      : scene_(scene), m_(m), start_(start), kept_(kept) {}

  bool as_written() const {
    for (int i = 0; i < m_.coordinate_count(); ++i) {
      const Coordinate& c = m_.coordinates()[static_cast<std::size_t>(i)];
      const double q = number(c.position_number).value, v = number(c.velocity_number).value;
      if (std::abs(start_.q[i] - q) > kAsWritten * (1 + std::abs(q)) ||
          std::abs(start_.v[i] - v) > kAsWritten * (1 + std::abs(v)))
        return false;
    }
    return true;
  }

  void write_body(const std::string& kind, const std::string& name) {
    const BodyFrame frame = body_frame(m_, start_, kind, name);
    const Eigen::Quaterniond e(frame.A);
    const Eigen::Matrix3d W =
        frame.A.transpose() * frame.rate;  // the cross matrix of the angular velocity in the body's frame
    const Eigen::Vector3d omega(W(2, 1), W(0, 2), W(1, 0));
    const std::string path = kind + "." + name;
    for (SceneNode& group : scene_.children)
      if (SceneNode* table = group.key == kind ? group.find(name) : nullptr)
        std::erase_if(table->children, [](const SceneNode& c) {
          return c.key == "rotation_axis" || c.key == "angle_rad" || c.key.starts_with("omega_global");
        });
    for (int i = 0; i < 3; ++i) {
      const char letter = "xyz"[i];
      write(fmt::format("{}.{}_m", path, letter), frame.r[i]);
      write(fmt::format("{}.v{}_m_per_s", path, letter), v(fmt::format("{}.{}", name, letter)));
      write(fmt::format("{}.omega_{}_rad_per_s", path, letter), omega[i]);
    }
    const double parameters[4] = {e.w(), e.x(), e.y(), e.z()};
    for (int i = 0; i < 4; ++i)  // all four or none
      if (const std::string e_i = fmt::format("{}.e{}", path, i); !kept_.contains(e_i))
        set_node(scene_, e_i, number_node(parameters[i]));
  }

  /// Of coordinates of joints, rotors and free points, whose numbers are keys of the scene.
  void write_coordinates() {
    for (int i = 0; i < m_.coordinate_count(); ++i) {
      const Coordinate& c = m_.coordinates()[static_cast<std::size_t>(i)];
      for (const auto& [k, value] : {std::pair(c.position_number, start_.q[i]), {c.velocity_number, start_.v[i]}}) {
        const auto parts = split_name(number(k).path);
        if (parts.size() == 3 && parts[0] != "rigid_body" && parts[0] != "natural_body" &&
            find_node(scene_, parts[0] + "." + parts[1]))
          write(number(k).path, value);
      }
    }
  }

  void write_taken_numbers() {
    for (const Number& n : m_.numbers()) {
      const auto parts = split_name(n.path);
      if (parts.size() != 3 || !find_node(scene_, parts[0] + "." + parts[1])) continue;
      for (const auto& [kind, key] :
           {std::pair("distance", "length_m"), std::pair("tie_rod", "length_m"), std::pair("gear", "offset_rad"),
            std::pair("rack_and_pinion", "offset_m"), std::pair("screw", "offset_m")})
        if (parts[0] == kind && parts[2] == key && !find_node(scene_, n.path)) write(n.path, n.value);
    }
  }

 private:
  const Number& number(int k) const { return m_.numbers()[static_cast<std::size_t>(k)]; }
  double v(const std::string& coordinate) const { return start_.v[m_.coordinate(coordinate)]; }
  void write(const std::string& path, double value) {
    if (kept_.contains(path)) return;
    // What the solution leaves of a zero, and of a number that is met, is not written.
    const SceneNode* n = find_node(scene_, path);
    const double now = n && n->is_number() ? n->as_double() : 0;
    if (std::abs(value - now) > kIsWritten * (1 + std::abs(now))) set_node(scene_, path, number_node(value + 0.0));
  }

  SceneNode& scene_;
  const Mechanism& m_;
  const Start& start_;
  const std::set<std::string>& kept_;
};

}  // namespace

void write_start(SceneNode& scene, const Mechanism& mechanism, const Start& start, const std::set<std::string>& kept,
                 const std::function<bool(const std::string&)>& gone) {
  StartWriter writer(scene, mechanism, start, kept);
  if (writer.as_written()) return;
  for (const char* kind : {"rigid_body", "natural_body"})
    if (const SceneNode* table = scene.find(kind))
      for (const SceneNode& t : SceneNode(*table).children)
        if (!gone(t.key)) writer.write_body(kind, t.key);
  writer.write_coordinates();
  writer.write_taken_numbers();
}

}  // namespace costate::app
