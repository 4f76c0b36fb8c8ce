#include "bushing_frame.h"

#include <Eigen/Geometry>

#include "scene_vector.h"

namespace costate::app {

void turn_bushing_frame(SceneNode& root, const std::string& path, const SceneNode& t, const std::string& end,
                        const Eigen::Matrix3d& R) {
  const std::string axis_key = "rotation_axis_" + end, angle_key = "angle_" + end + "_rad";
  Eigen::Matrix3d own = Eigen::Matrix3d::Identity();
  if (const SceneNode* axis = t.find(axis_key)) {
    const SceneNode* angle = t.find(angle_key);
    own = Eigen::AngleAxisd(angle ? angle->as_double() : 0, vector_of(*axis).normalized()).toRotationMatrix();
  }
  const Eigen::AngleAxisd now(R * own);
  set_node(root, path + "." + axis_key, vector_node(now.axis()));
  set_node(root, path + "." + angle_key, number_node(in_start_digits(now.angle())));
}

}  // namespace costate::app
